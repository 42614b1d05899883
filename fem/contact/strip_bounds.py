"""Strips along the profile on which the contact pressure is constant: equal ones, finer ones at a rounded tip edge."""

from dataclasses import dataclass
from math import cos

import numpy as np

from fem.contact.flank_gap import ContactSlices
from fem.microgeometry.flank import rounding
from fem.pair.hertz import log_mean

#: Strips of a slice: the largest pressure is within 1 % of Hertz's.
STRIPS = 21
#: Strips reach this many Hertzian half-widths to either side.
WINDOW = 1.5
#: Strips of a slice where an edge is rounded, and width of the narrowest over Hertz's half-width on the rounding: the
#: largest pressure is within 1 % of that on twice as many.
FINE, NARROW = 41, 0.35
#: Slices without a rounding have strips that grow by less than the inverse of this over their window.
EVEN = 1e6
#: Strips of a slice between which the smooth compliance is interpolated by parabolas.
NODES = 3


def nodes_of(strips: int) -> list[int]:
    """Numbers of the strips between which the smooth compliance is quadratic."""
    return [0, strips // 2, strips - 1]


def shapes_of(middles: np.ndarray) -> np.ndarray:
    """(..., NODES, m) quadratic shape functions at the middles of strips (..., m)."""
    powers = middles[..., None, :] ** np.arange(NODES)[:, None]
    return np.linalg.solve(powers[..., nodes_of(middles.shape[-1])], powers)


#: (NODES, STRIPS) shape functions at equal strips
SHAPES = shapes_of(np.arange(STRIPS))
#: (STRIPS, STRIPS) mean of -ln of the distance between two of equal strips of unit width
BETWEEN_STRIPS = log_mean(np.subtract.outer(np.arange(STRIPS), np.arange(STRIPS)), 1.0, 1.0)


@dataclass(frozen=True)
class Strips:
    """Strips along the profile in every slice.

    arcs        (2, n, m) arc lengths of their middles on pinion and wheel [m]
    width       (n, m) their widths [m]
    gap         (n, m) mean normal gap, aligned [m]
    approach    (n, m) normal approach per transmission error
    tilts       (2, n, m) angles of the direction of contact from the normals of pinion and wheel [rad]
    open        (2, n) whether the flank goes on beyond the first, and the last strip
    expected    (n, m) pressure by Hertz's ellipse, up to a factor
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
        """Whether the strips of each slice are equal."""
        return bool((self.width == self.width[:, :1]).all())

    @property
    def reach(self) -> float:
        """Width of all strips of the widest slice [m]."""
        return STRIPS * self.width.max() if self.equal else self.width.sum(axis=1).max()

    @property
    def middles(self) -> np.ndarray:
        """(n, m) middles of the strips from the first edge [m]."""
        return np.cumsum(self.width, axis=1) - self.width / 2

    @property
    def nodes(self) -> list[int]:
        """Numbers of the strips at the nodes of the smooth compliance."""
        return nodes_of(self.width.shape[1])

    @property
    def shapes(self) -> np.ndarray:
        """(NODES, m) shape functions of `shapes_of`, or (n, NODES, m) of each slice."""
        return SHAPES if self.equal else shapes_of(self.middles / self.width.sum(axis=1, keepdims=True))

    def between(self, depth: float) -> np.ndarray:
        """(n, m, m) displacement of half-planes clamped at a depth [m], per line load and flattening."""
        if self.equal:
            return BETWEEN_STRIPS - np.log(self.width[:, :1, None] / depth)
        distance = self.middles[:, :, None] - self.middles[:, None]
        return log_mean(distance, self.width[:, :, None], self.width[:, None]) + np.log(depth)


def strips_of(slices: ContactSlices, half_width: np.ndarray) -> Strips:
    """Strips as far as WINDOW times half_width (n,) [m] on either side of where the flanks are closest."""
    r_host, reach = slices.radii[0], WINDOW * half_width
    low, high, centre = (roll**2 / (2 * r_host) for roll in (*slices.limits, slices.closest))
    start, end = np.maximum(low, centre - reach[:, None]), np.minimum(high, centre + reach[:, None])
    arcs, width = edges_and_middles(slices, start, end, half_width)
    roll = np.sqrt(2 * r_host * arcs)
    gap, foot = slices.gap_at(roll)
    gap, slopes, roll, foot = means(gap), slices.slopes(roll[:, ::2]), roll[:, 1::2], foot[:, 1::2]
    closing = cos(slices.position.pair.beta_b) * half_width**2 / (2 * slices.radius)
    expected = np.sqrt(np.maximum(closing[:, None] - (gap - gap.min(axis=1, keepdims=True)), 0.0))
    tilts = slices.tilts(roll, foot, slopes, expected * (width / width[:, :1]))
    approach = slices.approach(roll, foot, tilts)
    is_open = np.stack([start > low, end < high])[..., 0]
    gap = gap + approach * slices.te
    return Strips(slices.arcs(roll, foot), width, gap, approach, slices.by_gear(tilts), is_open, expected)


def edges_and_middles(slices: ContactSlices, start, end, half_width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 2 m + 1) arc lengths of edges and middles of strips from start to end (n, 1) [m], and their (n, m) widths.

    half_width  (n,) Hertz's half-widths of the contact of the involutes [m]

    Beside a rounding of the mate's edge they are narrowest where it begins, or where it is closest.
    """
    begin, radius = mates_edge(slices)
    if not radius.any():
        width = (end - start) / STRIPS
        return start + width * np.linspace(0, STRIPS, 2 * STRIPS + 1), np.broadcast_to(width, (width.size, STRIPS))
    focus = np.minimum(slices.facing(begin), slices.closest) ** 2 / (2 * slices.radii[0])
    outside = np.maximum(0.0, np.maximum(start - focus, focus - end))
    narrow = NARROW * half_width[:, None] * np.sqrt(np.minimum(radius / slices.radius[:, None], 1.0))
    scale = np.where(radius > 0, np.hypot(narrow, outside), EVEN * (end - start))
    first, last = np.arcsinh((start - focus) / scale), np.arcsinh((end - focus) / scale)
    edges = focus + scale * np.sinh(first + (last - first) * np.linspace(0, 1, FINE + 1))
    arcs = np.empty((start.size, 2 * FINE + 1))
    arcs[:, ::2], arcs[:, 1::2] = edges, (edges[:, 1:] + edges[:, :-1]) / 2
    return arcs, np.diff(edges)


def mates_edge(slices: ContactSlices) -> tuple[np.ndarray, np.ndarray]:
    """(n, 1) roll lengths of the mate at which its tip edge begins, and radii to which it is rounded, 0: sharp [m]."""
    pair = slices.position.pair
    pinion, wheel = (rounding(gear.drive_flank, gear.face) for gear in (pair.pinion, pair.wheel))
    begin, radius = (np.where(slices.pinion_is_host, *ends)[:, None] for ends in zip(wheel, pinion, strict=True))
    return begin, radius


def at_tip_edge(slices: ContactSlices, force: np.ndarray) -> np.ndarray:
    """(n,) whether the contact of slices under forces (n,) [N], as wide as by Hertz, reaches the mate's tip edge."""
    begin, _ = mates_edge(slices)
    reach = slices.by_gear(slices.closest_arcs)[1, :, 0] + slices.half_width(force / slices.width)
    return (force > 0) & (reach >= begin[:, 0] ** 2 / (2 * slices.radii[1][:, 0]))


def means(values: np.ndarray) -> np.ndarray:
    """(n, m) means over strips of values (n, 2 m + 1) at their edges and middles (Simpson)."""
    return (values[:, :-1:2] + 4 * values[:, 1::2] + values[:, 2::2]) / 6
