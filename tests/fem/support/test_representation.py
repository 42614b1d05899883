"""Texts of data are short; exact texts, the keys of the cache, differ for different data."""

import re
from dataclasses import replace

import numpy as np
import pytest
from paper_gears import few_teeth, paper_gear, paper_pair
from scenes import linear_law, smooth_box, smooth_map

import exugear
import fem
from fem.support.representation import exact
from fem.units import GPa, mm, um

MODIFIED = [fem.TipRelief(15 * um, 2.5 * mm), fem.LeadCrowning(5 * um), fem.EndRelief(8 * um, 3 * mm)]
LEAVES = [
    few_teeth(flank=MODIFIED),
    few_teeth(beta=0.2, fillet=0.4 * mm, material=fem.Material(E=206 * GPa), flank=fem.Sides(MODIFIED, MODIFIED[0])),
    paper_pair(),
    fem.STEEL,
    *MODIFIED,
    fem.Grid((5 * mm, 9 * mm), (-9 * mm, 0.0, 9 * mm), np.full((2, 3), 3 * um)),
    fem.PitchDeviation(np.arange(20) * um / 10),
    fem.Offsets(misalignment=(-2e-4, 0, 2e-4), a=150 * mm),
    fem.Resolution(slices=40),
    fem.Slices(slices=40),
    fem.UpTo(350),
    exugear.Bearing(2e8, 1e8, 1e5, clearance=5 * um),
    exugear.Bearing(matrix=np.diag([1e8, 1e8, 1e7, 1e4, 1e4, 0])),
    exugear.Coupling(2e4, 2.0, inertia=0.02),
    exugear.Disc(1.0, 1e-3, 1e-3),
    exugear.Placement(tilt_x=2e-4, pivot=30 * mm),
    exugear.RingPair(few_teeth(), -60, -40 * mm),
    exugear.MeshFriction.of_pair(paper_pair(), 0.05),
    exugear.Recorder(),
    linear_law(),
    exugear.Shaft("fast", {0.0: exugear.Bearing(2e8, 1e8, 1e5), 30 * mm: paper_gear()}),
    smooth_box().stages[0],
]


@pytest.mark.parametrize("leaf", LEAVES, ids=lambda leaf: type(leaf).__name__)
def test_data_are_short(leaf):
    assert repr(leaf).startswith(f"{type(leaf).__name__}(")
    assert len(repr(leaf)) <= 200
    assert not re.search(r"\.\d*(0000|9999)", repr(leaf))


def test_gears_show_drawing_units():
    sizes = "z=57, m_n=2.6 mm, b=23 mm, d_bore=60 mm, x=-0.160659, s_n=3.78 mm, d_a=154.5 mm, d_f=141.7 mm"
    assert repr(paper_gear()) == f"Gear({sizes}, rho_f=0.988 mm)"
    short = "Gear(z=57, m_n=2.6 mm, ...)"
    assert repr(paper_pair()) == f"GearPair(pinion={short}, wheel={short}, a=150 mm)"
    assert repr(exugear.Bearing(2e8, damping_time=2e-5)) == "Bearing(radial=2e8 N/m, damping_time=2e-5 s)"
    assert "beta=-20 deg" in repr(few_teeth(beta=-np.pi / 9))


def test_models_show_a_few_lines():
    model = exugear.build(smooth_box())
    assert len(repr(model)) < 1000 and len(repr(model).splitlines()) <= 12
    assert repr(model.gearbox) == "Gearbox(fast-slow: 57/57 teeth)"
    assert repr(model.plan) == str(model.plan)


def test_keys_of_data_with_equal_short_texts_differ():
    gear = paper_gear()
    for unlike in (replace(gear, b=gear.b * (1 + 1e-12)), replace(gear, material=fem.Material(E=210.0001 * GPa))):
        assert repr(unlike) == repr(gear) or "Material" in repr(unlike)
        assert exact(unlike) != exact(gear)
    many, more = (fem.PitchDeviation([0.0] * 5 + [x]) for x in (1e-9, 1.0000001e-9))
    assert repr(many) == repr(more) and exact((many,)) != exact((more,))
    with pytest.raises(TypeError, match="ndarray"):
        exact((1.0, np.zeros(2)))


def test_maps_keep_the_exact_text_of_their_resolution():
    ste = fem.static_transmission_error(paper_pair(), [50], 4, resolution=fem.Slices(), progress=False)
    assert ste.attrs["resolution"].startswith("Slices(density=Density(flank=16, fillet=3, ")
    assert smooth_map().attrs["pinion_m_n"] == 2.6 * mm
