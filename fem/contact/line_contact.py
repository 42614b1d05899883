"""Contact with one line load in each cell, pressed as Hertz says: many states at once, and the first guess of one."""

import numpy as np

from fem.contact.unilateral import Equilibrium, unilateral_contact

#: Share of the mesh force by which the forces may still move.
SETTLED = 1e-9
#: Where Newton's method linearizes the flattening of a cell that pulls: at this share of its last force.
RELEASE = 0.2
#: Least flattening by one more unit of force, over the factor of its logarithm: by Hertz's formula slices so overloaded
#: that they are no half-planes would push back.
LEAST = 0.1
#: By which a transmission error under load may fall short of the first touch [m]: rounding.
SHORT = 1e-9


def line_contact(matrix, change, hertz, gap, approach, force) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Transmission errors (m,) [m], tangent stiffnesses (m,) [N/m] and forces of the cells (m, n) [N] of m states.

    matrix      (n, n) compliance between the cells, half-planes apart [m/N]
    change      (n, n) its change per transmission error [1/N]
    hertz       factor and constant (n,): a cell flattens by factor f (constant - ln(f) / 2) under its force f
    gap         (m, n) normal gap [m]
    approach    (n,) normal approach per transmission error
    force       (m,) mesh forces > 0 [N]

    Newton's method on active sets. Raises RuntimeError where it does not converge.
    Source: Johnson, Contact Mechanics, 4.2 and 5.6 (line contact of bodies that act as half-planes).
    """
    touching = (gap / approach).min(axis=1)
    active = gap / approach <= touching[:, None] + matrix.mean() * force[:, None]
    te, f = np.zeros(force.size), np.broadcast_to(force[:, None] / gap.shape[1], gap.shape)

    def newton_step(active: np.ndarray) -> Equilibrium:
        nonlocal te, f
        active = np.where(active.any(axis=1, keepdims=True), active, gap / approach <= touching[:, None])
        softened = np.maximum(te, touching)
        coupled, moved_by = matrix + softened[:, None, None] * change, _times(change, np.where(active, f, 0.0))
        pressed = gap - softened[:, None] * moved_by, approach - moved_by
        te, stiffness, new = _newton_step(coupled, hertz, pressed, approach, force, f, active)
        slack = np.matmul(new[:, None], coupled)[:, 0] + gap - approach * te[:, None]
        moved = np.abs(np.where(active, new - f, 0.0)).max(axis=1)
        f = np.maximum(np.where(new > 0, new, RELEASE * f), SETTLED * force[:, None])
        converged = (moved < SETTLED * force) & (te > touching - SHORT)
        return Equilibrium(te, stiffness, new, np.where(active, 0.0, slack), bool(converged.all()))

    state = unilateral_contact(newton_step, active)
    return state.te, state.stiffness, state.force


def _times(change, f: np.ndarray) -> np.ndarray:
    """(m, n) change (n, n) times forces (m, n); nothing without a change."""
    return np.zeros(f.shape) if np.ndim(change) == 0 else f @ change.T


def _newton_step(matrix, hertz, pressed, approach, force, f, active) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Transmission errors (m,), stiffnesses (m,) and forces (m, n) of the active cells, linear about the forces f.

    pressed     gap (m, n) and normal displacement per transmission error (m, n), as the softening changes them
    """
    (factor, constant), (gap, moving), (m, n) = hertz, pressed, f.shape
    below = np.minimum(f, np.exp(2 * (constant - 0.5 - LEAST)))
    softness = factor * (constant - np.log(below) / 2 - 0.5)
    start = factor * (below * (constant - np.log(below) / 2) + LEAST * (f - below)) - softness * f
    system, right, cells = np.zeros((m, n + 1, n + 1)), np.zeros((m, n + 1, 2)), np.arange(n)
    system[:, :n, :n] = np.where(active[:, :, None], matrix, 0.0)
    system[:, cells, cells] = np.where(active, matrix[:, cells, cells] + softness, 1.0)
    system[:, :n, n] = np.where(active, -moving, 0.0)
    system[:, n, :n] = approach
    right[:, :n, 0], right[:, n, 0], right[:, n, 1] = np.where(active, -gap - start, 0.0), force, 1.0
    solution = np.linalg.solve(system, right)
    return solution[:, n, 0], 1 / solution[:, n, 1], solution[:, :n, 0]
