"""Force centroid of laws that give none, from the change of their potential over the misalignment."""

import numpy as np

from exugear.force_table.offset_interpolation import slope_weights


def energy_centroid(misalignment: np.ndarray, deflection: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Force centroids [m] like force, from the work of the forces at the same deflection and other misalignments.

    misalignment        (n_misalignment,) [rad]
    deflection, force   (n_a, n_misalignment, n_axial, n_phase, n_deflection) [m, N]
    """
    centroid, weights = np.zeros(force.shape), slope_weights(misalignment)
    for index in np.ndindex(force.shape[0], *force.shape[2:4]):
        rows = index[0], slice(None), *index[1:]
        centroid[rows] = _centroids(deflection[rows], force[rows], weights)
    return centroid


def _centroids(deflection: np.ndarray, force: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(n_misalignment, n_deflection) force centroids; weights: of neighbouring values in the slope at a value."""
    centroid, count = np.zeros(force.shape), force.shape[0]
    for j, (at, pushed) in enumerate(zip(deflection, force, strict=True)):
        first = max(0, min(j - 1, count - weights.shape[1]))
        slope = np.zeros(at.size)
        for k, weight in enumerate(weights[j, : count - first]):
            slope += weight * _energy(deflection[first + k], force[first + k], at)
        loaded = pushed > 0
        centroid[j, loaded] = -slope[loaded] / pushed[loaded]
        centroid[j, ~loaded] = centroid[j, loaded][0]
    return centroid


def _energy(deflection: np.ndarray, force: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Work [J] of forces up to the deflections at [m]; beyond the last one along the last secant."""
    work = np.r_[0.0, np.cumsum(np.diff(deflection) * (force[1:] + force[:-1]) / 2)]
    i = np.clip(np.searchsorted(deflection, at) - 1, 0, deflection.size - 2)
    step, stiffness = at - deflection[i], np.diff(force)[i] / np.diff(deflection)[i]
    return np.where(at > deflection[0], work[i] + step * (force[i] + 0.5 * stiffness * step), 0.0)
