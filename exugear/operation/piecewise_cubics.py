"""Piecewise cubics that tabulate a function for the compiled kernels."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from fem.support.validation import number, require

#: Error of a table over its largest value, and largest number of pieces.
TOLERANCE, MOST_PIECES = 1e-6, 2**20
GOLDEN = (5**0.5 - 1) / 2
#: Positions in a piece through which its cubic passes. Near the middles between them it is checked, at positions that
#: differ from piece to piece by this share, as a vibration may vanish at all that are evenly spaced.
THROUGH, MIDDLES, IRREGULAR = np.arange(4) / 3, np.arange(1, 6, 2) / 6, 1 / 15
TO_COEFFICIENTS = np.linalg.inv(np.vander(THROUGH, 4, increasing=True)).T


@dataclass(frozen=True)
class PiecewiseCubic:
    """Cubics between knots.

    knots          (n + 1,) rising
    coefficients   (n, 4) of 1, x, x^2, x^3, x counted from the lower knot; the end pieces also hold beyond the knots
    """

    knots: np.ndarray
    coefficients: np.ndarray

    def __call__(self, x) -> np.ndarray:
        piece = np.clip(np.searchsorted(self.knots, x, "right") - 1, 0, len(self.coefficients) - 1)
        s, c = x - self.knots[piece], self.coefficients[piece].T
        return c[0] + s * (c[1] + s * (c[2] + s * c[3]))

    def integral(self, x) -> np.ndarray:
        """Integral from the first knot to x."""
        integrals = self.coefficients / np.arange(1, 5)
        at_knots = np.cumsum(np.r_[0.0, (integrals * np.diff(self.knots)[:, None] ** np.arange(1, 5)).sum(axis=1)])
        piece = np.clip(np.searchsorted(self.knots, x, "right") - 1, 0, len(self.coefficients) - 1)
        s, c = x - self.knots[piece], integrals[piece].T
        return at_knots[piece] + s * (c[0] + s * (c[1] + s * (c[2] + s * c[3])))


def constant(value: float) -> PiecewiseCubic:
    """The table of a constant."""
    return PiecewiseCubic(np.array([0.0, 1.0]), np.array([[value, 0.0, 0.0, 0.0]]))


def ramp(start: float, end: float, length: float) -> PiecewiseCubic:
    """The table of a line from start at 0 to end at a length."""
    return PiecewiseCubic(np.array([0.0, length]), np.array([[start, (end - start) / length, 0.0, 0.0]]))


def through_points(x: np.ndarray, y: np.ndarray) -> PiecewiseCubic:
    """Monotone cubic (PCHIP) through points, constant beyond them."""
    spline = scipy.interpolate.PchipInterpolator(x, y)
    width = x[-1] - x[0]
    ends = np.array([[y[0], 0.0, 0.0, 0.0]]), np.array([[y[-1], 0.0, 0.0, 0.0]])
    knots = np.r_[x[0] - width, x, x[-1] + width]
    return PiecewiseCubic(knots, np.ascontiguousarray(np.concatenate([ends[0], spline.c[::-1].T, ends[1]])))


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
        at_checks, y = (_sampled(name, function, low[:, None] + width[:, None] * s) for s in (checks, THROUGH))
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


def _sampled(name: str, function: Callable[[float], float], x: np.ndarray) -> np.ndarray:
    """Values of a function at x (n, m); ValueError where a value is no finite number."""
    values = np.array([number(name, function(each)) for each in x.ravel().tolist()]).reshape(x.shape)
    finite = np.isfinite(values)
    if not finite.all():
        raise ValueError(f"{name} must be finite, got {values[~finite][0]} at {x[~finite][0]:.6g}")
    return values
