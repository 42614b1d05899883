"""Invalid data: a valid gear, pair, shaft part or stage with an impossible number is refused in words."""

from functools import partial
from math import inf, nan
from warnings import catch_warnings, simplefilter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_gears import paper_gear, paper_pair
from scenes import linear_law

import exugear
import fem
from fem.units import GPa, deg, mm, um

PAIR, LAW = paper_pair(), linear_law(reach=1e-3)
GEAR = {"z": 30, "m_n": 2 * mm, "b": 20 * mm, "d_bore": 20 * mm, "alpha_n": 20 * deg, "beta": 0.1, "x": 0.1}
SHAFTS = [exugear.Shaft(name, {0.0: paper_gear()}) for name in ("a", "b")]
#: What builds it, valid data.
MAKERS = {
    "gear": (fem.Gear, GEAR | {"d_a": 66 * mm}),
    "material": (fem.Material, {"E": 210 * GPa, "nu": 0.3, "density": 7850.0}),
    "pair": (lambda a: fem.GearPair(paper_gear(), paper_gear(), a=a), {"a": 150 * mm}),
    "bearing": (exugear.Bearing, {"radial": 1e8, "axial": 1e8, "tilt": 1e4, "damping_time": 1e-5, "clearance": 5 * um}),
    "deep groove": (
        partial(exugear.RollingBearing.deep_groove, Z=9),
        {"D_w": 12 * mm, "D_pw": 60 * mm, "r_i": 6.3 * mm, "r_e": 6.4 * mm, "clearance": 5 * um, "C": 2e4}
        | {"E": 210 * GPa, "nu": 0.3, "damping_time": 1e-5},
    ),
    "tapered": (
        partial(exugear.RollingBearing.tapered_roller, Z=14),
        {"D_w": 10 * mm, "D_pw": 60 * mm, "L_we": 12 * mm, "alpha": 15 * deg, "C": 4e4},
    ),
    "Schlenk": (exugear.SchlenkFriction, {"viscosity": 0.02, "roughness": 0.4 * um, "lubricant_factor": 1.0}),
    "Niemann": (exugear.NiemannFriction, {"viscosity": 0.02, "roughness": 0.4 * um}),
    "Xu": (exugear.XuFriction, {"viscosity": 0.02, "roughness": 0.4 * um}),
    "drag": (exugear.Drag, {"constant": 1.0, "viscous": 1e-3, "speed": 1.0}),
    "bearing drag": (
        exugear.BearingDrag,
        {"d_m": 60 * mm, "f_0": 2.0, "viscosity": 20e-6, "f_1": 3e-4, "load": 1e3, "speed": 1.0},
    ),
    "disc": (exugear.Disc, {"mass": 1.0, "inertia": 1e-3, "transverse": 1e-3}),
    "coupling": (exugear.Coupling, {"torsion": 1e4, "damping": 1.0, "inertia": 0.1}),
    "placement": (exugear.Placement, {"x": 0.0, "y": 0.0, "z": 0.0, "tilt_x": 0.0, "tilt_y": 0.0, "pivot": 0.0}),
    "shaft": (
        lambda **given: exugear.Shaft("a", {0.0: paper_gear()}, **given),
        {"inertia": 1e-3, "mass": 1.0, "transverse": 1e-3, "length": 0.3},
    ),
    "stage": (lambda **given: exugear.Stage(*SHAFTS, LAW, pair=PAIR, **given), {"angle": 0.0, "phase": 0.0}),
}
NOT_NUMBERS = (nan, inf, -inf)
FAR = (-1e300, -1.0, -1e-300, 0.0, 1e-300, 1e300)


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind, (_, data) in MAKERS.items() for name in data])
def test_values_that_are_no_numbers_are_refused_by_name(kind, name):
    make, data = MAKERS[kind]
    make(**data)
    for value in NOT_NUMBERS:
        with pytest.raises(ValueError, match=rf"\b{name}\b"):
            make(**data | {name: value})


@st.composite
def spoilt(draw) -> tuple:
    """Some valid data, some of whose numbers are far off."""
    make, data = MAKERS[draw(st.sampled_from(list(MAKERS)))]
    names = draw(st.lists(st.sampled_from(list(data)), min_size=1, max_size=3, unique=True))
    wild = st.sampled_from((*NOT_NUMBERS, *FAR)) | st.floats()
    return make, data | {name: draw(wild) for name in names}


@given(spoilt())
@settings(max_examples=400)
def test_numbers_far_off_are_taken_or_refused_in_words(case):
    make, data = case
    try:
        with catch_warnings():
            simplefilter("ignore", UserWarning)
            make(**data)
    except ValueError as error:
        assert type(error) is ValueError
        assert any(word in str(error) for word in ("must", ";", "cannot", "needs", "holds"))
