"""Speed and load over time: lines and curves with exact integrals, and the operating conditions of a run."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite
from typing import Any

import numpy as np
import scipy

from fem.support.validation import number, require, require_within

#: Speed or load as users pass it: a constant, (from, to), or a function of time [s].
TimeFunction = float | tuple[float, float] | Callable[[float], float]
#: Least and largest number of intervals of a spline through a function of time.
COARSEST, FINEST = 512, 2**20
#: Number of instants at which the speed of a run is evaluated for its range.
INSTANTS = 1001


class Line:
    """The function a + b t and its integral from 0, of numbers, arrays and Exudyn's symbols."""

    def __init__(self, a: float, b: float):
        self.a, self.b = a, b
        self.initial_slope, self.constant = b, b == 0

    def __call__(self, t):
        return self.a + self.b * t

    def integral(self, t):
        return (self.a + 0.5 * self.b * t) * t


class Curve:
    """Cubic spline through a function of time, refined until it reproduces the function, and its integral from 0."""

    def __init__(self, function: Callable[[float], float], duration: float):
        self._spline = _spline_through(function, duration)
        self._interval = self._spline.x[1] - self._spline.x[0]
        self._coefficients = self._spline.c.T.tolist()
        self._integral_coefficients = self._spline.antiderivative().c.T.tolist()
        self.initial_slope, self.constant = float(self._spline.c[-2, 0]), np.ptp(self._spline.c[-1]) == 0

    def __call__(self, t):
        return self._spline(t) if isinstance(t, np.ndarray) else self._value(self._coefficients, t)

    def integral(self, t):
        return self._value(self._integral_coefficients, t)

    def _value(self, coefficients: list[list[float]], t: float) -> float:
        """Polynomial of the interval in which t lies, by Horner's rule."""
        i = min(max(int(t / self._interval), 0), len(coefficients) - 1)
        x, value = t - i * self._interval, 0.0
        for c in coefficients[i]:
            value = value * x + c
        return value


def _spline_through(function: Callable[[float], float], duration: float) -> Any:
    """Spline whose intervals are halved until it misses the new knots by less than 1e-6 of the largest value."""
    n, values = COARSEST, _sampled(function, duration, COARSEST)
    error = np.inf
    while error > 1e-6 and n < FINEST:
        coarse = scipy.interpolate.CubicSpline(np.linspace(0, duration, n + 1), values)
        n *= 2
        values = _sampled(function, duration, n)
        error = np.abs(coarse(np.linspace(0, duration, n + 1)) - values).max() / max(np.abs(values).max(), 1e-9)
    require(error < 1e-3, "speed(t) is too rough to be integrated; make it continuous")
    return scipy.interpolate.CubicSpline(np.linspace(0, duration, n + 1), values)


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


@dataclass(frozen=True)
class Conditions:
    """Operating conditions of a run.

    speed      of the driving shaft [rad/s]
    load       torque on the driven shaft against its motion at positive speed [N m]
    duration   [s]
    speed_of   the speed as a function of time, whose integral is the angle

    Raises ValueError for a duration out of range, and for speeds and loads that are not finite.
    """

    speed: TimeFunction
    load: TimeFunction
    duration: float
    speed_of: Line | Curve = field(init=False)
    _load_of: Callable[[float], float] = field(init=False)

    def __post_init__(self):
        require_within("duration", self.duration, 0, 1e5, remedy="s")
        speed, load, duration = self.speed, self.load, self.duration
        object.__setattr__(
            self, "speed_of", Curve(speed, duration) if callable(speed) else line("speed", speed, duration)
        )
        object.__setattr__(self, "_load_of", load if callable(load) else line("load", load, duration))
        top = self.highest_speed
        require(top < 1e5, f"speed must stay below 1e5 rad/s, got {top:g}; pass 3500*rpm")
        self.load_at(0.0)

    def load_at(self, t: float) -> float:
        """The load [N m] at a time [s]; ValueError where it is not finite."""
        load = number("load(t)", self._load_of(t))
        require(isfinite(load), f"load(t) must be finite, got {load} at t = {t:.6g} s")
        return load

    @property
    def constant_load(self) -> bool:
        """Whether the load is known never to change."""
        return isinstance(self._load_of, Line) and self._load_of.constant

    @cached_property
    def _magnitudes(self) -> np.ndarray:
        return np.abs(self.speed_of(np.linspace(0, self.duration, INSTANTS)))

    @property
    def highest_speed(self) -> float:
        """Largest magnitude of the speed [rad/s]."""
        return float(self._magnitudes.max())

    @property
    def constant_speed(self) -> bool:
        """Whether the magnitude of the speed does not change, but for rounding."""
        return bool(np.ptp(self._magnitudes) <= 1e-9 * self._magnitudes.max())

    def as_text(self) -> dict[str, str]:
        """Speed and load for the attributes of a run: numbers, or the name of the function."""
        return {name: getattr(x, "__name__", str(x)) for name, x in (("speed", self.speed), ("load", self.load))}
