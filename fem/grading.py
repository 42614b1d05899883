"""Places of nodes along a line: closer together beside edges, in layers that grow thicker."""

from itertools import pairwise

import numpy as np

#: Elements beside an edge are smaller by this factor, and grow by this share of their distance from it.
CLOSER, GROWTH = 4, 0.1
#: Each layer is thicker than the last by this factor.
THICKER = 1.5
SAMPLES = 100_001


def beside(edges, nodes: np.ndarray) -> np.ndarray:
    """Places spaced as nodes (n,), with edges (m,), increasing, among them and smaller elements beside each."""
    places = np.linspace(nodes[0], nodes[-1], SAMPLES)
    usual = np.interp(places, (nodes[1:] + nodes[:-1]) / 2, np.diff(nodes))
    size = usual
    for edge in edges:
        size = np.minimum(size, np.interp(edge, places, usual) / CLOSER + GROWTH * np.abs(places - edge))
    count = np.append(0.0, np.cumsum(np.diff(places) * 2 / (size[1:] + size[:-1])))
    parts = []
    for start, end in pairwise(np.interp([nodes[0], *edges, nodes[-1]], places, count)):
        stops = np.linspace(start, end, max(1, round(end - start)) + 1)
        parts.append(np.interp(stops[:-1], count, places))
    return np.append(np.concatenate(parts), nodes[-1])


def layers(first: float, thickest: float) -> np.ndarray:
    """(n,) depths from 0 to 1 of layers: about `first` at 0, growing up to about `thickest`."""
    depths = [0.0, first]
    while depths[-1] < 1:
        depths.append(depths[-1] + min(THICKER * (depths[-1] - depths[-2]), thickest))
    return np.array(depths) / depths[-1]


def along_rows(grid: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """(2, k, m) points of a grid (2, n, m) moved along its m rows to shares (k,) of their lengths."""
    found = np.empty((2, shares.size, grid.shape[2]))
    for row, points in enumerate(np.moveaxis(grid, 2, 0)):
        length = np.append(0.0, np.cumsum(np.hypot(*np.diff(points))))
        found[:, :, row] = [np.interp(shares * length[-1], length, part) for part in points]
    return found
