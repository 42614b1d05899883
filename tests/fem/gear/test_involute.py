"""The involute function against tables, its inverse and the half angle of a tooth against it."""

from math import atan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fem.gear.involute import half_angle, inverse_involute, involute
from fem.units import deg


@pytest.mark.parametrize(("angle", "value"), [(14.5, 0.0055448), (20, 0.0149044), (25, 0.0299753), (45, 0.2146018)])
def test_involute_of_published_tables(angle, value):
    assert involute(angle * deg) == pytest.approx(value, abs=5e-8)
    assert inverse_involute(value) == pytest.approx(angle * deg, abs=1e-6)


@given(st.floats(1e-9, 1e4))
@settings(max_examples=200, deadline=None, derandomize=True)
def test_inverse_is_the_angle_of_that_involute(value):
    assert involute(inverse_involute(value)) == pytest.approx(value, rel=1e-6, abs=1e-15)


def test_half_angle_is_that_of_the_base_circle_less_the_involute():
    roll = np.array([0.0, 0.2, 0.5])
    expected = [0.08 - involute(atan(at / 0.6)) for at in roll]
    assert half_angle(0.08, 0.6, roll) == pytest.approx(expected, abs=1e-15)
