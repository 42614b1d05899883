"""The involute function and its inverse (ISO 21771)."""

from math import atan, pi

import numpy as np
import scipy


def involute(alpha):
    """inv(alpha) = tan(alpha) - alpha of pressure angles [rad], scalar or array."""
    return np.tan(alpha) - alpha


def inverse_involute(value: float) -> float:
    """Pressure angle [rad] whose involute is value >= 0."""
    largest = atan(value + pi / 2)
    return scipy.optimize.brentq(lambda alpha: involute(alpha) - value, 0.0, largest, xtol=1e-15)
