"""Time steps that divide the mesh periods of a run and meet the jumps of its force laws."""

import numpy as np
import pytest

from exugear.planning.sampling import dividing_step, exactly_summable, largest_miss


def test_steps_divide_mesh_periods_and_the_times_of_jumps():
    phases = np.array([0.4496, 0.9995])
    for period in (1e-3, 7.7e-4):
        step = dividing_step(3.1e-5, [(period, phases)])
        assert step <= 3.1e-5
        assert largest_miss(step, [(period, phases)]) < 5e-4
    meshes = [(1e-3, phases), (1e-3 * 57 / 20, phases)]
    assert largest_miss(dividing_step(3.1e-5, meshes), meshes) < 5e-4


@pytest.mark.parametrize("duration", [1e-3, 0.7, 70.0, 1234.5])
def test_steps_sum_up_exactly(duration):
    """As Exudyn adds them: a further step of some 1e-10 s would spoil the rates at the end."""
    n = 3_000_017
    step = exactly_summable(duration / n, duration)
    for h, number in ((step, n), (step / 2, 2 * n)):
        assert np.cumsum(np.full(number, h))[-1] == n * step
    assert step == pytest.approx(duration / n, rel=1e-6)
    assert n * step <= duration
