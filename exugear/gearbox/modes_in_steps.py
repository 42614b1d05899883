"""Modes in steps of Newmark's rule with beta = 1/12, gamma = 1/2, and masses by which they vibrate as without steps.

In a vibration at omega, theta = omega h, the rule has the accelerations -omega~^2 q instead of -omega^2 q and rates
that are too small by a factor (trapezoidal sums), with s = sin(theta / 2):

    omega~^2 h^2 = 4 s^2 / (1 - s^2 / 3) = theta^2 (1 - theta^4 / 240 - ...),
    rate         = sin(theta) / (theta (1 - s^2 / 3)) = 1 - theta^2 / 12 - ...

A mode of the frequency omega with the mass (omega / omega~)^2 times its own vibrates at omega in these steps, and with
its damping over `rate` decays as it does; its static compliance is exact in any case. At most omega~ h = `TOP` times
the limit of stability is used, which belongs to theta = 2.3: modes above count by their compliance alone.

Dampers of bearings couple the modes. Where one of two vibrates, the rates of both are too small by the factor at its
frequency. The damping between them matters at the lower frequency, where the faster mode yields. So it is divided by
the factor of the slower mode; the added matrix then only dissipates.
"""

from math import asin, pi, sqrt

import numpy as np
import scipy

#: Limit of stability: omega~ h (`exugear.planning.integrator_and_step.STABLE`), and the share of it that is used; a
#: mesh of omega h = 0.8 beside modes there leaves 5 % to the limit.
LIMIT, TOP = sqrt(6), 0.88
#: The same as an angle theta.
TOP_ANGLE = 2 * asin(sqrt(3 * (TOP * LIMIT) ** 2 / (12 + (TOP * LIMIT) ** 2)))


def square_in_steps(angle: np.ndarray) -> np.ndarray:
    """(omega~ h)^2 by theta = omega h in [0, pi]; beyond pi that of pi."""
    s = np.sin(np.minimum(angle, pi) / 2) ** 2
    return 4 * s / (1 - s / 3)


def rate_in_steps(angle: np.ndarray) -> np.ndarray:
    """Rate in steps over the true one by theta = omega h in [0, pi]; beyond pi that of pi."""
    angle = np.minimum(angle, pi)
    return np.sinc(angle / pi) / (1 - np.sin(angle / 2) ** 2 / 3)


def factors_in_steps(omega: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Factors (n,) of mass and damping by which modes at omega (n,) [rad/s] keep frequency and decay in steps [s].

    Modes beyond `TOP_ANGLE` are static: they follow at frequencies at which rates are true.
    """
    angle = np.minimum(omega * step, TOP_ANGLE)
    square = np.where(angle > 0, square_in_steps(angle), 1.0)
    of_mass = np.where(angle > 0, (omega * step) ** 2 / square, 1.0)
    return of_mass, np.where(angle < TOP_ANGLE, 1 / rate_in_steps(angle), 1.0)


def additions_in_steps(
    mass: np.ndarray, stiffness: np.ndarray, damping: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """What to add to mass and damping (n, n) so that the modes of a system keep frequency and decay in steps [s].

    mass    positive definite
    """
    squares, modes = scipy.linalg.eigh(stiffness, mass)
    of_mass, of_damping = factors_in_steps(np.sqrt(np.maximum(squares, 0.0)), step)
    momenta, slower = mass @ modes, np.minimum.outer(of_damping, of_damping)
    further = (slower - 1) * (modes.T @ damping @ modes)
    return momenta * (of_mass - 1) @ momenta.T, momenta @ further @ momenta.T
