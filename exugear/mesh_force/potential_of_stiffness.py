"""The potential of a law from its secant stiffness k over u = (penetration / largest penetration)^(1/4).

U = w penetration^2 with w = 4 / u^8 integral of k u^7, so that force and tangent stiffness at the nodes are those of k:
k = 2 w + u w' / 4. All this is linear in the values and slopes of k at the nodes.
"""

from typing import NamedTuple

import numpy as np

from exugear.mesh_force.layout import PENETRATIONS, U
from exugear.mesh_force.pchip import hermite

#: Twelvefold weights of five values in the slopes at the first two of them.
AT_THE_ENDS = (-25, 48, -36, 16, -3), (-3, -10, 18, -6, 1)
#: Number of points of Gauss's rule, exact for the polynomials here.
GAUSS_POINTS = 6


class Curve(NamedTuple):
    """Values over `U` along the last axis, with first and second derivatives per step of u."""

    value: np.ndarray
    by_u: np.ndarray
    by_uu: np.ndarray


def differences(values: np.ndarray) -> np.ndarray:
    """Slopes (..., U.size) of values (..., U.size) per step of u, exact for quartic polynomials."""
    slopes = np.empty_like(values)
    slopes[..., 2:-2] = (values[..., :-4] - 8 * (values[..., 1:-3] - values[..., 3:-1]) - values[..., 4:]) / 12
    for j, weights in enumerate(AT_THE_ENDS):
        slopes[..., j] = sum(weight * values[..., k] for k, weight in enumerate(weights)) / 12
        slopes[..., -1 - j] = -sum(weight * values[..., -1 - k] for k, weight in enumerate(weights)) / 12
    return slopes


def with_curvature(value: np.ndarray, slope: np.ndarray) -> Curve:
    """The curve of values and slopes."""
    return Curve(value, slope, differences(slope))


def potential_of(k: np.ndarray, slope: np.ndarray) -> Curve:
    """w of the potential, from the secant stiffness and its slope per step of u."""
    steps = np.arange(1, U.size)
    work = 4 * np.cumsum(_integrals(k, slope), axis=-1) / U[1:] ** 8
    w = np.concatenate([k[..., :1] / 2, work], axis=-1)
    first = 4 * (k - 2 * w)[..., 1:] / steps
    first = np.concatenate([4 / 9 * slope[..., :1], first], axis=-1)
    second = (4 * slope - 9 * first)[..., 1:] / steps
    bend = 6 * (k[..., 1] - k[..., 0]) - 4 * slope[..., 0] - 2 * slope[..., 1]
    return Curve(w, first, np.concatenate([4 / 10 * bend[..., None], second], axis=-1))


def _integrals(k: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """(..., PENETRATIONS) integrals of k u^7 over each step, k cubic between the nodes."""
    points, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    total = np.zeros((*k.shape[:-1], PENETRATIONS))
    for t, weight in zip((points + 1) / 2, weights / 2, strict=True):
        u = U[:-1] + t / PENETRATIONS
        total += (
            weight / PENETRATIONS * u**7 * hermite.py_func(t, k[..., :-1], slope[..., :-1], k[..., 1:], slope[..., 1:])
        )
    return total
