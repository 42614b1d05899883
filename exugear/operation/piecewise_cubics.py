"""Piecewise cubics that tabulate functions of time, speed or angle, for Python and for the compiled kernels."""

from array import array
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from fem.support.intervals import interval_of
from fem.support.validation import number, require

#: Error of a table over its largest value, and largest number of pieces.
TOLERANCE, MOST_PIECES = 1e-6, 2**20
GOLDEN = (5**0.5 - 1) / 2
#: Positions in a piece through which its cubic passes. Near the middles between them it is checked, at positions that
#: differ from piece to piece by this share, as a vibration may vanish at all that are evenly spaced.
THROUGH, MIDDLES, IRREGULAR = np.arange(4) / 3, np.arange(1, 6, 2) / 6, 1 / 15
TO_COEFFICIENTS = np.linalg.inv(np.vander(THROUGH, 4, increasing=True)).T


@dataclass(frozen=True, eq=False)
class PiecewiseCubic:
    """Cubics between knots.

    knots          (n + 1,) rising
    coefficients   (n, 4) of 1, x, x^2, x^3, x counted from the lower knot; the end pieces also hold beyond the knots

    A single piece also takes Exudyn's symbols.
    """

    knots: np.ndarray
    coefficients: np.ndarray

    def __call__(self, x):
        return self._value(self._at_knots, x)

    def integral(self, x):
        """Integral from the first knot to x."""
        return self._value(self._integral, x)

    def slope(self, x):
        """Derivative at x."""
        return self._value(self._slope, x)

    def scaled(self, factor: float) -> "PiecewiseCubic":
        """The cubics times a factor."""
        return PiecewiseCubic(self.knots, factor * self.coefficients)

    @property
    def single(self) -> bool:
        """Whether one polynomial holds everywhere."""
        return len(self.coefficients) == 1

    @property
    def constant(self) -> bool:
        """Whether the value never changes."""
        return not self.coefficients[:, 1:].any() and bool(np.ptp(self.coefficients[:, 0]) == 0)

    @property
    def angle_pieces(self) -> tuple[np.ndarray, np.ndarray]:
        """Knots (n + 1,) and coefficients (n, 5) of the integral, for `exugear.multibody.polynomial_pieces`."""
        return self.knots, self._integral[0].copy()

    @cached_property
    def _at_knots(self) -> tuple[np.ndarray, array]:
        return self.coefficients, _row_by_row(self.coefficients)

    @cached_property
    def _slope(self) -> tuple[np.ndarray, array]:
        slopes = self.coefficients[:, 1:] * np.arange(1, 4)
        return slopes, _row_by_row(slopes)

    @cached_property
    def _integral(self) -> tuple[np.ndarray, array]:
        terms, widths = self.coefficients / np.arange(1, 5), np.diff(self.knots)[:, None]
        at_knots = np.cumsum(np.r_[0.0, (terms * widths ** np.arange(1, 5)).sum(axis=1)])
        integrals = np.column_stack([at_knots[:-1], terms])
        return integrals, _row_by_row(integrals)

    @cached_property
    def _plain_knots(self) -> array:
        return _row_by_row(self.knots)

    def _value(self, polynomials: tuple[np.ndarray, array], x):
        """Value at x of polynomials in each piece; numbers, as Exudyn passes them, take a tenth of an array."""
        of_pieces, row_by_row = polynomials
        value: Any = 0.0
        if self.single:
            s, coefficients = x - self._plain_knots[0], row_by_row
        elif isinstance(x, float):
            knots = self._plain_knots
            piece = min(max(bisect_right(knots, x) - 1, 0), len(knots) - 2)
            width = len(row_by_row) // (len(knots) - 1)
            s, coefficients = x - knots[piece], row_by_row[piece * width : (piece + 1) * width]
        else:
            pieces = interval_of(self.knots, x)
            s, coefficients = x - self.knots[pieces], of_pieces[pieces].T
        for c in reversed(coefficients):
            value = value * s + c
        return value


def _row_by_row(values: np.ndarray) -> array:
    """The values as an array of Python's, which reads a number in a tenth of the time that numpy takes."""
    return array("d", values.tobytes())


