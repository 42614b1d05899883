"""Elastic shafts from sections: mass, natural frequencies and torsion, against published and closed-form values."""

from math import pi

import numpy as np
import pytest
from paper_gears import paper_gear

import exugear
import fem
from exugear import Bearing, Coupling, Disc, Shaft
from fem.units import GPa, mm, rpm

GEAR = paper_gear()
SUPPORT = {0.0: Bearing(5e8, 1e8), 300 * mm: Bearing(5e8)}


def test_a_pinned_beam_has_the_frequencies_of_timoshenkos_closed_form():
    beam = Shaft("beam", {0.0: Bearing(9e12, 1e8), 1.0: Bearing(9e12)}, sections=[(0.1, 1.0)])
    both_planes = beam.bending_frequencies()[:8].reshape(4, 2)
    assert both_planes == pytest.approx(np.array([[200.702, 776.255, 1661.205, 2779.212]]).T * [1, 1], rel=2e-4)


def test_a_rotor_whirls_as_published():
    """Friswell, Penny, Garvey & Lees, Dynamics of Rotating Machines (2010), example 5.9.1: of six elements."""
    steel = fem.Material(E=211 * GPa, nu=211 / (2 * 81.2) - 1, density=7810.0)
    discs = {0.5: Disc.cylinder(0.07, 0.28, 0.05, 7810.0), 1.0: Disc.cylinder(0.07, 0.35, 0.05, 7810.0)}
    ends = {0.0: Bearing(1e6, 1e6), 1.5: Bearing(1e6)}
    rotor = Shaft("rotor", discs | ends, sections=[(0.05, 1.5)], material=steel)
    at_rest = rotor.bending_frequencies()[:8:2]
    assert at_rest == pytest.approx([13.792, 43.658, 114.08, 169.68], rel=1e-3)
    turning = rotor.bending_frequencies(4000 * rpm)[:6]
    assert turning == pytest.approx([13.590, 13.973, 40.073, 46.905, 95.522, 131.633], rel=1e-3)


def test_mass_follows_from_sections_and_counts_no_material_twice():
    solid = Shaft("s", {150 * mm: GEAR} | SUPPORT, sections=[(40 * mm, 300 * mm)])
    drilled = Shaft("s", {150 * mm: GEAR} | SUPPORT, sections=[(40 * mm, 100 * mm), (40 * mm, 200 * mm, 20 * mm)])
    shaft = 7850 * pi / 4 * (40 * mm) ** 2 * 300 * mm
    bore = 7850 * pi / 4 * (40 * mm) ** 2 * GEAR.b
    assert solid.mass == pytest.approx(GEAR.mass + shaft - bore)
    assert solid.centre == pytest.approx(150 * mm)
    assert solid.mass - drilled.mass == pytest.approx(7850 * pi / 4 * (20 * mm) ** 2 * 200 * mm)
    rod = Shaft("rod", SUPPORT, sections=[(40 * mm, 300 * mm)])
    assert rod.transverse == pytest.approx(shaft * (3 * (20 * mm) ** 2 + (300 * mm) ** 2) / 12)
    assert rod.inertia == pytest.approx(shaft * (20 * mm) ** 2 / 2)


def test_a_shaft_twists_between_its_end_and_its_gear():
    shaft = Shaft("s", {100 * mm: GEAR} | SUPPORT, sections=[(40 * mm, 300 * mm)], torque_at=300 * mm)
    rigidity = 210e9 / 2.6 * pi / 32 * (40 * mm) ** 4
    free = 200 * mm - GEAR.b / 2
    assert rigidity / (free + GEAR.b / 2) < shaft.twist.torsion < rigidity / free
    mode = np.sqrt(shaft.twist.torsion / shaft.body_inertia)
    beam, held = shaft.beam, shaft.beam.node(300 * mm)
    moving = np.delete(np.arange(beam.axial.size), held)
    part = np.ix_(moving, moving)
    squares = np.linalg.eigvals(np.linalg.solve(beam.torsion_mass[part], beam.torsion_stiffness[part]))
    assert mode == pytest.approx(np.sqrt(squares.real.min()), rel=5e-4)
    assert shaft.turning_inertia == pytest.approx(shaft.inertia)


def test_a_coupling_at_the_end_bears_its_rotor_behind_the_twist():
    motor = Coupling(1e4, inertia=0.01)
    shaft = Shaft(
        "s", {100 * mm: GEAR, 300 * mm: [motor, Bearing(5e8)], 0.0: Bearing(5e8, 1e8)}, sections=[(0.04, 0.3)]
    )
    assert [(rotor.name, rotor.body) for rotor in shaft.rotors] == [("s end", "s"), ("s rotor", "s end")]
    assert shaft.end == "s rotor"


@pytest.mark.parametrize(
    "sections, remedy, further",
    [
        ([], "list of", {}),
        ([(40.0, 300.0)], "pass metres", {}),
        ([(0.04, 0.3, 0.05)], "d > d_inner", {}),
        ([(0.2, 0.3)], "make it thinner", {}),
        ([(0.04, 0.3)], "leave mass out", {"mass": 2.0}),
        ([(0.04, 0.2)], "outside the shaft", {}),
        ([(0.04, 0.3)], "torque_at", {"torque_at": 0.4}),
        (None, "pass sections", {"torque_at": 0.1}),
    ],
)
def test_impossible_sections_are_refused_with_the_remedy(sections, remedy, further):
    with pytest.raises(ValueError, match=remedy):
        exugear.Shaft("s", {100 * mm: GEAR} | SUPPORT, sections=sections, **further)
