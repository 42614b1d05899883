"""One gear as an elastic body: pressure on its flanks in, displacement and stress at the nodes out.

The gear stands as in `mesh`: clamped at its bore, tooth 0 along y, teeth counted counter-clockwise, the flank that
faces counter-clockwise loaded. Unknowns are numbered component by component.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import cg
from skfem import Basis, BilinearForm, ElementHex1, ElementQuad1, ElementTriP1, ElementTriP2, Mesh, MeshHex, MeshTri

from fem import mesh as meshes
from fem import profile
from fem.cache import Arrays, cached
from fem.compliance import elasticity, lame_parameters, products, section_graph
from fem.gear import Gear, involute, require
from fem.mesh import Density
from fem.solver import Solve, factorize

INTERVALS = 24
#: Section for stress: root stress within 0.5 % of that with four times as many elements along the fillet.
FINE = Density(flank=30, fillet=8, land=4, tooth=5, rim=8, body=8)


@dataclass(frozen=True)
class FlankLoad:
    """Pressure on one tooth, constant on strips of the profile times slices of the width.

    tooth       number of the tooth, counter-clockwise
    edges       (n_strip + 1,) arc lengths that bound the strips, increasing [m]
    slices      (n_slice + 1,) axial places that bound the slices, increasing [m]; in a section [0, 1]: per metre
    force       (n_slice, n_strip) [N]
    """

    tooth: int
    edges: np.ndarray
    slices: np.ndarray
    force: np.ndarray

    def __post_init__(self):
        n, got = (self.slices.size - 1, self.edges.size - 1), self.force.shape
        require(got == n, f"force must have the shape (slices, strips) = {n}, got {got}")
        rising = bool((np.diff(self.edges) > 0).all() and (np.diff(self.slices) > 0).all())
        require(rising, f"edges and slices must increase; sort the strips from root to tip, got {self.edges}")

    @property
    def pressure(self) -> np.ndarray:
        """(n_slice, n_strip) [Pa]."""
        return self.force / np.diff(self.slices)[:, None] / np.diff(self.edges)

    def in_section(self, number: int) -> "FlankLoad":
        """Line load of one slice [N/m]."""
        line_load = self.force[number] / np.diff(self.slices)[number]
        return FlankLoad(self.tooth, self.edges, np.array([0.0, 1.0]), line_load[None])

    @property
    def extent(self) -> np.ndarray:
        """(2,) middle and half-width of the strips that carry load, in arc length [m]."""
        (pressed,) = np.nonzero(self.force.max(axis=0) > 0)
        low, high = self.edges[pressed[0]], self.edges[pressed[-1] + 1]
        return np.array([low + high, high - low]) / 2


@dataclass(frozen=True)
class Body:
    """Mesh of one gear with its factorized stiffness.

    section     scalar basis of the transverse section; of a solid, that of the quadrilaterals it is extruded from
    axial       (n_line,) axial places of the nodes over each node of the section [m]; none in plane strain
    """

    gear: Gear
    basis: Basis
    section: Basis
    axial: np.ndarray
    stiffness: sp.csr_matrix
    free: np.ndarray
    solve: Solve

    def displacement(self, forces: np.ndarray) -> np.ndarray:
        """Displacement of the dofs [m] under forces (n_dofs,) or (n_dofs, k)."""
        u = np.zeros_like(forces)
        u[self.free] = self.solve(forces[self.free].reshape(self.free.size, -1)).reshape(u[self.free].shape)
        return u


def plane_body(gear: Gear, mesh: MeshTri) -> Body:
    """Quadratic triangles in plane strain; forces are line loads [N/m]."""
    basis = Basis(mesh, ElementTriP2(), intorder=2)
    return _clamped(gear, basis, basis, np.zeros(0))


def solid_body(gear: Gear, density: Density) -> Body:
    """Linear hexahedra of the whole width, fully integrated: some per cent too stiff, contact not resolved."""
    solid, section = meshes.hexahedra(gear, density), Basis(meshes.section(gear, density), ElementQuad1())
    axial = solid.p[2, : solid.p.shape[1] // section.N]
    return _clamped(gear, Basis(solid, ElementHex1(), intorder=3), section, axial)


def _clamped(gear: Gear, basis: Basis, section: Basis, axial: np.ndarray) -> Body:
    dim = basis.mesh.dim()
    stiffness = elasticity([row[:dim] for row in products(basis)[:dim]], *lame_parameters(gear.material))
    hub = np.hypot(*basis.doflocs[:2]) < gear.d_bore / 2 * (1 + 1e-6)
    free = np.flatnonzero(~np.tile(hub, dim))
    column = free % basis.N // axial.size if axial.size else None
    solve = factorize(stiffness[free][:, free], column, section_graph(section))
    return Body(gear, basis, section, axial, stiffness, free, solve)


def graded(gear: Gear, density: Density, loads: list[FlankLoad], share: float) -> MeshTri:
    """Triangles of the section with edges of at most share half-widths under each load, growing away from it."""
    mesh = meshes.section(gear, density).to_meshtri()
    places = [(flank_points(gear, load.tooth, load.extent[:1]), load.extent[1]) for load in loads]
    while True:
        corners = mesh.p[:, mesh.t]
        size = np.hypot(*(corners - np.roll(corners, 1, axis=1))).max(axis=0)
        wanted = np.full(size.size, np.inf)
        for point, half in places:
            away = np.hypot(*(corners - point[:, :, None])).min(axis=0)
            wanted = np.minimum(wanted, share * half + 0.3 * np.maximum(away - 1.5 * half, 0.0))
        if (size <= wanted).all():
            return mesh
        mesh = _on_involute(gear, MeshTri(mesh.p, mesh.t).refined(np.flatnonzero(size > wanted)), loads)


def _on_involute(gear: Gear, mesh: MeshTri, loads: list[FlankLoad]) -> MeshTri:
    """Mesh with the nodes of the loaded flanks moved from the chords of the coarse facets to the involute."""
    points = mesh.p.copy()
    for load in loads:
        nodes = np.unique(mesh.facets[:, outline(gear, mesh, load.tooth)[0]])
        points[:, nodes] = flank_points(gear, load.tooth, arcs_of(gear, mesh.p[:, nodes]))
    return MeshTri(points, mesh.t)


def flank_ends(gear: Gear) -> np.ndarray:
    """(2,) arc lengths of root form and tip [m]."""
    return profile.arc_length(gear, np.array([gear.roll_form, gear.roll_tip]))


def flank_points(gear: Gear, tooth: int, arcs: np.ndarray) -> np.ndarray:
    """(2, n) points of a tooth's loaded flank at arc lengths arcs."""
    return profile.cartesian(profile.flank(gear, profile.roll_at(gear, arcs)), 2 * np.pi * tooth / gear.z)


