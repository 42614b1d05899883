"""The finite elements: symmetry, rigid motion, an independent assembly, closed forms of local flattening."""

import numpy as np
import pytest
from conftest import paper_gear
from skfem import Basis, ElementHex1, ElementLineP1, ElementLineP2, ElementQuad1, ElementVector
from skfem.models.elasticity import linear_elasticity

from fem import hertz
from fem.compliance import elasticity, extruded_products, flank_compliance, flank_loads, lame_parameters
from fem.gear import STEEL
from fem.mesh import Density, extruded, flank_arcs, half_width, hexahedra, section
from fem.units import mm

GEAR = paper_gear()
TINY = Density(flank=4, fillet=1, tooth=2, rim=1, body=1, teeth=1, width=2)


def test_products_of_section_and_width_equal_hexahedra():
    quads, line = section(GEAR, TINY), half_width(GEAR.b, GEAR.b, TINY.width)
    solid = Basis(extruded(quads, line), ElementVector(ElementHex1()), intorder=8)
    reference = linear_elasticity(*lame_parameters(STEEL)).assemble(solid)
    products = extruded_products(Basis(quads, ElementQuad1(), intorder=8), Basis(line, ElementLineP1(), intorder=8))
    ours = elasticity(products, *lame_parameters(STEEL))
    order = np.concatenate(list(solid.nodal_dofs))
    assert abs(ours - reference[order][:, order]).max() < 1e-12 * abs(reference).max()


def test_rigid_motion_is_free_of_force():
    plane, width = Basis(section(GEAR, TINY), ElementQuad1()), Basis(half_width(GEAR.b, GEAR.b, 2), ElementLineP2())
    stiffness = elasticity(extruded_products(plane, width), *lame_parameters(STEEL))
    x, y = (np.repeat(c, width.N) for c in plane.doflocs)
    z = np.tile(width.doflocs[0], plane.N)
    zero = np.zeros_like(x)
    for motion in ((zero + 1, zero, zero), (-y, x, zero), (zero, -z, y)):
        u = np.concatenate(motion)
        assert np.abs(stiffness @ u).max() < 1e-9 * np.abs(stiffness).max() * np.abs(u).max()


def test_flank_loads_are_unit_forces_with_the_lever_of_the_base_circle():
    basis = Basis(section(GEAR, Density()), ElementQuad1())
    x, y = basis.doflocs
    for tooth in (0, 1):
        f_x, f_y = flank_loads(GEAR, basis, flank_arcs(GEAR, 20), tooth).reshape(2, basis.N, -1)
        torque = x @ f_y - y @ f_x
        assert torque[1:] == pytest.approx(-GEAR.r_b, rel=2e-4)
        assert np.hypot(f_x.sum(axis=0), f_y.sum(axis=0)) == pytest.approx(1, rel=2e-3)


def test_mesh_is_valid_and_fills_the_gear():
    mesh = section(GEAR, Density())
    a, b, c, d = mesh.p[:, mesh.t].transpose(1, 0, 2)
    areas = ((c - a)[0] * (d - b)[1] - (c - a)[1] * (d - b)[0]) / 2
    assert areas.min() > 0
    tooth = GEAR.s_t * (GEAR.r_a - GEAR.r_f)
    expected = np.pi * (GEAR.r_f**2 - (GEAR.d_bore / 2) ** 2) + 5 * tooth
    assert areas.sum() == pytest.approx(expected, rel=0.02)
    solid = hexahedra(GEAR, TINY)
    assert np.ptp(solid.p[2]) == pytest.approx(GEAR.b)
    assert solid.boundaries["bore"].size > 0


@pytest.fixture(scope="module")
def compliance():
    return flank_compliance(GEAR, Density(), GEAR.b)


def test_compliance_is_symmetric(compliance):
    n = compliance.arcs.size * (compliance.slices.size - 1)
    own = compliance.blocks[0].reshape(n, n)
    assert np.abs(own - own.T).max() < 1e-10 * np.abs(own).max()


def test_densities_are_whole_numbers():
    with pytest.raises(ValueError, match="flank must be a whole number"):
        Density(flank=0)


def test_compliance_converges():
    """Density by halves moves the compliance under a line load over the whole width by less than 0.3 %."""
    coarse = flank_compliance(GEAR, Density(), GEAR.b)
    fine = flank_compliance(GEAR, Density(tooth=5, rim=6, body=9, width=4, fillet=5), GEAR.b)

    def line_load(body):
        width = np.diff(body.slices)
        own = np.einsum("y,yhzk,z->hk", width, body.blocks[0], width) / width.sum() ** 2
        return own[8, 8], own[14, 14]

    assert line_load(coarse) == pytest.approx(line_load(fine), rel=3e-3)


def test_wider_gear_is_stiffer_under_the_same_load(compliance):
    wider = flank_compliance(paper_gear(b=30 * mm), Density(), GEAR.b)
    assert wider.slices == pytest.approx(compliance.slices)
    assert wider.blocks[0, 0, 5, 0, 5] < compliance.blocks[0, 0, 5, 0, 5]


def test_strips_reproduce_hertz():
    """Elliptical pressure on strips: q c (1/2 - ln(a/2)) under its middle (integral of sqrt(1 - t^2) ln|t|)."""
    a, n = 0.125 * mm, 400
    edges = np.linspace(-a, a, n + 1)
    x = (edges[1:] + edges[:-1]) / 2
    share = np.sqrt(1 - (x / a) ** 2)
    share /= share.sum()
    u = hertz.log_mean(x[:, None] - x, edges[1] - edges[0], edges[1] - edges[0]) @ share
    expected = 0.5 - np.log(a / 2) - (x / a) ** 2
    assert u == pytest.approx(expected, abs=2e-3)


def test_hertz_half_width():
    """q = 100 N/mm, relative radius 13.93 mm, E 206 GPa: a = 0.12518 mm."""
    steel = type(STEEL)(E=206e9)
    assert hertz.half_width(100e3, 13.93 * mm, steel, steel) == pytest.approx(0.12518 * mm, abs=5e-9)
