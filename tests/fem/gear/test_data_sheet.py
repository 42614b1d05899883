"""Quantities of ISO 21771 against published numbers and against measurements on the outline of the teeth."""

import re
from math import cos, pi, sin

import numpy as np
import pytest
from involutes import involute_flank
from paper_gears import few_teeth, paper_gear, paper_pair

import exugear
import fem
from fem.units import deg, mm


def measured_span(gear: fem.Gear, k: int) -> float:
    """Distance of two parallel planes that touch the outer flanks of k teeth of a spur gear [m]."""
    r, psi = involute_flank(gear, np.linspace(gear.roll_form, gear.roll_tip, 20001))
    across = r * np.sin(psi + (k - 1) * pi / gear.z)
    return 2 * across.max()


def distance_to_flank(gear: fem.Gear, r: float) -> float:
    """Distance from the middle of a space at radius r, in mid-plane, to the flank next to it [m]."""
    roll, axial = np.meshgrid(np.linspace(gear.roll_form, gear.roll_tip, 801), np.linspace(-0.1, 0.1, 801) * gear.b)
    flank_r, psi = involute_flank(gear, roll)
    turn = psi - pi / gear.z + axial * gear.twist
    return np.sqrt((flank_r * np.cos(turn) - r) ** 2 + (flank_r * np.sin(turn)) ** 2 + axial**2).min()


@pytest.mark.parametrize("gear", [paper_gear(), few_teeth(), few_teeth(z=35, x=-0.2)], ids=lambda gear: f"z{gear.z}")
def test_span_is_the_distance_of_parallel_planes_on_the_flanks(gear):
    sheet = gear.data_sheet()
    k = int(sheet["k"].value)
    assert sheet["W_k"].value == pytest.approx(measured_span(gear, k), rel=1e-8)


@pytest.mark.parametrize(("beta", "k", "published"), [(0.0, 4, 32.8266), (25 * deg, 5, 42.0085)])
def test_span_of_published_gears(beta, k, published):
    """z 24, m_n 3, x 0.4 (KHK, Gear Technical Reference, span measurement)."""
    gear = fem.Gear(z=24, m_n=3 * mm, b=30 * mm, d_bore=20 * mm, beta=beta, x=0.4)
    assert gear.data_sheet(k=k)["W_k"].value == pytest.approx(published * mm, abs=6e-8)
    assert gear.data_sheet()["W_k"].value == gear.data_sheet(k=k)["W_k"].value


def test_gear_of_a_published_calculation():
    """z 20, m_n 1, k 2, balls of 1.7 mm (MESYS, geometry of helical gears by ISO 21771)."""
    sheet = fem.Gear(z=20, m_n=1 * mm, b=10 * mm, d_bore=5 * mm).data_sheet(k=2)
    published = {"d_b": 18.7939, "s_n": 1.5708, "s_an": 0.6949, "D_M": 1.7, "M_dK": 22.2941, "W_k": 4.7083}
    assert {name: sheet[name].value / mm for name in published} == pytest.approx(published, abs=6e-5)


@pytest.mark.parametrize("gear", [paper_gear(), few_teeth(), few_teeth(z=35, beta=25 * deg)], ids=lambda x: f"z{x.z}")
def test_balls_rest_on_both_flanks(gear):
    sheet = gear.data_sheet()
    ball = sheet["D_M"].value
    d_k = (sheet["M_dK"].value - ball) / (cos(pi / 2 / gear.z) if gear.z % 2 else 1)
    assert distance_to_flank(gear, d_k / 2) == pytest.approx(ball / 2, rel=1e-6)
    assert d_k + ball > gear.d_a and d_k - ball > gear.d_f


def test_measures_that_miss_the_flanks_are_refused():
    gear = paper_gear()
    for arguments, named in (
        ({"k": 30}, "choose another k"),
        ({"k": 2.5}, "whole number"),
        ({"D_M": 1 * mm}, "rest on"),
    ):
        with pytest.raises(ValueError, match=named):
            gear.data_sheet(**arguments)
    narrow = few_teeth(z=60, beta=30 * deg, b=8 * mm)
    with pytest.raises(ValueError, match="face width"):
        narrow.data_sheet(k=10)
    assert "W_k" not in narrow.data_sheet() and "M_dK" in narrow.data_sheet()