def arcs_of(gear: Gear, points: np.ndarray) -> np.ndarray:
    """Arc lengths of points (2, ...) of a flank; inverse of `flank_points`."""
    return ((points**2).sum(axis=0) - gear.r_b**2) / (2 * gear.r_b)


def push(gear: Gear, tooth: int, arcs: np.ndarray) -> np.ndarray:
    """(2, n) unit normals into the flank at arc lengths arcs."""
    base_half_angle = gear.s_t / (2 * gear.r) + involute(gear.alpha_t)
    tangent = np.pi / 2 + base_half_angle - profile.roll_at(gear, arcs) / gear.r_b + 2 * np.pi * tooth / gear.z
    return np.stack([np.sin(tangent), -np.cos(tangent)])


def outline(gear: Gear, mesh: Mesh, tooth: int) -> tuple[np.ndarray, np.ndarray]:
    """Boundary facets of a section on the loaded side of a tooth: on its flank, and on the root below it."""
    facets = mesh.boundary_facets()
    ends = mesh.p[:, mesh.facets[:, facets]]
    radius, (x, y) = np.hypot(*ends), ends.mean(axis=1)
    angle = (np.arctan2(-x, y) - 2 * np.pi * tooth / gear.z + np.pi) % (2 * np.pi) - np.pi
    steep = np.ptp(radius, axis=0) > 0.5 * np.hypot(*(ends[:, 1] - ends[:, 0]))
    beside = (angle > 0) & (angle < np.pi / gear.z)
    above = radius.min(axis=0) > gear.r_form * (1 - 1e-9)
    below = (radius.max(axis=0) < gear.r_form * (1 + 1e-9)) & (radius.min(axis=0) > gear.r_f * (1 - 1e-4))
    order = np.argsort(-angle)
    return facets[order][(beside & above & steep)[order]], facets[order][(beside & below)[order]]


