"""Frictionless contact of strips: the compliance of all slices together, and its solution on the active set.

The compliance is that of the strips of each slice as half-planes (`local`) plus a smooth remainder, quadratic over the
strips of a slice, that couples all slices (`smooth`). The system is solved in two steps: each slice under unit values
of the transmission error, its gap and the smooth displacements; then the coupling of the slices.
"""

from dataclasses import dataclass
from math import inf
from typing import NamedTuple

import numpy as np

from fem.contact.contact_slices import ContactSlices
from fem.contact.coupling import CompiledCompliance, smooth_compliance
from fem.contact.strip_bounds import NODES, Strips, interpolated_strips, write_half_planes, write_shapes
from fem.contact.unilateral import EXCHANGES, Equilibrium, unilateral_contact
from fem.elasticity.face_symmetry import Face
from fem.linalg.small_systems import (
    active_rows,
    column_times,
    congruent,
    factorize,
    indices_of_true,
    product,
    solve,
    square_root,
    submatrix,
    times,
)
from fem.support.numba_cache import kept_unchecked, unchecked

#: Half-planes are clamped at this share of the width of all strips, the logarithmic capacity of an interval: at this
#: depth and beyond the compliance is positive definite.
CAPACITY = 1 / 4
#: Compliances of pinion and wheel
Compliances = tuple[CompiledCompliance, CompiledCompliance]
#: Displacements under which the strips of a slice are solved: transmission error, gap, and the smooth ones.
SIDES = 2 + NODES


@dataclass(frozen=True)
class StripContact:
    """Potential contact of m strips in each of n slices.

    local       (n, m, m) compliance between the strips of a slice as half-planes [m/N]
    smooth      (n NODES, n NODES) all other compliance, between the strips that the shapes interpolate [m/N]
    sides       (n, SIDES, m) normal displacements per transmission error, gap [m] and smooth displacement; these are
                the shape functions of the strips
    """

    local: np.ndarray
    smooth: np.ndarray
    sides: np.ndarray

    @property
    def approach(self) -> np.ndarray:
        """(n, m) normal approach per transmission error."""
        return self.sides[:, 0]

    @property
    def gap(self) -> np.ndarray:
        """(n, m) normal gap [m]."""
        return self.sides[:, 1]

    def displacement(self, force: np.ndarray) -> np.ndarray:
        """(n, m) normal displacement of the strips under their forces (n, m) [m]."""
        return displacement_of(self.local, self.smooth, self.sides, force)

    def solve(self, force: float, active: np.ndarray, exchanges: int = EXCHANGES) -> "Solution":
        """Equilibrium with sum(approach f) = force in which no strip pulls or penetrates.

        active      (n, m) strips that are taken to touch at first
        exchanges   as in `unilateral_contact`

        Raises RuntimeError where no active set converges.
        """
        return Solution(*solve_strips(self.local, self.smooth, self.sides, force, active, exchanges))


class Solution(NamedTuple):
    """Equilibrium of the strips.

    te          transmission error [m]
    stiffness   change of the total force per transmission error while the same strips touch [N/m]: as pressure vanishes
                at the edges of the contact, that is the tangent stiffness of the mesh
    force       (n, m) on the strips [N]
    """

    te: float
    stiffness: float
    force: np.ndarray


class LoadedStrips(NamedTuple):
    """A mesh force [N] on a `StripContact`; slices whose active strips stay keep their forces.

    local, smooth, sides    as in `StripContact`
    active      (n, m) active strips of the last solution
    forces      (n, SIDES, m) forces on them that cause the `sides`, uncoupled
    condensed   (n, SIDES, SIDES) work of these forces on the sides
    root        (n, NODES, NODES) root of that on the smooth displacements
    """

    local: np.ndarray
    smooth: np.ndarray
    sides: np.ndarray
    mesh_force: float
    active: np.ndarray
    forces: np.ndarray
    condensed: np.ndarray
    root: np.ndarray


def assemble(
    slices: ContactSlices, strips: Strips, bodies: Compliances, face: Face, misalignment: float
) -> StripContact:
    """Contact of all strips under a misalignment [rad]."""
    depth = CAPACITY * strips.width.sum(axis=1).max()
    nodes = interpolated_strips(strips.width.shape[1], strips.equal)
    arcs, tilts = (np.stack([values[:, :, node] for node in nodes], axis=2) for values in (strips.arcs, strips.tilts))
    numbers = slices.number, slices.low, slices.high
    smooth = slices.mesh.call(smooth_compliance, bodies, face.share < 1, numbers, depth, arcs, tilts)
    gap, flat = strips.gap + slices.gap_by(misalignment)[:, None], slices.flattening
    local, sides = local_compliance(strips.width, strips.equal, depth, flat, strips.approach, gap)
    return StripContact(local, smooth, sides)


@kept_unchecked
def local_compliance(width, equal, depth, flattening, approach, gap):
    """`StripContact.local` and `sides` of strips of widths, approaches and gaps (n, m).

    depth       depth at which half-planes are clamped [m]
    flattening  (n,) of the slices per force [m/N]
    """
    n, m = width.shape
    local, sides = np.empty((n, m, m)), np.empty((n, SIDES, m))
    for i in range(n):
        write_half_planes(width[i], equal, depth, flattening[i], local[i])
        write_shapes(width[i], equal, sides[i])
        for k in range(m):
            sides[i, 0, k], sides[i, 1, k] = approach[i, k], gap[i, k]
    return local, sides


