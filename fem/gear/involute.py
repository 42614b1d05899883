"""The involute function, its inverse, and the half angle of a tooth between its involute flanks (ISO 21771)."""

from math import atan, pi, tan

import numpy as np
import scipy


def involute(alpha: float) -> float:
    """inv(alpha) = tan(alpha) - alpha of a pressure angle [rad]."""
    return tan(alpha) - alpha


def inverse_involute(value: float) -> float:
    """Pressure angle [rad] whose involute is value >= 0."""
    largest = atan(value + pi / 2)
    return scipy.optimize.brentq(lambda alpha: involute(alpha) - value, 0.0, largest, xtol=1e-15)


def half_angle(psi_b: float, r_b: float, roll):
    """Half angle of a tooth [rad] where its flanks have the roll length roll [m], scalar or array.

    psi_b       half angle at the base circle [rad]
    r_b         base radius [m]

    It is psi_b - inv(alpha), with tan(alpha) = roll / r_b.
    """
    return psi_b - (roll / r_b - np.arctan(roll / r_b))
