"""Imposed motion: angle, speed and acceleration of a shaft as a known function of time."""

import numpy as np
import pytest
from numba import njit

from exugear.mesh_force.kernel_records import address_of
from exugear.multibody.imposed_motion import imposed_motion, spin_of
from exugear.operation.time_functions import Line, curve_through_function, curve_through_points

FUNCTIONS = {
    "line": Line(50.0, 3.0),
    "function": curve_through_function(lambda t: 50 + 4 * np.sin(3 * t), 2.0),
    "points": curve_through_points(np.array([[0, 0.3, 1, 2.5], [50, 55, 52, 60]]), 2.0),
}
evaluated = njit(lambda address, t: spin_of(address, t, 0.1, 0.2))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_motion_is_that_of_the_function_in_any_order_of_times(name):
    speed_of, times = FUNCTIONS[name], np.random.default_rng(1).uniform(0, 2, 200)
    motion, _arrays = imposed_motion(*speed_of.angle_pieces)
    for t in [*times.tolist(), 0.0, 2.0]:
        expected = speed_of.integral(t), float(speed_of(t)), float(speed_of.slope(t))
        assert evaluated(address_of(motion), t) == pytest.approx(expected, rel=1e-12, abs=1e-10)


def test_without_a_motion_the_coordinates_count():
    assert evaluated(0, 1.0) == (0.1, 0.2, 0.0)
