"""Deflection between the torques of a map: closed forms, and pairs on which simpler interpolation failed."""

import numpy as np
import pytest
from coarse_maps import SLICES, STRIPS, map_of
from modified_pairs import fzg_type_c
from paper_gears import paper_gear
from scipy.interpolate import CubicHermiteSpline

import fem
from exugear import MeshForce
from fem.ste.load_interpolation import deflection_under, rational_cubic
from fem.units import mm, um


def test_line_contact_is_exact_below_the_lowest_load():
    """deflection = F (c - ln F) has the compliance of a Hertzian line contact."""
    law, force = (lambda f: f * (20 - np.log(f))), np.geomspace(1e-3, 10, 40)
    loads = np.array([10.0, 40.0])
    deflection = deflection_under(loads, law(loads), force, 1 / (19 - np.log(loads)))
    assert deflection == pytest.approx(law(force), rel=1e-12)


def test_curve_keeps_points_tangents_and_curvature():
    x, queries = np.array([1.0, 4.0, 16.0]), np.linspace(1, 16, 2001)
    y = rational_cubic(x, x**0.7, 0.7 * x**-0.3, queries)
    assert y == pytest.approx(queries**0.7, rel=2e-3)
    assert (np.diff(y, 2) < 1e-12).all()
    step = 1e-6
    ends = rational_cubic(x, x**0.7, 0.7 * x**-0.3, np.array([4 - step, 4.0, 4 + step]))
    assert np.diff(ends) / step == pytest.approx(np.full(2, 0.7 * 4**-0.3), rel=1e-5)


def test_the_curve_stays_concave_where_a_further_pair_comes_into_contact():
    """Soft up to 1.5, ten times as stiff beyond: a cubic polynomial with the same tangents overshoots."""
    x, y, slope, queries = np.array([1.0, 4.0]), np.array([1.0, 1.75]), np.array([1.0, 0.1]), np.linspace(1, 4, 301)
    curve, hermite = rational_cubic(x, y, slope, queries), CubicHermiteSpline(x, y, slope)(queries)
    assert np.diff(hermite, 2).max() > 1e-6
    assert np.diff(curve, 2).max() < 1e-12
    assert (np.diff(curve) > 0).all()


@pytest.mark.parametrize(("mode", "tolerance"), [(SLICES, 1e-4), (STRIPS, 0.03)])
def test_stiffness_of_a_map_is_the_slope_of_its_loads(mode, tolerance):
    """Strips and loaded widths are chosen anew at each load, which changes difference quotients by 2 per cent."""
    gear = paper_gear(flank=(fem.LeadCrowning(10 * um), fem.TipRelief(15 * um, 2.5 * mm)))
    pair, step = fem.GearPair(gear, gear, a=150 * mm), 1e-3
    ste = map_of(pair, 150 * np.array([1 - step, 1, 1 + step]), 12, mode)
    slope = 2 * step * 150 / pair.pinion.r_b / (ste["te"].values[2] - ste["te"].values[0])
    assert ste["stiffness"].values[1] == pytest.approx(slope, rel=tolerance)
    assert map_of(pair, [0, 1], 4, mode)["stiffness"].values[0] == pytest.approx(np.zeros(4), abs=0)


def test_law_between_torques_keeps_the_peak_to_peak():
    """Torques four times apart; interpolation of the compliance alone misses up to 1.1 um of 10 um."""
    pair, between, phase, mode = fzg_type_c(40 * um), np.array([100, 150, 200]), np.arange(48) / 48, SLICES
    law = MeshForce.from_ste(map_of(pair, [0, 18.9, 75.5, 302], 48, mode))
    te = [[law.deflection_at(at, torque / pair.pinion.r_b) for at in phase] for torque in between]
    interpolated = fem.ste_map(pair, between, phase, np.array(te))
    direct = fem.peak_to_peak(map_of(pair, between, 48, mode))["peak_to_peak"]
    assert fem.peak_to_peak(interpolated)["peak_to_peak"].values == pytest.approx(direct.values, abs=0.15 * um)
