"""Strips along the profile that carry the pressure of a contact: equal ones, or finer ones at a rounded tip edge."""

from dataclasses import dataclass
from math import cos

import numpy as np

from fem.contact.flank_gap import ContactSlices
from fem.elasticity.hertz import log_mean
from fem.microgeometry.flank import rounding

STRIPS = 21
#: Strips reach this many Hertzian half-widths to either side.
WINDOW = 1.5
#: There are so many where an edge is rounded, the narrowest within this share of Hertz's half-width on the rounding.
FINE, NARROW = 41, 0.35
#: Equal strips grow by less than the inverse of this over their window.
EVEN = 1e6
NODES = 3


def nodes_of(strips: int) -> list[int]:
    """The strips between which the smooth compliance is quadratic."""
    return [0, strips // 2, strips - 1]


def shapes_of(at: np.ndarray) -> np.ndarray:
    """(..., NODES, m) shape functions of that compliance for strips whose middles lie at (..., m)."""
    powers = at[..., None, :] ** np.arange(NODES)[:, None]
    return np.linalg.solve(powers[..., nodes_of(at.shape[-1])], powers)


#: (NODES, STRIPS) those of equal strips
SHAPES = shapes_of(np.arange(STRIPS))
#: (STRIPS, STRIPS) mean of -ln of the distance between two of equal strips of unit width
BETWEEN_STRIPS = log_mean(np.subtract.outer(np.arange(STRIPS), np.arange(STRIPS)), 1.0, 1.0)


@dataclass(frozen=True)
class Strips:
    """Strips along the profile in every cell.

    arcs        (2, n, m) arc lengths of their middles on pinion and wheel [m]
    width       (n, m) their widths [m]
    gap         (n, m) mean normal gap, aligned [m]
    approach    (n, m) normal approach per transmission error
    tilts       (2, n, m) of the direction of contact against the normals of pinion and wheel [rad]
    open        (2, n) whether there is more flank beside the first, and the last strip
    expected    (n, m) pressure that Hertz expects on each, up to a factor
    """

    arcs: np.ndarray
    width: np.ndarray
    gap: np.ndarray
    approach: np.ndarray
    tilts: np.ndarray
    open: np.ndarray
    expected: np.ndarray

    @property
    def equal(self) -> bool:
        """Whether the strips of each cell are equal."""
        return bool((self.width == self.width[:, :1]).all())

    @property
    def reach(self) -> float:
        """Width of all strips of the widest cell [m]."""
        return STRIPS * self.width.max() if self.equal else self.width.sum(axis=1).max()

    @property
    def middles(self) -> np.ndarray:
        """(n, m) places of the strips, counted from the first edge [m]."""
        return np.cumsum(self.width, axis=1) - self.width / 2

    @property
    def nodes(self) -> list[int]:
        """As of `nodes_of`."""
        return nodes_of(self.width.shape[1])

    @property
    def shapes(self) -> np.ndarray:
        """As of `shapes_of`: of all cells, or (n, NODES, m) of each."""
        return SHAPES if self.equal else shapes_of(self.middles / self.width.sum(axis=1, keepdims=True))

    def between(self, depth: float) -> np.ndarray:
        """(n, m, m) displacement of half-planes held at a depth [m], per line load and flattening."""
        if self.equal:
            return BETWEEN_STRIPS - np.log(self.width[:, :1, None] / depth)
        apart = self.middles[:, :, None] - self.middles[:, None]
        return log_mean(apart, self.width[:, :, None], self.width[:, None]) + np.log(depth)


def strips_of(cells: ContactSlices, half_width: np.ndarray) -> Strips:
    """Strips as far as WINDOW times half_width (n,) [m] on either side of where the flanks are closest."""
    r_own, reach = cells.radii[0], WINDOW * half_width
    low, high, centre = (roll**2 / (2 * r_own) for roll in (*cells.limits, cells.closest))
    start, end = np.maximum(low, centre - reach[:, None]), np.minimum(high, centre + reach[:, None])
    places, width = edges_and_middles(cells, start, end, half_width)
    roll = np.sqrt(2 * r_own * places)
    gap, foot = cells.clear(roll)
    gap, slopes, roll, foot = means(gap), cells.slopes(roll[:, ::2]), roll[:, 1::2], foot[:, 1::2]
    rise = cos(cells.meeting.pair.beta_b) * half_width**2 / (2 * cells.radius)
    expected = np.sqrt(np.maximum(rise[:, None] - (gap - gap.min(axis=1, keepdims=True)), 0.0))
    tilts = cells.tilts(roll, foot, slopes, expected * (width / width[:, :1]))
    per_error = cells.approach(roll, foot, tilts)
    arcs, beside = cells.arcs(roll, np.minimum(foot, cells.mate_tip)), np.stack([start > low, end < high])[..., 0]
    return Strips(arcs, width, gap + per_error * cells.te, per_error, cells.by_gear(tilts), beside, expected)


def edges_and_middles(cells: ContactSlices, start, end, half_width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 2 m + 1) arc lengths of edges and middles of strips from start to end (n, 1) [m], and their (n, m) widths.

    half_width  (n,) of the contact of the involutes by Hertz [m]

    Beside a rounding of the mate's edge they are narrowest where it begins, or where it is closest.
    """
    begin, radius = mates_edge(cells)
    if not radius.any():
        width = (end - start) / STRIPS
        return start + width * np.linspace(0, STRIPS, 2 * STRIPS + 1), np.broadcast_to(width, (width.size, STRIPS))
    focus = np.minimum(cells.facing(begin), cells.closest) ** 2 / (2 * cells.radii[0])
    beside = np.maximum(0.0, np.maximum(start - focus, focus - end))
    narrow = NARROW * half_width[:, None] * np.sqrt(np.minimum(radius / cells.radius[:, None], 1.0))
    scale = np.where(radius > 0, np.hypot(narrow, beside), EVEN * (end - start))
    first, last = np.arcsinh((start - focus) / scale), np.arcsinh((end - focus) / scale)
    edges = focus + scale * np.sinh(first + (last - first) * np.linspace(0, 1, FINE + 1))
    places = np.empty((start.size, 2 * FINE + 1))
    places[:, ::2], places[:, 1::2] = edges, (edges[:, 1:] + edges[:, :-1]) / 2
    return places, np.diff(edges)


def mates_edge(cells: ContactSlices) -> tuple[np.ndarray, np.ndarray]:
    """(n, 1) roll lengths of the mate at which its tip edge begins, and radii to which it is rounded, 0: sharp [m]."""
    pair = cells.meeting.pair
    pinion, wheel = (rounding(gear.drive_flank, gear.face) for gear in (pair.pinion, pair.wheel))
    begin, radius = (np.where(cells.own_is_pinion, *ends)[:, None] for ends in zip(wheel, pinion, strict=True))
    return begin, radius


def at_tip_edge(cells: ContactSlices, force: np.ndarray) -> np.ndarray:
    """(n,) whether the contact of cells under forces (n,) [N], as wide as Hertz says, reaches the mate's tip edge."""
    begin, _ = mates_edge(cells)
    reach = cells.by_gear(cells.touching)[1, :, 0] + cells.half_width(force / (cells.high - cells.low))
    return (force > 0) & (reach >= begin[:, 0] ** 2 / (2 * cells.radii[1][:, 0]))


def means(values: np.ndarray) -> np.ndarray:
    """(n, m) means over strips of values (n, 2 m + 1) at their edges and middles (Simpson)."""
    return (values[:, :-1:2] + 4 * values[:, 1::2] + values[:, 2::2]) / 6
