"""Hertzian contact of a rolling element and a raceway: point contact of balls, line contact of rollers.

T. A. Harris and M. N. Kotzalas, Rolling bearing analysis, CRC Press (2007), chapter 6.
"""

from functools import lru_cache
from math import pi
from typing import NamedTuple

import scipy

#: Range of the ratio of the axes of the contact ellipse in which it is sought.
RATIOS = 1.0 + 1e-9, 1e6


class Ellipse(NamedTuple):
    """Dimensionless contact ellipse: semi-axes a >= b, approach delta."""

    a: float
    b: float
    delta: float


@lru_cache
def ellipse(curvature_difference: float) -> Ellipse:
    """The dimensionless ellipse of a contact by its curvature difference F(rho) in [0, 1)."""
    if curvature_difference < 1e-9:
        return Ellipse(1.0, 1.0, 1.0)
    special = scipy.special

    def excess(k: float) -> float:
        first, second = special.ellipk(1 - 1 / k**2), special.ellipe(1 - 1 / k**2)
        return ((k**2 + 1) * second - 2 * first) / ((k**2 - 1) * second) - curvature_difference

    k = scipy.optimize.brentq(excess, *RATIOS, xtol=1e-13)
    first, second = special.ellipk(1 - 1 / k**2), special.ellipe(1 - 1 / k**2)
    b = (2 * second / (pi * k)) ** (1 / 3)
    return Ellipse(k * b, b, 2 * first / pi * (pi / (2 * k**2 * second)) ** (1 / 3))


class BallContact(NamedTuple):
    """Contact of a ball with the groove of a raceway.

    D_w         diameter of the ball [m]
    r           radius of the groove [m]
    gamma       D_w cos(alpha) / D_pw of the inner raceway, its negative of the outer one
    compliance  2 (1 - nu^2) / E of ball and ring together [1/Pa]
    """

    D_w: float
    r: float
    gamma: float
    compliance: float

    @property
    def curvature_sum(self) -> float:
        """Sum of the principal curvatures [1/m]."""
        return (4 + 2 * self.gamma / (1 - self.gamma) - self.D_w / self.r) / self.D_w

    @property
    def ellipse(self) -> Ellipse:
        """The dimensionless contact ellipse."""
        rolling = 2 * self.gamma / (1 - self.gamma)
        return ellipse((rolling + self.D_w / self.r) / (4 + rolling - self.D_w / self.r))

    @property
    def stiffness(self) -> float:
        """Force over approach^1.5 [N/m^1.5]."""
        total = self.curvature_sum
        return (2 / (self.ellipse.delta * total)) ** 1.5 * 2 * total / (3 * self.compliance)

    def pressure(self, force):
        """Largest pressure [Pa] under forces >= 0 [N]."""
        area, scale = self.ellipse, 3 * self.compliance / (2 * self.curvature_sum)
        return 1.5 * force ** (1 / 3) / (pi * area.a * area.b * scale ** (2 / 3))


class RollerContact(NamedTuple):
    """Line contact of a roller with a raceway.

    D_w         diameter of the roller [m]
    gamma       D_w cos(alpha) / D_pw of the inner raceway, its negative of the outer one
    compliance  2 (1 - nu^2) / E of roller and ring together [1/Pa]
    """

    D_w: float
    gamma: float
    compliance: float

    def pressure(self, force_per_length):
        """Largest pressure [Pa] under forces per length >= 0 [N/m]."""
        curvature = 2 / (self.D_w * (1 - self.gamma))
        return (force_per_length * curvature / (pi * self.compliance)) ** 0.5
