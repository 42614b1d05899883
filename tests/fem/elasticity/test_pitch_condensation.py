"""One pitch, and half of the toothless rest, stand for the whole section."""

import numpy as np
import pytest
from paper_gears import few_teeth, paper_gear
from raw_twin import solved
from whole_section import displacements_by_pitch, linear_system, solid_prism, uniform_prism

from fem import Density
from fem.units import deg

TINY = Density(flank=4, fillet=1, tooth=2, rim=1, body=2, teeth=2, behind=1, width=1)
HELICAL = few_teeth(beta=20 * deg)


def check_against_whole_section(prism, density: Density) -> None:
    matrix, forces = linear_system(prism, density, hats=2)
    u = solved(matrix.matrix, forces[0].toarray())
    expected = np.stack([force.T @ u for force in forces])
    assert displacements_by_pitch(prism, density, hats=2) == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("density", [TINY, TINY.with_teeth(0, behind=0), TINY.refined(2)])
@pytest.mark.parametrize("gear", [paper_gear(), HELICAL], ids=["spur", "helical"])
def test_sections_that_deform_alike_yield_as_the_whole_section(gear, density):
    check_against_whole_section(uniform_prism(gear), density)


@pytest.mark.parametrize(("gear", "halves"), [(paper_gear(), "equal"), (paper_gear(), "opposite"), (HELICAL, "any")])
def test_solids_yield_as_those_of_the_whole_section(gear, halves):
    check_against_whole_section(solid_prism(gear, TINY, halves), TINY)


def test_gear_whose_pitches_all_have_teeth_yields_as_the_whole_section():
    gear = few_teeth(z=12, x=0.4, d_bore=8e-3)
    check_against_whole_section(uniform_prism(gear), TINY.with_teeth(5, behind=6))
