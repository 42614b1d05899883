"""Cubic Hermite polynomials, monotone piecewise cubic curves (Fritsch & Butland 1984), and periodic ones over phase.

The curves equal those of scipy's PchipInterpolator, which builds an object for each: 110 us for a curve of 200 points,
against 1.8 us by these kernels. A map with two axes of five offsets has 12,800 curves.
"""

from collections.abc import Iterable

import numpy as np
import scipy

from fem.ste.ste_map import periodic_spline
from fem.support.numba_cache import compiled, kept

#: Share of the range of a quantity by which a spline may overshoot the values beside it; beyond, they jump.
OVERSHOOT = 0.01


@compiled
def hermite_weights(t):
    """Weights of y_0, m_0, y_1, m_1 in the cubic at t through y_0, y_1 with slopes m_0, m_1 at t = 0, 1."""
    s = 1.0 - t
    return s * s * (1.0 + 2.0 * t), s * s * t, t * t * (3.0 - 2.0 * t), -t * t * s


@compiled
def hermite_slope_weights(t):
    """Derivatives by t of `hermite_weights`."""
    s = 1.0 - t
    return -6.0 * s * t, s * (1.0 - 3.0 * t), 6.0 * s * t, t * (3.0 * t - 2.0)


@compiled
def hermite_bend_weights(t):
    """Second derivatives by t of `hermite_weights`."""
    return 12.0 * t - 6.0, 6.0 * t - 4.0, 6.0 - 12.0 * t, 6.0 * t - 2.0


@compiled
def weighted(weights, y_0, m_0, y_1, m_1):
    """The cubic of these weights (4), or its derivative."""
    return weights[0] * y_0 + weights[1] * m_0 + weights[2] * y_1 + weights[3] * m_1


@compiled
def hermite(t, y_0, m_0, y_1, m_1):
    """Cubic through y_0, y_1 with slopes m_0, m_1 at t = 0, 1."""
    return weighted(hermite_weights(t), y_0, m_0, y_1, m_1)


@compiled
def hermite_slope(t, y_0, m_0, y_1, m_1):
    """Derivative by t of `hermite`."""
    return weighted(hermite_slope_weights(t), y_0, m_0, y_1, m_1)


@compiled
def end_slope(h_0, h_1, m_0, m_1):
    """Slope at an end of the curve from the two nearest intervals h and secants m, limited to keep it monotone."""
    slope = ((2.0 * h_0 + h_1) * m_0 - h_0 * m_1) / (h_0 + h_1)
    if slope * m_0 <= 0.0:
        return 0.0
    return 3.0 * m_0 if m_0 * m_1 <= 0.0 and abs(slope) > 3.0 * abs(m_0) else slope


@compiled
def monotone_slopes(x, y):
    """Slopes (n,) of the monotone curve at the points x, y (n,)."""
    n, d, h, m = x.size, np.zeros(x.size), np.empty(x.size - 1), np.empty(x.size - 1)
    for k in range(n - 1):
        h[k] = x[k + 1] - x[k]
        m[k] = (y[k + 1] - y[k]) / h[k]
    if n == 2:
        d[0] = d[1] = m[0]
        return d
    for k in range(1, n - 1):
        if m[k - 1] * m[k] > 0.0:
            w_1, w_2 = 2.0 * h[k] + h[k - 1], h[k] + 2.0 * h[k - 1]
            d[k] = (w_1 + w_2) / (w_1 / m[k - 1] + w_2 / m[k])
    d[0] = end_slope(h[0], h[1], m[0], m[1])
    d[-1] = end_slope(h[-1], h[-2], m[-1], m[-2])
    return d


@compiled
def write_monotone_cubic(x, y, at, values, slopes):
    """Write values and slopes (m,) of a monotone curve through x, y (n,) at increasing at (m,) within increasing x."""
    d, i = monotone_slopes(x, y), 0
    for j in range(at.size):
        while i < x.size - 2 and x[i + 1] < at[j]:
            i += 1
        h = x[i + 1] - x[i]
        t = (at[j] - x[i]) / h
        values[j] = hermite(t, y[i], h * d[i], y[i + 1], h * d[i + 1])
        slopes[j] = hermite_slope(t, y[i], h * d[i], y[i + 1], h * d[i + 1]) / h


@kept
def monotone_cubics(x, y, first, at):
    """Values and slopes (k, m) at increasing at (m,) of monotone curves through rows of x, y (k, n), which increase.

    first   (k,) column in which each curve begins
    """
    values, slopes = np.empty((first.size, at.size)), np.empty((first.size, at.size))
    for i in range(first.size):
        write_monotone_cubic(x[i, first[i] :], y[i, first[i] :], at, values[i], slopes[i])
    return values, slopes


def periodic_cubics(
    phase: np.ndarray, curves: Iterable[np.ndarray], uniform: np.ndarray, pitches: int = 1
) -> list[np.ndarray]:
    """Values and slopes per step (2, n_uniform, ...) of periodic curves (n_phase, ...) at uniform phases.

    Cubic splines, twice continuously differentiable, where none overshoots; else monotone curves, which are so once.
    """
    curves = [np.asarray(values) for values in curves]
    ends = np.cumsum([values[0].size for values in curves])[:-1]
    columns = np.concatenate([values.reshape(phase.size, -1) for values in curves], axis=1)
    curve = periodic_spline(phase, columns, pitches)
    at_middles = curve((phase + np.append(phase[1:], phase[0] + pitches)) / 2)
    if any(map(_overshoots, np.split(columns, ends, axis=1), np.split(at_middles, ends, axis=1))):
        return [_monotone(phase, values, uniform, pitches) for values in curves]
    same = np.array_equal(phase, uniform)
    values, slopes = (columns, curve.c[2]) if same else (curve(uniform), curve(uniform, 1))
    splines = np.split(np.array([values, slopes / (uniform.size / pitches)]), ends, axis=2)
    return [spline.reshape(2, uniform.size, *x.shape[1:]) for spline, x in zip(splines, curves, strict=True)]


def _monotone(phase: np.ndarray, values: np.ndarray, uniform: np.ndarray, pitches: int) -> np.ndarray:
    """Values and slopes (2, n_uniform, ...) of monotone curves through those of a quantity (n_phase, ...)."""
    wrapped = np.r_[phase[-2:] - pitches, phase, phase[:2] + pitches]
    curve = scipy.interpolate.PchipInterpolator(wrapped, np.concatenate([values[-2:], values, values[:2]]))
    return np.array([curve(uniform), curve(uniform, 1) * pitches / uniform.size])


def _overshoots(values: np.ndarray, middle: np.ndarray) -> bool:
    """Whether a quantity leaves the range of two neighbouring values in the middle between them."""
    following = np.roll(values, -1, axis=0)
    beyond = np.maximum(np.minimum(values, following) - middle, middle - np.maximum(values, following))
    return bool(beyond.max() > OVERSHOOT * np.ptp(values, axis=0).max() + 1e-12 * np.abs(values).max())
