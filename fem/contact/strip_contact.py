"""Frictionless unilateral contact of strips: compliance of all cells together, active set."""

from collections import defaultdict
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from math import cos
from typing import NamedTuple

import numpy as np

from fem.contact.flank_gap import ContactSlices
from fem.contact.strip_bounds import NODES, SHAPES, Strips
from fem.contact.unilateral import Equilibrium, unilateral_contact
from fem.elasticity.flank_compliance import Compliance
from fem.elasticity.half_space import along_line
from fem.elasticity.hat_functions import lines
from fem.elasticity.hertz import flattening

#: Every load on strips presses a half-plane down that is held at this share of their whole width, or deeper.
CAPACITY = 1 / 4


@dataclass(frozen=True)
class Contact:
    """Potential contact of m strips in each of n cells.

    local       (n, m, m) compliance between the strips of a cell as of half-planes [m/N]
    smooth      (n, NODES, n, NODES) all other compliance, between strips of the cells that the shapes interpolate [m/N]
    gap         (n, m) [m]
    approach    (n, m) normal approach per transmission error
    shapes      (NODES, m) shape functions of the strips, or (n, NODES, m) of those of each cell
    """

    local: np.ndarray
    smooth: np.ndarray
    gap: np.ndarray
    approach: np.ndarray
    shapes: np.ndarray = field(default_factory=lambda: SHAPES)

    @cached_property
    def pressed(self) -> np.ndarray:
        """(n, m, 2 + NODES) displacements that transmission error, gap and smooth compliance ask of the strips."""
        shapes = np.broadcast_to(self.shapes.swapaxes(-1, -2), (*self.gap.shape, NODES))
        return np.concatenate([self.approach[..., None], self.gap[..., None], shapes], axis=2)

    def displacement(self, f: np.ndarray) -> np.ndarray:
        """(n, m) normal displacement of the strips under their forces f (n, m) [m]."""
        n = len(f)
        smooth = self.smooth.reshape(n * NODES, -1) @ (self.shapes @ f[..., None]).ravel()
        return (self.local @ f[..., None])[..., 0] + (smooth.reshape(n, 1, NODES) @ self.shapes)[:, 0]

    def solve(self, force: float, active: np.ndarray) -> "Solution":
        """Equilibrium with sum(approach f) = force in which no strip pulls or penetrates.

        active      (n, m) strips that are taken to touch at first

        Raises RuntimeError where no active set converges.
        """
        state = unilateral_contact(_Condensation(self, force), active.reshape(1, -1))
        return Solution(float(state.te[0]), float(state.stiffness[0]), state.force.reshape(active.shape))

    def slack(self, solution: "Solution") -> np.ndarray:
        """(n, m) gap that is left between the strips [m]."""
        return self.displacement(solution.force) + self.gap - self.approach * solution.te

    def _moved(self, active: np.ndarray, cells=slice(None)) -> np.ndarray:
        """(n, m, 2 + NODES) forces on the active strips that press them as `pressed` says, some cells by themselves."""
        active = active[cells]
        local = np.where(active[:, :, None] & active[:, None, :], self.local[cells], 0.0)
        each = np.arange(active.shape[1])
        local[:, each, each] += ~active
        return np.linalg.solve(local, self.pressed[cells] * active[..., None])

    def _coupled(self, moved: np.ndarray, force: float) -> "Solution":
        """Equilibrium from the forces of uncoupled cells."""
        n = len(moved)
        condensed = self.pressed.transpose(0, 2, 1) @ moved
        free, smooth = condensed[:, 2:, :2].reshape(-1, 2), self.smooth.reshape(n * NODES, -1)
        coupled = (condensed[:, 2:, 2:] @ smooth.reshape(n, NODES, -1)).reshape(n * NODES, -1)
        coupled.flat[:: n * NODES + 1] += 1.0
        reaction = smooth @ np.linalg.solve(coupled, free)
        total = condensed[:, :2, :2].sum(axis=0) - free.T @ reaction
        delta = float((force + total[0, 1]) / total[0, 0])
        levels = (reaction @ [delta, -1.0]).reshape(n, NODES, 1)
        strip_force = (moved[..., :2] @ [delta, -1.0]) - (moved[..., 2:] @ levels)[..., 0]
        return Solution(delta, float(total[0, 0]), strip_force)


class _Condensation:
    """Equilibrium under a mesh force for active strips; slices whose active strips stay keep their solution."""

    def __init__(self, contact: Contact, force: float):
        self.contact, self.force = contact, force
        self.active, self.moved = np.zeros(contact.gap.shape, bool), np.zeros(contact.pressed.shape)

    def __call__(self, active: np.ndarray) -> Equilibrium:
        contact, active = self.contact, active.reshape(self.active.shape)
        if not active.any():
            first_touch = contact.gap / contact.approach
            active = first_touch == first_touch.min()
        changed = (active != self.active).any(axis=1)
        self.active, self.moved[changed] = active, contact._moved(active, changed)
        solution = contact._coupled(self.moved, self.force)
        gap = np.where(active, 0.0, contact.slack(solution)).reshape(1, -1)
        return Equilibrium(np.array([solution.te]), np.array([solution.stiffness]), solution.force.reshape(1, -1), gap)


