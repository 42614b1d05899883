"""A pinion in a ring: published and derived numbers, limits, interferences with their remedies."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ring_gears import planet, ring, ring_pair, wind_turbine_stage

import fem
from fem import iso6336
from fem.units import deg, mm


def test_published_stage():
    """NREL 5 MW stage 2; a is accepted with either sign and < 0, as are the ring's diameters."""
    pair = wind_turbine_stage()
    sheet = pair.data_sheet()
    ring_sizes = {"d_w2": 1905.684, "d_Nf2": 1969.750, "d_Na2": 1906.081, "d_Ff2": 1987.879}
    sizes = {"d_w1": 737.684, "d_Nf1": 738.082, "c_1": 8.459, "c_2": 6.709, "g_alpha": 100.284, "a": -584.0}
    for symbol, expected in (sizes | {symbol: -size for symbol, size in ring_sizes.items()}).items():
        assert sheet[symbol].value == pytest.approx(expected * mm, abs=2e-6), symbol
    assert sheet["alpha_wt"].value == pytest.approx(15.6295 * deg, abs=1e-6)
    assert sheet["eps_alpha"].value == pytest.approx(1.618, abs=5e-4)
    assert sheet["j_bt"].value == 0 and pair == replace(pair, a=-584 * mm)
    assert sheet["u"].value == -93 / 36


def test_published_stiffness():
    """ISO 6336-1: the ring counts as a gear of infinitely many teeth; C_R is published as 0.862, rounded."""
    pair, rim = wind_turbine_stage(), {"C_R": 0.8623}
    stiffness = [f(pair, **rim) / 1e9 for f in (iso6336.single_stiffness, iso6336.mesh_stiffness)]
    stiffness.append(iso6336.face_load_stiffness(pair, **rim) / 1e9)
    assert stiffness == pytest.approx([14.053, 20.563, 17.479], rel=1e-4)


def test_backlash_grows_as_the_pinion_moves_towards_the_ring_s_centre():
    tight = ring_pair()
    loose = replace(tight, a=abs(tight.a) - 0.05 * mm)
    assert tight.backlash == 0 < loose.backlash
    assert loose.data_sheet()["j_r"].value == pytest.approx(0.05 * mm)
    with pytest.raises(ValueError, match=r"backlash must be >= 0, .* reduce \|a\|, a = -46.9149 mm, or reduce s_n"):
        replace(tight, a=abs(tight.a) + 0.02 * mm)


@pytest.mark.parametrize(
    ("gears", "message"),
    [
        (lambda: (ring(), planet()), r"pinion must be an external gear, .* fem.GearPair\(planet, ring\)"),
        (
            lambda: (planet(80), ring(d_rim=400 * mm)),
            r"must have more teeth than its pinion, got 80 and -71; raise \|z\|",
        ),
        (
            lambda: (planet(beta=10 * deg), ring(beta=-10 * deg, d_a=141 * mm, d_rim=180 * mm)),
            "must be equal, in a ring",
        ),
        (lambda: (planet(x=0.0), ring(x=0.0, height=1.0)), r"mate's tip .* of the pinion.* reduce \|a\|"),
        (lambda: (planet(50, -0.14), ring(-56, 0.15, height=0.48, fillet=0.3 * mm)), "trochoidal .* shorten the teeth"),
        (lambda: (planet(d_a=52.39 * mm), ring(fillet=0.9 * mm)), r"strikes the root of the wheel .*raise \|d_f\|"),
        (lambda: (planet(22, 0.65), ring(-63, 0.56, height=0.55)), r"too thick for any centre distance .* reduce x"),
    ],
)
def test_pairs_that_cannot_run_are_refused_with_a_remedy(gears, message):
    with pytest.raises(ValueError, match=message):
        fem.GearPair(*gears())


def test_radial_assembly_takes_a_ring_of_many_more_teeth():
    """The clearance of few more teeth is negative; with enough of them backlash alone limits it."""
    close = fem.GearPair(planet(60, 0.39), ring(-79, -0.1, height=0.59, fillet=0.3 * mm))
    far = ring_pair(a=abs(ring_pair().a) - 0.05 * mm)
    assert close.radial_clearance < 0 < far.radial_clearance < far.backlash
    assert "assemble along the axis" in str(close.data_sheet())


@settings(max_examples=25)
@given(st.integers(14, 40), st.integers(20, 80), st.floats(0, 0.5), st.floats(-0.2, 0.5), st.floats(0.6, 1.0))
def test_pairs_run_or_are_refused(z, more, x_1, x_2, height):
    """ValueError or a pair whose numbers fit one another."""
    try:
        pair = fem.GearPair(planet(z, x_1), ring(-z - more, x_2, height=height))
    except ValueError:
        return
    path = pair.path_of_contact
    assert path.start < path.end and pair.eps_alpha > 1
    assert path.on_wheel(path.end) < path.on_wheel(path.start) < 0
    assert pair.a < 0 < pair.data_sheet()["c_1"].value
    assert sum(path.r_w) == pytest.approx(pair.a)
