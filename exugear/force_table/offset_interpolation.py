"""Weights of the values of an offset axis, once continuously differentiable.

Over the centre distance and the axial offset: cubic Hermite polynomials whose slopes are those of parabolas through
three neighbouring values. Over the misalignment the map itself holds the slope of the potential, force times force
centroid: there each of two values stands for the potential of a deflection that is shifted by the centroid times a
lever, which makes the sum the cubic Hermite polynomial through values and slopes.
"""

from typing import NamedTuple

import numpy as np
from numba import carray

from exugear.force_table.kernel_records import doubles_at, start_of
from exugear.force_table.layout import SLOPE_WEIGHTS
from fem.support.numba_cache import compiled

#: Share of an axis, or of the largest penetration, by which rounding may exceed its end.
BEYOND = 1e-9
Weights = tuple[float, float, float, float]
Pair = tuple[float, float]


class Stencil(NamedTuple):
    """Index of the first offset value, and the weights of up to four values from there on, with their slopes."""

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
    return carray(doubles_at(start_of(table) + table.axes_start[offset]), table.offset_counts[offset])


@compiled
def interval(table, offset, x):
    """(lower value's index, lower value, length) of an axis; ValueError(x, low, high, offset) beyond the axis."""
    axis = axis_of(table, offset)
    low, high = axis[0], axis[axis.size - 1]
    margin = BEYOND * (high - low)
    if not low - margin <= x <= high + margin:
        raise ValueError(x, low, high, offset)
    j = 0
    while j < axis.size - 2 and axis[j + 1] <= x:
        j += 1
    return j, axis[j], axis[j + 1] - axis[j]


@compiled
def slope_weight(table, offset, j, k):
    """Weight of value k of an axis in the slope at value j."""
    count = table.offset_counts[offset]
    first = max(0, min(j - 1, count - SLOPE_WEIGHTS))
    if not 0 <= k - first < SLOPE_WEIGHTS:
        return 0.0
    slopes = carray(doubles_at(start_of(table) + table.slopes_start[offset]), (count, SLOPE_WEIGHTS))
    return slopes[j, k - first]


@compiled
def weight(table, offset, j, k, basis, length):
    """Weight of value k in a Hermite polynomial between the values j and j + 1, by its four basis functions."""
    low, low_slope, high, high_slope = basis
    end_values = (low if k == j else 0.0) + (high if k == j + 1 else 0.0)
    at_low, at_high = slope_weight(table, offset, j, k), slope_weight(table, offset, j + 1, k)
    return end_values + length * (low_slope * at_low + high_slope * at_high)


@compiled
def stencil(table, offset, x):
    """`Stencil` of centre distance or axial offset."""
    count = table.offset_counts[offset]
    if count == 1:
        return Stencil(0, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0))
    j, low, length = interval(table, offset, x)
    t, f = (x - low) / length, max(0, min(j - 1, count - 4))
    s = 1.0 - t
    basis = s * s * (1.0 + 2.0 * t), s * s * t, t * t * (3.0 - 2.0 * t), -t * t * s
    rise = 6.0 * s * t / length
    slope_basis = -rise, s * (1.0 - 3.0 * t) / length, rise, t * (3.0 * t - 2.0) / length
    return Stencil(f, weights(table, offset, j, f, basis, length), weights(table, offset, j, f, slope_basis, length))


@compiled
def weights(table, offset, j, first, basis, length):
    """`weight` of four values from the first one on."""
    return (
        weight(table, offset, j, first, basis, length),
        weight(table, offset, j, first + 1, basis, length),
        weight(table, offset, j, first + 2, basis, length),
        weight(table, offset, j, first + 3, basis, length),
    )


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