def test_data_sheet_of_the_papers_pair():
    sheet = paper_pair().data_sheet()
    published = {"alpha_wt": 21.8107 * deg, "eps_alpha": 1.45571, "p_bt": 7.67554 * mm, "j_bt": 1.8569 * mm}
    assert {name: sheet[name].value for name in published} == pytest.approx(published, rel=2e-5)
    assert sheet["c_1"].value == pytest.approx(150 * mm - 154.5 / 2 * mm - 141.7 / 2 * mm)
    assert sheet["d_Nf1"].value > sheet["d_Ff1"].value and sheet["d_Na1"].value == pytest.approx(154.5 * mm)


def test_radial_backlash_is_the_decrease_of_the_centre_distance_to_zero_backlash():
    tight = fem.GearPair(few_teeth(), few_teeth(z=41))
    for wider in (1e-6, 0.3 * mm):
        sheet = fem.GearPair(tight.pinion, tight.wheel, a=tight.a + wider).data_sheet()
        assert sheet["j_r"].value == pytest.approx(wider, rel=1e-8)
        slope = sheet["j_wt"].value / (2 * np.tan(sheet["alpha_wt"].value))
        assert abs(slope / wider - 1) > (0.01 if wider > 1e-5 else 0)


def test_specific_sliding_is_that_of_the_velocities_of_rotating_gears():
    """Velocities omega x r of both gears along the flank, where the path of contact begins."""
    pair = fem.GearPair(few_teeth(), few_teeth(z=41), a=62.2 * mm)
    sheet, alpha = pair.data_sheet(), pair.alpha_wt
    along, flank = np.array([sin(alpha), cos(alpha)]), np.array([cos(alpha), -sin(alpha)])
    centre, r_w = np.array([-pair.a, 0.0]), sheet["d_w1"].value / 2
    point = centre + [r_w, 0] + (pair.roll_start - pair.roll_pitch) * along
    turned = lambda omega, arm: omega * np.array([-arm[1], arm[0]])  # noqa: E731
    pinion, wheel = turned(1.0, point - centre) @ flank, turned(-20 / 41, point) @ flank
    assert sheet["zeta_f1"].value == pytest.approx((pinion - wheel) / pinion, rel=1e-9)
    assert sheet["K_gf"].value == pytest.approx(abs(pinion - wheel) / r_w, rel=1e-9)


def test_a_sheet_is_a_table_and_a_mapping():
    gear = paper_gear()
    sheet = gear.data_sheet()
    assert re.search(r"W_k +51.6809 mm +span measurement over k teeth", str(sheet))
    assert sheet["p_bt"] == (gear.p_bt, "m", "transverse base pitch") and len(sheet) == len(list(sheet))
    assert sheet._repr_html_().count("<tr>") == len(sheet)
    assert "20 deg" in str(sheet) and str(sheet).startswith(repr(gear))


def test_mass_and_inertia_are_those_of_a_cylinder_and_of_the_shaft():
    gear = few_teeth(beta=25 * deg, material=fem.Material(density=7000.0))
    sheet, r = gear.data_sheet(), (gear.r_a + gear.r_f) / 2
    assert sheet["mass"] == (pytest.approx(7000 * pi * r**2 * gear.b), "kg", "mass, the bore filled")
    assert gear.inertia == sheet["inertia"].value == pytest.approx(gear.mass * r**2 / 2)
    assert gear.transverse == pytest.approx(gear.mass * (r**2 / 4 + gear.b**2 / 12))
    shaft = exugear.Shaft("fast", {0.0: gear})
    assert (shaft.mass, shaft.inertia, shaft.transverse) == (gear.mass, gear.inertia, gear.transverse)
