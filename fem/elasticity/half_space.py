"""Half-spaces under forces along a line, in closed form, and under the hats that flank loads are sums of.

A force on a half-space moves what lies at a distance by that over (1 - nu^2) / (pi E) times its inverse (Johnson,
Contact Mechanics, 3.2). For forces along a line that is a half-plane held at some depth, under each length of the line,
and beside it a displacement which depends on places along the line only, wherever they are further apart than the
depth: the sum of both does not depend on it. End faces, where forces reach them, act like mirrors.
"""

from math import cos, log

import numpy as np

from fem.elasticity.hat_functions import hats, overlap
from fem.elasticity.hertz import flattening, log_mean
from fem.elasticity.section_mesh import divided
from fem.gear.gear import Gear

#: Depth at which half-planes under hats are held, over the least distance of the hats across the width.
DEPTH = 0.1
PARTS_PER_INTERVAL = 12


def along_line(edges: np.ndarray, end: float, depth: float, *, mirrored: bool) -> np.ndarray:
    """(n, n) displacement of segments of a line beside half-planes held at depth, per force and flattening [1/m].

    edges       (n + 1,) ends of the segments from one to the next [m]
    end         distance from mid-plane to the end faces [m]
    mirrored    whether the same forces act on the other half of the line
    """
    images = [edges, 2 * end - edges, -2 * end - edges]
    if mirrored:
        images += [-edges, 2 * end + edges, edges - 2 * end]
    distances = (edges[:, None] - np.array(images)[:, None]) / depth
    between = np.abs(np.diff(np.diff(_second_integral(distances), axis=1), axis=2)).sum(axis=0)
    return between * depth / 2 / np.outer(np.diff(edges), np.diff(edges))


def _second_integral(x: np.ndarray) -> np.ndarray:
    """Second antiderivative of 1 / sqrt(1 + x^2)."""
    return x * np.arcsinh(x) - np.sqrt(1 + x**2)


def half_plane(gear: Gear, arcs: np.ndarray, depth: float) -> np.ndarray:
    """(n_hat, n_hat) mean displacement over hats per line load on hats of a half-plane held at depth [m^2/N]."""
    strips = divided(arcs, PARTS_PER_INTERVAL)
    centres, widths = (strips[1:] + strips[:-1]) / 2, np.diff(strips)
    share = shares(arcs, strips)
    mean = log_mean(centres[:, None] - centres, widths[:, None], widths) + log(depth)
    return flattening(gear.material) * share @ mean @ share.T


def half_space(gear: Gear, arcs: np.ndarray, axial: np.ndarray) -> np.ndarray:
    """(n_axial, n_hat, n_axial, n_hat) mean displacement over hats per force on hats of a half-space [m/N]."""
    inclined, depth = cos(gear.beta_b), DEPTH * np.diff(axial).min()
    edges = divided(axial, PARTS_PER_INTERVAL)
    share = shares(axial, edges)
    far = along_line(edges / inclined, gear.b / 2 / inclined, depth, mirrored=axial[0] == 0)
    beside = flattening(gear.material) * share @ far @ share.T
    under = inclined * np.einsum("yz,hk->yhzk", overlap(axial), half_plane(gear, arcs, depth))
    return under + beside[:, None, :, None]


def shares(tops: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """(n_hat, n) shares of a unit force, spread as a hat, that act between edges (n + 1,)."""
    share = hats(tops, (edges[1:] + edges[:-1]) / 2) * np.diff(edges)
    return share / share.sum(axis=1, keepdims=True)
