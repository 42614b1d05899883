"""Line load across a slice from the overlap of its flanks: each section flattens as half-planes do by Hertz.

A section under a line load q flattens by factor q (constant - ln(q) / 2). Where the overlap across a slice falls to 0,
only a part of the slice carries load: force, moment and their derivatives are integrals over that part.
Source: Johnson, Contact Mechanics, 4.2 and 5.6 (line contact of bodies that act as half-planes).
"""

from math import exp, log, sqrt

import numpy as np

from fem.support.numba_cache import unchecked

#: Least flattening per force, over the factor of its logarithm: Hertz's formula becomes negative for slices whose
#: contact is too wide for half-planes.
LEAST = 0.1
#: Gauss points and weights over slices whose least overlap exceeds this share of the largest; over the loaded parts of
#: others they lie closer together towards the ends, where the rate of the line load falls to 0 as 1/ln does.
EVEN, EVEN_POINTS, EVEN_WEIGHTS = 0.5, *np.polynomial.legendre.leggauss(2)
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)
POINTS, WEIGHTS = _POINTS * (3 - _POINTS**2) / 2, _WEIGHTS * 1.5 * (1 - _POINTS**2)
#: Newton steps to the logarithm in Hertz's formula, and their last, relative to it.
STEPS, SHORTEST = 30, 1e-13


@unchecked
def line_load(factor, constant, overlap):
    """Line load under an overlap > 0 [m], and its derivative; both times the length of the slice [N], [N/m]."""
    least = 0.5 + LEAST
    widest = exp(2 * (constant - least))
    if overlap >= factor * widest * least:
        return widest + (overlap - factor * widest * least) / (factor * LEAST), 1 / (factor * LEAST)
    sought = constant - log(overlap / factor) / 2
    logarithm = max(sought + log(1 + abs(sought)) / 2, least)
    for _ in range(STEPS):
        change = (logarithm - log(logarithm) / 2 - sought) / (1 - 0.5 / logarithm)
        logarithm = max(logarithm - change, least)
        if abs(change) < SHORTEST * logarithm:
            break
    return overlap / factor / logarithm, 1 / (factor * (logarithm - 0.5))


@unchecked
def loaded_parts(middle, slope, bend):
    """Ends of the two parts of a slice in which the overlap middle + slope x - bend x^2 is positive; |x| <= 1."""
    if bend == 0 and slope == 0:
        return -1.0, 1.0 if middle > 0 else -1.0, 1.0, 1.0
    square = slope * slope + 4 * bend * middle
    if square <= 0:
        return -1.0, 1.0 if bend < 0 else -1.0, 1.0, 1.0
    twice = slope + (sqrt(square) if slope >= 0 else -sqrt(square))
    first, second = twice / (2 * bend), -2 * middle / twice
    low, high = max(min(first, second), -1.0), min(max(first, second), 1.0)
    if bend >= 0:
        return low, max(high, low), 1.0, 1.0
    return -1.0, max(min(low, 1.0), -1.0), min(max(high, -1.0), 1.0), 1.0


@unchecked
def slice_load(factor, constant, middle, slope, bend):
    """Force and moment over half of the width [N] of an overlap middle + slope x - bend x^2 [m], and derivatives.

    Returns force, moment, the largest line load times the length of the slice [N], and the derivatives of force by
    middle, of force by slope or moment by middle, and of moment by slope [N/m].
    """
    force, moment, largest, by_middle, mixed, by_slope = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    even = middle - abs(slope) - abs(bend) > EVEN * (middle + abs(slope) + abs(bend))
    points, weights = (EVEN_POINTS, EVEN_WEIGHTS) if even else (POINTS, WEIGHTS)
    ends = (-1.0, 1.0, 1.0, 1.0) if even else loaded_parts(middle, slope, bend)
    for part in range(2):
        low, high = (ends[0], ends[1]) if part == 0 else (ends[2], ends[3])
        if high > low:
            for k in range(points.size):
                x, weight = (low + high + (high - low) * points[k]) / 2, (high - low) / 4 * weights[k]
                overlap = middle + slope * x - bend * x * x
                if overlap > 0:
                    load, rate = line_load(factor, constant, overlap)
                    force, moment, largest = force + weight * load, moment + weight * load * x, max(largest, load)
                    by_middle, mixed = by_middle + weight * rate, mixed + weight * rate * x
                    by_slope += weight * rate * x * x
    return force, moment, largest, by_middle, mixed, by_slope
