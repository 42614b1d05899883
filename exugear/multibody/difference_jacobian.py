"""Jacobians of the forces of contacts by finite differences, for Newton's iteration and for modes."""

from collections.abc import Callable, Sequence
from math import ulp

import numpy as np

#: Least step of a difference over the spacing of floats at the largest coordinate, or at the largest velocity. After a
#: thousand revolutions angles are rounded to 1e-12 rad: differences over 1e-9 rad are then wrong by 0.1 %.
LEAST_SPACINGS = 1e5


def jacobian(forces: Callable, q, q_t, factors: tuple[float, float], steps: tuple[float, float]) -> np.ndarray:
    """(n, n) matrix -factor dF/dq - factor_t dF/dq_t that Exudyn's ObjectGenericODE2 asks for.

    forces    (*q, *q_t) -> F (n,)
    factors   of the derivatives by coordinates and by velocities
    steps     of the differences in coordinates and in velocities, larger where the state would round them

    A run computes it at the beginning of each segment; lists of a few floats take a fifth of the time of arrays.
    """
    n, state = len(q), [float(x) for x in (*q, *q_t)]
    sizes = [max(h, LEAST_SPACINGS * ulp(max(map(abs, x)))) for h, x in zip(steps, (state[:n], state[n:]), strict=True)]
    middle, rows = forces(*state), [[0.0] * n for _ in range(n)]
    for i, x in enumerate(list(state)):
        kind, column = divmod(i, n)
        state[i] = x + sizes[kind]
        after = forces(*state)
        state[i] = x - sizes[kind]
        before = forces(*state)
        state[i] = x
        for row, derivative in zip(rows, slopes(before, middle, after, sizes[kind]), strict=True):
            row[column] -= factors[kind] * derivative
    return np.array(rows)


def slopes(before: Sequence[float], middle: Sequence[float], after: Sequence[float], step: float) -> list[float]:
    """Derivatives of forces by central differences; by one-sided differences where only one side has contact."""
    if any(middle) and any(after) != any(before):
        low, high = (middle, after) if any(after) else (before, middle)
        return [(b - a) / step for a, b in zip(low, high, strict=True)]
    return [(b - a) / (2 * step) for a, b in zip(before, after, strict=True)]