def flank_shares(gear: Gear, section: Basis, tooth: int, edges: np.ndarray) -> np.ndarray:
    """(n_dofs, n_strip) means of the shape functions of a section over strips of a tooth's flank."""
    mesh, (facets, _) = section.mesh, outline(gear, section.mesh, tooth)
    require(facets.size > 0, f"tooth {tooth} is not on the mesh; raise the density's teeth")
    one, other = section.dofs.nodal_dofs[0][mesh.facets[:, facets]]
    dofs = [one, other] + ([section.dofs.facet_dofs[0][facets]] if section.elem.facet_dofs else [])
    ends = arcs_of(gear, mesh.p[:, mesh.facets[:, facets]])
    return _gathered(dofs, strip_means(ends, edges, quadratic=len(dofs) == 3), section.N)


def unit_forces(gear: Gear, section: Basis, tooth: int, edges: np.ndarray) -> np.ndarray:
    """(2, n_dofs, n_strip) unit line loads on strips of a tooth's flank, spread evenly over each."""
    middle = (edges[1:] + edges[:-1]) / 2
    return push(gear, tooth, middle)[:, None, :] * flank_shares(gear, section, tooth, edges)


def strip_means(ends: np.ndarray, edges: np.ndarray, *, quadratic: bool) -> np.ndarray:
    """(n_shape, n_interval, n_strip) means over strips of the shapes on intervals with ends (2, n_interval)."""
    points, weights = np.polynomial.legendre.leggauss(3)
    low = np.maximum(ends.min(axis=0)[:, None], edges[:-1])
    high = np.maximum(np.minimum(ends.max(axis=0)[:, None], edges[1:]), low)
    at = (low + high)[..., None] / 2 + (high - low)[..., None] / 2 * points
    t = (at - ends[0][:, None, None]) / (ends[1] - ends[0])[:, None, None]
    shapes = [(1 - t) * (1 - 2 * t), t * (2 * t - 1), 4 * t * (1 - t)] if quadratic else [1 - t, t]
    covered = (high - low).sum(axis=0)
    return np.stack([shape @ (weights / 2) * (high - low) / covered for shape in shapes])


def forces(body: Body, loads: list[FlankLoad]) -> np.ndarray:
    """(n_dofs,) consistent nodal forces of the loads [N], in plane strain [N/m]."""
    total = np.zeros((body.basis.mesh.dim(), body.basis.N))
    for load in loads:
        units = unit_forces(body.gear, body.section, load.tooth, load.edges)
        total[:2] += (units @ load.force.T @ axial_shares(body, load.slices).T).reshape(2, -1)
    return total.ravel()


def axial_shares(body: Body, slices: np.ndarray) -> np.ndarray:
    """(n_line, n_slice) means over slices of the shape functions along the width; one in plane strain."""
    if not body.axial.size:
        return np.ones((1, slices.size - 1))
    ends, node = np.stack([body.axial[:-1], body.axial[1:]]), np.arange(body.axial.size)
    return _gathered([node[:-1], node[1:]], strip_means(ends, slices, quadratic=False), node.size)


def _gathered(dofs, means: np.ndarray, n: int) -> np.ndarray:
    """(n, n_strip) sums of means that belong to the same of n dofs."""
    shares = np.zeros((n, means.shape[2]))
    for dof, mean in zip(dofs, means, strict=True):
        np.add.at(shares, dof, mean)
    return shares


