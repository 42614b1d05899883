"""Finite elements of a gear that is clamped at its rigid hub, in the hub's frame, with the flanks that may touch."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
import scipy.sparse as sp
from scipy.linalg import solve_triangular
from scipy.spatial import cKDTree
from skfem import Basis, ElementQuad1, ElementQuad2, MeshLine
from skfem.element import Element

from fem.elasticity import extrusion, section_mesh
from fem.elasticity.face_symmetry import Face, HalfFace, WholeFace, clamped
from fem.elasticity.mesh_density import Density
from fem.elasticity.rim_springs import quadrature_on_rim, rim_springs, shapes_on_rim
from fem.gear import tooth_profile
from fem.gear.gear import Gear
from fem.gear.rim_support import Bush
from fem.linalg.block_matrix import BlockMatrix
from fem.linalg.direct_solver import Solve, factorize
from fem.linalg.multifrontal import schur_complement
from fem.microgeometry.flank import edges, removed
from fem.pair.pair import GearPair
from fem.reference.deformed_flank import Flank, WidthQuadrature, gauss_width, plane_strain_width
from fem.reference.st_venant_kirchhoff import Solid, internal_force, lumped_mass, solid_on_basis, stiffness

#: Loaded teeth touch up to this share of a pitch before and after the path of contact of rigid gears.
EARLY_CONTACT = 1 / 4
#: Edges of the mesh keep this distance from each other and from the ends of the flank [modules].
LEAST_EDGE_DISTANCE = 1 / 100
#: Flanks count as equal where their modifications differ by less [m].
EQUAL_WITHIN = 1e-9
#: Stiffness over E of the bush that holds a rim against tilting and along its axis: nearly rigid.
HOLDING = 1e3
#: Points on the fillet and on the involute of a tooth's outline.
OUTLINE_POINTS = 100


@dataclass(frozen=True)
class DeformableGear:
    """A clamped gear. Displacements are arrays (n_dofs, dim), 0 where the hub or the symmetry plane clamps them.

    face        modelled part of the face width
    solid       finite elements
    columns     (n_dofs,) number of the dof of the transverse section on whose line along the helix each dof lies
    free        (n_free,) flat numbers of the displacements that are not clamped
    flanks      flanks of the teeth that may touch, by the number of the tooth
    toothless   number of pitches that the mesh ends at the root circle
    springs     (n_spring, n) matrix B of the supports of a rim, whose stiffness is B^T B; None where it is clamped
    """

    face: Face
    solid: Solid
    columns: np.ndarray
    free: np.ndarray
    flanks: dict[int, Flank]
    toothless: int
    springs: sp.csr_matrix | None = None

    def internal_force(self, u: np.ndarray) -> np.ndarray:
        """Forces (n_dofs, dim) [N] by which the solid and the supports of its rim resist displacements u."""
        force = internal_force(self.solid, u)
        if self.springs is None:
            return force
        return force + (self.springs.T @ (self.springs @ u.ravel())).reshape(u.shape)

    def undeformed(self) -> np.ndarray:
        """(n_dofs, dim) displacements 0."""
        return np.zeros_like(self.solid.positions)

    def free_stiffness(self, mass: np.ndarray | float = 0.0) -> sp.csr_matrix:
        """(n_free, n_free) stiffness of the undeformed gear plus a diagonal mass (n_dofs,) [N/m]."""
        diagonal = np.repeat(mass + np.zeros(len(self.solid.positions)), self.solid.positions.shape[1])
        matrix = (stiffness(self.solid) + sp.diags_array(diagonal)).tocsr()
        if self.springs is not None:
            matrix = (matrix + self.springs.T @ self.springs).tocsr()
        return matrix[self.free][:, self.free]

    def solver(self, mass: np.ndarray | float = 0.0) -> Solve:
        """Solution (n_dofs, dim, n) for the `free_stiffness`."""
        dim = self.solid.positions.shape[1]
        solve_free = factorize(self.free_stiffness(mass), self.columns[self.free // dim] if dim == 3 else None)

        def solve(force: np.ndarray) -> np.ndarray:
            u = np.zeros((self.solid.positions.size, force[0, 0].size))
            free_force = np.ascontiguousarray(force.reshape(u.shape)[self.free])
            u[self.free] = solve_free(free_force).reshape(self.free.size, -1)
            return u.reshape(force.shape)

        return solve

    @cached_property
    def held(self) -> np.ndarray:
        """(n_dofs,) whether the hub clamps all displacements of a node."""
        held = np.ones(self.solid.positions.shape, bool)
        held.ravel()[self.free] = False
        return np.all(held, axis=1)

    @cached_property
    def masses(self) -> np.ndarray:
        """(n_dofs,) lumped masses of a plane gear [kg]; at its hub also the inertia of the teeth outside the mesh."""
        masses = lumped_mass(self.solid)
        inertia = masses[self.held] @ (self.solid.positions[self.held] ** 2).sum(axis=1)
        masses[self.held] *= 1 + self.toothless * tooth_inertia(self.flanks[0].gear) / inertia
        return masses

    @cached_property
    def flank_operator(self) -> sp.csr_matrix:
        """Operator from flat displacements to those of the flank nodes in transverse planes, flat, tooth by tooth.

        Its transpose maps forces on the flank nodes to nodal forces of the gear.
        """
        dim = self.solid.positions.shape[1]
        flanks = self.flanks.values()
        blocks = np.concatenate([flank.section_displacement[..., :dim].reshape(-1, 2, dim) for flank in flanks])
        nodes = np.concatenate([flank.nodes.ravel() for flank in flanks])
        columns = np.broadcast_to(dim * nodes[:, None, None] + np.arange(dim), blocks.shape)
        row_starts = np.arange(0, blocks.size + 1, dim)
        shape = row_starts.size - 1, self.solid.positions.size
        return sp.csr_matrix((blocks.ravel(), columns.ravel(), row_starts), shape)

    def with_flanks_of(self, gear: Gear) -> "DeformableGear":
        """The same finite elements with the flank modifications of another gear."""
        return replace(self, flanks={tooth: replace(flank, gear=gear) for tooth, flank in self.flanks.items()})


def clamped_pair(pair: GearPair, density: Density, element: Element) -> tuple[DeformableGear, DeformableGear]:
    """Pinion and wheel with the densities from `with_edges`; equal gears share their solid, a ring on supports has all
    its teeth."""
    last, symmetric = last_tooth_in_contact(pair), all(map(symmetric_about_mid_plane, (pair.pinion, pair.wheel)))
    face = HalfFace() if symmetric and element.dim == 3 else WholeFace()
    density = density.with_teeth(max(density.teeth, last), max(density.behind, last))
    densities = with_edges(pair, density)
    with_density = partial(discretized, element=element, teeth=range(-last, last + 1), face=face)
    pinion = with_density(pair.pinion, densities[0])
    if densities[0] == densities[1] and replace(pair.wheel, flank=()) == replace(pair.pinion, flank=()):
        return pinion, pinion.with_flanks_of(pair.wheel)
    of_wheel = densities[1].with_teeth(abs(pair.wheel.z), behind=0) if pair.wheel.support else densities[1]
    return pinion, with_density(pair.wheel, of_wheel)


def tooth_inertia(gear: Gear) -> float:
    """Moment of inertia of a tooth, from the root circle to the tip, about the gear's axis [kg m^2]."""
    root = tooth_profile.fillet(gear, np.linspace(1, 0, OUTLINE_POINTS))
    involute = tooth_profile.flank(gear, np.linspace(gear.roll_form, gear.roll_tip, OUTLINE_POINTS))
    r, psi = np.append(root.r, involute.r), np.append(root.psi, involute.psi)
    moment = (r**4 - gear.r_f**4) / 4
    half = moment[-1] * psi[-1] - np.trapezoid(moment, psi)
    return float(2 * gear.material.density * gear.b * half)


