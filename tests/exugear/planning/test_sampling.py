"""Time steps that divide the mesh periods of a run and meet the jumps of its force laws."""

import numpy as np

from exugear.planning.sampling import dividing_step, largest_miss


def test_steps_divide_mesh_periods_and_the_times_of_jumps():
    phases = np.array([0.4496, 0.9995])
    for period in (1e-3, 7.7e-4):
        step = dividing_step(3.1e-5, [(period, phases)])
        assert step <= 3.1e-5
        assert largest_miss(step, [(period, phases)]) < 5e-4
    meshes = [(1e-3, phases), (1e-3 * 57 / 20, phases)]
    assert largest_miss(dividing_step(3.1e-5, meshes), meshes) < 5e-4
