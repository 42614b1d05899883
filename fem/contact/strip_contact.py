"""Frictionless contact of strips: the compliance of all slices together, and its solution on the active set.

The compliance is that of the strips of each slice as half-planes (`local`) plus a smooth remainder, quadratic over the
strips of a slice, that couples all slices (`smooth`). The system is solved in two steps: each slice under unit values
of the transmission error, its gap and the smooth displacements; then the coupling of the slices.
"""

from collections import defaultdict
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from math import cos
from typing import NamedTuple

import numpy as np

from fem.contact.flank_gap import ContactSlices
from fem.contact.strip_bounds import NODES, SHAPES, Strips, strips_of
from fem.contact.unilateral import Equilibrium, unilateral_contact
from fem.elasticity.flank_compliance import Compliance
from fem.elasticity.half_space import along_line
from fem.pair.hertz import flattening

#: Half-planes are clamped at this share of the width of all strips, the logarithmic capacity of an interval: at this
#: depth and beyond the compliance is positive definite.
CAPACITY = 1 / 4
#: Factor by which strips are widened that are narrower than the contact, and how often: to a hundred times in total.
WIDENING, WIDENINGS = 1.6, 12

#: Compliances of pinion and wheel
Bodies = tuple[Compliance, Compliance]


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


@dataclass(frozen=True)
class StripContact:
    """Potential contact of m strips in each of n slices.

    local       (n, m, m) compliance between the strips of a slice as half-planes [m/N]
    smooth      (n, NODES, n, NODES) all other compliance, between the strips that the shapes interpolate [m/N]
    gap         (n, m) [m]
    approach    (n, m) normal approach per transmission error
    shapes      (NODES, m) shape functions of the strips, or (n, NODES, m) of those of each slice
    """

    local: np.ndarray
    smooth: np.ndarray
    gap: np.ndarray
    approach: np.ndarray
    shapes: np.ndarray = field(default_factory=lambda: SHAPES)

    @cached_property
    def right_sides(self) -> np.ndarray:
        """(n, m, 2 + NODES) normal displacements per transmission error, gap and smooth displacement."""
        shapes = np.broadcast_to(self.shapes.swapaxes(-1, -2), (*self.gap.shape, NODES))
        return np.concatenate([self.approach[..., None], self.gap[..., None], shapes], axis=2)

    def displacement(self, f: np.ndarray) -> np.ndarray:
        """(n, m) normal displacement of the strips under their forces f (n, m) [m]."""
        n = len(f)
        smooth = self.smooth.reshape(n * NODES, -1) @ (self.shapes @ f[..., None]).ravel()
        return (self.local @ f[..., None])[..., 0] + (smooth.reshape(n, 1, NODES) @ self.shapes)[:, 0]

    def solve(self, force: float, active: np.ndarray) -> Solution:
        """Equilibrium with sum(approach f) = force in which no strip pulls or penetrates.

        active      (n, m) strips that are taken to touch at first

        Raises RuntimeError where no active set converges.
        """
        state = unilateral_contact(ActiveStrips(self, force), active.reshape(1, -1))
        return Solution(float(state.te[0]), float(state.stiffness[0]), state.force.reshape(active.shape))

    def slice_forces(self, active: np.ndarray, slices: np.ndarray) -> np.ndarray:
        """(n, m, 2 + NODES) forces on the active strips of selected slices (n,) that cause `right_sides`, uncoupled."""
        active = active[slices]
        local = np.where(active[:, :, None] & active[:, None, :], self.local[slices], 0.0)
        strip = np.arange(active.shape[1])
        local[:, strip, strip] += ~active
        return np.linalg.solve(local, self.right_sides[slices] * active[..., None])

    def coupled(self, slice_forces: np.ndarray, force: float) -> Solution:
        """Equilibrium of all slices from the forces of uncoupled ones."""
        n = len(slice_forces)
        condensed = self.right_sides.transpose(0, 2, 1) @ slice_forces
        free, smooth = condensed[:, 2:, :2].reshape(-1, 2), self.smooth.reshape(n * NODES, -1)
        system = (condensed[:, 2:, 2:] @ smooth.reshape(n, NODES, -1)).reshape(n * NODES, -1)
        system.flat[:: n * NODES + 1] += 1.0
        reaction = smooth @ np.linalg.solve(system, free)
        total = condensed[:, :2, :2].sum(axis=0) - free.T @ reaction
        te = float((force + total[0, 1]) / total[0, 0])
        nodal = (reaction @ [te, -1.0]).reshape(n, NODES, 1)
        strip_force = (slice_forces[..., :2] @ [te, -1.0]) - (slice_forces[..., 2:] @ nodal)[..., 0]
        return Solution(te, float(total[0, 0]), strip_force)


class ActiveStrips:
    """Equilibrium under a mesh force for active strips; slices whose active strips stay keep their forces."""

    def __init__(self, contact: StripContact, force: float):
        self.contact, self.force = contact, force
        self.active, self.slice_forces = np.zeros(contact.gap.shape, bool), np.zeros(contact.right_sides.shape)

    def __call__(self, active: np.ndarray) -> Equilibrium:
        """Equilibrium of the active strips (1, n m); where none is active, of the strip that touches first."""
        contact, active = self.contact, active.reshape(self.active.shape)
        if not active.any():
            first_touch = contact.gap / contact.approach
            active = first_touch == first_touch.min()
        changed = (active != self.active).any(axis=1)
        self.active, self.slice_forces[changed] = active, contact.slice_forces(active, changed)
        te, stiffness, force = contact.coupled(self.slice_forces, self.force)
        slack = np.where(active, 0.0, contact.displacement(force) + contact.gap - contact.approach * te)
        return Equilibrium(np.array([te]), np.array([stiffness]), force.reshape(1, -1), slack.reshape(1, -1))