def last_tooth_in_contact(pair: GearPair) -> int:
    """Number of the last tooth that may touch within half a mesh cycle from the pitch point, ahead or behind."""
    tip_rolls = (pair.pinion.roll_tip, pair.wheel.roll_tip)
    pitch_rolls = (pair.roll_pitch, pair.path_of_contact.on_wheel(pair.roll_pitch))
    path = max(np.subtract(tip_rolls, pitch_rolls)) + pair.b / 2 * np.tan(abs(pair.beta_b))
    return max(1, int(path / pair.p_bt + 1 / 2 + EARLY_CONTACT))


def symmetric_about_mid_plane(gear: Gear) -> bool:
    """Whether both halves of the face width are equal."""
    material = sampled_modification(gear)
    return gear.beta == 0 and bool(np.abs(material - material[:, ::-1]).max() < EQUAL_WITHIN)


def sampled_modification(gear: Gear) -> np.ndarray:
    """(9, 9) material removed from the driving flank [m] along the profile and from end face to end face."""
    roll = np.linspace(gear.roll_form, gear.roll_tip, 9)[:, None]
    return removed(gear.drive_flank, gear.face, roll, np.linspace(-gear.b / 2, gear.b / 2, 9))


def with_edges(pair: GearPair, density: Density) -> tuple[Density, Density]:
    """Densities of pinion and wheel; edges, unless given, where reliefs of the gear or of its mate begin."""
    if density.edges is not None:
        return density, density
    pinion, wheel = (distinct_edges(gear, edges(gear.drive_flank, gear.face)) for gear in (pair.pinion, pair.wheel))
    on_mate = pair.path_of_contact.on_wheel
    on_pinion = distinct_edges(pair.pinion, [*pinion, *map(on_mate, wheel)])
    on_wheel = distinct_edges(pair.wheel, [*wheel, *map(on_mate, pinion)])
    return replace(density, edges=on_pinion), replace(density, edges=on_wheel)


