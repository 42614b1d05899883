"""Frictionless unilateral contact of strips: compliance of all cells together, active set."""

from dataclasses import dataclass
from itertools import product
from math import cos, log

import numpy as np

from fem.compliance import Compliance
from fem.gap import Cells
from fem.hertz import flattening, log_mean

STRIPS = 17
#: (STRIPS, STRIPS) mean of -ln of the distance between two of equal strips of unit width
BETWEEN_STRIPS = log_mean(np.subtract.outer(np.arange(STRIPS), np.arange(STRIPS)), 1.0, 1.0)

ACTIVE_SETS = 40
#: Share of the force that counts as none, and penetration that does [m], where strips join and leave one by one.
FORCELESS, PENETRATION = 1e-14, 1e-14
#: Strips between which the smooth compliance is quadratic, and their shape functions (NODES, STRIPS)
PRESSED = slice(STRIPS // 6, STRIPS - STRIPS // 6)
PLACES = [0, STRIPS // 2, STRIPS - 1]
NODES = len(PLACES)
SHAPES = np.linalg.solve(np.vander(PLACES, increasing=True).T, np.vander(np.arange(STRIPS), NODES, increasing=True).T)


@dataclass(frozen=True)
class Contact:
    """Potential contact of m strips in each of n cells.

    local       (n, m, m) compliance between the strips of a cell as of half-planes [m/N]
    smooth      (n, NODES, n, NODES) all other compliance, between places of the cells that `SHAPES` interpolate [m/N]
    gap         (n, m) [m]
    approach    (n, m) normal approach per transmission error
    expected    (n, m) whether a strip lies where Hertz expects the contact
    """

    local: np.ndarray
    smooth: np.ndarray
    gap: np.ndarray
    approach: np.ndarray
    expected: np.ndarray

    def displacement(self, f: np.ndarray) -> np.ndarray:
        """(n, m) normal displacement of the strips under their forces f (n, m) [m]."""
        smooth = np.einsum("piqj,qj->pi", self.smooth, f @ SHAPES.T)
        return np.einsum("nst,nt->ns", self.local, f) + smooth @ SHAPES

    def solve(self, force: float) -> tuple[float, np.ndarray]:
        """Transmission error [m] and strip forces (n, m) [N] with sum(approach f) = force (primal-dual active set).

        Raises RuntimeError where no active set settles.
        """
        active = self.expected
        for _ in range(ACTIVE_SETS):
            delta, f = self._with_active(active, force)
            slack = self.displacement(f) + self.gap - self.approach * delta
            wanted = np.where(active, f > 0, slack < 0)
            if (wanted == active).all():
                return delta, f
            active = wanted
            if not active.any():
                active[np.unravel_index(np.argmin(slack), slack.shape)] = True
        return self._one_by_one(np.maximum(f, 0.0), force)

    def _one_by_one(self, f: np.ndarray, force: float) -> tuple[float, np.ndarray]:
        """The same where active sets cycle: strips join one at a time, and leave as they run out of force.

        f       (n, m) forces >= 0 to start from [N]

        Every step lowers the energy (Lawson & Hanson, Solving Least Squares Problems, ch. 23).
        """
        f = f * force / (self.approach * f).sum()
        for _ in range(3 * f.size):
            delta, new = self._with_active(f > 0, force)
            while (new[f > 0] <= 0).any():
                falling = (f > 0) & (new <= 0)
                share = (f[falling] / (f - new)[falling]).min()
                f = np.where((f + share * (new - f) > FORCELESS * force) & (f > 0), f + share * (new - f), 0.0)
                delta, new = self._with_active(f > 0, force)
            slack = np.where(new > 0, 0.0, self.displacement(new) + self.gap - self.approach * delta)
            if slack.min() >= -PENETRATION:
                return delta, new
            f = np.where(slack == slack.min(), 2 * FORCELESS * force, new)
        raise RuntimeError("contact did not settle; try a neighbouring phase or a finer density")

    def _with_active(self, active: np.ndarray, force: float) -> tuple[float, np.ndarray]:
        """Transmission error and forces where only the active strips touch: cells one by one, then their coupling."""
        n, m = active.shape
        both = active[:, :, None] & active[:, None, :]
        local = np.where(both, self.local, 0.0)
        local[:, np.arange(m), np.arange(m)] += ~active
        pressed = np.concatenate([self.approach[..., None], self.gap[..., None], np.tile(SHAPES.T, (n, 1, 1))], axis=2)
        pressed *= active[..., None]
        moved = np.linalg.solve(local, pressed)
        condensed = np.einsum("nsa,nsb->nab", pressed, moved)
        smooth = self.smooth.reshape(n * NODES, -1)
        coupled = np.matmul(condensed[:, 2:, 2:], self.smooth.reshape(n, NODES, -1)).reshape(n * NODES, -1)
        carried = np.linalg.solve(np.eye(n * NODES) + coupled, condensed[:, 2:, :2].reshape(-1, 2))
        reaction = smooth @ carried
        total = condensed[:, :2, :2].sum(axis=0) - condensed[:, 2:, :2].reshape(-1, 2).T @ reaction
        delta = (force + total[0, 1]) / total[0, 0]
        levels = (reaction @ [delta, -1.0]).reshape(n, NODES)
        f = moved[..., 0] * delta - moved[..., 1] - np.einsum("nsk,nk->ns", moved[..., 2:], levels)
        return float(delta), np.where(active, f, 0.0)


@dataclass(frozen=True)
class Strips:
    """Equal strips along the profile in every cell.

    arcs        (2, n, m) arc lengths of their middles on pinion and wheel [m]
    width       (n,) their width [m]
    gap         (n, m) normal gap, aligned [m]
    approach    (n, m) normal approach per transmission error
    tilts       (2, n, m) of the direction of contact against the normals of pinion and wheel [rad]
    open        (2, n) whether there is more flank beside the first, and the last strip
    """

    arcs: np.ndarray
    width: np.ndarray
    gap: np.ndarray
    approach: np.ndarray
    tilts: np.ndarray
    open: np.ndarray


def strips_of(cells: Cells, reach: np.ndarray) -> Strips:
    """Strips as far as reach (n,) [m] on either side of where the flanks are closest."""
    r_own = cells.radii[0]
    low, high, centre = (roll**2 / (2 * r_own) for roll in (*cells.limits, cells.closest))
    start, end = np.maximum(low, centre - reach[:, None]), np.minimum(high, centre + reach[:, None])
    width = (end - start) / STRIPS
    roll = np.sqrt(2 * r_own * (start + width * (np.arange(STRIPS) + 0.5)))
    gap, _, per_error = cells.gap(roll)
    foot, beside = cells.foot(roll), np.stack([start > low, end < high])[..., 0]
    tilts = cells.tilts(roll, foot, cells.slopes(roll[:, PRESSED]))
    arcs = cells.arcs(roll, np.minimum(foot, cells.mate_tip))
    return Strips(arcs, width[:, 0], gap, per_error, tilts, beside)


def coupling(cells: Cells, arcs: np.ndarray, pinion: Compliance, wheel: Compliance, tilts=None) -> np.ndarray:
    """(n, m, n, m) displacement between the flanks per force at places arcs (2, n, m), half-planes apart.

    tilts       (2, n, m) of the direction of contact against the normals of pinion and wheel [rad]; none: 0
    """
    n, m = arcs.shape[1:]
    normal, along = np.zeros((2, n * m, n * m))
    numbers, first, count = np.unique(cells.number, return_index=True, return_counts=True)
    groups = [(k, slice(i * m, (i + c) * m)) for k, i, c in zip(numbers.tolist(), first, count, strict=True)]
    tilts = np.zeros(arcs.shape) if tilts is None else tilts
    for side, body in enumerate((pinion, wheel)):
        shift = side * cells.meeting.axial
        across = across_weights(body, cells.low - shift, cells.high - shift)
        weights = (across[:, None, :, None] * along_weights(body, arcs[side])).reshape(-1, n * m)
        tilted = weights * tilts[side].ravel()
        for (k, here), (j, there) in product(groups, repeat=2):
            ahead = (k - j) * (-1) ** side
            normal[here, there] += weights[:, here].T @ (body.ahead(ahead) @ weights[:, there])
            if tilted[:, here].any():
                along[here, there] += tilted[:, here].T @ (body.slide_ahead(ahead) @ weights[:, there])
    return (normal - along - along.T).reshape(n, m, n, m)


def across_weights(body: Compliance, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(n_axial, n) mean values of the hats across the width over the slices between low and high (n,) [m]."""
    return (_hat_areas(body.axial, high) - _hat_areas(body.axial, low)) / (high - low)


def _hat_areas(tops: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(n_hat, n) integrals of the hats up to the places at (n,) [m]."""
    left, share = _hats_at(tops, at)
    size = np.diff(tops)
    rising, falling = np.append(0.0, size) / 2, np.append(size, 0.0) / 2
    areas = np.where(np.arange(tops.size)[:, None] < left, (rising + falling)[:, None], 0.0)
    each = np.arange(at.size)
    areas[left, each] = rising[left] + size[left] * (share - share**2 / 2)
    areas[left + 1, each] = size[left] * share**2 / 2
    return areas


def along_weights(body: Compliance, arcs: np.ndarray) -> np.ndarray:
    """(n_hat, n, m) values at places arcs (n, m) of the hats along the profile."""
    left, share = _hats_at(body.arcs, arcs)
    tops = np.arange(body.arcs.size)[:, None, None]
    return np.where(tops == left, 1 - share, 0.0) + np.where(tops == left + 1, share, 0.0)


def _hats_at(tops: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number of the hat left of each place, and the share of the one right of it; straight on beyond the ends."""
    left = np.clip(np.searchsorted(tops, at) - 1, 0, tops.size - 2)
    return left, (at - tops[left]) / (tops[left + 1] - tops[left])


def half_planes(cells: Cells, pinion: Compliance, wheel: Compliance) -> tuple[np.ndarray, np.ndarray]:
    """Flattening of both flanks per force in a cell (n,) [m/N], and that times the logarithm of the depths (n,)."""
    pair = cells.meeting.pair
    inclined = cos(pair.beta_b) / (cells.high - cells.low)
    one, other = flattening(pair.pinion.material), flattening(pair.wheel.material)
    return inclined * (one + other), inclined * (one * log(pinion.depth) + other * log(wheel.depth))


def assemble(cells: Cells, strips: Strips, pinion: Compliance, wheel: Compliance, misalignment, half_width) -> Contact:
    """Contact of all strips; half_width (n,) [m] where Hertz expects the contact."""
    smooth = coupling(cells, strips.arcs[:, :, PLACES], pinion, wheel, strips.tilts[:, :, PLACES])
    factor, constant = (x[:, None, None] for x in half_planes(cells, pinion, wheel))
    local = factor * (BETWEEN_STRIPS - np.log(strips.width)[:, None, None]) + constant
    gap = strips.gap + (cos(cells.meeting.pair.beta_b) * misalignment * cells.middle)[:, None]
    arcs = np.where(cells.own_is_pinion[:, None], *strips.arcs)
    centre = cells.closest**2 / (2 * cells.radii[0])
    expected = np.abs(arcs - centre) <= np.maximum(half_width, strips.width)[:, None]
    return Contact(local, smooth, gap, strips.approach, expected)
