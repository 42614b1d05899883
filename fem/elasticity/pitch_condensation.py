"""Displacements of flanks from the finite elements of one pitch: those of all toothed pitches are equal but for a turn.

Parts of the section end at radial lines. The unknowns inside a part are eliminated, which leaves a stiffness over its
two lines and, in a pitch, over its flank. One pitch and half of the toothless rest of the section, whose other half is
its mirror image, stand for the whole gear. They are joined at the lines, where displacements have tangential, radial
and axial components; the order of a part's lines is counter-clockwise, in an internal gear clockwise.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from math import cos, pi, sin

import numpy as np
from skfem import Basis, ElementQuad2

from fem.elasticity import extruded_elasticity, section_mesh
from fem.elasticity.face_symmetry import Face, clamped
from fem.elasticity.mesh_density import Density
from fem.gear.gear import Gear
from fem.linalg.block_matrix import BlockMatrix, KroneckerMatrix
from fem.linalg.dense_kernels import eliminate, solve_lower
from fem.linalg.multifrontal import factorize, schur_complement
from fem.support.blas_threads import one_thread

#: Nodes lie on a radial line within this angle [rad].
ON_LINE = 1e-9
#: Elements along the side of a tile of the section, whose unknowns are eliminated together where all sections deform
#: alike. Measured: half as many, or twice as many, take longer.
TILE = 4
#: Function of a basis on the pitch of tooth 0: forces (2, 3, n_dofs, n_hat) into its flank, and along its profile.
FlankForces = Callable[[Basis], np.ndarray]


@dataclass(frozen=True)
class Prism:
    """The gear along its axis.

    axis        finite elements along the axis; None: all sections deform alike
    spread      (n_axis, n_spread) distributions of unit forces over the dofs of the axis
    clamped     whether the gear is clamped at its bore or its outer rim
    """

    gear: Gear
    axis: Basis | None
    spread: np.ndarray
    face: Face
    clamped: bool = True

    def stiffness(self, section: Basis) -> tuple[KroneckerMatrix, np.ndarray]:
        """Stiffness over the free unknowns, and which (components, n_section, n_axis) are free."""
        gear = self.gear
        if self.axis is None:
            matrix, points = extruded_elasticity.uniform_stiffness(section, gear.material, gear.twist), section.doflocs
        else:
            matrix = extruded_elasticity.stiffness(section, self.axis, gear.material, gear.twist)
            points = extruded_elasticity.points(section, self.axis)
        held = (section_mesh.on_hub(gear, section) & self.clamped).reshape(-1, *[1] * (points.ndim - 2))
        free = ~clamped(gear, held, points, matrix.unknowns.shape[1] // len(self.spread), self.face)
        return matrix.part(free.ravel()), free.reshape(len(free), section.N, -1)

    def mirror(self, free: np.ndarray) -> np.ndarray:
        """(n, n) displacements of a node from those of its mirror image; free (components, n_axis) has n unknowns.

        The image of a helical gear has the same hand if its end faces are exchanged too.
        """
        axial, signs = np.eye(free.shape[1]), [-1.0, 1.0, -1.0 if self.gear.twist else 1.0]
        if self.gear.twist and self.axis is not None:
            upwards = np.argsort(self.axis.doflocs[0])
            axial[upwards] = axial[upwards[::-1]]
        return _of_unknowns(np.diag(signs), free, axial)


@one_thread()
def flank_displacements(prism: Prism, density: Density, forces: FlankForces) -> np.ndarray:
    """(n_virtual, n_load, n_load) displacements under virtual forces per force into the flank of tooth 0 [m/N].

    Virtual forces act into the flanks of teeth 0 to `density.teeth`, then along the profiles of teeth from
    `-density.behind` on. Loads are numbered by spread, then by hat.
    """
    z, teeth = abs(prism.gear.z), section_mesh.toothed_pitches(prism.gear, density)
    pitch, on_lines, on_flank = loaded_pitch(prism, density, forces)
    parts = [pitch] * len(teeth) + toothless_rest(prism, density)
    ends = np.arange(len(parts))[:, None] + [0, 1]
    ends[-1, 1] = 0
    n_load = on_flank.shape[1]
    load = np.zeros((len(parts), len(pitch) // 2, n_load))
    load[ends[teeth.index(0)]] = on_lines[:, :n_load].reshape(2, -1, n_load)
    u = factorize(joined(parts, ends))(load.reshape(-1, n_load)).reshape(load.shape)

    def displacement(tooth: int, virtual: slice) -> np.ndarray:
        moved = u[ends[(tooth - teeth[0]) % z]].reshape(-1, n_load)
        return on_lines[:, virtual].T @ moved + (on_flank[virtual] if tooth == 0 else 0.0)

    ahead, behind = range(density.teeth + 1), range(-density.behind, 0)
    normal = [displacement(tooth, slice(n_load)) for tooth in ahead]
    return np.stack(normal + [displacement(tooth, slice(n_load, None)) for tooth in (*behind, *ahead)])


def pitch_section(gear: Gear, density: Density) -> Basis:
    """Quadratic elements of the section of the pitch of tooth 0."""
    return Basis(section_mesh.mesh_of(gear, section_mesh.pitch_blocks(gear, density)), ElementQuad2())


def loaded_pitch(prism: Prism, density: Density, forces: FlankForces) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pitch of tooth 0 without its flank: stiffness over its lines, forces on the lines, displacements of the flank.

    The forces (2 n, 2 n_load) act on the lines instead of those on the flank, into it and along the profile; the
    displacements (2 n_load, n_load) are those under loads into the flank while the lines are held. A rim that is not
    clamped follows the lines, its unknowns along fixed axes.
    """
    blocks, half = section_mesh.pitch_blocks(prism.gear, density), pi / prism.gear.z
    section = pitch_section(prism.gear, density)
    by_hat = forces(section)
    rim = np.flatnonzero(section_mesh.on_hub(prism.gear, section) & (not prism.clamped))
    flank = np.flatnonzero(by_hat[0].any(axis=(0, 2)))
    kept = np.concatenate([rim, flank])
    stiffness, free = condensed(prism, section, section_mesh.tiles(blocks, TILE), (-half, half), kept)
    acting = [_spread_out(prism, force[: len(free), flank], free) for force in by_hat]
    n = len(stiffness) - len(acting[0])
    lower, reduced = np.asfortranarray(stiffness[n:, n:]), np.asfortranarray(np.hstack([stiffness[n:, :n], *acting]))
    eliminate(lower, len(lower))
    solve_lower(lower, reduced)
    of_lines, of_forces = reduced[:, :n].T, reduced[:, n:]
    on_flank = of_forces.T @ of_forces[:, : of_forces.shape[1] // 2]
    return stiffness[:n, :n] - of_lines @ of_lines.T, -of_lines @ of_forces, on_flank


def toothless_rest(prism: Prism, density: Density) -> list[np.ndarray]:
    """Stiffness over the lines of both halves of the toothless rest; nothing where all pitches have teeth."""
    blocks, pitch = section_mesh.rest_blocks(prism.gear, density), 2 * pi / prism.gear.z
    if not blocks:
        return []
    half = [block[:, : block.shape[1] // 2 + 1] for block in blocks]
    section, tiles = Basis(section_mesh.mesh_of(prism.gear, half), ElementQuad2()), section_mesh.tiles(half, TILE)
    opposite = (density.teeth - density.behind) * pitch / 2 - prism.gear.sign * pi
    angles = opposite, -(density.behind + 0.5) * pitch
    clockwise, free = condensed(prism, section, tiles, angles, np.zeros(0, int))
    return [mirrored(clockwise, prism.mirror(free)), clockwise]


def condensed(prism: Prism, section: Basis, tiles: np.ndarray, angles: tuple[float, float], further: np.ndarray):
    """Stiffness of a part of the section over its lines and further dofs, after elimination of all other unknowns.

    tiles       (n_element,) numbers of tiles
    angles      of the lines, counter-clockwise from the middle of tooth 0 [rad]; they end at the bore or the outer rim
    further     (n,) dofs of the section

    Also (components, n_axis): which displacements of a node are unknowns.
    """
    matrix, free = prism.stiffness(section)
    of_section, of_node = np.any(free, axis=(0, 2)), np.any(free, axis=1)
    inside = of_section & ~section_mesh.on_hub(prism.gear, section)
    lines = [radial_line(prism.gear, section, inside, angle) for angle in angles]
    nodes = np.concatenate([*lines, further])
    kept = matrix.unknowns[(np.cumsum(of_section) - 1)[nodes]].ravel()
    blocks = _in_tiles(matrix, tile_groups(section, tiles, nodes)[of_section]) if prism.axis is None else matrix
    stiffness = schur_complement(blocks, kept)
    for k, angle in enumerate(angles):
        axes = np.array([[cos(angle), -sin(angle), 0], [sin(angle), cos(angle), 0], [0, 0, 1]])
        _turn(stiffness, slice(k * lines[0].size, (k + 1) * lines[0].size), _of_unknowns(axes, of_node))
    return stiffness, of_node


def radial_line(gear: Gear, section: Basis, free: np.ndarray, angle: float) -> np.ndarray:
    """Free dofs on the radial line at an angle from the middle of tooth 0 [rad], outwards."""
    x, y = gear.sign * section.doflocs
    on_line = np.flatnonzero((np.abs(np.angle((y - 1j * x) * np.exp(-1j * angle))) < ON_LINE) & free)
    return on_line[np.argsort(np.hypot(x, y)[on_line])]


def tile_groups(section: Basis, tiles: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """(n_dofs,) numbers of groups of dofs: they belong to the same tiles (n_element,), and all are kept or none."""
    dof, tile = np.unique(np.stack([section.element_dofs.ravel(), np.tile(tiles, len(section.element_dofs))]), axis=1)
    first = np.flatnonzero(np.diff(dof, prepend=-1))
    of_tiles = [np.minimum.reduceat(tile, first), np.maximum.reduceat(tile, first), np.diff(first, append=dof.size)]
    keys = np.stack([*of_tiles, np.isin(np.arange(section.N), kept)])
    return np.unique(keys, axis=1, return_inverse=True)[1].ravel()


def _in_tiles(matrix: KroneckerMatrix, group: np.ndarray) -> BlockMatrix:
    """The matrix in larger blocks: all unknowns over section dofs of the same group (n_section,)."""
    block = np.empty(matrix.unknowns.size, int)
    block[matrix.unknowns] = np.unique(group, return_inverse=True)[1][:, None]
    return BlockMatrix(matrix.matrix, block)


def _turn(stiffness: np.ndarray, line: slice, axes: np.ndarray) -> None:
    """Express the displacements of the nodes on a line along axes (n, n), in place."""
    n = len(axes)
    rows, columns = stiffness.reshape(-1, n, len(stiffness)), stiffness.reshape(len(stiffness), -1, n)
    rows[line] = axes.T @ rows[line]
    columns[:, line] = (columns[:, line].reshape(-1, n) @ axes).reshape(len(stiffness), -1, n)


def mirrored(lines: np.ndarray, mirror: np.ndarray) -> np.ndarray:
    """Stiffness (2 n, 2 n) over the lines of the mirror image of a part; mirror as `Prism.mirror` gives it."""
    exchanged = np.roll(lines, len(lines) // 2, axis=(0, 1))
    _turn(exchanged, slice(None), mirror)
    return exchanged


def joined(parts: list[np.ndarray], ends: np.ndarray) -> KroneckerMatrix:
    """Stiffness over all lines from parts (2 n, 2 n) between two lines each, whose numbers are the ends (n_part, 2)."""
    n, n_line = len(parts[0]) // 2, ends.max() + 1
    distinct = {id(part): part for part in parts}
    quarters = [part[i : i + n, j : j + n] for part in distinct.values() for i in (0, n) for j in (0, n)]
    entries = np.zeros((n_line, n_line, len(quarters)))
    for part, lines in zip(parts, ends, strict=True):
        first = 4 * list(distinct).index(id(part))
        for quarter, coupled in enumerate(product(lines, lines), first):
            entries[*coupled, quarter] += 1
    indices = np.stack(np.nonzero(entries.any(axis=2)))
    unknowns = np.arange(n_line * n).reshape(n_line, n)
    return KroneckerMatrix(indices, entries[tuple(indices)], np.stack(quarters), unknowns)


def _of_unknowns(components: np.ndarray, free: np.ndarray, axial: np.ndarray | None = None) -> np.ndarray:
    """(n, n) Kronecker product over components and axial dofs, of the n free ones (components, n_axis)."""
    n, n_axis = free.shape
    whole = np.kron(components[:n, :n], np.eye(n_axis) if axial is None else axial)
    return whole[free.ravel()][:, free.ravel()]


def _spread_out(prism: Prism, by_hat: np.ndarray, free: np.ndarray) -> np.ndarray:
    """(n, n_spread n_hat) forces on the unknowns of a flank; by_hat (components, n_dofs, n_hat) in the section."""
    on_dofs = np.einsum("cnh,as->ncash", by_hat, prism.spread)[:, free]
    return on_dofs.reshape(-1, on_dofs.shape[2] * on_dofs.shape[3])
