"""Jacobians of the forces of contacts and bearings by finite differences."""

from collections.abc import Callable

import numpy as np

#: Least step of a difference over the spacing of floats at the largest coordinate, or at the largest velocity. After a
#: thousand revolutions angles are rounded to 1e-12 rad: differences over 1e-9 rad are then wrong by 0.1 %.
LEAST_SPACINGS = 1e5


def jacobian(forces: Callable, q, q_t, factors: tuple[float, float], steps: tuple[float, float]) -> np.ndarray:
    """(n, n) matrix -factor dF/dq - factor_t dF/dq_t that Exudyn's ObjectGenericODE2 asks for.

    forces    (*q, *q_t) -> F (n,)
    factors   of the derivatives by coordinates and by velocities
    steps     of the differences in coordinates and in velocities, larger where the state would round them
    """
    n, state = len(q), np.array([*q, *q_t])
    least = LEAST_SPACINGS * np.spacing([np.abs(x).max() for x in (q, q_t)])
    middle, total = np.array(forces(*state)), np.zeros((n, n))
    for i in range(2 * n):
        step = np.zeros(2 * n)
        step[i] = max(steps[i // n], least[i // n])
        after, before = (np.array(forces(*x)) for x in (state + step, state - step))
        total[:, i % n] -= factors[i // n] * slope(before, middle, after, step[i])
    return total


def slope(before: np.ndarray, middle: np.ndarray, after: np.ndarray, step: float) -> np.ndarray:
    """Derivative of forces by central differences; by a one-sided difference where only one side has contact."""
    if middle.any() and after.any() != before.any():
        return (after - middle if after.any() else middle - before) / step
    return (after - before) / (2 * step)
