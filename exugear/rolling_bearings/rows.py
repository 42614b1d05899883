"""A row of rolling elements: geometry, contact constants, and the map from the motion of a ring to its contacts.

An element feels a ring displaced by (x, y, z) and tilted by (a, b) through xi = x cos psi + y sin psi, z and
tau = a sin psi - b cos psi. Two coordinates of its contact follow by a constant map. Of a ball they are the distances
of the groove centres, radial xi + R_0 and axial z + R tau + X_0; of a roller its approach cos(alpha) xi + sin(alpha)
(z + R tau) - gap and the tilt tau. One radius R = D_pw / 2 counts in kinematics and moments, so that the force is the
slope of an energy.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import cos, pi, sin

import numpy as np

from exugear.rolling_bearings.hertz import BallContact, RollerContact
from fem.units import mm

#: Force per approach^(10/9) and length^(8/9) of a roller between two steel raceways (ISO/TS 16281) [N/m^2].
LINE_CONTACT = 35948.0 / mm**2
#: Drops of profiles over the diameter of a roller (ISO/TS 16281): short cylindrical, tapered, long rollers.
SHORT_DROP, TAPERED_DROP, LONG_DROP = 0.00035, 0.00045, 0.0005
#: Length over diameter from which a roller is long.
LONG = 2.5
#: Least axial distance of the groove centres of pressed balls, over that of the centred bearing.
LEAST_ANGLE = 0.1
#: Pressure at the static capacity [Pa] (ISO 76).
STATIC_PRESSURE_OF_BALLS, STATIC_PRESSURE_OF_ROLLERS = 4200e6, 4000e6


@dataclass(frozen=True)
class Row:
    """A row of rolling elements.

    Z            number of elements
    D_w, D_pw    diameter of the elements, of the pitch circle [m]
    alpha        nominal contact angle [rad]
    E, nu        Young's modulus [Pa] and Poisson's ratio of elements and rings
    axial        position from the centre of the bearing [m]
    direction    1: a motion of the shaft along z closes the contacts, -1: against z
    cage_angle   of the first element while the shaft has not turned [rad], where the cage rolls with the shaft; None:
                 the cage stands, the first element on the x axis
    on_pin       whether the outer ring moves with the shaft instead of the inner one, which stands
    """

    Z: int
    D_w: float
    D_pw: float
    alpha: float = 0.0
    E: float = 210e9
    nu: float = 0.3
    axial: float = 0.0
    direction: int = 1
    cage_angle: float | None = None
    on_pin: bool = False

    @property
    def R(self) -> float:
        """Radius at which forces act on the elements [m]."""
        return self.D_pw / 2

    @property
    def gamma(self) -> float:
        """D_w cos(alpha) / D_pw."""
        return self.D_w * cos(self.alpha) / self.D_pw

    @property
    def compliance(self) -> float:
        """2 (1 - nu^2) / E [1/Pa]."""
        return 2 * (1 - self.nu**2) / self.E

    @cached_property
    def angles(self) -> np.ndarray:
        """(Z,) angles of the elements from x [rad], while the cage has not turned."""
        return (self.cage_angle or 0.0) + 2 * pi * np.arange(self.Z) / self.Z

    @property
    def cage_ratio(self) -> float:
        """Turns of the cage per turn of the shaft, 0 where it stands: (1 - gamma) / 2, of the outer ring the rest."""
        return 0.0 if self.cage_angle is None else (1 - self.moving_side * self.gamma) / 2

    @property
    def moving_side(self) -> int:
        """1 where the inner ring moves with the shaft, -1 where the outer one does: its motion closes contacts."""
        return -1 if self.on_pin else 1

    def ring_motion(self, q: np.ndarray) -> np.ndarray:
        """(n, Z, 3) xi, z, tau at the elements, by displacements q (n, 5) [m, rad] of the bearing."""
        x, y, z, a, b = np.moveaxis(q, -1, 0)
        x, y = x + self.axial * b, y - self.axial * a
        c, s = np.cos(self.angles), np.sin(self.angles)
        xi, tau = np.multiply.outer(x, c) + np.multiply.outer(y, s), np.multiply.outer(a, s) - np.multiply.outer(b, c)
        z = np.broadcast_to(z[..., None], xi.shape)
        return np.stack([xi, self.direction * z, self.direction * tau], -1)

    def contacts(self, q: np.ndarray) -> np.ndarray:
        """(n, Z, 2) coordinates of the contacts at displacements q (n, 5) [m, rad] of the bearing."""
        return self.origin + self.ring_motion(q) @ self.map.T

    @property
    def stiffness(self) -> float:
        """Factor of the power of the approach of an element or of its lamina."""
        raise NotImplementedError

    @property
    def static_approach(self) -> float:
        """Approach [m] at the pressure of the static capacity."""
        raise NotImplementedError

    def preloaded(self, approach: float) -> "Row":
        """The row whose rings are pushed together along the axis [m]."""
        raise NotImplementedError

    def comes_apart(self, q: np.ndarray) -> np.ndarray:
        """(n,) whether displacements q (n, 5) part the rings, so that elements press where rings have no shoulder."""
        return np.zeros(len(q), bool)

    def loads(self, q: np.ndarray) -> np.ndarray:
        """(n, Z) forces of the elements [N] at displacements q (n, 5) [m, rad]."""
        raise NotImplementedError

    @property
    def origin(self) -> np.ndarray:
        """(2,) coordinates of the contacts of the centred bearing."""
        raise NotImplementedError

    @property
    def map(self) -> np.ndarray:
        """(2, 3) slopes of the coordinates of a contact by xi, z and tau."""
        raise NotImplementedError


@dataclass(frozen=True)
class BallRow(Row):
    """A row of balls.

    r_i, r_e   radii of the grooves of inner and outer ring [m]
    X_0, R_0   axial and radial distance of the groove centres of the centred bearing [m]
    """

    r_i: float = 0.0
    r_e: float = 0.0
    X_0: float = 0.0
    R_0: float = 0.0

    @property
    def A(self) -> float:
        """Distance of the groove centres at which a ball just touches both [m]."""
        return self.r_i + self.r_e - self.D_w

    @property
    def inner(self) -> BallContact:
        """Contact with the inner raceway."""
        return BallContact(self.D_w, self.r_i, self.gamma, self.compliance)

    @property
    def outer(self) -> BallContact:
        """Contact with the outer raceway."""
        return BallContact(self.D_w, self.r_e, -self.gamma, self.compliance)

    @property
    def stiffness(self) -> float:
        """Force of a ball over the approach of both rings^1.5 [N/m^1.5]."""
        return (self.inner.stiffness ** (-2 / 3) + self.outer.stiffness ** (-2 / 3)) ** -1.5

    @property
    def origin(self) -> np.ndarray:
        """(2,) radial and axial distance of the groove centres of the centred bearing [m]."""
        return np.array([self.R_0, self.X_0])

    @property
    def map(self) -> np.ndarray:
        """(2, 3) slopes of these distances by xi, z and tau."""
        return self.moving_side * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, self.R]])

    def loads(self, q: np.ndarray) -> np.ndarray:
        """(n, Z) forces of the balls [N] at displacements q (n, 5) [m, rad]."""
        approach = np.hypot(*np.moveaxis(self.contacts(q), -1, 0)) - self.A
        return self.stiffness * np.maximum(approach, 0.0) ** 1.5

    def comes_apart(self, q: np.ndarray) -> np.ndarray:
        """(n,) whether balls of an angular contact row press with a tenth of their contact angle, or beyond it."""
        if self.alpha == 0:
            return super().comes_apart(q)
        radial, axial = np.moveaxis(self.contacts(q), -1, 0)
        pressing = np.hypot(radial, axial) > self.A
        return (pressing & (axial < LEAST_ANGLE * self.A * sin(self.alpha))).any(axis=1)

    @property
    def static_approach(self) -> float:
        """Approach [m] at the pressure of the static capacity, at the more heavily pressed raceway."""
        pressure = max(self.inner.pressure(1.0), self.outer.pressure(1.0))
        return ((STATIC_PRESSURE_OF_BALLS / pressure) ** 3 / self.stiffness) ** (2 / 3)

    def preloaded(self, approach: float) -> "BallRow":
        """The row whose rings are pushed together along the axis [m]."""
        return replace(self, X_0=self.X_0 + approach)


@dataclass(frozen=True)
class RollerRow(Row):
    """A row of rollers, cut into laminae (ISO/TS 16281).

    L_we      effective length of a roller [m]
    gap       approach after which the centre of a roller touches [m]
    drop      of the profile over the diameter: P = drop D_w ln(1 / (1 - (2 x / L_we)^2)); None: of long rollers, by
              which only the ends of 1.25 D_w drop
    laminae   number of laminae
    """

    L_we: float = 0.0
    gap: float = 0.0
    drop: float = SHORT_DROP
    laminae: int = 30

    @cached_property
    def slices(self) -> np.ndarray:
        """(laminae,) positions of the laminae along the roller [m]."""
        return (np.arange(self.laminae) + 0.5 - self.laminae / 2) * self.L_we / self.laminae

    @cached_property
    def profile(self) -> np.ndarray:
        """(laminae,) drop of the roller's surface at the laminae [m]."""
        if self.L_we <= LONG * self.D_w:
            return -self.drop * self.D_w * np.log(1 - (2 * self.slices / self.L_we) ** 2)
        ends = np.maximum(2 * np.abs(self.slices) - self.L_we + LONG * self.D_w, 0.0) / (LONG * self.D_w)
        return -LONG_DROP * self.D_w * np.log(1 - ends**2)

    @property
    def stiffness(self) -> float:
        """Force of a lamina over its approach^(10/9) [N/m^(10/9)]."""
        return LINE_CONTACT * self.L_we ** (8 / 9) / self.laminae

    @property
    def inner(self) -> RollerContact:
        """Contact with the inner raceway."""
        return RollerContact(self.D_w, self.gamma, self.compliance)

    @property
    def outer(self) -> RollerContact:
        """Contact with the outer raceway."""
        return RollerContact(self.D_w, -self.gamma, self.compliance)

    @property
    def origin(self) -> np.ndarray:
        """(2,) approach [m] and tilt of a roller of the centred bearing."""
        return np.array([-self.gap, 0.0])

    @property
    def map(self) -> np.ndarray:
        """(2, 3) slopes of approach and tilt by xi, z and tau."""
        axial = sin(self.alpha)
        return self.moving_side * np.array([[cos(self.alpha), axial, self.R * axial], [0.0, 0.0, 1.0]])

    def lamina_loads(self, q: np.ndarray) -> np.ndarray:
        """(n, Z, laminae) forces of the laminae [N] at displacements q (n, 5) [m, rad]."""
        approach, tilt = np.moveaxis(self.contacts(q), -1, 0)
        each = approach[..., None] - tilt[..., None] * self.slices - 2 * self.profile
        return self.stiffness * np.maximum(each, 0.0) ** (10 / 9)

    def loads(self, q: np.ndarray) -> np.ndarray:
        """(n, Z) forces of the rollers [N] at displacements q (n, 5) [m, rad]."""
        return self.lamina_loads(q).sum(axis=-1)

    @property
    def static_approach(self) -> float:
        """Approach [m] of a straight roller at the pressure of the static capacity, at the inner raceway."""
        lamina = self.L_we / self.laminae
        force = lamina * (STATIC_PRESSURE_OF_ROLLERS / self.inner.pressure(1.0)) ** 2
        return (force / self.stiffness) ** 0.9

    def preloaded(self, approach: float) -> "RollerRow":
        """The row whose rings are pushed together along the axis [m]."""
        return replace(self, gap=self.gap - approach * sin(self.alpha))


def static_capacity(row: Row) -> float:
    """Static radial capacity of a row [N] (ISO 76): the heaviest element, with 5 / Z of the load, at that pressure."""
    if isinstance(row, BallRow):
        heaviest = row.stiffness * row.static_approach**1.5
    else:
        assert isinstance(row, RollerRow)
        heaviest = row.L_we * (STATIC_PRESSURE_OF_ROLLERS / row.inner.pressure(1.0)) ** 2
    return row.Z * cos(row.alpha) * heaviest / 5
