"""One gear as an elastic body: pressure on its flanks in, displacement out.

The gear stands as in `mesh`, clamped at its bore. Unknowns are numbered by component, dof of the section, dof of the
axis; those of a helical gear are components along axes that turn with the section, as in `prism`.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from skfem import Basis, ElementLineP2, ElementQuad2, ElementTriP2, MeshHex, MeshLine, MeshTri

from fem.elasticity import extruded_elasticity, extrusion, section_mesh
from fem.elasticity.mesh_density import Density
from fem.gear.gear import Gear
from fem.linalg.block_matrix import KroneckerMatrix
from fem.linalg.direct_solver import Solve, factorize
from fem.stress.flank_loads import FlankLoad, arcs_of, flank_points, flank_shares, gathered, outline, push, strip_means
from fem.support.progress import announced

#: Section for stress: root stress within 0.5 % of that with four times as many elements along the fillet.
FINE = Density(flank=30, fillet=8, land=4, tooth=5, rim=8, body=8)
#: Solid for fields: root stress within 1 to 3 % of that on finer ones, 4 % on undercut teeth.
SOLID = Density(flank=12, fillet=8, land=2, tooth=4, rim=4, body=4, width=2, rim_power=1.5)

#: Elements of solids are narrower towards the end faces by this power: there lines of contact of helical gears begin.
GRADING = 1.6


@dataclass(frozen=True)
class Body:
    """Mesh of one gear with its factorized stiffness.

    section     scalar basis of the transverse section
    axis        scalar basis from end face to end face; None in plane strain, where forces are line loads [N/m]
    free        dofs that are not clamped
    """

    gear: Gear
    section: Basis
    axis: Basis | None
    stiffness: KroneckerMatrix
    free: np.ndarray
    solve: Solve

    @property
    def dim(self) -> int:
        return 2 if self.axis is None else 3

    @property
    def axial(self) -> np.ndarray:
        """(n_axis,) axial places of the dofs over each dof of the section [m]; 0 in plane strain."""
        return np.zeros(1) if self.axis is None else self.axis.doflocs[0]

    @cached_property
    def upwards(self) -> np.ndarray:
        """(n_axis,) numbers of the dofs over each dof of the section, from low to high."""
        return np.argsort(self.axial)

    @property
    def line(self) -> MeshLine:
        """Elements between the dofs along the axis."""
        return MeshLine(self.axial[self.upwards])

    @cached_property
    def mesh(self) -> MeshTri | MeshHex:
        """Triangles, or hexahedra along the helix: the elements of the section over those of `line`."""
        section = self.section.mesh
        return section if self.axis is None else extrusion.extruded(section, self.line, self.gear.twist)

    def displacement(self, forces: np.ndarray) -> np.ndarray:
        """Displacement of the dofs [m] under forces (n_dofs,) or (n_dofs, k)."""
        u = np.zeros_like(forces)
        u[self.free] = self.solve(forces[self.free].reshape(self.free.size, -1)).reshape(u[self.free].shape)
        return u

    def at_vertices(self, u: np.ndarray) -> np.ndarray:
        """(dim, n_vertex) displacement of those of `mesh` along fixed axes, of unknowns u (n_dofs,)."""
        parts = self.in_fixed_axes(u).reshape(self.dim, self.section.N, -1)
        return parts[:, self.section.nodal_dofs[0]][..., self.upwards].reshape(self.dim, -1)

    def in_fixed_axes(self, u: np.ndarray) -> np.ndarray:
        """(dim, n) components along axes that do not turn with the section, of unknowns u (n_dofs,)."""
        parts = u.reshape(self.dim, -1, self.axial.size).copy()
        parts[:2] = section_mesh.rotated(parts[:2], self.gear.twist * self.axial)
        return parts.reshape(self.dim, -1)


def plane_body(gear: Gear, mesh: MeshTri) -> Body:
    """Quadratic triangles in plane strain; forces are line loads [N/m]."""
    return _clamped(gear, Basis(mesh, ElementTriP2(), intorder=2), None)


def solid_body(gear: Gear, density: Density) -> Body:
    """Quadratic elements of the whole width, which resolve the root and not the contact."""
    line = extrusion.both_sides(extrusion.half_width(gear.b, gear.b, density.width, GRADING))
    with announced(f"finite elements of the gear of {gear.z} teeth"):
        return _clamped(gear, Basis(section_mesh.section(gear, density), ElementQuad2()), Basis(line, ElementLineP2()))


def _clamped(gear: Gear, section: Basis, axis: Basis | None) -> Body:
    stiffness = extruded_elasticity.stiffness(section, axis, gear.material, gear.twist)
    dim, n = (2, 1) if axis is None else (3, axis.N)
    hub = np.hypot(*section.doflocs) < gear.d_bore / 2 * (1 + 1e-6)
    free = ~np.tile(np.repeat(hub, n), dim)
    part = stiffness.part(free)
    return Body(gear, section, axis, stiffness, np.flatnonzero(free), factorize(part.matrix if axis is None else part))


def graded(gear: Gear, density: Density, loads: list[FlankLoad], share: float) -> MeshTri:
    """Triangles of the section with edges of at most share half-widths under each load, growing away from it."""
    mesh = section_mesh.section(gear, density).to_meshtri()
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


def forces(body: Body, loads: list[FlankLoad]) -> np.ndarray:
    """(n_dofs,) consistent nodal forces of the loads [N], in plane strain [N/m]."""
    total = np.zeros((body.dim, body.section.N, body.axial.size))
    for load in loads:
        low, high = load.edges[:, :-1], load.edges[:, 1:]
        shares = flank_shares(body.gear, body.section, load.tooth, low.ravel(), high.ravel())
        pressed = push(body.gear, load.tooth, load.middle)[: body.dim] * load.force
        by_cell = np.einsum("ncs,dcs->dnc", shares.reshape(-1, *low.shape), pressed)
        total += by_cell @ axial_shares(body.axis, load.low, load.high).T
    return total.ravel()


def axial_shares(axis: Basis | None, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(n_axis, n_slice) means over slices of the shape functions along the width; one in plane strain."""
    if axis is None:
        return np.ones((1, low.size))
    ends, dofs = axis.mesh.p[0][axis.mesh.t], axis.element_dofs
    return gathered(dofs, strip_means(ends, low, high, quadratic=len(dofs) == 3), axis.N)


