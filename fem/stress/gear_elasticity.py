"""Linear elasticity of a gear that is clamped at its bore, or at the outside of its rim, under pressure on its flanks.

Quadratic elements of the section times those of the axis (`fem.elasticity.extruded_elasticity`, which states the weak
form). Dofs are numbered by component, dof of the section, dof of the axis; those of a helical gear are components along
axes that turn with the section. The position of the gear is that of
`fem.elasticity.section_mesh`.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product
from math import sqrt

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree
from skfem import (
    Basis,
    BilinearForm,
    ElementLineP2,
    ElementQuad2,
    ElementTriP2,
    FacetBasis,
    LinearForm,
    MeshHex,
    MeshLine,
    MeshTri,
)

from fem.elasticity import extruded_elasticity, extrusion, section_mesh
from fem.elasticity.face_symmetry import WholeFace, clamped
from fem.elasticity.mesh_density import Density
from fem.elasticity.rim_springs import rim_springs
from fem.gear.gear import Gear
from fem.gear.rim_support import Bolts, Bush
from fem.gear.tooth_profile import arc_at, flank_points
from fem.linalg.block_matrix import KroneckerMatrix
from fem.linalg.direct_solver import Solve, factorize
from fem.stress.flank_loads import FlankLoad
from fem.stress.tooth_boundary import flank_shares, inward_normal, outline, strip_means
from fem.support.progress import announced

#: Mesh of a section for stress: root stress within 0.5 % of that with four times as many elements along the fillet.
FINE = Density(flank=30, fillet=8, land=4, tooth=5, rim=8, body=8)
#: Mesh of a solid for fields: root stress within 1 to 3 % of that on finer meshes, 4 % on undercut teeth.
SOLID = Density(flank=12, fillet=8, land=2, tooth=4, rim=4, body=4, width=2, rim_power=1.5)

#: Power by which elements of solids narrow towards the end faces, where lines of contact of helical gears begin.
GRADING = 1.6
#: Stiffness per area of the bush that makes the elements of a rim on supports positive definite, over E / radius: in
#: the section, where it adds to the supports, and along the axis, where it stands for them.
SOFT, AXIAL = 1e-7, 1e-2
#: Around a load elements grow beyond LOADED_RADIUS half-widths from its middle by GROWTH times the distance.
LOADED_RADIUS, GROWTH = 1.5, 0.3

#: Factorized solids that a process remembers: of pinion and wheel.
REMEMBERED = 2


@dataclass(frozen=True)
class ElasticGear:
    """Finite elements of a gear with the factorized stiffness.

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
        """(n_axis,) axial positions of the dofs over each dof of the section [m]; 0 in plane strain."""
        return np.zeros(1) if self.axis is None else self.axis.doflocs[0]

    @cached_property
    def axial_order(self) -> np.ndarray:
        """(n_axis,) numbers of the dofs over each dof of the section by increasing axial position."""
        return np.argsort(self.axial)

    @property
    def axial_mesh(self) -> MeshLine:
        """Line elements between the dofs along the axis."""
        return MeshLine(self.axial[self.axial_order])

    @cached_property
    def mesh(self) -> MeshTri | MeshHex:
        """Triangles of the section in plane strain, else hexahedra over `axial_mesh` along the helix."""
        section = self.section.mesh
        return section if self.axis is None else extrusion.extruded(section, self.axial_mesh, self.gear.twist)

    def displacement(self, forces: np.ndarray, springs: np.ndarray | None = None) -> np.ndarray:
        """Dofs of the displacement [m] under forces (n_dofs,) or (n_dofs, k), of a rim that `supports` hold.

        springs     (n_dofs, n) of the supports, as `supports` gives them; without any, the gear is clamped

        The stiffness has the springs by the formula of Sherman, Morrison and Woodbury.
        """
        u = np.zeros_like(forces)
        u[self.free] = self.solve(forces[self.free].reshape(self.free.size, -1)).reshape(u[self.free].shape)
        if springs is None:
            return u
        by_springs = np.zeros_like(springs)
        by_springs[self.free] = self.solve(springs[self.free])
        inside = np.eye(springs.shape[1]) + springs.T @ by_springs
        return u - by_springs @ np.linalg.solve(inside, springs.T @ u)

    def supports(self, angle: float) -> np.ndarray | None:
        """(n_dofs, n_spring) springs of the bolts of a rim while tooth 0 is at an angle on them [rad]; None: no bolts.

        In plane strain of the unit width.
        """
        gear, bolts = self.gear, tuple(part for part in self.gear.support if isinstance(part, Bolts))
        if not bolts:
            return None
        share = self.axial_means()
        turned = -angle - gear.sign * gear.twist * self.axial
        of_sections = [rim_springs(gear, self.section, bolts, turn).toarray() for turn in turned]
        in_section = np.stack(of_sections, axis=-1) * share
        springs = np.zeros((len(in_section), self.dim, self.section.N, self.axial.size))
        springs[:, :2] = in_section.reshape(len(in_section), 2, self.section.N, -1)
        return springs.reshape(len(springs), -1).T / (sqrt(gear.b) if self.axis is None else 1.0)

    def axial_means(self) -> np.ndarray:
        """(n_axis,) mean over the width of the shape functions along the axis; 1 in plane strain."""
        if self.axis is None:
            return np.ones(1)
        return LinearForm(lambda v, w: v).assemble(self.axis) / self.gear.b

    def displacement_at_vertices(self, u: np.ndarray) -> np.ndarray:
        """(dim, n_vertex) displacement of the vertices of `mesh` along fixed axes, of dofs u (n_dofs,)."""
        components = self.in_fixed_axes(u).reshape(self.dim, self.section.N, -1)
        return components[:, self.section.nodal_dofs[0]][..., self.axial_order].reshape(self.dim, -1)

    def in_fixed_axes(self, u: np.ndarray) -> np.ndarray:
        """(dim, n) components along axes that do not turn with the section, of dofs u (n_dofs,)."""
        components = u.reshape(self.dim, -1, self.axial.size).copy()
        components[:2] = section_mesh.rotated(components[:2], self.gear.twist * self.axial)
        return components.reshape(self.dim, -1)


