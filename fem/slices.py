"""Contact with one line load in each cell, pressed as Hertz says: many states at once, and the first guess of one."""

import numpy as np

STEPS, CYCLING = 120, 30
#: Share of the mesh force by which the forces may still move.
SETTLED = 1e-9
#: Least flattening by one more unit of force, over the factor of its logarithm.
LEAST = 0.1


def line_contact(matrix, change, hertz, gap, approach, force) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Transmission errors (m,) [m], tangent stiffnesses (m,) [N/m] and forces of the cells (m, n) [N] of m states.

    matrix      (n, n) compliance between the cells, half-planes apart [m/N]
    change      (n, n) its change per transmission error [1/N]
    hertz       factor and constant (n,): a cell flattens by factor f (constant - ln(f) / 2) under its force f
    gap         (m, n) normal gap [m]
    approach    (n,) normal approach per transmission error
    force       (m,) mesh forces > 0 [N]

    Newton's method on active sets. Raises RuntimeError where it does not settle.
    Source: Johnson, Contact Mechanics, 4.2 and 5.6 (line contact of bodies that act as half-planes).
    """
    factor, constant = hertz
    f = np.broadcast_to(force[:, None] / gap.shape[1], gap.shape)
    active = gap / approach <= (gap / approach).min(axis=1, keepdims=True) + matrix.mean() * force[:, None]
    rng, te = np.random.default_rng(0), np.zeros(force.size)
    for step in range(STEPS):
        coupled = matrix + te[:, None, None] * change
        te, new = _newton_step(coupled, (factor, constant), gap, approach, force, f, active)
        slack = np.matmul(new[:, None], coupled)[:, 0] + gap - approach * te[:, None]
        wanted = np.where(active, new > 0, slack < 0)
        moved = np.abs(np.where(active, new - f, 0.0)).max(axis=1)
        f = np.maximum(np.where(new > 0, new, 0.2 * f), SETTLED * force[:, None])
        if (wanted == active).all() and (moved < SETTLED * force).all():
            moving = approach - (np.broadcast_to(change, matrix.shape) @ new[..., None])[..., 0]
            return te, _stiffness(coupled, hertz, approach, moving, f, active), np.where(active, new, 0.0)
        active = wanted if step < CYCLING else np.where(rng.random(active.shape) < 0.5, wanted, active)
    raise RuntimeError("line contact did not settle; try the resolved mode (a smaller accuracy) or other slices")


def _newton_step(matrix, hertz, gap, approach, force, f, active) -> tuple[np.ndarray, np.ndarray]:
    """Transmission errors (m,) and forces (m, n) of the active cells, linear about the forces f."""
    factor, constant = hertz
    system, softness = _system(matrix, hertz, approach, approach, f, active)
    start = factor * f * (constant - np.log(f) / 2) - softness * f
    right = np.append(np.where(active, -gap - start, 0.0), force[:, None], axis=1)
    solution = np.linalg.solve(system, right[..., None])[..., 0]
    return solution[:, -1], solution[:, :-1]


def _stiffness(matrix, hertz, approach, moving, f, active) -> np.ndarray:
    """(m,) change of the mesh force per transmission error [N/m]; moving (m, n): approach less what softening takes."""
    system, _ = _system(matrix, hertz, approach, moving, f, active)
    right = np.zeros((*system.shape[:2], 1))
    right[:, -1] = 1.0
    return 1 / np.linalg.solve(system, right)[:, -1, 0]


def _system(matrix, hertz, approach, moving, f, active) -> tuple[np.ndarray, np.ndarray]:
    """Matrix (m, n + 1, n + 1) over forces and transmission error about the forces f, and softness (m, n) of the cells.

    moving      (n,) or (m, n) normal displacement per transmission error
    """
    (factor, constant), (m, n) = hertz, f.shape
    softness = factor * np.maximum(constant - np.log(f) / 2 - 0.5, LEAST)
    system, cells = np.zeros((m, n + 1, n + 1)), np.arange(n)
    system[:, :n, :n] = np.where(active[:, :, None], matrix, 0.0)
    system[:, cells, cells] = np.where(active, matrix[:, cells, cells] + softness, 1.0)
    system[:, :n, n] = np.where(active, -moving, 0.0)
    system[:, n, :n] = approach
    return system, softness