def coupling(slices: ContactSlices, arcs: np.ndarray, bodies: Bodies, tilts=None) -> np.ndarray:
    """(n, m, n, m) displacement between the flanks per force at arcs (2, n, m) [m], beside half-spaces [m/N].

    tilts       (2, n, m) of the direction of contact from the normals of pinion and wheel [rad]; None: 0
    """
    n, m = arcs.shape[1:]
    total = np.zeros((n * m, n * m))
    groups = [(k, slice(rows.start * m, rows.stop * m)) for k, rows in slices_by_pair(slices)]
    tilts = np.zeros(arcs.shape) if tilts is None else tilts
    for side, body in enumerate(bodies):
        shift = side * slices.position.axial
        across = body.across(slices.low - shift, slices.high - shift)
        weights = (across.repeat(m, axis=1)[:, None] * body.along(arcs[side])).reshape(-1, n * m)
        tilted = weights * 2 * tilts[side].ravel()
        for (k, rows), (loaded_pair, columns) in product(groups, repeat=2):
            ahead = (k - loaded_pair) * (-1) ** side
            if abs(ahead) > body.pitches:
                continue
            u = weights[:, rows].T @ body.normal(ahead)
            if tilted[:, rows].any():
                u -= tilted[:, rows].T @ body.tangential(ahead)
            total[rows, columns] += u @ weights[:, columns]
    return ((total + total.T) / 2).reshape(n, m, n, m)


def slices_by_pair(slices: ContactSlices) -> list[tuple[int, slice]]:
    """Tooth pairs by number, and which of the slices are theirs."""
    numbers, first, count = np.unique(slices.number, return_index=True, return_counts=True)
    return [(k, slice(i, i + c)) for k, i, c in zip(numbers.tolist(), first, count, strict=True)]


def along_contact(slices: ContactSlices, depth: float, bodies: Bodies) -> np.ndarray:
    """(n, n) displacement between the flanks per force in slices: half-spaces less their half-planes [m/N].

    depth       depth at which the half-planes are clamped [m]

    The slices of a tooth pair adjoin, from low to high.
    """
    pair, axial = slices.position.pair, slices.position.axial
    total, inclined = np.zeros((slices.low.size, slices.low.size)), cos(pair.beta_b)
    softness: dict[tuple[float, float], float] = defaultdict(float)
    for gear, body, shift in zip((pair.pinion, pair.wheel), bodies, (0.0, axial), strict=True):
        softness[body.end, shift] += flattening(gear.material)
    for (_, rows), ((end, shift), factor) in product(slices_by_pair(slices), softness.items()):
        edges = np.append(slices.low[rows], slices.high[rows][-1]) - shift
        total[rows, rows] += factor * along_line(edges / inclined, end / inclined, depth, bodies[0].face)
    return total


def flattening_of(slices: ContactSlices) -> np.ndarray:
    """(n,) flattening of both flanks per force in a slice [m/N]."""
    pair = slices.position.pair
    return cos(pair.beta_b) / slices.width * (flattening(pair.pinion.material) + flattening(pair.wheel.material))


def assemble(slices: ContactSlices, strips: Strips, bodies: Bodies, misalignment: float) -> StripContact:
    """Contact of all strips under a misalignment [rad]."""
    depth, nodes = CAPACITY * strips.reach, strips.nodes
    smooth = coupling(slices, strips.arcs[:, :, nodes], bodies, strips.tilts[:, :, nodes])
    smooth += along_contact(slices, depth, bodies)[:, None, :, None]
    gap = strips.gap + slices.gap_by(misalignment)[:, None]
    local = flattening_of(slices)[:, None, None] * strips.between(depth)
    return StripContact(local, smooth, gap, strips.approach, strips.shapes)


def wide_enough(
    slices: ContactSlices, bodies: Bodies, force: float, misalignment: float, half_width: np.ndarray
) -> tuple[Strips, Solution]:
    """Strips that cover all of the contact, and its solution under a force on the modelled face [N].

    half_width  (n,) guess of the contact's half-widths [m]

    Slices whose outermost strips are loaded get wider strips; in other slices the active set starts from the last one.

    Raises RuntimeError where the contact is far wider than the guess.
    """
    full, touching = np.ones(slices.low.size, bool), np.zeros((slices.low.size, 1), bool)
    for _ in range(WIDENINGS):
        strips = strips_of(slices, half_width)
        touching = np.where(full[:, None], strips.expected > 0, touching)
        solution = assemble(slices, strips, bodies, misalignment).solve(force, touching)
        touching = solution.force > 0
        first_full, last_full = strips.open & touching[:, [0, -1]].T
        full = first_full | last_full
        if not full.any():
            return strips, solution
        half_width = np.where(full, WIDENING * half_width, half_width)
    raise RuntimeError("contact is a hundred times wider than by Hertz; reduce the load or take more slices")
