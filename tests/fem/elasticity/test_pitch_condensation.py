"""One pitch, and half of the toothless rest, stand for the whole section."""

from functools import partial

import numpy as np
import pytest
from paper_gears import few_teeth, paper_gear
from whole_section import linear_system, solid_prism, uniform_prism

from fem import Density
from fem.elasticity import section_mesh
from fem.elasticity.face_symmetry import HalfFace, WholeFace
from fem.elasticity.flank_compliance import flank_forces
from fem.elasticity.pitch_condensation import Prism, flank_displacements
from fem.linalg.direct_solver import superlu
from fem.units import deg

TINY = Density(flank=4, fillet=1, tooth=2, rim=1, body=2, teeth=2, behind=1, width=1)
HELICAL = few_teeth(beta=20 * deg)


def check_against_whole_section(prism: Prism, density: Density) -> None:
    arcs = section_mesh.flank_arcs(prism.gear, 2)
    matrix, forces = linear_system(prism, density, arcs)
    u = superlu(matrix.matrix)(forces[0].toarray())
    expected = np.stack([force.T @ u for force in forces])
    displacements = flank_displacements(prism, density, partial(flank_forces, gear=prism.gear, arcs=arcs))
    assert displacements == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("density", [TINY, TINY.with_teeth(0, behind=0), TINY.refined(2)])
@pytest.mark.parametrize("gear", [paper_gear(), HELICAL], ids=["spur", "helical"])
def test_sections_that_deform_alike_yield_as_the_whole_section(gear, density):
    check_against_whole_section(uniform_prism(gear), density)


@pytest.mark.parametrize(
    ("gear", "face"),
    [(paper_gear(), HalfFace()), (paper_gear(), HalfFace(antisymmetric=True)), (HELICAL, WholeFace())],
    ids=["equal", "opposite", "helical"],
)
def test_solids_yield_as_those_of_the_whole_section(gear, face):
    check_against_whole_section(solid_prism(gear, TINY, face), TINY)


def test_gear_whose_pitches_all_have_teeth_yields_as_the_whole_section():
    gear = few_teeth(z=12, x=0.4, d_bore=8e-3)
    check_against_whole_section(uniform_prism(gear), TINY.with_teeth(5, behind=6))
