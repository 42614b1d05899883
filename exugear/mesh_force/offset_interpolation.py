"""Weights of the values of an offset axis, once continuously differentiable.

Over the centre distance and the axial offset: cubic Hermite polynomials whose slopes are those of parabolas through
three neighbouring values. Over the misalignment the map itself holds the slope of the potential, force times force
centroid: there each of two values stands for the potential of a deflection that is shifted by the centroid times a
lever, which makes the sum the cubic Hermite polynomial through values and slopes.
"""

from typing import NamedTuple

import numpy as np

from exugear.mesh_force.kernel_records import array_behind
from exugear.mesh_force.layout import SLOPE_WEIGHTS
from fem.support.numba_cache import compiled

#: Share of an axis by which rounding may exceed its end.
BEYOND = 1e-9
#: Largest number of values in a `Stencil`.
MOST_VALUES = 4
Weights = tuple[float, float, float, float]
Pair = tuple[float, float]


class Stencil(NamedTuple):
    """Index of the first offset value, and the weights of up to MOST_VALUES values from there on, with their slopes."""

    first: int
    weights: Weights
    slopes: Weights


class TiltStencil(NamedTuple):
    """Index of the first misalignment, weights of it and of the next one, levers [rad]; slopes of weights and levers.

    The potential is that of the deflection minus lever times force centroid.
    """

    first: int
    weights: Pair
    slopes: Pair
    levers: Pair
    lever_slopes: Pair


@compiled
def axis_of(table, offset):
    """Values of an offset's axis."""
    return array_behind(table, table.axes_start[offset], table.offset_counts[offset])


@compiled
def interval(table, offset, x):
    """(lower value's index, lower value, length) of an axis; ValueError(x, low, high, offset, side) beyond the axis."""
    axis = axis_of(table, offset)
    low, high = axis[0], axis[axis.size - 1]
    margin = BEYOND * (high - low)
    if not low - margin <= x <= high + margin:
        raise ValueError(x, low, high, offset, table.side)
    j = 0
    while j < axis.size - 2 and axis[j + 1] <= x:
        j += 1
    return j, axis[j], axis[j + 1] - axis[j]


@compiled
def slope_weights_of(table, offset, j, first):
    """Weights, in the slope at value j of an axis, of four values from the first one on."""
    count = table.offset_counts[offset]
    slopes = array_behind(table, table.slopes_start[offset], (count, SLOPE_WEIGHTS))
    before, middle, after = slopes[j, 0], slopes[j, 1], slopes[j, 2]
    begins = max(0, min(j - 1, count - SLOPE_WEIGHTS))
    return (before, middle, after, 0.0) if begins == first else (0.0, before, middle, after)


@compiled
def stencil(table, offset, x):
    """`Stencil` of centre distance or axial offset."""
    count = table.offset_counts[offset]
    if count == 1:
        return Stencil(0, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0))
    j, low, length = interval(table, offset, x)
    t, first = (x - low) / length, max(0, min(j - 1, count - MOST_VALUES))
    s = 1.0 - t
    at_low, at_high = slope_weights_of(table, offset, j, first), slope_weights_of(table, offset, j + 1, first)
    basis = s * s * (1.0 + 2.0 * t), length * (s * s * t), t * t * (3.0 - 2.0 * t), -length * (t * t * s)
    rise = 6.0 * s * t / length
    slope_basis = -rise, s * (1.0 - 3.0 * t), rise, t * (3.0 * t - 2.0)
    return Stencil(first, weights(basis, j - first, at_low, at_high), weights(slope_basis, j - first, at_low, at_high))


@compiled
def weights(basis, low, at_low, at_high):
    """Weights of four values in the Hermite polynomial between the values low and low + 1, by its basis functions."""
    return (
        weight(0, basis, low, at_low[0], at_high[0]),
        weight(1, basis, low, at_low[1], at_high[1]),
        weight(2, basis, low, at_low[2], at_high[2]),
        weight(3, basis, low, at_low[3], at_high[3]),
    )


@compiled
def weight(k, basis, low, at_low, at_high):
    """Weight of value k, which has these weights in the slopes at both ends."""
    end_values = (basis[0] if k == low else 0.0) + (basis[2] if k == low + 1 else 0.0)
    return end_values + (basis[1] * at_low + basis[3] * at_high)


@compiled
def tilt_stencil(table, x):
    """`TiltStencil` of a misalignment x; a law without that axis is expanded to first order."""
    if table.offset_counts[1] == 1:
        return TiltStencil(0, (1.0, 0.0), (0.0, 0.0), (x - axis_of(table, 1)[0], 0.0), (1.0, 0.0))
    j, low, length = interval(table, 1, x)
    t = (x - low) / length
    s = 1.0 - t
    rise, a, b = 6.0 * s * t / length, 1.0 + 2.0 * t, 1.0 + 2.0 * s
    return TiltStencil(
        j, (s * s * a, t * t * b), (-rise, rise), (length * t / a, -length * s / b), (1.0 / (a * a), 1.0 / (b * b))
    )


def slope_weights(axis: np.ndarray) -> np.ndarray:
    """(n, SLOPE_WEIGHTS) weights of neighbouring values in the slopes at the values of an axis (n,).

    The slopes are those of parabolas through three values, at the ends through the outermost three.
    """
    table = np.zeros((axis.size, SLOPE_WEIGHTS))
    count = min(axis.size, SLOPE_WEIGHTS)
    for j in range(axis.size if axis.size > 1 else 0):
        first = max(0, min(j - 1, axis.size - SLOPE_WEIGHTS))
        distance = axis[first : first + count] - axis[j]
        powers = np.vander(distance, count, increasing=True).T
        table[j, :count] = np.linalg.solve(powers, np.eye(count)[1])
    return table
