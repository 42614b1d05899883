"""The mean coefficient of friction of a mesh by published formulas, as data; over a run it follows load and speed.

Both formulas are power laws mu = c (w / v)^0.2 of the line load w = F_bt / b and of the sum v of the surface speeds
2 v_t sin(alpha_wt) at the pitch point, c of the geometry, the oil and the roughness. In the formulas w stands in N/mm,
v in m/s, the radius of curvature rho_redC in mm, the dynamic viscosity in mPa s and the roughness Ra in um.
"""

from dataclasses import dataclass
from math import cos, inf, sin
from typing import NamedTuple

from exugear.mesh_force.ring_pair import RingPair
from fem.pair.pair import GearPair
from fem.support.arguments import checked
from fem.support.representation import short
from fem.support.validation import require
from fem.units import mm, um

#: Line load below which the formulas hold the coefficient [N/m], and pitch line speed above which they do [m/s].
LEAST_LINE_LOAD, LARGEST_SPEED = 150e3, 50.0
#: Sum of the surface speeds below which the coefficient is held [m/s]. The formulas would let it grow without bound; at
#: 0.1 m/s it has reached the 0.1 of boundary lubrication.
SLOWEST = 0.1
#: Exponent of line load over speed, and exponent of the viscosity.
EXPONENT, VISCOSITY_EXPONENT = 0.2, -0.05
#: Ranges in which a viscosity [Pa s] and a roughness [m] are taken as given in their units.
VISCOSITIES, ROUGHNESSES = (5e-4, 5.0), (1e-8, 2e-5)
MILLIPASCAL_SECOND = 1e-3


class PowerLaw(NamedTuple):
    """mu = factor (F / v)^exponent, F the mesh force, at least least_force, v within slowest and fastest.

    factor           the coefficient itself where the exponent is 0
    least_force      [N], transverse
    sum_speed        sum of the surface speeds at the pitch point per omega_1 - omega_2 [m]
    slowest, fastest limits of the sum of the surface speeds [m/s]
    """

    factor: float
    exponent: float = 0.0
    least_force: float = 0.0
    sum_speed: float = 0.0
    slowest: float = 0.0
    fastest: float = inf

    def at(self, force: float, speed: float) -> float:
        """The coefficient at a mesh force [N] and a difference of the angular velocities [rad/s]."""
        sum_speed = min(max(abs(speed) * self.sum_speed, self.slowest), self.fastest)
        return (
            self.factor * (max(force, self.least_force) / sum_speed) ** self.exponent if self.exponent else self.factor
        )


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


def _power_law(pair: GearPair | RingPair, factor: float, viscosity: float) -> PowerLaw:
    """factor (w / (v rho_redC))^0.2 eta^-0.05 as a law of the mesh force [N] and of omega_1 - omega_2 [rad/s]."""
    r_1, r_2 = _pitch_radii(pair)
    pitch_line_speed = r_1 * r_2 / pair.a
    sum_over_pitch_line = 2 * sin(pair.alpha_wt)
    line_load_per_newton = 1 / (pair.b / mm) / (_radius_at_pitch_point(pair) / mm)
    return PowerLaw(
        factor * (viscosity / MILLIPASCAL_SECOND) ** VISCOSITY_EXPONENT * line_load_per_newton**EXPONENT,
        EXPONENT,
        LEAST_LINE_LOAD * pair.b,
        pitch_line_speed * sum_over_pitch_line,
        SLOWEST,
        LARGEST_SPEED * sum_over_pitch_line,
    )
