"""The involute function against tables; its inverse."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fem.gear.involute import inverse_involute, involute
from fem.units import deg


@pytest.mark.parametrize(("angle", "value"), [(14.5, 0.0055448), (20, 0.0149044), (25, 0.0299753), (45, 0.2146018)])
def test_involute_of_published_tables(angle, value):
    assert involute(angle * deg) == pytest.approx(value, abs=5e-8)
    assert inverse_involute(value) == pytest.approx(angle * deg, abs=1e-6)


@given(st.floats(1e-9, 1e4))
@settings(max_examples=200)
def test_inverse_is_the_angle_of_that_involute(value):
    assert involute(inverse_involute(value)) == pytest.approx(value, rel=1e-6, abs=1e-15)
