"""Grading and slices of the face, and the search for the loaded width: inverse, kinks, closed forms of the overlap."""

import numpy as np
import pytest
from contacts import position_of
from hypothesis import given
from hypothesis import strategies as st
from paper_gears import paper_gear, paper_pair
from whole_section import FACES

import fem
from fem.contact.contact_state import State
from fem.contact.loaded_width import LEAST_REACH, SHORT, FaceSlicing, positive_range, union
from fem.units import mm, um


@given(st.floats(-0.9, 0.9), st.floats(0.1, 2))
def test_positive_range_of_a_parabola_ends_at_its_roots(middle, half):
    """It reaches beyond the last positive value by at least a share of a step."""
    axial = np.linspace(-4, 4, 81)
    low, high = positive_range(axial, half**2 - (axial - middle) ** 2)
    assert (low, high) == pytest.approx((middle - half, middle + half), abs=1.01 * LEAST_REACH * 0.1)


def test_the_union_of_loaded_widths_covers_both():
    none = [np.nan, np.nan]
    first, second = np.array([none, [1.0, 2.0], [0.0, 1.0], none]), np.array([[0.0, 2.0], [1.5, 3.0], none, none])
    assert union(first, second) == pytest.approx(np.array([[0, 2], [1, 3], [0, 1], none]), nan_ok=True)


@pytest.mark.parametrize("te", [2 * um, 5 * um])
def test_the_search_returns_the_width_on_which_crowned_flanks_overlap(te):
    """Crowning C_beta over b: they overlap by te where C_beta (2 z / b)^2 < te."""
    crowned = paper_gear(flank=fem.LeadCrowning(10 * um))
    pair = fem.GearPair(crowned, paper_gear(), a=150 * mm)
    slicing = FaceSlicing(position_of(pair), FACES["equal"], 10)

    def solve(slices, last: State) -> State:
        return State(te, slices, np.ones(slices.low.size), np.zeros(slices.low.size), FACES["equal"])

    state = slicing.loaded(solve(slicing.whole, None), 0.0, solve)
    wanted = pair.b / 2 * np.sqrt(te / (10 * um))
    assert state.slices.low.min() == pytest.approx(0.0, abs=1e-9)
    assert state.slices.high[state.slices.number == 0].max() == pytest.approx(wanted, rel=SHORT)


def test_a_loaded_width_that_does_not_converge_raises_with_a_remedy():
    pair = paper_pair()
    slicing = FaceSlicing(position_of(pair), FACES["any"], 4)
    growing = iter(-11.5 * um + 0.02 * um * 1.3 ** np.arange(30))

    def solve(slices, last) -> State:
        force = np.where(slices.number == 0, 1.0, 0.0)
        return State(next(growing), slices, force, 0 * force, FACES["any"])

    with pytest.raises(RuntimeError, match="the loaded width did not converge; try a neighbouring phase"):
        slicing.loaded(solve(slicing.whole, None), 1e-3, solve)
