"""Sums of hat functions on a line: projections, and displacements that decay along the line."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem.elasticity.hat_functions import overlap, products, spread

TOPS = st.lists(st.floats(0.1, 3), min_size=2, max_size=12).map(lambda steps: np.append(0, np.cumsum(steps)))


@given(TOPS, st.floats(0, 100))
def test_a_uniform_load_gives_a_uniform_displacement_at_any_reach(tops, reach):
    whole = products(tops).sum(axis=1)
    assert spread(tops, reach) @ whole == pytest.approx(np.ones(tops.size))


@given(TOPS, st.floats(0, 100), st.booleans())
def test_compliance_of_loads_on_a_line_is_positive_semidefinite(tops, reach, odd):
    decayed = spread(tops, reach, odd=odd)
    assert decayed == pytest.approx(decayed.T)
    assert np.linalg.eigvalsh(decayed).min() > -1e-12 * decayed.max()


def test_no_reach_is_the_overlap_and_endless_reach_the_mean():
    tops = np.array([0, 0.3, 1, 1.5, 3])
    assert spread(tops, 0) == pytest.approx(overlap(tops))
    assert spread(tops, 1e4) == pytest.approx(np.full((5, 5), 1 / 3))


def test_loads_decay_by_their_distance():
    """On a long line exp(-distance / reach) / (2 reach); the ends reflect."""
    tops = np.linspace(-30, 30, 1201)
    decayed = spread(tops, 2.0)
    assert decayed[600, 602:800] == pytest.approx(np.exp(-tops[602:800] / 2) / 4, rel=1e-3)
    assert decayed[0, 0] == pytest.approx(1 / 2, rel=2e-2)


def test_equal_and_opposite_halves_are_halves_of_a_whole():
    half = np.array([0, 0.4, 1.0, 1.2])
    whole = spread(np.append(-half[:0:-1], half), 0.7)
    same, opposite = (spread(half, 0.7, odd=odd) for odd in (False, True))
    upper = whole[4:, 4:]
    lower = whole[4:, 2::-1]
    assert same[1:, 1:] == pytest.approx(upper + lower)
    assert opposite[1:, 1:] == pytest.approx(upper - lower)
