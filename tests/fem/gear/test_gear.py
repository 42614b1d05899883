"""Macro-geometry against closed forms and published numbers; impossible gears are refused with a remedy."""

import pickle
from dataclasses import replace
from math import asin, atan, cos, hypot, nan, pi, sin, tan

import numpy as np
import pytest
from compliance_products import elastic_body
from hypothesis import given, settings
from measured_rows import deviation
from paper_gears import paper_gear
from strategies import rough_data

import fem
from fem import Density, pair_of, ste_map
from fem.units import GPa, deg, mm


@pytest.mark.parametrize("x", [-3.0, -2.3, 2.3])
def test_large_shifts_are_gears_of_more_or_fewer_teeth(x):
    """A gear of 150 teeth is limited by pointed teeth and undercut only."""
    gear = fem.Gear(z=150, m_n=2 * mm, b=20 * mm, x=x, d_bore=20 * mm)
    assert gear.r_b < gear.r_form < gear.r_a
    assert gear.root.psi_f < pi / gear.z
    assert replace(gear, b=10 * mm).s_n == gear.s_n == pytest.approx(2 * mm * (pi / 2 + 2 * x * tan(20 * deg)))
    assert fem.GearPair(gear, replace(gear, x=-x, s_n=None, d_a=None, d_f=None)).a == pytest.approx(300 * mm)


def test_profile_shift_and_tooth_thickness_follow_from_each_other():
    by_shift = paper_gear(s_n=None, x=-0.2)
    assert paper_gear(s_n=by_shift.s_n).x == pytest.approx(-0.2, abs=1e-12)


def test_root_diameter_follows_from_the_addendum_of_the_tool():
    """ISO 21771: d_f = d + 2 x m_n - 2 h_fP."""
    gear = paper_gear(x=0.2, s_n=None, d_f=None, h_fP=1.4 * 2.6 * mm)
    assert gear.d_f == pytest.approx(2 * gear.r + 0.4 * 2.6 * mm - 2.8 * 2.6 * mm)
    assert replace(gear, b=10 * mm).d_f == gear.d_f
    assert paper_gear(d_f=None, h_fP=1.25 * 2.6 * mm) == paper_gear(d_f=None)


@pytest.mark.parametrize(
    ("z", "beta", "x", "d_Ff"), [(25, 0, 0, 70.942), (25, 30, 0, 81.857), (40, -40, 0, 151.177), (20, 15, 0.4, 59.291)]
)
def test_root_form_diameter_of_the_standard(z, beta, x, d_Ff, measured):
    """d_Ff^2 = d_b^2 + (d sin alpha_t - 2 (h_FfP - x m_n) / sin alpha_t)^2 (ISO 21771) without undercut.

    h_FfP = h_fP - rho_fP (1 - sin alpha_n), in the normal section of the basic rack (ISO 53).
    """
    gear = fem.Gear(z=z, m_n=3 * mm, b=20 * mm, beta=beta * deg, x=x, d_bore=30 * mm, rho_f=1.14 * mm)
    h_FfP = 3.75 * mm - 1.14 * mm * (1 - sin(20 * deg))
    roll = gear.r * sin(gear.alpha_t) - (h_FfP - x * 3 * mm) / sin(gear.alpha_t)
    assert not gear.undercut
    measured("root form diameter d_Ff", deviation(gear.r_form, hypot(gear.r_b, roll)), 1e-12)
    assert 2 * gear.r_form == pytest.approx(d_Ff * mm, abs=0.5e-3 * mm)


def test_transverse_section_of_a_helical_gear():
    """Hand calculation: z 20, m_n 3 mm, alpha_n 20 deg, beta 30 deg."""
    gear = fem.Gear(z=20, m_n=3 * mm, beta=30 * deg, b=40 * mm, d_bore=20 * mm)
    assert gear.m_t == pytest.approx(3 * mm / cos(pi / 6))
    assert gear.alpha_t == pytest.approx(atan(tan(20 * deg) / cos(pi / 6)))
    assert gear.beta_b == pytest.approx(atan(tan(pi / 6) * cos(gear.alpha_t)))
    assert gear.p_bt == pytest.approx(pi * gear.m_t * cos(gear.alpha_t))
    pair = fem.GearPair(gear, replace(gear, beta=-30 * deg))
    assert pair.a == pytest.approx(60 * mm / cos(pi / 6))
    assert pair.eps_beta == pytest.approx(40 * sin(pi / 6) / (pi * 3))
    assert pair.eps_gamma == pair.eps_alpha + pair.eps_beta
    assert pair.beta_b == pytest.approx(asin(sin(pi / 6) * cos(20 * deg)))


@pytest.mark.parametrize(("angle", "value"), [(14.5, 0.0055448), (20, 0.0149044), (25, 0.0299753)])
def test_teeth_widen_to_the_base_circle_by_the_involute_of_published_tables(angle, value):
    gear = fem.Gear(z=40, m_n=3 * mm, b=20 * mm, d_bore=20 * mm, alpha_n=angle * deg)
    assert gear.psi_b - gear.s_t / (2 * gear.r) == pytest.approx(value, abs=5e-8)


