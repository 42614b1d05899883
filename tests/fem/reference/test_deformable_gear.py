"""Mass of gears whose mesh leaves teeth out: that of the whole gear."""

import numpy as np
import pytest
from skfem import ElementQuad1

import fem
from fem import Density
from fem.reference.deformable_gear import DeformableGear, clamped_pair
from fem.reference.dynamic import Motion, equations_of_motion
from fem.reference.st_venant_kirchhoff import lumped_mass
from fem.reference.time_integration import LoadedRun, RunUp
from fem.units import mm

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


def test_wheel_accelerates_by_the_inertia_of_all_its_teeth():
    """A unit acceleration of the rigid wheel on the line of action takes J / r_b^2."""
    loaded = LoadedRun(PAIR, 50.0, RunUp())
    equations = equations_of_motion(loaded, FEW, ElementQuad1())
    rest = equations.at_rest().displacement
    force = equations.inertia_forces((rest, rest, Motion(rest.u, 1.0)), 0.0, 0.0)
    whole = wheel(ALL)
    assert force.te * SMALL.r_b**2 == pytest.approx(inertia(whole, whole.masses), rel=0.006)
