"""Mass of gears whose mesh leaves teeth out: that of the whole gear; smaller elements where reliefs begin."""

import numpy as np
import pytest
from paper_gears import paper_gear
from skfem import ElementHex2, ElementQuad1, ElementQuad2

import fem
from fem import Density, dynamic
from fem.reference.deformable_gear import DeformableGear, clamped_pair, flank_flexibility, with_edges
from fem.reference.st_venant_kirchhoff import lumped_mass
from fem.reference.time_integration import LoadedRun
from fem.units import mm, um

SMALL = fem.Gear(z=20, x=0.3, m_n=2 * mm, b=20 * mm, d_bore=18 * mm)
LARGE = fem.Gear(z=47, x=-0.1, m_n=2 * mm, b=20 * mm, d_bore=40 * mm)
PAIR = fem.GearPair(LARGE, SMALL)
FEW, ALL = (Density(flank=16, teeth=n, behind=n) for n in (2, 10))


def wheel(density: Density) -> DeformableGear:
    return clamped_pair(PAIR, density, ElementQuad1())[1]


def inertia(gear: DeformableGear, masses: np.ndarray) -> float:
    """About the gear's axis [kg m^2]."""
    return float(masses @ (gear.solid.positions**2).sum(axis=1))


def test_teeth_outside_the_mesh_count_as_inertia_of_the_hub():
    few, whole = wheel(FEW), wheel(ALL)
    assert (few.toothless, whole.toothless) == (15, 0)
    assert inertia(whole, whole.masses) == pytest.approx(inertia(whole, lumped_mass(whole.solid)), rel=1e-12)
    assert inertia(few, lumped_mass(few.solid)) < 0.7 * inertia(whole, whole.masses)
    assert inertia(few, few.masses) == pytest.approx(inertia(whole, whole.masses), rel=0.006)
    free = few.free // 2
    np.testing.assert_array_equal(few.masses[free], lumped_mass(few.solid)[free])


@pytest.mark.parametrize("element", [ElementQuad2(), ElementHex2()])
@pytest.mark.parametrize("mass", [0.0, 1e8])
def test_flanks_yield_as_by_solutions_for_single_forces(element, mass):
    tiny = Density(flank=4, fillet=1, tooth=1, rim=1, body=1, width=1, teeth=1, behind=1)
    gear, _ = clamped_pair(fem.GearPair(SMALL, SMALL), tiny, element)
    operator = gear.flank_operator
    forces = operator[::7].T.toarray().reshape(*gear.solid.positions.shape, -1)
    expected = operator @ gear.solver(mass)(forces).reshape(operator.shape[1], -1)
    flexibility = flank_flexibility(gear, mass)[:, ::7]
    assert flexibility == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())


def test_wheel_accelerates_by_the_inertia_of_all_its_teeth():
    """A unit acceleration of the rigid wheel on the line of action takes J / r_b^2."""
    loaded = LoadedRun(PAIR, 50.0, dynamic.RunUp())
    equations = dynamic.equations_of_motion(loaded, FEW, ElementQuad1())
    rest = equations.at_rest().displacement
    force = equations.inertia_forces((rest, rest, dynamic.Motion(rest.u, 1.0)), 0.0, 0.0)
    whole = wheel(ALL)
    assert force.te * SMALL.r_b**2 == pytest.approx(inertia(whole, whole.masses), rel=0.006)


def test_edges_are_where_reliefs_begin_on_either_gear():
    relieved = paper_gear(flank=(fem.TipRelief(15 * um, 2.5 * mm), fem.RootRelief(5 * um, 6 * mm)))
    pair = fem.GearPair(relieved, paper_gear(), a=150 * mm)
    tip, root = relieved.roll_tip - 2.5 * mm, relieved.roll_form + 6 * mm
    across = pair.a * np.sin(pair.alpha_wt)
    pinion, wheel = with_edges(pair, Density())
    assert pinion.edges == pytest.approx((root, tip))
    assert wheel.edges == pytest.approx((across - tip, across - root))
    turned = with_edges(fem.GearPair(paper_gear(), relieved, a=150 * mm), Density())
    assert turned == (wheel, pinion)


@pytest.mark.parametrize(
    ("flank", "edges"),
    [
        ((), None),
        ((fem.ProfileCrowning(5 * um), fem.LeadCrowning(5 * um)), None),
        ((fem.TipRelief(15 * um, 2.5 * mm, power=2),), None),
        ((fem.TipRelief(15 * um, 2.5 * mm),), ()),
    ],
)
def test_no_edges_without_reliefs_or_where_none_are_requested(flank, edges):
    gear = paper_gear(flank=flank)
    assert [graded.edges for graded in with_edges(fem.GearPair(gear, gear, a=150 * mm), Density(edges=edges))] == [
        (),
        (),
    ]


def test_edges_closer_than_an_element_are_merged():
    """Reliefs of both gears that begin 1 nm apart on the path of contact, and a relief from root to tip."""
    gear = paper_gear()
    pair = fem.GearPair(gear, gear, a=150 * mm)
    length = gear.roll_tip - pair.a * np.sin(pair.alpha_wt) / 2
    whole = fem.RootRelief(1 * um, gear.roll_tip - gear.roll_form)
    flanks = [(fem.TipRelief(15 * um, length + off), whole) for off in (0.0, 1e-9)]
    pinion, wheel = (paper_gear(flank=flank) for flank in flanks)
    for density in with_edges(fem.GearPair(pinion, wheel, a=150 * mm), Density()):
        assert density.edges == pytest.approx((gear.roll_tip - length,), abs=1e-8)
