"""Pairs of gears against closed forms and published numbers; pairs that cannot run are refused with a remedy."""

from dataclasses import replace
from math import pi, sin

import numpy as np
import pytest
from helical_gears import published_pair
from hypothesis import given, settings
from hypothesis import strategies as st
from involutes import involute
from paper_gears import paper_gear
from strategies import pairs, without_backlash

import fem
from fem import Density, pair_of, ste_map
from fem.units import deg, mm, um


def test_paper_pair(paper_pair):
    assert paper_pair.pinion.r_b == pytest.approx(69.63122 * mm, abs=5e-9)
    assert paper_pair.alpha_wt == pytest.approx(21.8107 * deg, abs=1e-6)
    assert paper_pair.eps_alpha == pytest.approx(1.45571, abs=5e-6)
    assert paper_pair.p_bt == pytest.approx(7.67554 * mm, abs=5e-9)
    assert paper_pair.backlash == pytest.approx(1.8569 * mm, abs=5e-8)


def test_published_helical_pair():
    pair = published_pair()
    assert pair.eps_alpha == pytest.approx(1.4599, abs=5e-5)
    assert pair.eps_beta == pytest.approx(0.5414, abs=5e-5)


def test_published_gear_with_shifts_of_two_modules():
    """FZG H951: eps_alpha 0.93, eps_beta 1.00; the fillets of a tool with tip radius 0.38 m_n would interfere."""
    data = {"m_n": 1.75 * mm, "b": 21.2418 * mm, "d_bore": 30 * mm}
    sizes = [{"d_a": 2 * r_a * mm, "d_f": 2 * r_f * mm} for r_a, r_f in ((38.115, 35.196), (55.867, 52.947))]
    pinion = fem.Gear(z=38, beta=15 * deg, x=1.6915, **data, **sizes[0])
    wheel = fem.Gear(z=57, beta=-15 * deg, x=2.0003, **data, **sizes[1])
    with pytest.raises(
        ValueError, match=r"interference.* reduce rho_f = 0.665 mm or d_f = 70.392 mm .* h_fP.* or raise a"
    ):
        fem.GearPair(pinion, wheel, a=91.5 * mm)
    pair = fem.GearPair(*(replace(gear, rho_f=0.5 * mm) for gear in (pinion, wheel)), a=91.5 * mm)
    assert [pair.eps_alpha, pair.eps_beta] == pytest.approx([0.93, 1.00], abs=0.005)
    rough = Density(flank=6, fillet=1, tooth=2, rim=1, body=1, width=1)
    slices = fem.Slices(density=rough, slices=8)
    ste = fem.static_transmission_error(pair, [0, 100], 4, resolution=slices, progress=False)
    te = ste["te"].values
    assert te[0] == pytest.approx(0, abs=1e-9) and (te[1] > 1 * um).all()


def test_centre_distance_without_backlash_obeys_the_profile_shifts():
    data = {"m_n": 3 * mm, "b": 20 * mm, "d_bore": 15 * mm}
    pair = fem.GearPair(fem.Gear(z=23, x=0.3, **data), fem.Gear(z=41, x=0.2, **data))
    expected = involute(20 * deg) + 2 * np.tan(20 * deg) * (0.3 + 0.2) / (23 + 41)
    assert involute(pair.alpha_wt) == pytest.approx(expected, rel=1e-9)
    assert pair.backlash == pytest.approx(0, abs=1e-12)


@given(pairs(), st.floats(0.5, 1.5))
@settings(max_examples=100)
def test_pairs_at_any_centre_distance_run_or_raise_value_errors(pair, factor):
    try:
        moved = fem.GearPair(pair.pinion, pair.wheel, a=factor * pair.a)
    except ValueError as error:
        assert len(str(error)) > 20
    else:
        assert moved.eps_gamma > 1 and moved.backlash >= 0 and 0 < moved.alpha_wt < pi / 2


@given(pairs())
@settings(max_examples=200)
def test_a_pair_and_the_same_with_pinion_and_wheel_exchanged_agree(pair):
    m_n, pinion, wheel = pair.pinion.m_n, pair.pinion, pair.wheel
    swapped = fem.GearPair(wheel, pinion, a=pair.a)
    for name in ("eps_alpha", "eps_beta", "alpha_wt", "p_bt"):
        assert getattr(swapped, name) == pytest.approx(getattr(pair, name), rel=1e-9)
    assert swapped.backlash == pytest.approx(pair.backlash, abs=1e-9 * m_n)
    line = pair.a * sin(pair.alpha_wt)
    assert swapped.roll_start == pytest.approx(line - pair.roll_end, abs=1e-9 * m_n)
    assert swapped.roll_pitch + pair.roll_pitch == pytest.approx(line, abs=1e-9 * m_n)
    assert pair._backlash_at(pair.a_without_backlash) == pytest.approx(0, abs=1e-9 * m_n)
    assert pair.a >= pair.a_without_backlash - 1e-9 * m_n
    assert pair.a_without_backlash == pytest.approx(without_backlash(pinion, wheel), abs=1e-9 * m_n)
    for gear, mate, start in ((pinion, wheel, pair.roll_start), (wheel, pinion, swapped.roll_start)):
        assert gear.roll_form == start if start > line - mate.roll_tip + 1e-9 * m_n else gear.roll_form < start
        assert start == line - mate.roll_tip or gear.undercut
    assert pair_of(ste_map(pair, [0, 1], [0, 0.5], np.zeros((2, 2)))) == pair


