"""Force centroid of laws that give none, from the change of their potential over the misalignment."""

import numpy as np

from exugear.force_table.offset_interpolation import slope_weights
from fem.support.numba_cache import compiled, kept


def energy_centroid(misalignment: np.ndarray, deflection: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Force centroids [m] like force, from the work of the forces at the same deflection and other misalignments.

    misalignment        (n_misalignment,) [rad]
    deflection, force   (n_a, n_misalignment, n_axial, n_phase, n_deflection) [m, N]
    """
    steps = np.diff(deflection) * (force[..., 1:] + force[..., :-1]) / 2
    work = np.concatenate([np.zeros((*force.shape[:-1], 1)), np.cumsum(steps, axis=-1)], axis=-1)
    tables = (np.ascontiguousarray(np.moveaxis(x, 1, 3)) for x in (deflection, force, work))
    rows = (x.reshape(-1, *x.shape[3:]) for x in tables)
    centroid = _centroids(slope_weights(misalignment), *rows)
    shape = force.shape[0], *force.shape[2:4], force.shape[1], force.shape[4]
    return np.moveaxis(centroid.reshape(shape), 3, 1)


@compiled
def energy(deflection, force, work, y):
    """Work [J] of forces up to a deflection y [m]; beyond the last one along the last secant."""
    if y <= deflection[0]:
        return 0.0
    i = min(max(np.searchsorted(deflection, y) - 1, 0), deflection.size - 2)
    step = y - deflection[i]
    stiffness = (force[i + 1] - force[i]) / (deflection[i + 1] - deflection[i])
    return work[i] + step * (force[i] + 0.5 * stiffness * step)


@kept
def _centroids(weights, deflection, force, work):
    """Force centroids (n, n_misalignment, n_deflection); weights: of neighbouring values in the slope at a value."""
    centroid = np.zeros(force.shape)
    number, count, size = force.shape
    for row in range(number):
        for j in range(count):
            first = max(0, min(j - 1, count - weights.shape[1]))
            for m in range(size - 1, -1, -1):
                if force[row, j, m] > 0.0:
                    slope, y = 0.0, deflection[row, j, m]
                    for k in range(min(weights.shape[1], count - first)):
                        at = first + k
                        slope += weights[j, k] * energy(deflection[row, at], force[row, at], work[row, at], y)
                    centroid[row, j, m] = -slope / force[row, j, m]
                elif m + 1 < size:
                    centroid[row, j, m] = centroid[row, j, m + 1]
    return centroid
