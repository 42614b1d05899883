"""The finite elements: symmetry, rigid motion, an independent assembly, closed forms of local flattening."""

import numpy as np
import pytest
from compliance_products import across
from involutes import arc_length
from paper_gears import paper_gear
from raw_twin import hexahedra_along, line_from_mid_plane
from scipy.sparse.linalg import spsolve
from skfem import Basis, ElementHex1, ElementLineP1, ElementLineP2, ElementQuad1, ElementQuad2, ElementVector, MeshLine
from skfem.models.elasticity import lame_parameters, linear_elasticity
from twins import line_flattening

from fem import STEEL, Density, LeadCrowning, Resolution, hexahedra, section
from fem.elasticity import extruded_elasticity
from fem.elasticity.flank_compliance import flank_compliance, flank_compliances, flank_loads, solutions
from fem.pair import hertz
from fem.support.cache import source_stamp
from fem.units import mm, um

GEAR = paper_gear()
TINY = Density(flank=4, fillet=1, tooth=2, rim=1, body=1, teeth=1, width=2)


def test_products_of_section_and_width_equal_hexahedra():
    quads, line = section(GEAR, TINY), line_from_mid_plane(GEAR.b, TINY.width)
    solid = Basis(hexahedra_along(GEAR, TINY, line), ElementVector(ElementHex1()), intorder=8)
    reference = linear_elasticity(*lame_parameters(STEEL.E, STEEL.nu)).assemble(solid)
    plane, width = Basis(quads, ElementQuad1(), intorder=8), Basis(line, ElementLineP1(), intorder=8)
    matrix = extruded_elasticity.stiffness(plane, width, STEEL).matrix
    order = np.concatenate(list(solid.nodal_dofs))
    assert abs(matrix - reference[order][:, order]).max() < 1e-12 * abs(reference).max()


