"""Jacobians of the forces of contacts and bearings by finite differences."""

from collections.abc import Callable

import numpy as np


def jacobian(forces: Callable, q, q_t, factors: tuple[float, float], steps: tuple[float, float]) -> np.ndarray:
    """(n, n) matrix -factor dF/dq - factor_t dF/dq_t that Exudyn's ObjectGenericODE2 asks for.

    forces    (*q, *q_t) -> F (n,)
    factors   of the derivatives by coordinates and by velocities
    steps     of the differences in coordinates and in velocities
    """
    n, state = len(q), np.array([*q, *q_t])
    middle, total = np.array(forces(*state)), np.zeros((n, n))
    for i in range(2 * n):
        step = np.zeros(2 * n)
        step[i] = steps[i // n]
        after, before = (np.array(forces(*x)) for x in (state + step, state - step))
        total[:, i % n] -= factors[i // n] * slope(before, middle, after, step[i])
    return total


def slope(before: np.ndarray, middle: np.ndarray, after: np.ndarray, step: float) -> np.ndarray:
    """Derivative of forces by central differences; by a one-sided difference where only one side has contact."""
    if middle.any() and after.any() != before.any():
        return (after - middle if after.any() else middle - before) / step
    return (after - before) / (2 * step)
