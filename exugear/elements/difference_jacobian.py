"""Jacobians of the forces of contacts and bearings, by differences."""

from collections.abc import Callable

import numpy as np


def jacobian(forces: Callable, q, q_t, factors: tuple[float, float], nudges: tuple[float, float]) -> np.ndarray:
    """(n, n) matrix -factor dF/dq - factor_t dF/dq_t that Exudyn's ObjectGenericODE2 asks for.

    forces    (*q, *q_t) -> F (n,)
    factors   of the derivatives by coordinates and by velocities
    nudges    differences of coordinates and of velocities
    """
    n, state = len(q), np.array([*q, *q_t])
    here, total = np.array(forces(*state)), np.zeros((n, n))
    for i in range(2 * n):
        nudge = np.zeros(2 * n)
        nudge[i] = nudges[i // n]
        ahead, behind = (np.array(forces(*x)) for x in (state + nudge, state - nudge))
        total[:, i % n] -= factors[i // n] * slope(behind, here, ahead, nudge[i])
    return total


def slope(behind: np.ndarray, here: np.ndarray, ahead: np.ndarray, nudge: float) -> np.ndarray:
    """Derivative of forces by central differences; from the loaded side alone where the other one loses contact."""
    if here.any() and ahead.any() != behind.any():
        return (ahead - here if ahead.any() else here - behind) / nudge
    return (ahead - behind) / (2 * nudge)