class Solution(NamedTuple):
    """Equilibrium of the strips.

    te          transmission error [m]
    stiffness   change of the total force per transmission error while the same strips touch [N/m]: as pressure vanishes
                at the edges of the contact, that is the tangent stiffness of the mesh
    force       (n, m) of the strips [N]
    """

    te: float
    stiffness: float
    force: np.ndarray


def coupling(cells: ContactSlices, arcs: np.ndarray, pinion: Compliance, wheel: Compliance, tilts=None) -> np.ndarray:
    """(n, m, n, m) displacement between the flanks per force at places arcs (2, n, m), half-spaces apart [m/N].

    tilts       (2, n, m) of the direction of contact against the normals of pinion and wheel [rad]; none: 0
    """
    n, m = arcs.shape[1:]
    total = np.zeros((n * m, n * m))
    groups = [(k, slice(own.start * m, own.stop * m)) for k, own in pairs_of(cells)]
    tilts = np.zeros(arcs.shape) if tilts is None else tilts
    for side, body in enumerate((pinion, wheel)):
        shift = side * cells.meeting.axial
        across = across_weights(body, cells.low - shift, cells.high - shift)
        weights = (across.repeat(m, axis=1)[:, None] * along_weights(body, arcs[side])).reshape(-1, n * m)
        tilted = weights * 2 * tilts[side].ravel()
        for (k, here), (j, there) in product(groups, repeat=2):
            ahead = (k - j) * (-1) ** side
            if abs(ahead) > body.pitches:
                continue
            moved = weights[:, here].T @ body.ahead(ahead)
            if tilted[:, here].any():
                moved -= tilted[:, here].T @ body.slide_ahead(ahead)
            total[here, there] += moved @ weights[:, there]
    return ((total + total.T) / 2).reshape(n, m, n, m)


def pairs_of(cells: ContactSlices) -> list[tuple[int, slice]]:
    """Pairs of teeth by number, and which of the cells are theirs."""
    numbers, first, count = np.unique(cells.number, return_index=True, return_counts=True)
    return [(k, slice(i, i + c)) for k, i, c in zip(numbers.tolist(), first, count, strict=True)]


def along_contact(cells: ContactSlices, depth: float, pinion: Compliance, wheel: Compliance) -> np.ndarray:
    """(n, n) displacement between the flanks per force in cells as of half-spaces, beside half-planes [m/N].

    depth       at which the half-planes are held [m]

    The cells of a pair of teeth adjoin, from low to high.
    """
    pair, axial = cells.meeting.pair, cells.meeting.axial
    found, inclined = np.zeros((cells.low.size, cells.low.size)), cos(pair.beta_b)
    softness: dict[tuple[float, float], float] = defaultdict(float)
    for gear, body, shift in ((pair.pinion, pinion, 0.0), (pair.wheel, wheel, axial)):
        softness[body.end, shift] += flattening(gear.material)
    for (_, own), ((end, shift), factor) in product(pairs_of(cells), softness.items()):
        edges = np.append(cells.low[own], cells.high[own][-1]) - shift
        found[own, own] += factor * along_line(edges / inclined, end / inclined, depth, mirrored=pinion.share < 1)
    return found


def across_weights(body: Compliance, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(n_axial, n) mean values of the hats across the width over the slices between low and high (n,) [m]."""
    kinks = body.axial[1:-1, None]
    below, above = (np.stack([at, at**2 / 2, *np.maximum(at - kinks, 0) ** 2 / 2]) for at in (low, high))
    return body.hats_of_lines[0] @ ((above - below) / (high - low))


def along_weights(body: Compliance, arcs: np.ndarray) -> np.ndarray:
    """(n_hat, n m) values at places arcs (n, m) of the hats along the profile; straight on beyond the ends."""
    return body.hats_of_lines[1] @ lines(body.arcs, arcs.ravel())


def flattening_of(cells: ContactSlices) -> np.ndarray:
    """(n,) flattening of both flanks per force in a cell [m/N]."""
    pair = cells.meeting.pair
    both = flattening(pair.pinion.material) + flattening(pair.wheel.material)
    return cos(pair.beta_b) / (cells.high - cells.low) * both


def assemble(cells: ContactSlices, strips: Strips, pinion: Compliance, wheel: Compliance, misalignment) -> Contact:
    """Contact of all strips."""
    depth, nodes = CAPACITY * strips.reach, strips.nodes
    smooth = coupling(cells, strips.arcs[:, :, nodes], pinion, wheel, strips.tilts[:, :, nodes])
    smooth += along_contact(cells, depth, pinion, wheel)[:, None, :, None]
    gap = strips.gap + (cos(cells.meeting.pair.beta_b) * misalignment * cells.middle)[:, None]
    local = flattening_of(cells)[:, None, None] * strips.between(depth)
    return Contact(local, smooth, gap, strips.approach, strips.shapes)
