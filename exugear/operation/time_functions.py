"""Speeds over time: lines and cubic splines, with exact integrals.

A speed is a spline with a continuous slope, as its acceleration acts on the train; a torque, which may jump, consists
of independent pieces (`piecewise_cubics.tabulated`). Both are a `PiecewiseCubic`.
"""

from collections.abc import Callable
from math import ceil, factorial
from typing import Any

import numpy as np
import scipy

from exugear.operation.piecewise_cubics import PiecewiseCubic, golden_fractions, of_spline, ramp, sampled
from fem.support.validation import finite, increasing, numbers, require, require_finite

#: Speed or load as users pass it: a constant, (from, to), or a function of time [s].
TimeFunction = float | tuple[float, float] | Callable[[float], float]
#: Least and largest number of intervals of a spline through a function of time.
COARSEST, FINEST = 512, 2**20
#: Time in which the function is checked once [s], and largest number of checks.
CHECK_INTERVAL, MOST_CHECKS = 1e-3, 2**17


def curve_through_function(function: Callable[[float], float], duration: float) -> PiecewiseCubic:
    """Cubic spline whose intervals are halved until it is within 1e-6 of the function, relative to the largest value.

    It is compared with the function at the new knots, and once in each `CHECK_INTERVAL` at an irregular time, as a
    vibration may vanish at all times that are evenly spaced.
    """
    knots, times = np.linspace(0, duration, COARSEST + 1), _irregular(duration)
    values, checks, error = sampled("speed(t)", function, knots), sampled("speed(t)", function, times), np.inf
    while error > 1e-6 and knots.size <= FINEST:
        coarse, middles = scipy.interpolate.CubicSpline(knots, values), (knots[:-1] + knots[1:]) / 2
        at_middles = sampled("speed(t)", function, middles)
        missed = max(np.abs(coarse(middles) - at_middles).max(), np.abs(coarse(times) - checks).max())
        knots, values = _alternating(knots, middles), _alternating(values, at_middles)
        error = missed / max(np.abs(values).max(), np.abs(checks).max(), 1e-9)
    rough = f"speed(t) is too rough: {FINEST} samples of {duration:g} s leave {error:.1%} of its largest value"
    require(error < 1e-3, f"{rough}; let it be continuous, round its corners, or pass arrays (t, speed)")
    return of_spline(scipy.interpolate.CubicSpline(knots, values))


def curve_through_points(points: np.ndarray, duration: float) -> PiecewiseCubic:
    """Monotone cubic (PCHIP) through points (2, n): times [s] and speeds [rad/s].

    ValueError unless the times reach from 0, or before, to the duration [s], or beyond.
    """
    t, speed = points
    check_covered("speed", t, duration)
    return of_spline(_from_zero(scipy.interpolate.PchipInterpolator(t, speed)))


def check_covered(name: str, t: np.ndarray, duration: float) -> None:
    """ValueError unless the times of a function reach from 0, or before, to the duration [s], or beyond."""
    covered = f"{name}: t must reach from 0 to {duration:g} s, got {t[0]:g} to {t[-1]:g} s; extend the arrays"
    require(t[0] <= 0 and t[-1] >= duration, covered)


def _from_zero(cubic: Any) -> Any:
    """The pieces of a cubic (`scipy.interpolate.PPoly`) from t = 0 on."""
    following = np.searchsorted(cubic.x, 0.0, side="right")
    first = [cubic(0.0, n) / factorial(n) for n in (3, 2, 1, 0)]
    pieces = np.column_stack([first, cubic.c[:, following:]])
    return scipy.interpolate.PPoly(pieces, np.r_[0.0, cubic.x[following:]])


def speed_function(value, duration: float) -> PiecewiseCubic:
    """The speed over a duration [s] from a number, (from, to), a function of time, or arrays (t, speed)."""
    if isinstance(value, PiecewiseCubic):
        return value
    if callable(value):
        return curve_through_function(value, duration)
    if np.ndim(value) == 2:
        return curve_through_points(numbers("speed", value), duration)
    return line("speed", value, duration)


def _alternating(at_knots: np.ndarray, at_middles: np.ndarray) -> np.ndarray:
    """(2 n + 1,) of which every second is one of n + 1 at knots, and those between are of n in the middles."""
    both = np.empty(at_knots.size + at_middles.size)
    both[::2], both[1::2] = at_knots, at_middles
    return both


def _irregular(duration: float) -> np.ndarray:
    """A time in each of even intervals of the duration [s], at fractions that do not repeat."""
    n = min(max(ceil(duration / CHECK_INTERVAL), COARSEST), MOST_CHECKS)
    return duration / n * (np.arange(n) + golden_fractions(n))


def line(name: str, value, duration: float) -> PiecewiseCubic:
    """Line over a duration [s] from a number or (from, to); ValueError unless finite."""
    ends = np.ravel(value).astype(float)
    require(ends.size in (1, 2), f"{name} must be a number, (from, to) or a function of time, got {value}")
    require_finite(name, ends)
    return ramp(float(ends[0]), float(ends[-1]), duration)


def check_time_function(name: str, value) -> None:
    """ValueError unless the value is a number, (from, to), a function of time, or arrays (t, values)."""
    if callable(value):
        return
    kinds = f"{name} must be a number, (from, to), a function of time or arrays (t, values)"
    try:
        values = numbers(name, value)
    except ValueError as error:
        raise ValueError(f"{kinds}: {error}") from None
    require(values.shape in ((), (2,)) or (values.ndim == 2 and len(values) == 2), f"{kinds}, got {value}")
    require_finite(name, values)
    if values.ndim == 2:
        increasing(f"the times of {name}", values[0], least=2)
    elif values.ndim == 0:
        finite(name, value)
