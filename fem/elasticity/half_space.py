"""Half-space under forces along a line, in closed form, and under the hat functions that make up flank loads.

A force on a half-space moves a point at a distance by the force times (1 - nu^2) / (pi E) over the distance (Johnson,
Contact Mechanics, 3.2). For forces along a line this is the displacement of a half-plane that is clamped at a depth,
under each length of the line, plus a displacement along the line that depends on the distance alone where this is
larger than the depth: the sum does not depend on the depth. The end faces are taken as planes of symmetry.
"""

from math import asinh, cos, log, sqrt

import numpy as np
from numba import types

from fem.elasticity.face_symmetry import Face
from fem.elasticity.hat_functions import hats, overlap
from fem.elasticity.section_mesh import divided
from fem.gear.gear import Gear
from fem.pair.hertz import flattening, log_mean
from fem.support.numba_cache import kept_unchecked, unchecked
from fem.support.on_demand import on_demand

#: Depth at which half-planes under hats are clamped, over the least distance of tops across the width: so small that
#: the sum of half-plane and line does not depend on it.
DEPTH = 0.1
#: Strips of constant load in each interval between the tops of hats.
PARTS_PER_INTERVAL = 12


def along_line(edges: np.ndarray, end: float, depth: float, face: Face) -> np.ndarray:
    """(n, n) displacement of segments of a line beside half-planes clamped at depth, per force and flattening [1/m].

    edges       (n + 1,) ends of the segments from one to the next [m]
    end         distance from mid-plane to the end faces [m]
    """
    return between_segments(np.ascontiguousarray(edges), float(end), float(depth), len(face.images(edges)) > 1)


@kept_unchecked
def between_segments(edges, end, depth, mirrored):
    """`along_line`, of a face that is mirrored about mid-plane or not."""
    n, total = edges.size - 1, np.zeros((edges.size - 1, edges.size - 1))
    integral = np.empty((n + 1, n + 1))
    for image in range(6 if mirrored else 3):
        sign, shift = 1 - 2 * ((image % 3 > 0) != (image >= 3)), (0.0, 2 * end, -2 * end)[image % 3]
        for i in range(n + 1):
            for j in range(n + 1):
                integral[i, j] = _second_integral((edges[i] - (shift + sign * edges[j])) / depth)
        for i in range(n):
            for j in range(n):
                low, high = integral[i, j + 1] - integral[i, j], integral[i + 1, j + 1] - integral[i + 1, j]
                total[i, j] += abs(high - low)
    for i in range(n):
        for j in range(n):
            total[i, j] *= depth / 2 / ((edges[i + 1] - edges[i]) * (edges[j + 1] - edges[j]))
    return total


#: `between_segments` where a kernel calls it: the code that Python calls.
between_in_kernels = on_demand(types.float64[:, ::1], types.float64[::1], types.float64, types.float64, types.boolean)(
    between_segments
)


@unchecked
def _second_integral(x):
    """Second antiderivative of 1 / sqrt(1 + x^2)."""
    return x * asinh(x) - sqrt(1 + x * x)


def half_plane(gear: Gear, arcs: np.ndarray, depth: float) -> np.ndarray:
    """(n_hat, n_hat) mean displacement over hats per line load on hats of a half-plane clamped at depth [m^2/N]."""
    strips = divided(arcs, PARTS_PER_INTERVAL)
    centres, widths = (strips[1:] + strips[:-1]) / 2, np.diff(strips)
    share = shares(arcs, strips)
    mean = log_mean(centres[:, None] - centres, widths[:, None], widths) + log(depth)
    return flattening(gear.material) * share @ mean @ share.T


def half_space(gear: Gear, arcs: np.ndarray, axial: np.ndarray, face: Face) -> np.ndarray:
    """(n_axial, n_hat, n_axial, n_hat) mean displacement over hats per force on hats of a half-space [m/N]."""
    inclined, depth = cos(gear.beta_b), DEPTH * np.diff(axial).min()
    edges = divided(axial, PARTS_PER_INTERVAL)
    share = shares(axial, edges)
    between_segments = along_line(edges / inclined, gear.b / 2 / inclined, depth, face)
    beside = flattening(gear.material) * share @ between_segments @ share.T
    under = inclined * np.einsum("yz,hk->yhzk", overlap(axial), half_plane(gear, arcs, depth))
    return under + beside[:, None, :, None]


def shares(tops: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """(n_hat, n) shares of a unit force, spread as a hat, that act between edges (n + 1,)."""
    share = hats(tops, (edges[1:] + edges[:-1]) / 2) * np.diff(edges)
    return share / share.sum(axis=1, keepdims=True)
