"""Internal gears: signs and sizes of ISO 21771, roots by a cutter or an arc, inspection, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from ring_gears import planet, ring, wind_turbine_stage

import fem
from fem.gear import tooth_profile
from fem.units import deg, mm


@pytest.fixture(scope="module")
def published() -> fem.Gear:
    return wind_turbine_stage().wheel


def test_published_sizes(published):
    """NREL 5 MW stage 2; the profile shift adds to the ring's tooth thickness and moves its tip inwards."""
    sizes = {"d_b": 1835.220, "d_a": 1906.081, "d_f": 2000.581, "d_Ff": 1987.879}
    sheet = published.data_sheet(D_M=35 * mm)
    for symbol, expected in sizes.items():
        assert sheet[symbol].value == pytest.approx(-expected * mm, abs=2e-6)
    assert sheet["s_n"].value == pytest.approx(34.777 * mm, abs=6e-7)
    assert sheet["M_dK"].value == pytest.approx(1900.511 * mm, abs=6e-7)
    assert 2 * (published.generation.a_0 - published.r_f) == pytest.approx(682.571 * mm, abs=2e-6)
    assert "k" not in sheet


def test_diameters_are_accepted_with_either_sign(published):
    diameters = {name: -getattr(published, name) for name in ("d_a", "d_f", "d_rim")}
    assert min(diameters.values()) > 0
    assert replace(published, **diameters) == published


def test_a_cutter_of_given_diameter_cuts_the_root(published):
    cutter = replace(published.cutter, d_a0=682.571 * mm)
    assert replace(published, cutter=cutter, d_f=None).d_f == pytest.approx(published.d_f, abs=2e-6)
    with pytest.raises(ValueError, match=r"cuts d_f = -2000.58 mm, got -2010 mm; leave out d_f or d_a0"):
        replace(published, cutter=cutter, d_f=2010 * mm)


@pytest.mark.parametrize("beta", [0, 15 * deg])
def test_roots_join_involute_and_root_circle_tangentially(published, beta):
    """By a cutter and by an arc: the curves are continuous, and their radii grow from root to tip."""
    by_cutter = replace(published, beta=beta, d_a=None, d_f=None, d_rim=2400 * mm)
    for gear in (by_cutter, replace(by_cutter, cutter=None, fillet=5 * mm)):
        r, psi = gear.root.points(np.linspace(0, 1, 2001))
        flank = tooth_profile.flank(gear, [gear.roll_form, gear.roll_form + 1e-6])
        assert (np.diff(r) < 0).all() and r[-1] == pytest.approx(gear.r_f, rel=1e-9)
        assert [r[0], psi[0]] == pytest.approx([flank.r[0], flank.psi[0]], rel=1e-9)
        slopes = [np.diff(curve.psi[:2]) / np.diff(curve.r[:2]) for curve in (flank, tooth_profile.Polar(r, psi))]
        assert slopes[0] == pytest.approx(slopes[1], rel=0.02)
        assert abs(np.diff(r[-2:])) < 1e-3 * abs(gear.r_f * np.diff(psi[-2:]))


def test_a_ring_of_very_many_teeth_and_an_external_gear_of_very_many_meet_in_the_rack():
    z, sizes = 9000, {"m_n": 2 * mm, "x": 0.2, "b": 20 * mm, "fillet": 0.5 * mm}
    external = fem.Gear(z=z, d_bore=2 * (z - 20) * mm, **sizes)
    internal = fem.Gear(z=-z, d_rim=2 * (z + 20) * mm, **sizes)
    for symbol in ("s_n", "h", "s_an", "s_cn", "h_ca"):
        outside, inside = (gear.data_sheet()[symbol].value for gear in (external, internal))
        assert inside == pytest.approx(outside, rel=2e-3)
    outlines = []
    for gear in (external, internal):
        roll = np.interp([0.1, 0.5, 0.9], [0, 1], [gear.roll_form, gear.roll_tip])
        outlines.append(tooth_profile.cartesian(tooth_profile.flank(gear, roll)) - [[0], [gear.r]])
    assert outlines[0] == pytest.approx(outlines[1], abs=0.01 * mm)


def test_mass_and_inertia_are_those_of_a_hollow_cylinder():
    gear = ring()
    inner, outer = abs(gear.r_a + gear.r_f) / 2, abs(gear.d_rim) / 2
    mass = gear.material.density * gear.b * np.pi * (outer**2 - inner**2)
    assert gear.mass == pytest.approx(mass)
    assert gear.inertia == pytest.approx(mass * (outer**2 + inner**2) / 2)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"d_rim": None}, r"d_rim must be given, .* got z = -71 without it"),
        ({"d_bore": 60 * mm}, r"d_bore belongs to external gears, .* pass d_rim"),
        (
            {"rho_f": 0.5 * mm},
            r"rho_f is the tip radius of a rack, which cannot cut .*fem.PinionCutter\(\.\.\.\) or a fillet",
        ),
        ({"fillet": 0.5 * mm, "cutter": fem.PinionCutter(20)}, "give a fillet or a cutter, not both"),
        ({"d_rim": 147 * mm}, r"d_rim must lie in .*leave a rim of one module outside the root circle -146.2 mm"),
        ({"d_a": 150 * mm}, r"d_f must lie .*outside the tip circle d_a = -150 mm"),
        ({"d_a": 132 * mm}, r"tip circle .* outside its base circle, d_b = -133.436 mm, .* shorten its teeth by d_a"),
        ({"fillet": 1.9 * mm}, r"fillet 1.9 mm does not fit between two teeth; reduce it or \|d_f\|"),
        ({"cutter": fem.PinionCutter(71)}, r"z_0 of the cutter must be less than 71 teeth, got 71"),
        (
            {"cutter": fem.PinionCutter(20, rho_a0=2 * mm)},
            r"rho_a0 must lie in .* roundest tip that fits on the cutter",
        ),
        ({"cutter": fem.PinionCutter(20, 1.5)}, r"pointed teeth|does not fit into the gear"),
        ({"flank": fem.Grid((0.01, 0.02), (-0.01, 0.01), ((0, 0), (0, 0)))}, r"pass Grid\(-roll\[::-1\]"),
        ({"flank": fem.TipRelief(5e-6, d_Ca=130 * mm)}, r"must lie in \[-145.* mm, from root form to tip circle"),
    ],
)
def test_rings_that_do_not_exist_are_refused_with_a_remedy(options, message):
    with pytest.raises(ValueError, match=message):
        ring(**options)


def test_what_belongs_to_rings_is_refused_of_external_gears():
    with pytest.raises(ValueError, match=r"d_rim belongs to internal gears, .* pass z=-23"):
        planet(d_rim=80 * mm)
    with pytest.raises(ValueError, match=r"cutter generates internal gears"):
        planet(cutter=fem.PinionCutter(20))
    with pytest.raises(ValueError, match=r"d_bore must be given"):
        fem.Gear(z=23, m_n=2 * mm, b=20 * mm)
    with pytest.raises(ValueError, match=r"an internal gear has no span over teeth"):
        ring().data_sheet(k=5)
