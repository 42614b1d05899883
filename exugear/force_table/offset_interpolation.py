"""Weights of the values of an offset axis: Lagrange polynomials through up to four neighbouring values.

Over the misalignment the polynomials have a corner at 0, where the first contact moves from one end of the face to the
other.
"""

from typing import NamedTuple

import numpy as np
from numba import carray

from exugear.force_table.kernel_records import doubles_at, start_of
from fem.support.numba_cache import compiled, kept

#: Share of an axis, or of the largest penetration, by which rounding may exceed its end.
BEYOND = 1e-9


class Stencil(NamedTuple):
    """Index of the first offset value with a weight, and the weights of up to four values from there on."""

    first: int
    weights: tuple[float, float, float, float]


@compiled
def axis_of(table, offset):
    """Values of an offset's axis."""
    return carray(doubles_at(start_of(table) + table.axes_start[offset]), table.offset_counts[offset])


@compiled
def stencil(table, offset, x):
    """The stencil of an offset about x; ValueError(x, low, high, number of the offset) beyond its axis."""
    axis = axis_of(table, offset)
    if axis.size == 1:
        return Stencil(0, (1.0, 0.0, 0.0, 0.0))
    low, high = axis[0], axis[axis.size - 1]
    margin = BEYOND * (high - low)
    if not low - margin <= x <= high + margin:
        raise ValueError(x, low, high, offset)
    cell, lowest, highest = 0, 0, axis.size - 1
    for k in range(1, axis.size - 1):
        if axis[k] <= x:
            cell = k
        if offset == 1 and axis[k] == 0.0:
            lowest, highest = (k, highest) if x >= 0.0 else (lowest, k)
    first = max(lowest, min(cell - 1, highest - 3))
    return Stencil(first, lagrange(axis, first, min(highest - first, 3) + 1, x))


@compiled
def lagrange(axis, first, count, x):
    """Weights (4) at x of the polynomial through count values of an axis, from the first one on."""
    weights = (0.0, 0.0, 0.0, 0.0)
    for k in range(count):
        weight = 1.0
        for i in range(count):
            if i != k:
                weight *= (x - axis[first + i]) / (axis[first + k] - axis[first + i])
        weights = (
            weight if k == 0 else weights[0],
            weight if k == 1 else weights[1],
            weight if k == 2 else weights[2],
            weight if k == 3 else weights[3],
        )
    return weights


@kept
def weights_along(table, offset, x):
    """(n,) weights of the values of one offset at x."""
    first, nonzero = stencil(table, offset, x)
    weights = np.zeros(table.offset_counts[offset])
    for k in range(min(4, weights.size - first)):
        weights[first + k] = nonzero[k]
    return weights
