"""The coefficient of friction of a mesh by published formulas, as data; over a run it follows load and speed.

The formulas of Schlenk and of Niemann and Winter give its mean over the path of contact, that of Xu its local value.
The first two are power laws mu = c (w / v)^0.2 of the line load w = F_bt / b and of the sum v of the surface speeds
2 v_t sin(alpha_wt) at the pitch point, c of the geometry, the oil and the roughness. In the formulas w stands in N/mm,
v in m/s, the radius of curvature rho_redC in mm, the dynamic viscosity in mPa s and the roughness Ra in um.
"""

from dataclasses import dataclass
from math import cos, exp, inf, log10, pi, sin
from typing import NamedTuple

import numpy as np

from exugear.mesh_force.ring_pair import RingPair
from fem.pair.pair import GearPair
from fem.support.arguments import Numbers, checked
from fem.support.representation import short
from fem.support.validation import require, require_finite
from fem.units import GPa, mm, um

#: Line load below which the formulas hold the coefficient [N/m], and pitch line speed above which they do [m/s].
LEAST_LINE_LOAD, LARGEST_SPEED = 150e3, 50.0
#: Speeds over which dry friction may fade at standstill [rad/s].
FADING_SPEEDS = 0.01, 1e5
#: Sum of the surface speeds below which the coefficient is held [m/s]. The formulas would let it grow without bound; at
#: 0.1 m/s it has reached the 0.1 of boundary lubrication.
SLOWEST = 0.1
#: Exponent of line load over speed, and exponent of the viscosity.
EXPONENT, VISCOSITY_EXPONENT, XU_SPEED_EXPONENT = 0.2, -0.05, 0.100601
#: Ranges in which a viscosity [Pa s] and a roughness [m] are taken as given in their units.
VISCOSITIES, ROUGHNESSES = (5e-4, 5.0), (1e-8, 2e-5)
MILLIPASCAL_SECOND = 1e-3


class PowerLaw(NamedTuple):
    """mu = factor (F / v)^exponent, F and v within their limits.

    factor           the coefficient itself where the exponent is 0
    least_force, largest_force  limits of the transverse mesh force F [N]
    sum_speed        sum of the surface speeds at the pitch point per omega_1 - omega_2 [m]
    slowest, fastest limits of the sum velocity, that of both surfaces [m/s]
    """

    factor: float
    exponent: float = 0.0
    least_force: float = 0.0
    largest_force: float = inf
    sum_speed: float = 0.0
    slowest: float = 0.0
    fastest: float = inf

    def at(self, force: float, speed: float) -> float:
        """The coefficient at a mesh force [N] and a difference of the angular velocities [rad/s]."""
        if self.exponent == 0:
            return self.factor
        sum_speed = min(max(abs(speed) * self.sum_speed, self.slowest), self.fastest)
        return self.factor * (min(max(force, self.least_force), self.largest_force) / sum_speed) ** self.exponent


@checked
@short(roughness="um", viscosity="Pa s")
@dataclass(frozen=True)
class SchlenkFriction:
    """mu = 0.048 (w / (v rho_redC))^0.2 eta^-0.05 Ra^0.25 X_L, the mean coefficient of Schlenk.

    viscosity          dynamic, of the oil at its temperature of injection or in the sump [Pa s]
    roughness          mean of the arithmetic roughnesses Ra of both flanks [m]
    lubricant_factor   X_L: 1 for mineral oils, about 0.8 for polyalphaolefins

    The line load counts as at least 150 N/mm, the pitch line speed as at most 50 m/s, as in the source. Raises
    ValueError for values that suggest another unit.

    L. Schlenk, thesis, TU Munich 1994, as in B.-R. Höhn, K. Michaelis and M. Hinterstoißer, Optimization of gearbox
    efficiency, Goriva i maziva 48 (2009) 441. Much used for the losses by ISO/TR 14179-2, P = P_in mu H_v.
    """

    viscosity: float
    roughness: float
    lubricant_factor: float = 1.0

    def __post_init__(self):
        _check_oil(self.viscosity, self.roughness)
        factor = f"lubricant_factor must lie in (0.1, 5), 1 for mineral oils, got {self.lubricant_factor}"
        require(0.1 < self.lubricant_factor < 5, factor)

    @checked
    def power_law(self, pair: GearPair | RingPair) -> PowerLaw:
        """The law for a pair."""
        return _power_law(pair, 0.048 * self.lubricant_factor * (self.roughness / um) ** 0.25, self.viscosity)


