"""Courses over time: a line or a curve, with exact integrals."""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from fem.support.validation import number, require

FINEST = 2**20


class Line:
    """a + b t, with its integral; works on numbers, arrays and Exudyn's symbols."""

    def __init__(self, a: float, b: float):
        self.a, self.b = a, b
        #: At t = 0, and whether the value never changes
        self.slope, self.steady = b, b == 0

    def __call__(self, t):
        return self.a + self.b * t

    def integral(self, t):
        return (self.a + 0.5 * self.b * t) * t


class Curve:
    """Cubic spline through a function of time, as fine as it needs, with the spline's integral; quick for numbers."""

    def __init__(self, function: Callable[[float], float], duration: float):
        spline = _spline_through(function, duration)
        self.dt, self._value = spline.x[1] - spline.x[0], spline
        self._values, self._integrals = spline.c.T.tolist(), spline.antiderivative().c.T.tolist()
        self.slope, self.steady = float(spline.c[-2, 0]), np.ptp(spline.c[-1]) == 0

    def __call__(self, t):
        return self._value(t) if isinstance(t, np.ndarray) else self._at(self._values, t)

    def integral(self, t):
        return self._at(self._integrals, t)

    def _at(self, pieces: list[list[float]], t: float) -> float:
        i = min(max(int(t / self.dt), 0), len(pieces) - 1)
        x, value = t - i * self.dt, 0.0
        for c in pieces[i]:
            value = value * x + c
        return value


def _spline_through(function: Callable[[float], float], duration: float) -> Any:
    """Knots are doubled until the spline misses the new ones by less than 1e-6 of the largest value."""
    n, values = 512, _sampled(function, duration, 512)
    missed = np.inf
    while missed > 1e-6 and n < FINEST:
        coarse = scipy.interpolate.CubicSpline(np.linspace(0, duration, n + 1), values)
        n *= 2
        values = _sampled(function, duration, n)
        missed = np.abs(coarse(np.linspace(0, duration, n + 1)) - values).max() / max(np.abs(values).max(), 1e-9)
    require(missed < 1e-3, "speed(t) is too rough to be integrated; make it continuous")
    return scipy.interpolate.CubicSpline(np.linspace(0, duration, n + 1), values)


def _sampled(function: Callable[[float], float], duration: float, n: int) -> np.ndarray:
    values = np.array([number("speed(t)", function(t)) for t in np.linspace(0, duration, n + 1).tolist()])
    require(bool(np.isfinite(values).all()), f"speed(t) must be finite for 0 <= t <= {duration:g} s")
    return values


def line(name: str, value, duration: float) -> Line:
    """Line from a number or (from, to); ValueError unless finite."""
    ends = np.ravel(value).astype(float)
    require(ends.size in (1, 2), f"{name} must be a number, (from, to) or a function of time, got {value}")
    require(bool(np.isfinite(ends).all()), f"{name} must be finite, got {value}")
    return Line(float(ends[0]), float(ends[-1] - ends[0]) / duration)