def plane_gear(gear: Gear, mesh: MeshTri) -> ElasticGear:
    """Quadratic triangles in plane strain; forces are line loads [N/m]."""
    return _clamped(gear, Basis(mesh, ElementTriP2(), intorder=2), None)


def solid_gear(gear: Gear, density: Density) -> ElasticGear:
    """Quadratic elements of the whole width, which resolve the root but not the contact; remembered for all flanks."""
    return _solid(replace(gear, flank=()), density)


@lru_cache(maxsize=REMEMBERED)
def _solid(gear: Gear, density: Density) -> ElasticGear:
    """The solid of a gear without modifications."""
    line = extrusion.both_sides(extrusion.half_face(gear.b, gear.b, density.width, GRADING))
    with announced(f"finite elements of the gear of {gear.z} teeth"):
        return _clamped(gear, Basis(section_mesh.section(gear, density), ElementQuad2()), Basis(line, ElementLineP2()))


def _clamped(gear: Gear, section: Basis, axis: Basis | None) -> ElasticGear:
    """The gear clamped at its hub; a rim on supports rests on a soft bush, beside which their springs act."""
    stiffness = extruded_elasticity.stiffness(section, axis, gear.material, gear.twist)
    if gear.support:
        stiffness = _with_bush(gear, section, axis, stiffness)
    points = section.doflocs if axis is None else extruded_elasticity.points(section, axis)
    held = (section_mesh.on_hub(gear, section) & (not gear.support)).reshape(-1, *[1] * (points.ndim - 2))
    free = ~clamped(gear, held, points, len(points), WholeFace()).ravel()
    part = stiffness.part(free)
    solve = factorize(part.matrix if axis is None else part)
    return ElasticGear(gear, section, axis, stiffness, np.flatnonzero(free), solve)


def _with_bush(gear: Gear, section: Basis, axis: Basis | None, stiffness: KroneckerMatrix) -> KroneckerMatrix:
    """Stiffness with the bush of a rim, and a soft one, which holds it along its axis and hardly in the section."""
    mass = BilinearForm(lambda u, v, w: u * v)
    facets = section_mesh.clamped_facets(gear, section.mesh)
    on_rim = mass.assemble(FacetBasis(section.mesh, section.elem, facets=facets)).tocsr()
    along = np.ones((1, 1)) if axis is None else mass.assemble(axis).toarray()
    dim = 2 if axis is None else 3
    components = np.diag([SOFT, SOFT, AXIAL][:dim]) * gear.material.E / abs(gear.r_clamp)
    springs = rim_springs(gear, section, tuple(part for part in gear.support if isinstance(part, Bush)))
    bush, terms = sp.csr_matrix(springs.T @ springs) / gear.b, [(on_rim, components)]
    for i, j in product(range(2), range(2)):
        between = bush[i * section.N : (i + 1) * section.N, j * section.N : (j + 1) * section.N]
        terms.append((between, np.outer(np.eye(dim)[i], np.eye(dim)[j])))
    entries = [np.asarray(between[*stiffness.indices]).ravel() for between, _ in terms]
    dense = [np.kron(components, along) for _, components in terms]
    return replace(
        stiffness,
        entries=np.column_stack([stiffness.entries, *entries]),
        dense=np.concatenate([stiffness.dense, np.stack(dense)]),
    )


