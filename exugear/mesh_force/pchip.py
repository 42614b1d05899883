"""Cubic Hermite polynomials, monotone piecewise cubic curves (Fritsch & Butland 1984), and periodic ones over phase.

The curves equal those of scipy's PchipInterpolator, which takes points x that are the same for all curves, and builds
an object for each where they are not: 110 us for a curve of 200 points, against 9 us for one of many here. A map with
two axes of five offsets has 12,800 curves.
"""

from collections.abc import Iterable

import numpy as np
import scipy

from fem.ste.ste_map import periodic_spline
from fem.support.numba_cache import fused

#: Share of the range of a quantity by which a spline may overshoot the values beside it; beyond, they jump.
OVERSHOOT = 0.01


@fused
def hermite_weights(t):
    """Weights of y_0, m_0, y_1, m_1 in the cubic at t through y_0, y_1 with slopes m_0, m_1 at t = 0, 1."""
    s = 1.0 - t
    return s * s * (1.0 + 2.0 * t), s * s * t, t * t * (3.0 - 2.0 * t), -t * t * s


@fused
def hermite_slope_weights(t):
    """Derivatives by t of `hermite_weights`."""
    s = 1.0 - t
    return -6.0 * s * t, s * (1.0 - 3.0 * t), 6.0 * s * t, t * (3.0 * t - 2.0)


@fused
def hermite_bend_weights(t):
    """Second derivatives by t of `hermite_weights`."""
    return 12.0 * t - 6.0, 6.0 * t - 4.0, 6.0 - 12.0 * t, 6.0 * t - 2.0


@fused
def weighted(weights, y_0, m_0, y_1, m_1):
    """The cubic of these weights (4), or its derivative."""
    return weights[0] * y_0 + weights[1] * m_0 + weights[2] * y_1 + weights[3] * m_1


@fused
def hermite(t, y_0, m_0, y_1, m_1):
    """Cubic through y_0, y_1 with slopes m_0, m_1 at t = 0, 1."""
    return weighted(hermite_weights(t), y_0, m_0, y_1, m_1)


@fused
def hermite_slope(t, y_0, m_0, y_1, m_1):
    """Derivative by t of `hermite`."""
    return weighted(hermite_slope_weights(t), y_0, m_0, y_1, m_1)


def monotone_cubics(x: np.ndarray, y: np.ndarray, first: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes (k, m) at increasing at (m,) of monotone curves through rows of x, y (k, n), which increase.

    first   (k,) column in which each curve begins
    """
    begin, rows = first[:, None], np.arange(first.size)[:, None]
    x = np.where(np.arange(x.shape[1]) < begin, x[rows, begin], x)
    d = _monotone_slopes(x, y, first)
    i = np.maximum(np.array([points.searchsorted(at) for points in x[:, 1:-1]]), begin) + rows * x.shape[1]
    start, step = x.take(i), x.take(i + 1)
    step -= start
    ends = y.take(i), step * d.take(i), y.take(i + 1), step * d.take(i + 1)
    t = (at - start) / step
    values, by_t = (weighted.py_func(weights.py_func(t), *ends) for weights in (hermite_weights, hermite_slope_weights))
    return values, by_t / step


def _monotone_slopes(x: np.ndarray, y: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Slopes (k, n) of the monotone curves at their points."""
    h, d, rows, last = np.diff(x), np.zeros(x.shape), np.arange(first.size), x.shape[1] - 2
    with np.errstate(divide="ignore", invalid="ignore"):
        m = np.diff(y) / h
        w_1, w_2 = 2 * h[:, 1:] + h[:, :-1], h[:, 1:] + 2 * h[:, :-1]
        mean = (w_1 + w_2) / (w_1 / m[:, :-1] + w_2 / m[:, 1:])
        np.copyto(d[:, 1:-1], mean, where=m[:, :-1] * m[:, 1:] > 0)
    second, last_but_one = np.minimum(first + 1, last), np.maximum(first, last - 1)
    d[rows, first] = _end_slopes(h[rows, first], h[rows, second], m[rows, first], m[rows, second])
    d[:, -1] = _end_slopes(h[:, -1], h[rows, last_but_one], m[:, -1], m[rows, last_but_one])
    return d


def _end_slopes(h_0: np.ndarray, h_1: np.ndarray, m_0: np.ndarray, m_1: np.ndarray) -> np.ndarray:
    """Slopes at ends of curves from the two nearest intervals h and secants m, limited to keep the curves monotone."""
    slope = ((2 * h_0 + h_1) * m_0 - h_0 * m_1) / (h_0 + h_1)
    limited = np.where((m_0 * m_1 <= 0) & (np.abs(slope) > 3 * np.abs(m_0)), 3 * m_0, slope)
    return np.where(slope * m_0 <= 0, 0, limited)


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