def contact_pressure(body: Body, loads: list[FlankLoad]) -> np.ndarray:
    """(n_vertex,) largest pressure on the flanks [Pa] nearer to a vertex of `body.mesh` than to the next ones."""
    section, across = body.section.mesh, _around(body.axial[body.upwards])
    pressure = np.zeros((section.p.shape[1], body.axial.size))
    for load in loads:
        nodes = np.unique(section.facets[:, outline(body.gear, section, load.tooth)[0]])
        arcs = arcs_of(body.gear, section.p[:, nodes])
        nodes, along = nodes[np.argsort(arcs)], _around(np.sort(arcs))
        area = np.diff(load.edges, axis=1) * (load.high - load.low)[:, None] / np.cos(body.gear.beta_b)
        on_strips = np.divide(load.force, area, out=np.zeros_like(area), where=area > 0)
        touched = _overlap(load.edges[:, :-1], load.edges[:, 1:], along)
        by_cell = np.where(touched, on_strips[:, :, None], 0.0).max(axis=1)
        found = np.where(_overlap(load.low, load.high, across)[:, None], by_cell[:, :, None], 0.0).max(axis=0)
        pressure[nodes] = np.maximum(pressure[nodes], found)
    return pressure.ravel()


def _around(places: np.ndarray) -> np.ndarray:
    """(n + 1,) ends of what is nearest to increasing places (n,)."""
    return np.concatenate([[-np.inf], (places[1:] + places[:-1]) / 2, [np.inf]])


def _overlap(low: np.ndarray, high: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """(..., n) whether ranges from low to high (...) reach into those between ends (n + 1,)."""
    return (low[..., None] < ends[1:]) & (high[..., None] > ends[:-1])