def distinct_edges(gear: Gear, rolls: Iterable[float]) -> tuple[float, ...]:
    """Increasing roll lengths on the flank that keep LEAST_EDGE_DISTANCE from its ends and from each other [m]."""
    kept, distance = [gear.roll_form], LEAST_EDGE_DISTANCE * gear.m_n
    for roll in sorted(rolls):
        if kept[-1] + distance < roll < gear.roll_tip - distance:
            kept.append(roll)
    return tuple(kept[1:])


def discretized(
    gear: Gear, density: Density, element: Element, *, teeth=range(-1, 2), face: Face | None = None
) -> DeformableGear:
    """Gear on quadrilaterals (plane strain) or on hexahedra, by the element.

    teeth       numbers of the teeth that may touch
    face        part of the face width that hexahedra model, by default all of it
    """
    face = WholeFace() if face is None else face
    mesh, degree = section_mesh.section(gear, density), element.maxdeg // element.dim
    section = Basis(mesh, ElementQuad1() if degree == 1 else ElementQuad2(), intorder=2 * degree + 1)
    if element.dim == 2:
        width, solid = plane_strain_width(gear.b), solid_on_basis(section, gear.material, gear.b)
    else:
        half = np.sort(extrusion.half_face(gear.b, gear.b, density.width).p[0])
        line = MeshLine(face.positions(half))
        width = gauss_width(section_mesh.divided(np.sort(line.p[0]), degree), degree)
        in_space = Basis(extrusion.extruded(mesh, line, gear.twist), element, intorder=2 * degree + 1)
        solid = solid_on_basis(in_space, gear.material)
    columns = section_dofs(section, solid.positions, gear.twist)
    stacks = np.lexsort((*solid.positions.T[2:], columns)).reshape(section.N, -1)
    flanks = {tooth: flank_of(gear, section, stacks, tooth, width, degree) for tooth in teeth}
    held = (section_mesh.on_hub(gear, section) & (not gear.support))[columns]
    free = np.flatnonzero(~clamped(gear, held, solid.positions.T, element.dim, face).T)
    toothless = abs(gear.z) - len(section_mesh.toothed_pitches(gear, density))
    springs = springs_across(gear, section, stacks, width, face) if gear.support else None
    return DeformableGear(face, solid, columns, free, flanks, toothless, springs)


