"""Torques that brake a shaft, as data: constant and viscous ones, and the drag of rolling bearings after Palmgren."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from exugear.mesh_force.friction_coefficient import check_fading_speed
from fem.support.arguments import Numbers, checked
from fem.support.numba_cache import compiled_or_not
from fem.support.representation import short
from fem.support.validation import require, require_finite
from fem.units import mm, rpm

#: Largest torque [N m] and largest viscous factor.
LARGEST_TORQUE, LARGEST_VISCOUS = 1e6, 1e5
#: Ranges in which a kinematic viscosity [m^2/s], a mean diameter [m] and the factors are taken as given in their units.
VISCOSITIES, DIAMETERS, LARGEST_F_0, LARGEST_F_1 = (1e-7, 1e-2), (1e-3, 3.0), 50.0, 0.05
#: Product of kinematic viscosity [mm^2/s] and speed [1/min] below which the hydrodynamic part is constant.
LEAST_VISCOUS_SPEED = 2000.0
EXPONENT = 2 / 3


class DragTerms(NamedTuple):
    """tanh(omega / speed) (constant + arm P + hydrodynamic max(|omega|, least_speed)^(2/3)) + viscous omega [N m].

    arm   [m]; P is the load of the bearing [N]
    """

    speed: float
    constant: float = 0.0
    arm: float = 0.0
    hydrodynamic: float = 0.0
    least_speed: float = 1.0
    viscous: float = 0.0


@compiled_or_not
def braking_torque(terms, omega, load):
    """Torque against the rotation [N m], signed like omega [rad/s], by `DragTerms` and a load [N]."""
    hydrodynamic = terms.hydrodynamic * np.maximum(np.abs(omega), terms.least_speed) ** EXPONENT
    return np.tanh(omega / terms.speed) * (terms.constant + terms.arm * load + hydrodynamic) + terms.viscous * omega


@compiled_or_not
def braking_slope(terms, omega, load):
    """Derivative of `braking_torque` by the speed [N m s/rad]."""
    faded, speed = np.tanh(omega / terms.speed), np.maximum(np.abs(omega), terms.least_speed)
    hydrodynamic = terms.hydrodynamic * speed**EXPONENT
    sliding = terms.constant + terms.arm * load + hydrodynamic
    steeper = np.where(np.abs(omega) > terms.least_speed, EXPONENT * hydrodynamic / speed, 0.0)
    return (1.0 - faded**2) / terms.speed * sliding + np.abs(faded) * steeper + terms.viscous


@checked
@short(constant="N m", viscous="N m s/rad", speed="rad/s")
@dataclass(frozen=True)
class Drag:
    """A torque that brakes a shaft: constant tanh(omega / speed) + viscous omega; of seals, oil, a fan or a bearing.

    constant   [N m]
    viscous    torque per speed of the shaft [N m s/rad]
    speed      [rad/s] that regularizes the constant torque at standstill, so that a shaft comes to rest smoothly

    A shaft carries it as a part at any axial position, or a `Bearing` carries it. Raises ValueError for values out of
    range.
    """

    constant: float = 0.0
    viscous: float = 0.0
    speed: float = field(default=1.0, kw_only=True)

    def __post_init__(self):
        brakes = "a drag brakes"
        constant = f"constant must lie in [0, {LARGEST_TORQUE:g}) N m, {brakes}, got {self.constant}"
        require(0 <= self.constant < LARGEST_TORQUE, constant)
        viscous = f"viscous must lie in [0, {LARGEST_VISCOUS:g}) N m s/rad, {brakes}, got {self.viscous}"
        require(0 <= self.viscous < LARGEST_VISCOUS, viscous)
        check_fading_speed(self.speed)

    @property
    def terms(self) -> DragTerms:
        """The terms of the torque."""
        return DragTerms(self.speed, self.constant, viscous=self.viscous)

    @property
    def needs_load(self) -> bool:
        """Whether the torque depends on the load of a bearing."""
        return False

    @checked
    def torque(self, omega: Numbers):
        """Torque against the rotation [N m] at speeds of the shaft [rad/s], number or array; signed like the speed."""
        return braking_torque(self.terms, _finite("omega", omega, "rad/s"), 0.0)


@checked
@short(d_m="mm", viscosity="m^2/s", load="N", speed="rad/s")
@dataclass(frozen=True)
class BearingDrag:
    """Drag of a rolling bearing after Palmgren: M_0 of the oil and M_1 = f_1 P d_m of the load.

    d_m         mean diameter, (bore + outer diameter) / 2 [m]
    f_0         of type and lubrication: for an oil bath about 2 for deep groove ball bearings, 2 to 4 for cylindrical
                and 6 for tapered roller bearings
    viscosity   kinematic, of the oil in the bearing [m^2/s]
    f_1         of type and load: 0.0004 to 0.0009 (P_0 / C_0)^0.55 for deep groove ball bearings (Harris and Kotzalas),
                0.0002 to 0.0004 for cylindrical roller bearings
    load        equivalent load P [N]; by default the radial force of the elastic `Bearing` that carries the drag, as it
                is in the run
    speed       [rad/s] that regularizes the torque at standstill by tanh(omega / speed)

    M_0 = 1e-7 f_0 (nu n)^(2/3) d_m^3 [N mm] for nu n > 2000, nu in mm^2/s, n in 1/min, d_m in mm. Below it is constant;
    sources round it there to 160e-7 f_0 d_m^3, which is 0.8 % more. Raises ValueError for values that suggest another
    unit.

    A. Palmgren, Grundlagen der Waelzlagertechnik (1964); T. A. Harris and M. N. Kotzalas, Rolling bearing analysis,
    CRC Press (2007); f_0 and f_1 stand in catalogues of bearings and in ISO/TR 14179-2.
    """

    d_m: float
    f_0: float
    viscosity: float
    f_1: float = 0.0
    load: float | None = field(default=None, kw_only=True)
    speed: float = field(default=1.0, kw_only=True)

    def __post_init__(self):
        (least, largest), (thin, thick) = DIAMETERS, VISCOSITIES
        diameter = f"d_m must lie in ({least:g}, {largest:g}) m, got {self.d_m:g}; pass metres: 60*mm"
        require(least < self.d_m < largest, diameter)
        require(0 <= self.f_0 < LARGEST_F_0, f"f_0 must lie in [0, {LARGEST_F_0:g}), about 2, got {self.f_0}")
        viscosity = f"viscosity must lie in ({thin:g}, {thick:g}) m^2/s, got {self.viscosity:g}"
        require(thin < self.viscosity < thick, f"{viscosity}; pass m^2/s, the kinematic viscosity: 20 mm^2/s are 20e-6")
        require(0 <= self.f_1 < LARGEST_F_1, f"f_1 must lie in [0, {LARGEST_F_1:g}), about 0.0003, got {self.f_1}")
        newton = f"load must lie in [0, 1e9) N, got {self.load}"
        require(self.load is None or 0 <= self.load < 1e9, newton)
        check_fading_speed(self.speed)

    @property
    def terms(self) -> DragTerms:
        """The terms of the torque; the arm is 0 where the load is given."""
        per_radian = self.viscosity / (mm**2 * rpm)
        hydrodynamic = 1e-10 * self.f_0 * per_radian**EXPONENT * (self.d_m / mm) ** 3
        arm = self.f_1 * self.d_m
        constant, arm = (0.0, arm) if self.load is None else (arm * self.load, 0.0)
        return DragTerms(self.speed, constant, arm, hydrodynamic, LEAST_VISCOUS_SPEED / per_radian)

    @property
    def needs_load(self) -> bool:
        """Whether the torque depends on the force of the bearing in the run."""
        return self.load is None and self.f_1 > 0

    @checked
    def torque(self, omega: Numbers, load: Numbers = 0.0):
        """Torque against the rotation [N m] at speeds of the shaft [rad/s], number or array; signed like the speed.

        load   radial force of the bearing >= 0 [N], if the drag has no load of its own
        """
        force = _finite("load", load, "N")
        require(bool((force >= 0).all()), f"load must be >= 0 N, got {force.min():g}; pass the magnitude of the force")
        return braking_torque(self.terms, _finite("omega", omega, "rad/s"), force)


def _finite(name: str, values, unit: str) -> np.ndarray:
    """The values as array; ValueError unless all are finite."""
    require_finite(name, values, f"pass {unit}")
    return np.asarray(values, float)
