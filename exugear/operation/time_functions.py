"""Speeds over time: lines and curves with exact integrals."""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from fem.support.validation import finite, increasing, number, numbers, require

#: Speed or load as users pass it: a constant, (from, to), or a function of time [s].
TimeFunction = float | tuple[float, float] | Callable[[float], float]
#: Least and largest number of intervals of a spline through a function of time.
COARSEST, FINEST = 512, 2**20


class Line:
    """The function a + b t and its integral from 0, of numbers, arrays and Exudyn's symbols."""

    def __init__(self, a: float, b: float):
        self.a, self.b = a, b
        self.constant = b == 0

    def __call__(self, t):
        return self.a + self.b * t

    def integral(self, t):
        return (self.a + 0.5 * self.b * t) * t

    def slope(self, t) -> float:
        return self.b

    @property
    def angle_pieces(self) -> tuple[np.ndarray, np.ndarray]:
        """Knots (n + 1,) and coefficients (n, 5) of the integral, as `exugear.kernels.imposed_motion` reads them."""
        return np.array([0.0, 1.0]), np.array([[0.0, self.a, 0.5 * self.b, 0.0, 0.0]])


class Curve:
    """Piecewise cubic function of time (`scipy.interpolate.PPoly`, from t = 0 on) and its integral from 0."""

    def __init__(self, spline: Any):
        self._spline = spline
        self._knots = spline.x.tolist()
        self._interval = (spline.x[-1] - spline.x[0]) / (spline.x.size - 1)
        self._uniform = bool(np.ptp(np.diff(spline.x)) < 1e-9 * self._interval)
        self._coefficients = spline.c.T.tolist()
        self._integral_coefficients = spline.antiderivative().c.T.tolist()
        self.constant = np.ptp(spline.c[-1]) == 0

    def __call__(self, t):
        return self._spline(t) if isinstance(t, np.ndarray) else self._value(self._coefficients, t)

    def integral(self, t):
        return self._value(self._integral_coefficients, t)

    def slope(self, t):
        return self._spline(t, 1)

    @property
    def angle_pieces(self) -> tuple[np.ndarray, np.ndarray]:
        """Knots (n + 1,) and coefficients (n, 5) of the integral, as `exugear.kernels.imposed_motion` reads them."""
        return np.array(self._knots), np.array(self._integral_coefficients)[:, ::-1]

    def _value(self, coefficients: list[list[float]], t: float) -> float:
        """Polynomial of the interval in which t lies, by Horner's rule."""
        i = int(t / self._interval) if self._uniform else int(np.searchsorted(self._knots, t, "right")) - 1
        i = min(max(i, 0), len(coefficients) - 1)
        x, value = t - self._knots[i], 0.0
        for c in coefficients[i]:
            value = value * x + c
        return value


def curve_through_function(function: Callable[[float], float], duration: float) -> Curve:
    """Cubic spline whose intervals are halved until it misses the new knots by less than 1e-6 of the largest value."""
    n, values = COARSEST, _sampled(function, duration, COARSEST)
    error = np.inf
    while error > 1e-6 and n < FINEST:
        coarse = scipy.interpolate.CubicSpline(np.linspace(0, duration, n + 1), values)
        n *= 2
        values = _sampled(function, duration, n)
        error = np.abs(coarse(np.linspace(0, duration, n + 1)) - values).max() / max(np.abs(values).max(), 1e-9)
    require(error < 1e-3, "speed(t) is too rough to be integrated; make it continuous")
    return Curve(scipy.interpolate.CubicSpline(np.linspace(0, duration, n + 1), values))


def curve_through_points(points: np.ndarray, duration: float) -> Curve:
    """Monotone cubic (PCHIP) through points (2, n): times from 0 to at least the duration [s], speeds [rad/s]."""
    t, speed = points
    covered = f"t must begin at 0 and reach the duration of {duration:g} s, got {t[0]:g} to {t[-1]:g} s"
    require(t[0] == 0 and t[-1] >= duration, covered)
    return Curve(scipy.interpolate.PchipInterpolator(t, speed))


def speed_function(value, duration: float) -> Line | Curve:
    """The speed over a duration [s] from a number, (from, to), a function of time, or arrays (t, speed)."""
    if isinstance(value, Line | Curve):
        return value
    if callable(value):
        return curve_through_function(value, duration)
    if np.ndim(value) == 2:
        return curve_through_points(numbers("speed", value), duration)
    return line("speed", value, duration)


def _sampled(function: Callable[[float], float], duration: float, n: int) -> np.ndarray:
    """(n + 1,) values of a speed over its duration [s]; ValueError where a value is no finite number."""
    values = np.array([number("speed(t)", function(t)) for t in np.linspace(0, duration, n + 1).tolist()])
    require(bool(np.isfinite(values).all()), f"speed(t) must be finite for 0 <= t <= {duration:g} s")
    return values


def line(name: str, value, duration: float) -> Line:
    """Line from a number or (from, to); ValueError unless finite."""
    ends = np.ravel(value).astype(float)
    require(ends.size in (1, 2), f"{name} must be a number, (from, to) or a function of time, got {value}")
    require(bool(np.isfinite(ends).all()), f"{name} must be finite, got {value}")
    return Line(float(ends[0]), float(ends[-1] - ends[0]) / duration)


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
    require(bool(np.isfinite(values).all()), f"{name} must be finite, got {value}")
    if values.ndim == 2:
        increasing(f"the times of {name}", values[0], least=2)
    elif values.ndim == 0:
        finite(name, value)