def contact_pressure(body: Body, loads: list[FlankLoad]) -> np.ndarray:
    """(n_vertex,) pressure on the flanks [Pa], averaged over the hats of the vertices: their areas give the force."""
    section = body.section.with_element(ElementQuad1() if body.axial.size else ElementTriP1())
    ends = np.array([body.axial[0], body.axial[-1]]) if body.axial.size else np.array([0.0, 1.0])
    width = axial_shares(body, ends) * (ends[1] - ends[0])
    pressure, flank = np.zeros((section.N, width.size)), flank_ends(body.gear)
    for load in loads:
        shares = flank_shares(body.gear, section, load.tooth, load.edges)
        nodal = shares @ load.force.T @ axial_shares(body, load.slices).T
        length = flank_shares(body.gear, section, load.tooth, flank) * (flank[1] - flank[0])
        pressure += np.divide(nodal, length * width.T, out=np.zeros_like(nodal), where=length > 0)
    return pressure.ravel()


def stress(body: Body, u: np.ndarray) -> np.ndarray:
    """(3, 3, n_vertex) stress [Pa]: that of the quadrature points, projected on linear elements."""
    basis, dim = body.basis, body.basis.mesh.dim()
    grad = np.zeros((3, 3, *basis.dx.shape))
    for i, component in enumerate(u.reshape(dim, -1)):
        grad[i, :dim] = basis.interpolate(component).grad
    lame, mu = lame_parameters(body.gear.material)
    volume = np.einsum("iieq->eq", grad) * np.eye(3)[:, :, None, None]
    return _projected(basis, mu * (grad + grad.transpose(1, 0, 2, 3)) + lame * volume)


def _projected(basis: Basis, values: np.ndarray) -> np.ndarray:
    """Nodal values whose linear interpolation is closest to values (..., n_element, n_point)."""
    linear = basis.with_element(ElementHex1() if isinstance(basis.mesh, MeshHex) else ElementTriP1())
    mass = BilinearForm(lambda u, v, w: u * v).assemble(linear)
    shapes = np.stack([np.broadcast_to(shape, linear.dx.shape) for (shape,) in linear.basis])
    result = np.empty((*values.shape[:-2], linear.N))
    for place in np.ndindex(values.shape[:-2]):
        local = np.einsum("beq,eq,eq->be", shapes, values[place], linear.dx)
        load = np.bincount(linear.element_dofs.ravel(), local.ravel(), linear.N)
        result[place], failed = cg(mass, load, rtol=1e-10, M=sp.diags_array(1 / mass.diagonal()))
        if failed:
            raise RuntimeError("the stress could not be averaged to nodes; the mesh is distorted, raise its density")
    return result


@dataclass(frozen=True)
class Root:
    """Stress along the loaded side's fillet of a tooth per line load on the flank of tooth 0, in plane strain.

    arcs            (n_load,) arc lengths of the unit loads [m]
    stress          (2 n_teeth + 1, n_place, n_load) on teeth -n_teeth .. n_teeth [1/m]
    inclination     (n_place,) angle between the fillet's tangent and the tooth's centre line [rad]
    """

    arcs: np.ndarray
    stress: np.ndarray
    inclination: np.ndarray


def root_influence(gear: Gear, density: Density = FINE) -> Root:
    """Stress in the roots under unit loads by one factorization, from the cache where it was computed before.

    On the free surface the stress is that of the stretched facets: E/(1 - nu^2) times their strain.
    """

    def compute() -> Arrays:
        body = plane_body(gear, meshes.section(gear, density).to_meshtri())
        mesh, edges = body.basis.mesh, meshes.divided(flank_ends(gear), INTERVALS)
        u = body.displacement(unit_forces(gear, body.section, 0, edges).reshape(-1, INTERVALS))
        u = u.reshape(2, -1, INTERVALS)
        strain = []
        for tooth in range(-density.teeth, density.teeth + 1):
            one, other = mesh.facets[:, outline(gear, mesh, tooth)[1]]
            edge = mesh.p[:, other] - mesh.p[:, one]
            strain.append(np.einsum("cf,cfl->fl", edge / (edge**2).sum(axis=0), u[:, other] - u[:, one]))
        x, y = meshes.rotated(edge, -2 * np.pi * tooth / gear.z)
        stress = gear.material.E / (1 - gear.material.nu**2) * np.stack(strain)
        return {"arcs": (edges[1:] + edges[:-1]) / 2, "stress": stress, "inclination": np.arctan(np.abs(x / y))}

    return Root(**cached(f"root stress 1 {replace(gear, flank=())} {density}", compute))
