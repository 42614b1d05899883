"""Decay of the vibrations that meshes excite: how long a part of a run takes to forget the state in which it began."""

from math import log

import numpy as np

from exugear.planning.eigenmodes import damped_modes

#: Difference of two states, over the rms of each coordinate and velocity, up to which they count as equal.
SEAM_TOLERANCE = 1e-6
#: Share of the strain energy of a mode in the meshes above which meshes excite it.
EXCITED = 1e-9
#: Rate of decay over the angular frequency of a mode that is rounding.
UNDAMPED = 1e-8
#: Time of the linear decay times this: teeth that part are not damped.
MARGIN = 1.5


def slowest_decay(mass: np.ndarray, stiffness: np.ndarray, damping: np.ndarray, rows: np.ndarray) -> float:
    """Rate [1/s] at which the slowest of the modes decays that the meshes excite; 0 where one of them is not damped.

    mass, stiffness, damping   (n, n) with the meshes
    rows                       (n_stage, n) of the meshes, times the roots of their stiffnesses
    """
    values, vectors = damped_modes(mass, stiffness, damping)
    modes = vectors[: len(mass)]
    strain = np.einsum("im,ij,jm->m", modes.conj(), stiffness, modes).real
    excited = (np.abs(rows @ modes) ** 2).sum(axis=0) > EXCITED * np.maximum(strain, np.finfo(float).tiny)
    slowest = float((-values.real / np.maximum(np.abs(values), 1.0))[excited].min(initial=1.0))
    return float(-values.real[excited].max(initial=-np.inf)) if slowest > UNDAMPED else 0.0


def settling_time(decay: float, share: float) -> float:
    """Time [s] in which vibrations of a rate of decay > 0 [1/s] fall to a share."""
    return MARGIN * log(1 / share) / decay
