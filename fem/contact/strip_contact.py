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
from fem.elasticity.flank_compliance import Compliance
from fem.elasticity.half_space import along_line
from fem.elasticity.hat_functions import lines
from fem.elasticity.hertz import flattening

#: Every load on strips presses a half-plane down that is held at this share of their whole width, or deeper.
CAPACITY = 1 / 4
ACTIVE_SETS = 40
#: Share of the force that counts as none, and penetration that does [m], where strips join and leave one by one.
FORCELESS, PENETRATION = 1e-14, 1e-14


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

    @property
    def nearest(self) -> np.ndarray:
        """(n, m) 1 at the strip that touches first, else 0."""
        clear = self.gap / self.approach
        return (clear == clear.min()).astype(float)

    def displacement(self, f: np.ndarray) -> np.ndarray:
        """(n, m) normal displacement of the strips under their forces f (n, m) [m]."""
        n = len(f)
        smooth = self.smooth.reshape(n * NODES, -1) @ (self.shapes @ f[..., None]).ravel()
        return (self.local @ f[..., None])[..., 0] + (smooth.reshape(n, 1, NODES) @ self.shapes)[:, 0]

    def solve(self, force: float, active: np.ndarray) -> "Solution":
        """Equilibrium with sum(approach f) = force (primal-dual active set).

        active      (n, m) strips that are taken to touch at first

        Raises RuntimeError where no active set settles.
        """
        moved = self._moved(active)
        for _ in range(ACTIVE_SETS):
            solution = self._coupled(moved, force)
            f, slack = solution.force, self.slack(solution)
            wanted = np.where(active, f > 0, slack < 0)
            if (wanted == active).all():
                return solution
            if not wanted.any():
                wanted[np.unravel_index(np.argmin(slack), slack.shape)] = True
            changed = (wanted != active).any(axis=1)
            active, moved[changed] = wanted, self._moved(wanted, changed)
        return self._one_by_one(np.where(f > 0, f, 0.0) if (f > 0).any() else self.nearest, force)

    def slack(self, solution: "Solution") -> np.ndarray:
        """(n, m) gap that is left between the strips [m]."""
        return self.displacement(solution.force) + self.gap - self.approach * solution.te

    def _one_by_one(self, f: np.ndarray, force: float) -> "Solution":
        """The same where active sets cycle: strips join one at a time, and leave as they run out of force.

        f       (n, m) forces >= 0 to start from [N]

        Every step lowers the energy (Lawson & Hanson, Solving Least Squares Problems, ch. 23).
        """
        f = f * force / (self.approach * f).sum()
        for _ in range(3 * f.size):
            solution = self._with_active(f > 0, force)
            while ((new := solution.force)[f > 0] <= 0).any():
                falling = (f > 0) & (new <= 0)
                share = (f[falling] / (f - new)[falling]).min()
                f = np.where((f + share * (new - f) > FORCELESS * force) & (f > 0), f + share * (new - f), 0.0)
                solution = self._with_active(f > 0, force)
            slack = np.where(new > 0, 0.0, self.slack(solution))
            if slack.min() >= -PENETRATION:
                return solution
            f = np.where(slack == slack.min(), 2 * FORCELESS * force, new)
        raise RuntimeError("contact did not settle; try a neighbouring phase or a finer density")

    def _with_active(self, active: np.ndarray, force: float) -> "Solution":
        """Equilibrium where only the active strips touch."""
        return self._coupled(self._moved(active), force)

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
