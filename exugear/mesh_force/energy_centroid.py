"""Force centroid of laws that give none, from the change of their complementary energy over the misalignment."""

import numpy as np

from exugear.mesh_force.offset_interpolation import slope_weights
from fem.support.numba_cache import compiled, kept


def energy_centroid(misalignment: np.ndarray, deflection: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Force centroids [m] like force: slope over the misalignment of the mean deflection from contact to a force.

    That mean is the complementary energy over the force. At equal deflections, where light forces of a misalignment
    stand beside large ones of the next, finite differences of the potential would say nothing about the centroid.

    misalignment        (n_misalignment,) [rad]
    deflection, force   (n_a, n_misalignment, n_axial, n_phase, n_deflection) [m, N]
    """
    steps = np.diff(force) * (deflection[..., 1:] + deflection[..., :-1]) / 2
    energy = np.concatenate([np.zeros((*force.shape[:-1], 1)), np.cumsum(steps, axis=-1)], axis=-1)
    tables = (np.ascontiguousarray(np.moveaxis(x, 1, 3)) for x in (deflection, force, energy))
    rows = (x.reshape(-1, *x.shape[3:]) for x in tables)
    centroid = _centroids(slope_weights(misalignment), *rows)
    shape = force.shape[0], *force.shape[2:4], force.shape[1], force.shape[4]
    return np.moveaxis(centroid.reshape(shape), 3, 1)


@compiled
def complementary_energy(deflection, force, energy, f):
    """Complementary energy [J] up to a force f > 0 [N]; beyond the last one along the last secant."""
    i = min(np.searchsorted(force, f) - 1, deflection.size - 2)
    compliance = (deflection[i + 1] - deflection[i]) / (force[i + 1] - force[i])
    step = f - force[i]
    return energy[i] + step * (deflection[i] + 0.5 * compliance * step)


@kept
def _centroids(weights, deflection, force, energy):
    """Force centroids (n, n_misalignment, n_deflection); weights: of neighbouring values in the slope at a value."""
    centroid = np.zeros(force.shape)
    number, count, size = force.shape
    for row in range(number):
        for j in range(count):
            first = max(0, min(j - 1, count - weights.shape[1]))
            for m in range(size - 1, -1, -1):
                f = force[row, j, m]
                if f > 0.0:
                    for k in range(min(weights.shape[1], count - first)):
                        at = first + k
                        total = complementary_energy(deflection[row, at], force[row, at], energy[row, at], f)
                        centroid[row, j, m] += weights[j, k] * total / f
                elif m + 1 < size:
                    centroid[row, j, m] = centroid[row, j, m + 1]
    return centroid