def section_refined_at(gear: Gear, density: Density, loads: list[FlankLoad], share: float) -> MeshTri:
    """Triangles of the section with edges of at most share half-widths under each load, growing away from it."""
    mesh = section_mesh.section(gear, density).to_meshtri()
    middles = [(flank_points(gear, load.extent[:1], load.tooth), load.extent[1]) for load in loads]
    while True:
        corners = mesh.p[:, mesh.t]
        size = np.hypot(*(corners - np.roll(corners, 1, axis=1))).max(axis=0)
        largest = np.full(size.size, np.inf)
        for point, half in middles:
            distance = np.hypot(*(corners - point[:, :, None])).min(axis=0)
            grown = GROWTH * np.maximum(distance - LOADED_RADIUS * half, 0.0)
            largest = np.minimum(largest, share * half + grown)
        if (size <= largest).all():
            return mesh
        middles_of_hub = mesh.p[:, mesh.facets[:, section_mesh.clamped_facets(gear, mesh)]].mean(axis=1)
        refined = MeshTri(mesh.p, mesh.t).refined(np.flatnonzero(size > largest))
        mesh = _on_involute(gear, _on_hub(gear, refined, middles_of_hub), loads)


def _on_hub(gear: Gear, mesh: MeshTri, middles: np.ndarray) -> MeshTri:
    """Mesh with the nodes at middles (2, n) of clamped facets moved to the circle where the gear is clamped."""
    apart, nodes = cKDTree(mesh.p.T).query(middles.T)
    nodes, points = nodes[apart < 1e-9 * abs(gear.r_clamp)], mesh.p.copy()
    points[:, nodes] *= abs(gear.r_clamp) / np.hypot(*points[:, nodes])
    return MeshTri(points, mesh.t)


def _on_involute(gear: Gear, mesh: MeshTri, loads: list[FlankLoad]) -> MeshTri:
    """Mesh with the nodes of the loaded flanks moved from the chords of the coarse facets to the involute."""
    points = mesh.p.copy()
    for load in loads:
        nodes = np.unique(mesh.facets[:, outline(gear, mesh, load.tooth)[0]])
        points[:, nodes] = flank_points(gear, arc_at(gear, mesh.p[:, nodes]), load.tooth)
    return MeshTri(points, mesh.t)


def nodal_forces(elastic: ElasticGear, loads: list[FlankLoad]) -> np.ndarray:
    """(n_dofs,) consistent nodal forces int p . v dA of the loads [N]; [N/m] in plane strain."""
    total = np.zeros((elastic.dim, elastic.section.N, elastic.axial.size))
    for load in loads:
        low, high = load.edges[:, :-1], load.edges[:, 1:]
        shares = flank_shares(elastic.gear, elastic.section, load.tooth, low.ravel(), high.ravel())
        pressed = inward_normal(elastic.gear, load.tooth, load.middle)[: elastic.dim] * load.force
        by_slice = np.einsum("ncs,dcs->dnc", shares.reshape(-1, *low.shape), pressed)
        total += by_slice @ axial_shares(elastic.axis, load.low, load.high).T
    return total.ravel()


def axial_shares(axis: Basis | None, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(n_axis, n_slice) means over slices of the shape functions along the width; ones in plane strain."""
    if axis is None:
        return np.ones((1, low.size))
    return strip_means(axis.mesh.p[0][axis.mesh.t], axis.element_dofs, axis.N, low, high)


def contact_pressure(elastic: ElasticGear, loads: list[FlankLoad]) -> np.ndarray:
    """(n_vertex,) largest pressure [Pa] in the part of the flanks that is nearest to each vertex of `mesh`."""
    section, axial_cells = elastic.section.mesh, _cell_bounds(elastic.axial[elastic.axial_order])
    pressure = np.zeros((section.p.shape[1], elastic.axial.size))
    for load in loads:
        nodes = np.unique(section.facets[:, outline(elastic.gear, section, load.tooth)[0]])
        arcs = arc_at(elastic.gear, section.p[:, nodes])
        nodes, profile_cells = nodes[np.argsort(arcs)], _cell_bounds(np.sort(arcs))
        area = np.diff(load.edges, axis=1) * (load.high - load.low)[:, None] / np.cos(elastic.gear.beta_b)
        on_strips = np.divide(load.force, area, out=np.zeros_like(area), where=area > 0)
        strip_in_cell = _overlap(load.edges[:, :-1], load.edges[:, 1:], profile_cells)
        by_slice = np.where(strip_in_cell, on_strips[:, :, None], 0.0).max(axis=1)
        slice_in_cell = _overlap(load.low, load.high, axial_cells)
        at_nodes = np.where(slice_in_cell[:, None], by_slice[:, :, None], 0.0).max(axis=0)
        pressure[nodes] = np.maximum(pressure[nodes], at_nodes)
    return pressure.ravel()


def _cell_bounds(positions: np.ndarray) -> np.ndarray:
    """(n + 1,) bounds of the cells that are nearest to increasing positions (n,)."""
    return np.concatenate([[-np.inf], (positions[1:] + positions[:-1]) / 2, [np.inf]])


def _overlap(low: np.ndarray, high: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """(..., n) whether ranges from low to high (...) overlap with the cells between bounds (n + 1,)."""
    return (low[..., None] < bounds[1:]) & (high[..., None] > bounds[:-1])