@checked
@short(roughness="um", viscosity="Pa s")
@dataclass(frozen=True)
class NiemannFriction:
    """mu = 0.045 (w / (v rho_redC))^0.2 eta^-0.05 X_R, the mean coefficient of Niemann and Winter and of DIN 3990-4.

    viscosity   dynamic, of the oil at its temperature of injection or in the sump [Pa s]
    roughness   mean of the arithmetic roughnesses Ra of both flanks [m]; X_R = 2.2 (Ra / rho_redC)^0.25, Ra in um

    The line load counts as at least 150 N/mm, the pitch line speed as at most 50 m/s, as in the source. Raises
    ValueError for values that suggest another unit.

    DIN 3990-4:1987; G. Niemann and H. Winter, Maschinenelemente II, Springer, where X_R = 3.8 (Ra / d_1)^0.25.
    """

    viscosity: float
    roughness: float

    def __post_init__(self):
        _check_oil(self.viscosity, self.roughness)

    @checked
    def power_law(self, pair: GearPair | RingPair) -> PowerLaw:
        """The law for a pair."""
        roughness_factor = 2.2 * (self.roughness / um / (_radius_at_pitch_point(pair) / mm)) ** 0.25
        return _power_law(pair, 0.045 * roughness_factor, self.viscosity)


@checked
@short(roughness="um", viscosity="Pa s")
@dataclass(frozen=True)
class XuFriction:
    """The local coefficient of Xu, a regression of elastohydrodynamic solutions: it vanishes at the pitch point.

    viscosity   dynamic, of the oil at its inlet [Pa s]
    roughness   composite rms roughness of both flanks [m]

    mu = exp(f) P^1.03303 S^1.036077 V^-0.100601 eta^0.752755 R^-0.390958 with f = -8.916465 - 0.354068 S P lg(eta) +
    2.812084 exp(-S P lg(eta)) + 0.620305 exp(Ra); P is Hertz's pressure in GPa, S the sliding over the mean
    entrainment velocity V in m/s, eta the viscosity in mPa s, R the equivalent radius of curvature in m, Ra the
    roughness in um. Raises ValueError for values that suggest another unit.

    H. Xu, A. Kahraman, N. E. Anderson and D. G. Maddock, J. Mech. Des. 129 (2007) 58, for a 75W-90 gear oil.
    """

    viscosity: float
    roughness: float

    def __post_init__(self):
        _check_oil(self.viscosity, self.roughness)

    @checked
    def power_law(self, pair: GearPair | RingPair) -> PowerLaw:
        """Factor on the coefficient of a pair at a sum velocity of 1 m/s."""
        unit = {"least_force": 1.0, "largest_force": 1.0}
        return PowerLaw(1.0, XU_SPEED_EXPONENT, **unit, sum_speed=_sum_speed(pair), slowest=SLOWEST)

    @checked
    def local(self, pair: GearPair, distance: Numbers, line_load: Numbers):
        """Coefficient at points of the path of contact, at a sum velocity of 1 m/s at the pitch point.

        distance    beyond the pitch point along the line of action [m]
        line_load   [N/m]
        """
        s, w, (r_1, r_2) = np.asarray(distance, float), np.asarray(line_load, float), _pitch_radii(pair)
        require_finite("distance", s, "pass metres")
        low, high = -r_1 * sin(pair.alpha_wt), r_2 * sin(pair.alpha_wt)
        high = inf if r_2 < 0 else high
        within = f"distance must lie between the base circles, in ({low:.4g}, {high:.4g}) m"
        require(bool(((low < s) & (s < high)).all()), f"{within}, got {s.min():g} to {s.max():g} m; pass metres")
        require_finite("line_load", w, "pass N/m")
        require(bool((w >= 0).all()), f"line_load must be >= 0 N/m, got {w.min():g}")
        rho_1, rho_2 = r_1 * sin(pair.alpha_wt) + s, r_2 * sin(pair.alpha_wt) - s
        omega_1, omega_2 = (r / pair.a / _sum_speed(pair) for r in (r_2, r_1))
        mean_speed = (omega_1 * rho_1 + omega_2 * rho_2) / 2
        sliding = np.abs(omega_1 * rho_1 - omega_2 * rho_2) / mean_speed
        radius = rho_1 * rho_2 / (rho_1 + rho_2) / cos(pair.beta_b)
        pressure = np.sqrt(w / radius / pi / _compliance(pair)) / GPa
        eta = self.viscosity / MILLIPASCAL_SECOND
        x = sliding * pressure * log10(eta)
        f = -8.916465 - 0.354068 * x + 2.812084 * np.exp(-x) + 0.620305 * exp(self.roughness / um)
        size = pressure**1.03303 * sliding**1.036077 * mean_speed**-XU_SPEED_EXPONENT
        return np.exp(f) * size * eta**0.752755 * radius**-0.390958