def springs_across(gear: Gear, section: Basis, stacks: np.ndarray, width: WidthQuadrature, face: Face) -> sp.csr_matrix:
    """Springs of the supports of a rim over (x, y) or (x, y, z) of each dof.

    They act on the mean across the face width at an angle, which a helical section meets elsewhere at each axial
    position: the rim may warp and contract along its axis, as in a map. On the modelled part of the face their
    stiffness is its share. Over the whole face they also hold the rim against tilting and along its axis.
    """
    dim = 2 if stacks.shape[1] == 1 else 3
    mean = width.weights @ width.shapes / width.weights.sum()

    def across(springs: Callable[[float], sp.csr_matrix], share: np.ndarray, axes: range) -> sp.csr_matrix:
        """Springs (n, dim stacks.size) from those of the section at the angle of each axial position, times shares."""
        total = sp.csr_matrix((springs(0.0).shape[0], dim * stacks.size))
        for line, turn, of_line in zip(stacks.T, gear.twist * width.nodes, share, strict=True):
            total += of_line * springs(-gear.sign * turn) @ _along_axes_of_section(line, turn, dim, axes, stacks.size)
        return sp.csr_matrix(total)

    supports = across(partial(rim_springs, gear, section, gear.support), np.sqrt(face.share) * mean, range(2))
    if dim == 2 or isinstance(face, HalfFace):
        return supports
    stiffness = HOLDING * gear.material.E
    bush, slope = Bush(radial=stiffness, tangential=stiffness), 2 * width.axial / gear.b
    tilt = (width.weights * 3 * slope) @ width.shapes / width.weights.sum()
    theta, weight = quadrature_on_rim(gear, section)
    of_points = sp.diags_array(np.sqrt(stiffness * abs(gear.r_clamp) * weight))

    def axial(turned: float) -> sp.csr_matrix:
        return of_points @ shapes_on_rim(gear, section, theta + turned)

    against_tilting = across(partial(rim_springs, gear, section, (bush,)), tilt, range(2))
    return sp.csr_matrix(sp.vstack([supports, against_tilting, across(axial, mean, range(2, 3))]))


def _along_axes_of_section(line: np.ndarray, turn: float, dim: int, axes: range, n_dofs: int) -> sp.csr_matrix:
    """Operator from flat displacements to those of the dofs of a line, along axes of their turned section."""
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])[axes, :dim]
    columns = dim * line + np.arange(dim)[:, None]
    rows = np.arange(line.size) + line.size * np.arange(len(axes))[:, None]
    shape = len(axes), dim, line.size
    entries = [np.broadcast_to(a, shape).ravel() for a in (rotation[..., None], rows[:, None], columns)]
    return sp.csr_matrix((entries[0], (entries[1], entries[2])), (rows.size, dim * n_dofs))


def section_dofs(section: Basis, positions: np.ndarray, twist: float) -> np.ndarray:
    """(n_dofs,) number of the section's dof on whose line along the helix each position (n_dofs, dim) lies."""
    angle = -twist * positions[:, 2:].sum(axis=1)
    return cKDTree(section.doflocs.T).query(section_mesh.rotated(positions[:, :2].T, angle).T)[1]


def flank_of(gear: Gear, section: Basis, stacks: np.ndarray, tooth: int, width: WidthQuadrature, degree: int) -> Flank:
    """Flank of a tooth; row i of stacks (section.N, n_across) holds the dofs along the helix of section dof i."""
    points = section_mesh.divided(section_mesh.flank_nodes(gear, section.mesh, tooth), degree)
    nodes = stacks[cKDTree(section.doflocs.T).query(points.T)[1]]
    return Flank(gear, tooth, tooth_profile.arc_at(gear, points), nodes, width, degree)


def flank_flexibility(gear: DeformableGear, mass: np.ndarray | float = 0.0) -> np.ndarray:
    """(n, n) displacement of the flank nodes in transverse planes per force on them [m/N], with a mass as in `solver`.

    From the Schur complement over the flanks: on the reference mesh in plane strain in a sixth of the time of solutions
    for each of the forces, on hexahedra in half of it.
    """
    dim, on_flank = gear.solid.positions.shape[1], np.zeros(len(gear.solid.positions), bool)
    for flank in gear.flanks.values():
        on_flank[flank.nodes] = True
    group = gear.columns if dim == 3 else neighbourhoods(gear.solid.positions, on_flank)
    _, block = np.unique(group[gear.free // dim], return_inverse=True)
    kept = np.flatnonzero(on_flank[gear.free // dim])
    left = np.linalg.cholesky(schur_complement(BlockMatrix(gear.free_stiffness(mass), block), kept))
    root = solve_triangular(left, gear.flank_operator[:, gear.free[kept]].T.toarray(), lower=True, check_finite=False)
    return root.T @ root


def neighbourhoods(points: np.ndarray, apart: np.ndarray, largest: int = 16) -> np.ndarray:
    """(n,) number of the small group of neighbours to which each point (n, dim) belongs; those set apart (n,) have
    groups of their kind."""
    number, count = np.empty(len(points), int), 0
    for part in (np.flatnonzero(apart), np.flatnonzero(~apart)):
        waiting = [cKDTree(points[part], leafsize=largest).tree]
        while waiting:
            node = waiting.pop()
            if node.split_dim < 0:
                number[part[node.indices]] = count
                count += 1
            else:
                waiting += [node.lesser, node.greater]
    return number
