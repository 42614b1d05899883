"""Kinks, where reliefs begin along the line of contact, end the slices."""

from dataclasses import replace

import numpy as np
import pytest
from coarse_maps import COARSE
from contacts import position_of
from measured_rows import deviation
from modified_pairs import end_relieved
from paper_gears import paper_gear

import fem
from fem.contact.face_grading import FaceGrading, axial_at, kinks, share_at, write_with_kinks
from fem.units import deg, mm, um


def test_kinks_are_where_reliefs_begin_and_where_the_path_of_contact_ends():
    pair = end_relieved(0.26)
    relieved = replace(pair, pinion=replace(pair.pinion, flank=(fem.TipRelief(15 * um, 2.5 * mm),)))
    position = position_of(relieved, 0.3, 1 * mm)
    ends = relieved.path_of_contact.start, relieved.path_of_contact.end
    for number, (high, low, *along) in zip(position.numbers(), kinks(position), strict=True):
        assert np.array([low, high]) == pytest.approx(np.array([-7.5, 7.5]) * mm + 1 * mm)
        assert position.nominal(number, np.array(along)) == pytest.approx([relieved.pinion.roll_tip - 2.5 * mm, *ends])


def with_kinks(stops: np.ndarray, kinks) -> np.ndarray:
    """Equidistant stops (n,) and the kinks among them."""
    edges = np.empty(stops.size + len(kinks))
    return edges[: write_with_kinks(stops[0], stops[-1], stops.size - 1, np.sort(kinks), edges)]


def test_slices_end_at_kinks():
    stops = np.linspace(0, 1, 6)
    assert with_kinks(stops, [-1.0, 2.0]) == pytest.approx(stops)
    assert with_kinks(stops, [-1.0, 0.25, 0.599, 2.0]) == pytest.approx([0, 0.2, 0.25, 0.4, 0.599, 0.8, 1])


def test_line_load_where_reliefs_begin_on_lines_of_contact(measured):
    """Even stops beside the kink would leave narrow slices next to wide ones, with a third too much load."""
    common = {"m_n": 3 * mm, "b": 25 * mm, "flank": (fem.TipRelief(40 * um, 3 * mm),)}
    pinion = fem.Gear(z=24, beta=15 * deg, x=0.2, d_bore=30 * mm, **common)
    pair = fem.GearPair(pinion, fem.Gear(z=40, beta=-15 * deg, d_bore=60 * mm, **common))
    few, many = (
        fem.static_transmission_error(
            pair, 30, [0.23, 0.64, 0.65, 0.78], resolution=fem.Resolution(slices=n), progress=False
        )["line_load"].values
        for n in (20, 60)
    )
    measured("line load where a relief begins on a helix, 30 N m, 20 slices", deviation(few, many), 0.06)


@pytest.mark.parametrize("seed", range(20))
def test_kinks_make_no_narrow_slices(seed):
    """Kinks of both gears may coincide up to rounding, or lie at an end or at another edge."""
    rng = np.random.default_rng(seed)
    stops = np.linspace(*np.sort(rng.random(2)), rng.integers(2, 12))
    kinks_of_pinion = np.concatenate([stops, rng.random(5)])
    for tiny in (1e-18, 1e-12, 1e-4):
        edges = with_kinks(stops, np.append(kinks_of_pinion, kinks_of_pinion + tiny))
        assert edges[[0, -1]] == pytest.approx(stops[[0, -1]], abs=0)
        assert np.diff(edges).min() > 0.019 * (stops[1] - stops[0])


def test_kinks_of_both_gears_may_coincide():
    """End reliefs of gears of unequal width that begin in the same section up to rounding, or up to a nanometre."""
    pinion, offsets = paper_gear(flank=(fem.EndRelief(20 * um, 4 * mm),)), fem.Offsets(misalignment=1e-4)
    wheels = (paper_gear(b=25 * mm, flank=(fem.EndRelief(20 * um, long),)) for long in (5 * mm, 5 * mm + 1e-9))
    at_same_section, a_nanometre_apart = (
        fem.static_transmission_error(
            fem.GearPair(pinion, wheel, a=150 * mm), [5, 350], 4, offsets=offsets, resolution=COARSE, progress=False
        )
        for wheel in wheels
    )
    assert at_same_section["te"].values == pytest.approx(a_nanometre_apart["te"].values, abs=1e-9)


def test_narrow_slices_beside_kinks_bear_any_load():
    """Slices of 0.04 mm under 4.5 kN/mm, too much for half-planes: te does not depend on the number of slices."""
    common = {"m_n": 1.5 * mm, "b": 12 * mm, "alpha_n": 0.36487030420051161, "rho_f": 0.57 * mm}
    pinion = fem.Gear(z=100, d_bore=120.5 * mm, x=0.24, d_a=153.253 * mm, d_f=147.42 * mm, **common)
    wheel = fem.Gear(z=110, d_bore=153.28 * mm, x=0.883, d_a=170.468 * mm, d_f=164.349 * mm, **common)
    relieved = replace(pinion, flank=(fem.EndRelief(5 * um, 0.1 * mm, 1.1),))
    pair, torque = fem.GearPair(relieved, wheel, a=159.15 * mm), 54e3 * pinion.r_b
    te = [
        fem.static_transmission_error(
            pair,
            torque,
            [0.1, 0.25, 0.4],
            offsets=fem.Offsets(axial=0.6 * mm),
            resolution=fem.Slices(COARSE.density, slices),
            progress=False,
        )["te"].values[0]
        for slices in (6, 12, 20, 40)
    ]
    assert np.array(te) == pytest.approx(np.tile(te[-1], (4, 1)), rel=2e-4)


@pytest.mark.parametrize(("start", "lower_end"), [(-1.0, -10 * mm), (0.0, 0.0)], ids=["whole", "half"])
def test_positions_and_shares_of_the_face_are_inverse(start, lower_end):
    grading = FaceGrading(-10 * mm, 10 * mm, start)
    share = np.linspace(0, 1, 11)
    assert share_at(grading, axial_at(grading, share)) == pytest.approx(share, abs=1e-12)
    assert axial_at(grading, np.array([0, 1])) == pytest.approx((lower_end, 10 * mm), abs=1e-15)
    steps = np.diff(axial_at(grading, share))
    assert steps[-1] < steps[-2] < steps[-3]
