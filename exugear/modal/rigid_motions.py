"""Motions that no elastic element resists, counted from the structure of a system and not from its frequencies.

The null space of the stiffness is that of all rows by which the elements measure the motion, whatever their stiffness
and whatever inertia they hold: a threshold on frequencies takes true low modes for rigid motions where a small inertia
on a stiff mesh has a very high frequency.
"""

from collections.abc import Sequence

import numpy as np

#: Share of the largest eigenvalue of an element, scaled to a unit diagonal, that is rounding: elements may be known as
#: differences of the whole stiffness. The same of a whole stiffness, which sums stiff and soft elements.
ROUNDING, ROUNDING_OF_SUMS = 1e-6, 1e-13
#: Least singular value of the normalized rows of all elements that counts as resistance.
INDEPENDENT = 1e-9


def measured_rows(stiffness: np.ndarray, rounding: float = ROUNDING) -> np.ndarray:
    """(r, n) rows of unit length by which an element of symmetric stiffness (n, n) and rank r measures the motion."""
    scale = np.sqrt(np.abs(np.diag(stiffness)))
    moved = np.flatnonzero(scale > 0)
    if not moved.size:
        return np.zeros((0, len(stiffness)))
    part, scale = stiffness[np.ix_(moved, moved)], scale[moved]
    values, vectors = np.linalg.eigh(part / np.outer(scale, scale))
    elastic = np.abs(values) > rounding * np.abs(values).max()
    rows = np.zeros((int(elastic.sum()), len(stiffness)))
    rows[:, moved] = vectors[:, elastic].T * scale
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def rigid_motions(rows: Sequence[np.ndarray], motions: np.ndarray) -> np.ndarray:
    """(n_free, r) motions that rows (k, n) of elements do not measure, among `motions` (n, n_free) that are allowed."""
    measured = np.concatenate([np.zeros((0, len(motions))), *rows]) @ motions
    size = np.linalg.norm(measured, axis=1, keepdims=True)
    measured = measured[size[:, 0] > 0] / size[size > 0][:, None]
    scale = np.abs(measured).max(axis=0, initial=0.0)
    scale[scale == 0] = 1.0
    _, singular, directions = np.linalg.svd(measured / scale, full_matrices=True)
    rank = int((singular > INDEPENDENT * singular.max(initial=0.0)).sum())
    free = directions[rank:].T / scale[:, None]
    return free / np.abs(free).max(axis=0, initial=0.0)