def of_spline(spline: Any) -> PiecewiseCubic:
    """The pieces of a cubic spline (`scipy.interpolate.PPoly`)."""
    return PiecewiseCubic(spline.x, np.ascontiguousarray(spline.c[::-1].T))


def constant(value: float) -> PiecewiseCubic:
    """The table of a constant."""
    return PiecewiseCubic(np.array([0.0, 1.0]), np.array([[value, 0.0, 0.0, 0.0]]))


def ramp(start: float, end: float, length: float) -> PiecewiseCubic:
    """The table of a line from start at 0 to end at a length."""
    return PiecewiseCubic(np.array([0.0, length]), np.array([[start, (end - start) / length, 0.0, 0.0]]))


def through_points(x: np.ndarray, y: np.ndarray) -> PiecewiseCubic:
    """Monotone cubic (PCHIP) through points, constant beyond them."""
    inner, width = of_spline(scipy.interpolate.PchipInterpolator(x, y)), x[-1] - x[0]
    start, end = ([[value, 0.0, 0.0, 0.0]] for value in (y[0], y[-1]))
    return PiecewiseCubic(np.r_[x[0] - width, x, x[-1] + width], np.concatenate([start, inner.coefficients, end]))


def tabulated(name: str, function: Callable[[float], float], knots: np.ndarray, halvings: int) -> PiecewiseCubic:
    """Cubics through a function, within `TOLERANCE` of its largest value; each interval is halved until they are.

    name       of the function in messages
    halvings   of an interval at most: where the function jumps, a line crosses the last interval

    Raises ValueError where the function gives no finite numbers, or needs more than `MOST_PIECES`.
    """
    low, high, scale = knots[:-1], knots[1:], float(np.finfo(float).tiny)
    lower_knots, coefficients, pieces = [], [], 0
    for halving in range(halvings + 1):
        width = high - low
        checks = MIDDLES + IRREGULAR * (golden_fractions(len(low))[:, None] - 0.5)
        at_checks, y = (sampled(name, function, low[:, None] + width[:, None] * s) for s in (checks, THROUGH))
        scale = max(scale, float(np.abs(y).max(initial=0.0)), float(np.abs(at_checks).max(initial=0.0)))
        cubics = y @ TO_COEFFICIENTS
        missed = np.einsum("ik,ijk->ij", cubics, checks[..., None] ** np.arange(4)) - at_checks
        rough = np.abs(missed).max(axis=1, initial=0.0) > TOLERANCE * scale
        if halving == halvings:
            cubics[rough] = np.c_[y[rough, 0], y[rough, -1] - y[rough, 0], np.zeros((rough.sum(), 2))]
            rough[:] = False
        lower_knots.append(low[~rough])
        coefficients.append(cubics[~rough] / width[~rough, None] ** np.arange(4))
        pieces += len(low)
        require(pieces < MOST_PIECES, f"{name} is too rough to be tabulated; make it smoother, or pass arrays")
        middle = (low[rough] + high[rough]) / 2
        low, high = np.r_[low[rough], middle], np.r_[middle, high[rough]]
    lower, all_coefficients = np.concatenate(lower_knots), np.concatenate(coefficients)
    order = np.argsort(lower)
    return PiecewiseCubic(np.r_[lower[order], knots[-1]], np.ascontiguousarray(all_coefficients[order]))


def golden_fractions(n: int) -> np.ndarray:
    """(n,) fractions that fill [0, 1) evenly without repeating: multiples of the golden ratio, less their wholes."""
    return np.arange(n) * GOLDEN % 1


def sampled(name: str, function: Callable[[float], float], x: np.ndarray) -> np.ndarray:
    """Values of a function at x, of any shape; ValueError where a value is no finite number."""
    listed = [function(each) for each in x.ravel().tolist()]
    if not set(map(type, listed)) <= {float, np.float64}:
        listed = [number(name, value) for value in listed]
    values = np.array(listed).reshape(x.shape)
    finite = np.isfinite(values)
    if not finite.all():
        raise ValueError(f"{name} must be finite, got {values[~finite][0]} at {x[~finite][0]:.6g}")
    return values