@given(rough_data())
@settings(max_examples=400)
def test_impossible_data_raise_nothing_but_value_errors(data):
    try:
        gear = fem.Gear(**data)
    except ValueError as error:
        assert len(str(error)) > 20
    else:
        assert 0 <= gear.roll_form < gear.roll_tip and gear.r_f < gear.r_form < gear.r_a


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"m_n": 2.6}, "m_n must lie in .* mm .*2.6\\*mm"),
        ({"alpha_n": 20}, "alpha_n .*pass radians"),
        ({"beta": 18}, "beta .*pass radians"),
        ({"b": -1 * mm}, "b must lie"),
        ({"b": nan}, "b must lie"),
        ({"s_n": 3.78}, "s_n must lie in .*pass metres: 3.78\\*mm.*got 3780"),
        ({"s_n": 0}, "s_n must lie in .*got 0"),
        ({"z": "25"}, "z must be one real number .*got '25'"),
        ({"m_n": None}, "m_n must be one real number .*got None"),
        ({"b": [23 * mm]}, "b must be one real number"),
        ({"d_a": 154.5j * mm}, "d_a must be one real number"),
        ({"h_fP": "3.25", "d_f": None}, "h_fP must be one real number .*got '3.25'"),
        ({"material": 210 * GPa}, "material must be a fem.Material, .*E=210\\*GPa.*got 210"),
        ({"material": "steel"}, "material must be a fem.Material"),
        ({"material": None}, "material must be a fem.Material"),
        ({"d_bore": 141 * mm}, "d_bore .*leave a rim"),
        ({"d_a": 130 * mm}, "d_a must lie .*above the base circle"),
        ({"d_f": 160 * mm}, "d_f must lie"),
        ({"d_a": 163 * mm}, "teeth are pointed"),
        ({"rho_f": 3 * mm}, "rho_f must lie"),
        ({"z": 2}, "z must be a whole number"),
        ({"z": 57.5}, "z must be a whole number"),
        ({"z": np.inf}, "z must be a whole number"),
        ({"z": 6, "x": -0.7, "s_n": None, "d_a": None, "d_f": None, "d_bore": 0.1 * mm}, "undercuts"),
        ({"h_fP": 3.25 * mm}, "give h_fP or d_f, not both"),
        ({"h_fP": 1.25, "d_f": None}, "h_fP must lie .*pass metres"),
        ({"fillet": 1, "d_f": None}, "fillet must lie .*pass metres"),
        ({"fillet": 2.5 * mm}, "fillet 2.5 mm does not fit"),
        ({"fillet": 1 * mm, "rho_f": 1 * mm}, "not both"),
        ({"d_f": 133 * mm}, "d_f = 133 mm is too deep"),
        ({"d_f": 128 * mm}, "d_f = 128 mm is too deep for s_n = 3.78 mm .*raise d_f or reduce x"),
        ({"s_n": None, "d_a": None, "d_f": None, "x": 3.5}, "teeth are pointed: .* reduce d_a or x = 3.5 modules"),
        (
            {"s_n": None, "d_a": None, "d_f": None, "x": -3.5},
            "d_a must lie .*above the base circle, .*x = -3.5 modules",
        ),
        ({"s_n": None, "x": 3.5}, "d_f must lie .*shifted by x = 3.5 modules"),
        ({"s_n": None, "x": 300}, "x must lie .*profile shift in modules"),
        ({"x": 2.1}, "s_n must lie .*whole pitch on the circle shifted by x = 2.1 modules"),
    ],
)
def test_impossible_gears_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        paper_gear(**changes)


def test_compliance_is_inversely_proportional_to_youngs_modulus():
    """The gears of a pair may have different materials."""
    density = Density(flank=4, fillet=1, tooth=2, rim=1, body=1, teeth=1, width=1)
    soft = paper_gear(material=fem.Material(E=3 * GPa))
    blocks = [elastic_body(gear, density).blocks for gear in (paper_gear(), soft)]
    assert blocks[1] == pytest.approx(70 * blocks[0], rel=1e-6, abs=1e-9 * np.abs(blocks[1]).max())
    pair = fem.GearPair(paper_gear(), soft, a=150 * mm)
    assert pair_of(ste_map(pair, [0, 1], [0, 0.5], np.zeros((2, 2)))).wheel.material == soft.material


def test_materials_are_checked():
    with pytest.raises(ValueError, match="E must lie"):
        fem.Material(E=210)
    with pytest.raises(ValueError, match="nu"):
        fem.Material(nu=0.5)
    with pytest.raises(ValueError, match=r"E must be one real number .*got '210e9'"):
        fem.Material(E="210e9")


def test_numbers_of_any_library_become_python_floats():
    """Also in single precision: a gear of such numbers is equal to one of Python floats."""
    sizes = {"m_n": 2.6 * mm, "b": 23 * mm, "d_bore": 60 * mm, "s_n": 3.78 * mm, "rho_f": 0.9 * mm, "fillet": None}
    for kind in (np.float32, np.float64, np.array):
        given = {name: None if size is None else kind(size) for name, size in sizes.items()}
        plain = {name: None if size is None else float(size) for name, size in given.items()}
        gear = paper_gear(z=np.int64(57), material=fem.Material(E=kind(200e9)), **given)
        assert gear == paper_gear(z=57, material=fem.Material(E=float(kind(200e9))), **plain)
        assert {type(getattr(gear, name)) for name in sizes} == {float, type(None)} and type(gear.z) is int
        assert type(fem.GearPair(gear, gear, a=kind(150 * mm)).a) is float
    with_int = fem.Gear(z=20, m_n=2 * mm, b=20 * mm, d_bore=20 * mm, x=0, beta=0)
    assert repr(with_int) == repr(fem.Gear(z=20, m_n=2 * mm, b=20 * mm, d_bore=20 * mm, x=0.0, beta=0.0))


def test_equality_and_copies_ignore_cached_quantities():
    used, fresh = paper_gear(), paper_gear()
    assert used.face.roll_tip == used.roll_tip
    assert (used, hash(used), repr(used)) == (fresh, hash(fresh), repr(fresh))
    assert pickle.loads(pickle.dumps(used)) == fresh
    larger = {"d_a": 155 * mm, "b": 20 * mm}
    assert replace(used, **larger).roll_tip == paper_gear(**larger).roll_tip > used.roll_tip