def _compliance(pair: GearPair) -> float:
    """Sum of (1 - nu^2) / E of both gears [1/Pa]."""
    return sum((1 - gear.material.nu**2) / gear.material.E for gear in (pair.pinion, pair.wheel))


def _check_oil(viscosity: float, roughness: float) -> None:
    """ValueError for a viscosity [Pa s] or a roughness [m] that suggests another unit."""
    low, high = VISCOSITIES
    thick = f"viscosity must lie in ({low:g}, {high:g}) Pa s, got {viscosity:g}"
    require(low < viscosity < high, f"{thick}; pass Pa s, the dynamic viscosity: 20 mPa s are 0.02")
    low, high = ROUGHNESSES
    rough = f"roughness must lie in ({low / um:g}, {high / um:g}) um, got {roughness / um:g} um"
    require(low < roughness < high, f"{rough}; pass metres: 0.4*um")


def _radius_at_pitch_point(pair: GearPair | RingPair) -> float:
    """rho_redC, equivalent radius of curvature at the pitch point in the normal section [m]."""
    r_1, r_2 = _pitch_radii(pair)
    return r_1 * r_2 / pair.a * sin(pair.alpha_wt) / cos(pair.beta_b)


def _pitch_radii(pair: GearPair | RingPair) -> tuple[float, float]:
    """Working pitch radii of pinion and wheel [m], < 0 for a ring gear."""
    return pair.pinion.r_b / cos(pair.alpha_wt), pair.wheel.r_b / cos(pair.alpha_wt)


def _sum_speed(pair: GearPair | RingPair) -> float:
    """Sum of the surface speeds at the pitch point per omega_1 - omega_2 [m]."""
    r_1, r_2 = _pitch_radii(pair)
    return 2 * sin(pair.alpha_wt) * r_1 * r_2 / pair.a


def _power_law(pair: GearPair | RingPair, factor: float, viscosity: float) -> PowerLaw:
    """factor (w / (v rho_redC))^0.2 eta^-0.05 as a law of the mesh force [N] and of omega_1 - omega_2 [rad/s]."""
    line_load_per_newton = 1 / (pair.b / mm) / (_radius_at_pitch_point(pair) / mm)
    return PowerLaw(
        factor * (viscosity / MILLIPASCAL_SECOND) ** VISCOSITY_EXPONENT * line_load_per_newton**EXPONENT,
        EXPONENT,
        least_force=LEAST_LINE_LOAD * pair.b,
        sum_speed=_sum_speed(pair),
        slowest=SLOWEST,
        fastest=LARGEST_SPEED * 2 * sin(pair.alpha_wt),
    )


def check_fading_speed(speed: float) -> None:
    """ValueError unless a speed that regularizes dry friction at standstill [rad/s] is in range."""
    within = f"speed must be at least {FADING_SPEEDS[0]} rad/s and below {FADING_SPEEDS[1]:g}, got {speed}"
    require(FADING_SPEEDS[0] <= speed < FADING_SPEEDS[1], f"{within}; take a hundredth of that of the shafts")
