"""Smaller elements beside edges of the flank, thin layers below it; the FE mesh keeps its shape."""

import numpy as np
import pytest
from paper_gears import paper_gear
from skfem import Basis, ElementQuad2
from skfem.helpers import det
from twins import section_compliance

import fem
from fem import Density, section
from fem.elasticity import section_mesh
from fem.units import mm

EDGES = (25 * mm, 31 * mm)


def test_steps_are_small_at_edges_and_as_before_far_from_them():
    nodes = np.linspace(0, 1, 41) ** 1.2
    graded = section_mesh.refined_at_edges((0.3, 0.7), nodes)
    steps, usual = np.diff(graded), np.interp(graded[:-1], nodes[:-1], np.diff(nodes))
    assert graded[[0, -1]] == pytest.approx(nodes[[0, -1]])
    for edge in (0.3, 0.7):
        at = np.argmin(np.abs(graded - edge))
        assert graded[at] == pytest.approx(edge, abs=1e-12)
        assert steps[at - 1 : at + 1] == pytest.approx(usual[at] / section_mesh.CLOSER, rel=0.25)
    assert steps[3:6] == pytest.approx(usual[3:6], rel=0.1)
    assert (steps[1:] / steps[:-1]).max() < 1.3


def test_layers_fill_the_depth_and_grow():
    depths = section_mesh.layers(0.01, 0.2)
    assert depths[[0, -1]] == pytest.approx([0, 1])
    assert depths[1] == pytest.approx(0.01, rel=0.2)
    assert np.diff(depths).max() < 0.2 * (1 + 1e-9)


@pytest.mark.parametrize("divide", [1, 2])
def test_graded_section_has_the_area_and_flank_of_the_gear(divide):
    gear = paper_gear()
    plain, graded = (section(gear, Density(flank=30, fillet=6, divide=divide, edges=edges)) for edges in ((), EDGES))
    areas = [Basis(mesh, ElementQuad2()).dx.sum() for mesh in (plain, graded)]
    assert areas[1] == pytest.approx(areas[0], rel=1e-5)
    assert det(graded.mapping().DF(np.full((2, 1), 0.5))).min() > 0
    roll = np.sqrt((section_mesh.flank_nodes(gear, graded, 0) ** 2).sum(axis=0) - gear.r_b**2)
    assert (np.diff(roll) > 0).all()
    assert np.abs(roll[:, None] - EDGES).min(axis=0) == pytest.approx(0, abs=1e-9)
    assert roll[[0, -1]] == pytest.approx([gear.roll_form, gear.roll_tip])


def test_graded_section_bends_like_the_plain_one():
    gear, density = paper_gear(), Density(flank=44)
    plain, graded = (
        section_compliance(gear, Density(flank=16), mesh.refined(2))[0]
        for mesh in (density, Density(flank=44, edges=EDGES))
    )
    assert graded == pytest.approx(plain, rel=2e-4)


@pytest.mark.parametrize("tooth", [4, 24, 64])
@pytest.mark.parametrize("z", [17, 57])
def test_many_layers_turn_no_element_inside_out(tooth, z):
    gear = paper_gear() if z == 57 else fem.Gear(z=17, x=0.2, m_n=2 * mm, b=10 * mm, d_bore=20 * mm)
    mesh = section(gear, Density(flank=66, tooth=tooth, teeth=0, behind=0))
    corners = np.array([[0, 0, 1, 1], [0, 1, 0, 1]], float)
    assert det(mesh.mapping().DF(corners)).min() > 0


@pytest.mark.parametrize("edges", [(31 * mm, 25 * mm), (25 * mm, 25 * mm)])
def test_edges_out_of_order_are_refused(edges):
    with pytest.raises(ValueError, match="edges must increase"):
        Density(edges=edges)


@pytest.mark.parametrize("edge", [5 * mm, 40 * mm])
def test_edges_beside_the_flank_are_refused(edge):
    with pytest.raises(ValueError, match="edges must lie in"):
        section(paper_gear(), Density(edges=(edge,)))
