"""Weights of the values of an offset's axis: polynomials through up to four of them.

Over the misalignment the polynomials have a corner at 0, where the first contact moves from one end of the face to the
other.
"""

from typing import NamedTuple

import numpy as np
from numba import carray

from exugear.force_table.kernel_records import doubles_at, start_of
from fem.support.numba_cache import compiled, kept

BEYOND = 1e-9


class Stencil(NamedTuple):
    """Number of the first of the values of an offset that take part, and the weights of up to four of them."""

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
    cell, least, most = 0, 0, axis.size - 1
    for k in range(1, axis.size - 1):
        if axis[k] <= x:
            cell = k
        if offset == 1 and axis[k] == 0.0:
            least, most = (k, most) if x >= 0.0 else (least, k)
    first = max(least, min(cell - 1, most - 3))
    return Stencil(first, lagrange(axis, first, min(most - first, 3) + 1, x))


@compiled
def lagrange(axis, first, count, x):
    """Weights (4) of the polynomial through count values of an axis, at x."""
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
    taking_part, weights = stencil(table, offset, x), np.zeros(table.offset_counts[offset])
    for k in range(min(4, weights.size - taking_part.first)):
        weights[taking_part.first + k] = taking_part.weights[k]
    return weights