@pytest.mark.parametrize("twist", [0.0, 4.0])
def test_sections_that_deform_alike_are_a_prism_of_uniform_displacement(twist):
    """Work per length of displacements that do not vary along the axis; without twist in the plane."""
    plane, line = Basis(section(GEAR, TINY), ElementQuad1()), line_from_mid_plane(GEAR.b, 2)
    per_length = extruded_elasticity.uniform_stiffness(plane, STEEL, twist).matrix
    u = np.random.default_rng(0).standard_normal(per_length.shape[0])
    width = Basis(line, ElementLineP2())
    uniform = np.zeros((3, plane.N, width.N))
    uniform[: u.size // plane.N] = u.reshape(-1, plane.N, 1)
    work = uniform.ravel() @ extruded_elasticity.stiffness(plane, width, STEEL, twist).matrix @ uniform.ravel()
    assert work == pytest.approx(u @ per_length @ u * GEAR.b / 2, rel=1e-12)


def turned(x, y, angle):
    return np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y


@pytest.mark.parametrize("twist", [0.0, 4.0])
def test_rigid_motion_is_free_of_force(twist):
    plane, width = Basis(section(GEAR, TINY), ElementQuad1()), Basis(line_from_mid_plane(GEAR.b, 4), ElementLineP2())
    stiffness = extruded_elasticity.stiffness(plane, width, STEEL, twist).matrix
    z = np.tile(width.doflocs[0], plane.N)
    x, y = turned(*(np.repeat(c, width.N) for c in plane.doflocs), twist * z)
    zero = np.zeros_like(x)
    for motion in ((zero + 1, zero, zero), (-y, x, zero), (zero, zero, zero + 1), (zero, -z, y)):
        u = np.concatenate([*turned(*motion[:2], -twist * z), motion[2]])
        assert np.abs(stiffness @ u).max() < (1e-8 if twist else 1e-12) * np.abs(stiffness).max() * np.abs(u).max()


def test_rigid_motion_of_a_large_section_is_free_of_force():
    """The flat numbers of its matrix entries exceed 32 bits."""
    plane = Basis(section(GEAR, Density().refined(3)), ElementQuad2())
    assert int(plane.N) ** 2 > 2**31
    stiffness = extruded_elasticity.uniform_stiffness(plane, STEEL).matrix
    turning = np.concatenate([-plane.doflocs[1], plane.doflocs[0]])
    assert np.abs(stiffness @ turning).max() < 1e-11 * np.abs(stiffness).max() * np.abs(turning).max()


def test_twisted_prism_yields_like_twisted_hexahedra():
    """Both are fine along z; the hexahedra are assembled on turned nodes by scikit-fem's own form."""
    twist, tiny = 6.0, Density(flank=2, fillet=1, tooth=1, rim=1, body=1, teeth=0, behind=0, width=1)
    quads, line = section(GEAR, tiny), MeshLine(np.linspace(0, 10 * mm, 17))
    basis, axis = Basis(quads, ElementQuad1()), Basis(line, ElementLineP1())
    matrix = extruded_elasticity.stiffness(basis, axis, STEEL, twist).matrix
    mesh = hexahedra_along(GEAR, tiny, line)
    x, y = turned(mesh.p[0], mesh.p[1], twist * mesh.p[2])
    solid = Basis(type(mesh)(np.stack([x, y, mesh.p[2]]), mesh.t), ElementVector(ElementHex1()))
    reference = linear_elasticity(*lame_parameters(STEEL.E, STEEL.nu)).assemble(solid)
    n = mesh.p.shape[1]
    angle = twist * mesh.p[2]
    free = np.flatnonzero(np.tile(np.hypot(x, y) > GEAR.d_bore / 2 * (1 + 1e-6), 3))
    force = np.random.default_rng(0).standard_normal(3 * n) * np.tile(np.hypot(x, y) > 70 * mm, 3)
    local = np.concatenate([*turned(force[:n], force[n : 2 * n], -angle), force[2 * n :]])
    order = np.concatenate(list(solid.nodal_dofs))
    reference = reference[order][:, order]
    work = [f[free] @ spsolve(k[free][:, free].tocsc(), f[free]) for f, k in ((local, matrix), (force, reference))]
    assert work[0] == pytest.approx(work[1], rel=2e-3)


def test_flank_loads_are_unit_forces_with_the_lever_of_the_base_circle():
    basis = Basis(section(GEAR, Density()), ElementQuad1())
    x, y = basis.doflocs
    for tooth in (0, 1):
        low, high = arc_length(GEAR, np.array([GEAR.roll_form, GEAR.roll_tip]))
        f_x, f_y, size = flank_loads(GEAR, basis, high - (high - low) * np.linspace(1, 0, 9) ** 1.5, tooth)
        assert size.sum(axis=0) == pytest.approx(1, rel=1e-12)
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


def test_threads_do_not_change_a_bit(monkeypatch, tmp_path):
    """Two gears at once, as one gear after the other."""
    bodies, blocks = [(paper_gear(), TINY, GEAR.b), (paper_gear(z=40, d_a=None, d_f=None), TINY, GEAR.b)], []
    for number in (1, 2):
        monkeypatch.setenv("EXUGEAR_CACHE", str(tmp_path / str(number)))
        monkeypatch.setattr("fem.support.blas_threads.cores", lambda number=number: number)
        blocks.append([body.blocks for body in flank_compliances(bodies, whole=True)])
    assert all((serial == threaded).all() for serial, threaded in zip(*blocks, strict=True))


def test_flanks_of_a_gear_share_its_compliance():
    """A modification is a gap: it changes no compliance, and what the other flank computed is taken, not made again."""
    plain, modified, smaller, again = (
        flank_compliance(gear, TINY, gear.b, whole=True)
        for gear in (GEAR, paper_gear(flank=(LeadCrowning(5 * um),)), paper_gear(z=40, d_a=None, d_f=None), GEAR)
    )
    assert modified is plain and again is plain
    assert smaller is not plain and smaller.blocks.max() != plain.blocks.max()
    assert flank_compliance(GEAR, TINY, GEAR.b) is not plain


def test_compliance_is_symmetric(compliance):
    n = compliance.arcs.size * compliance.axial.size
    loaded_tooth = compliance.blocks[0].reshape(n, n)
    assert np.abs(loaded_tooth - loaded_tooth.T).max() < 1e-10 * np.abs(loaded_tooth).max()


def test_densities_are_whole_numbers():
    with pytest.raises(ValueError, match="fillet must be a whole number"):
        Density(fillet=0)
    with pytest.raises(ValueError, match="flank must be an even number"):
        Resolution(Density(flank=7))


def test_compliance_converges():
    """A finer mesh moves the compliance under a line load over the whole width by less than 0.3 %."""
    few = {"teeth": 0, "behind": 0}
    coarse = flank_compliance(GEAR, Density(**few), GEAR.b)
    fine = flank_compliance(GEAR, Density(tooth=5, rim=6, body=9, width=4, fillet=5, **few), GEAR.b)

    def line_load(body):
        even = across(body, np.array([0.0]), np.array([GEAR.b / 2]))[:, 0]
        smooth = np.einsum("y,yhzk,z->hk", even, body.blocks[0], even)
        half_space = line_flattening(STEEL, body.end, 0.1 * mm)
        return smooth[3, 3] + half_space, smooth[6, 6] + half_space

    assert line_load(coarse) == pytest.approx(line_load(fine), rel=3e-3)


def test_wider_gear_is_stiffer_under_the_same_load(compliance):
    wider = flank_compliance(paper_gear(b=30 * mm), Density(), GEAR.b)
    assert wider.axial == pytest.approx(compliance.axial)
    assert wider.blocks[0, 0, 3, 0, 3] < compliance.blocks[0, 0, 3, 0, 3]


def test_left_hand_is_the_mirror_of_right_hand():
    right, left = (flank_compliance(paper_gear(beta=b, d_a=156 * mm), TINY, GEAR.b) for b in (0.1, -0.1))
    assert left.blocks == pytest.approx(right.blocks[:, ::-1, :, ::-1])
    assert np.abs(left.blocks - right.blocks).max() > 1e-3 * right.blocks.max()


def test_helical_compliance_tends_to_that_of_spur():
    spur = flank_compliance(paper_gear(), TINY, GEAR.b, whole=True)
    nearly = flank_compliance(paper_gear(beta=1e-5), TINY, GEAR.b)
    assert nearly.blocks == pytest.approx(spur.blocks, rel=1e-3, abs=1e-4 * spur.blocks.max())


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
    assert hertz.half_width(100e3, 13.93 * mm, 2 * hertz.flattening(steel)) == pytest.approx(0.12518 * mm, abs=5e-9)


def test_keys_of_the_cache_hold_all_that_a_solution_depends_on():
    """All fields to the last digit, and the checksum of the sources, so that changed code computes anew."""
    stamp = source_stamp("fem.elasticity.flank_compliance")
    sizes = "z=57, m_n=0.0026000000000000003, b=0.023, d_bore=0.06, d_rim=None, alpha_n=0.3490658503988659, beta=0.0, "
    tooth = "x=-0.1606589796889921, s_n=0.00378, d_a=0.1545, d_f=0.1417, rho_f=0.0009880000000000002, fillet=None, "
    gear = f"Gear({sizes}{tooth}cutter=None, material=Material(E=210000000000.0, nu=0.3, density=7850.0), flank=(), "
    gear += "support=())"
    section = "flank=16, fillet=3, land=1, tooth=4, rim=4, body=7"
    rest = "teeth=2, behind=1, divide=1, rim_power=1.0, tip_power=None, edges=None)"
    assert solutions(paper_gear(flank=(LeadCrowning(5 * um),)), Density(width=4, behind=1), 0.023) == {
        "near field": f"near field {stamp} {gear} Density({section}, width=1, {rest}",
        "even": f"solid {stamp} {gear} Density({section}, width=4, {rest} 0.023 even",
    }