def test_undercut_pinion_runs_with_every_mate_up_to_the_rack():
    """The root that the rack cut clears the tip of every mate; the contact begins at the undercut end of the flank."""
    data = {"m_n": 3 * mm, "b": 20 * mm, "d_bore": 5 * mm}
    pinion, tip = fem.Gear(z=12, **data), 30 * um
    for z in (12, 31, 150, 1500):
        wheel = fem.Gear(z=z, **data)
        pair = fem.GearPair(pinion, wheel, a=(12 + z) * 1.5 * mm)
        assert pair.roll_start == pinion.roll_form > pair.a * sin(pair.alpha_wt) - wheel.roll_tip
        length = (pair.pinion.roll_tip if z > 17 else pair.roll_end) - pinion.roll_form
        assert pair.eps_alpha == pytest.approx(length / pair.p_bt)
    for z, raised in ((12, 10 * tip), (31, 10 * tip), (150, tip)):
        fem.GearPair(pinion, fem.Gear(z=z, d_a=(z + 2) * 3 * mm + 2 * raised, **data), a=(12 + z) * 1.5 * mm)
    for z, raised in ((150, 10 * tip), (1500, tip)):
        with pytest.raises(ValueError, match="interference"):
            fem.GearPair(pinion, fem.Gear(z=z, d_a=(z + 2) * 3 * mm + 2 * raised, **data), a=(12 + z) * 1.5 * mm)


def test_an_undercut_beyond_the_pitch_point_is_refused():
    """Behind the pitch point the wheel's flank would touch where the pinion has lost its involute."""
    data = {"m_n": 2 * mm, "b": 20 * mm, "alpha_n": 14.5 * deg}
    tool = {"h_fP": 3.014 * mm, "rho_f": 0.1 * mm, "d_a": 19.37 * mm}
    pinion = fem.Gear(z=8, beta=20 * deg, x=-0.309, d_bore=3.2 * mm, **tool, **data)
    wheel = fem.Gear(z=27, beta=-20 * deg, x=-0.063, d_bore=10.8 * mm, **data)
    words = (
        r"undercut removes the involute of the pinion up to roll length 2.975 mm, beyond the pitch point at 1.246 mm"
    )
    with pytest.raises(ValueError, match=words):
        fem.GearPair(pinion, wheel)


def test_a_helical_pair_without_a_path_of_contact_is_refused():
    data = {"m_n": 2 * mm, "b": 40 * mm, "d_bore": 1 * mm}
    with pytest.raises(ValueError, match=r"path of contact is empty, eps_alpha = -0\.035"):
        fem.GearPair(fem.Gear(z=7, beta=15 * deg, x=0.0, **data), fem.Gear(z=8, beta=-15 * deg, x=-0.3, **data))


def test_attributes_hold_all_inputs(paper_pair):
    data = fem.ste_map(paper_pair, [0, 1], [0, 0.5], np.zeros((2, 2)))
    assert fem.pair_of(data) == paper_pair
    assert data.attrs["wheel_s_n"] == 3.78 * mm


@pytest.mark.parametrize(
    ("wheel", "a", "message"),
    [
        ({}, 150, "pass metres: 150\\*mm"),
        ({}, "88", "a must be one real number .*got '88'"),
        ({}, 100 * mm, "base circles touch below"),
        ({}, 154 * mm, "contact ratio must exceed 1"),
        ({}, 148.2 * mm, "interference"),
        ({"m_n": 2.5 * mm, "d_a": 150 * mm, "d_f": 138 * mm}, 150 * mm, "m_n of pinion and wheel"),
        ({"beta": 0.1, "d_a": 156 * mm}, 150 * mm, "beta of pinion and wheel must be equal and opposite"),
        ({"s_n": 5.8 * mm, "d_a": 153 * mm, "rho_f": 0.1 * mm, "d_f": 143 * mm}, 150 * mm, "backlash must be >= 0"),
    ],
)
def test_impossible_pairs_are_refused(wheel, a, message):
    with pytest.raises(ValueError, match=message):
        fem.GearPair(paper_gear(), paper_gear(**wheel), a=a)