@unchecked
def displacement_of(local, smooth, sides, force):
    """`StripContact.displacement`."""
    n, m = force.shape
    nodal, u = np.empty((1, n * NODES)), np.empty((n, m))
    for i in range(n):
        for a in range(NODES):
            nodal[0, i * NODES + a] = product(sides[i], 2 + a, force, i, m)
    for i in range(n):
        for k in range(m):
            u[i, k] = product(local[i], k, force, i, m)
        for a in range(NODES):
            at_node = product(smooth, i * NODES + a, nodal, 0, n * NODES)
            for k in range(m):
                u[i, k] += at_node * sides[i, 2 + a, k]
    return u


@unchecked
def _linear_equilibrium(load, active):
    """Equilibrium of the active strips (n m,); where none is active, of the strip that touches first."""
    (n, m), sides = load.active.shape, load.sides
    chosen, least = 0, inf
    for i in range(n):
        for k in range(m):
            chosen += active[i * m + k]
            least = min(least, sides[i, 1, k] / sides[i, 0, k])
    for i in range(n):
        changed = 0
        for k in range(m):
            touches = active[i * m + k] if chosen else sides[i, 1, k] / sides[i, 0, k] == least
            changed += touches != load.active[i, k]
            load.active[i, k] = touches
        if changed:
            _condense(load.local[i], sides[i], load.active[i], load.forces[i], load.condensed[i])
            square_root(load.condensed[i], 2, load.root[i])
    te, stiffness, force = _coupled(load)
    slack = displacement_of(load.local, load.smooth, sides, force)
    for i in range(n):
        for k in range(m):
            slack[i, k] = 0.0 if load.active[i, k] else slack[i, k] + sides[i, 1, k] - sides[i, 0, k] * te
    return Equilibrium(te, stiffness, force.reshape(n * m), slack.reshape(n * m), True)


@unchecked
def _condense(local, sides, active, forces, condensed):
    """Write the forces (SIDES, m) on the active strips of a slice that cause its sides, and their work on these."""
    strips = indices_of_true(active)
    matrix, right = np.empty((strips.size, strips.size)), np.empty((SIDES, strips.size))
    for k, strip in enumerate(strips):
        for j in range(k + 1):
            matrix[k, j] = local[strip, strips[j]]
        for a in range(SIDES):
            right[a, k] = sides[a, strip]
    factorize(matrix)
    solve(matrix, right)
    for a in range(SIDES):
        for k in range(active.size):
            forces[a, k] = 0.0
        for k, strip in enumerate(strips):
            forces[a, strip] = right[a, k]
    for a in range(SIDES):
        for b in range(SIDES):
            condensed[a, b] = product(forces, a, sides, b, active.size)


@unchecked
def _coupled(load):
    """Transmission error, stiffness and strip forces (n, m) of all slices from the forces of uncoupled ones.

    With the condensed compliance of a slice H = L L^T and the smooth one S the displacements at the nodes are r = S y,
    where (1 + L^T S L) w = L^T S free and y = free - L w.
    """
    n, m = load.active.shape
    loaded = active_rows(load.active)
    free, nodes = np.empty((2, loaded.size * NODES)), np.empty(loaded.size * NODES, np.int64)
    for k, i in enumerate(loaded):
        for a in range(NODES):
            nodes[k * NODES + a] = i * NODES + a
            free[0, k * NODES + a], free[1, k * NODES + a] = load.condensed[i, 2 + a, 0], load.condensed[i, 2 + a, 1]
    smooth = submatrix(load.smooth, nodes)
    reaction = _reaction(smooth, load.root, loaded, free)
    stiffness, closed = -product(free, 0, reaction, 0, nodes.size), -product(free, 0, reaction, 1, nodes.size)
    for i in loaded:
        stiffness += load.condensed[i, 0, 0]
        closed += load.condensed[i, 0, 1]
    te, force = (load.mesh_force + closed) / stiffness, np.zeros((n, m))
    for k, i in enumerate(loaded):
        for j in range(m):
            force[i, j] = load.forces[i, 0, j] * te - load.forces[i, 1, j]
            for a in range(NODES):
                at = k * NODES + a
                force[i, j] -= (reaction[0, at] * te - reaction[1, at]) * load.forces[i, 2 + a, j]
    return te, stiffness, force


@unchecked
def _reaction(smooth, roots, loaded, free):
    """(2, n) displacements at the nodes r of `_coupled`."""
    system, right = congruent(smooth, roots[loaded]), times(smooth, free)
    for k, i in enumerate(loaded):
        for a in range(NODES):
            system[k * NODES + a, k * NODES + a] += 1.0
            for r in range(2):
                right[r, k * NODES + a] = column_times(roots[i], a, right, r, k * NODES)
    factorize(system)
    solve(system, right)
    y = free.copy()
    for k, i in enumerate(loaded):
        for r in range(2):
            for a in range(NODES):
                for b in range(a + 1):
                    y[r, k * NODES + a] -= roots[i, a, b] * right[r, k * NODES + b]
    return times(smooth, y)


_equilibrium = unilateral_contact(_linear_equilibrium, unchecked)


@kept_unchecked
def solve_strips(local, smooth, sides, force, active, exchanges):
    """`StripContact.solve`."""
    n, m = active.shape
    forces, condensed, root = np.zeros((n, SIDES, m)), np.zeros((n, SIDES, SIDES)), np.zeros((n, NODES, NODES))
    load = LoadedStrips(local, smooth, sides, force, np.zeros((n, m), np.bool_), forces, condensed, root)
    state = _equilibrium(load, active.reshape(n * m), exchanges)
    return state.te, state.stiffness, state.force.reshape(n, m)
