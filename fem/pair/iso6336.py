"""Tooth stiffness and dynamic factor by ISO 6336-1, method B: quick estimates to compare with computed ones.

The stiffness does not take rim and hub into account: a gear that is clamped at its bore is softer, often by a third.
"""

from dataclasses import dataclass, fields
from math import cos, degrees, inf, pi, sin, sqrt

import numpy as np
import xarray as xr

from fem.gear.gear import Gear
from fem.pair.pair import GearPair
from fem.support.arguments import Numbers, checked
from fem.support.representation import short
from fem.support.validation import as_floats, number, numbers, require
from fem.units import GPa, mm

__all__ = [
    "FlankDeviations",
    "basic_rack_factor",
    "dynamic_factor",
    "face_load_stiffness",
    "mesh_stiffness",
    "reduced_mass",
    "resonance_speed",
    "single_stiffness",
    "virtual_teeth",
]


def __dir__() -> list[str]:
    """Public names, for help and completion."""
    return __all__


#: Line load from which on the stiffness is constant [N/m].
LINE_LOAD_OF_STANDARD = 100e3
#: Young's modulus E_St of steel that the coefficients hold for; the stiffness of other materials is scaled with E.
STEEL_OF_STANDARD = 206 * GPa
#: C_1 to C_9 of the standard, for the compliance of a tooth pair [mm um/N].
COEFFICIENTS = (0.04723, 0.15551, 0.25791, -0.00635, -0.11654, -0.00193, -0.24188, 0.00529, 0.00182)
#: 1 N/(mm um) in N/m^2.
PER_MM_UM = 1e9
#: Resonance ratios at which the main resonance ends and the supercritical range begins.
END_OF_RESONANCE, SUPERCRITICAL = 1.15, 1.5
#: Larger deviations are probably not in metres.
LARGEST_DEVIATION = 1 * mm


@checked
def virtual_teeth(gear: Gear) -> float:
    """Number of teeth z_n of the virtual spur gear; < 0 of an internal gear."""
    return gear.z / (cos(gear.beta_b) ** 2 * cos(gear.beta))


@checked
def single_stiffness(
    pair: GearPair, line_load: float = LINE_LOAD_OF_STANDARD, *, C_R: float = 1.0, C_M: float = 0.8
) -> float:
    """Largest stiffness c' of a tooth pair per face width [N/m^2].

    line_load   F_t K_A / b [N/m], F_t at the reference circle; below 100 N/mm the stiffness is proportional to its
                fourth root
    C_R         gear blank factor of web and rim; 1: solid discs
    C_M         correction factor of the theoretical stiffness by measurements

    Index 1 of the standard is the smaller gear, whichever drives; a ring has infinitely many teeth. With the default
    `Material`, E = 210 GPa, the stiffness is 210 / 206 of that of the standard for steel.

    Source: ISO 6336-1, 9.3; 1 N/(mm um) = 1e9 N/m^2. Raises ValueError for a line load <= 0, factors outside (0, 1].
    """
    require(
        0 < number("line_load", line_load) < np.inf,
        f"line_load must be > 0 N/m (pass 100e3 for 100 N/mm), got {line_load}",
    )
    for name, factor in (("C_R", C_R), ("C_M", C_M)):
        require(0 < number(name, factor) <= 1, f"{name} must lie in (0, 1] (solid discs: C_R = 1), got {factor}")
    smaller, larger = sorted((pair.pinion, pair.wheel), key=lambda gear: (abs(gear.z), abs(gear.d_a)))
    z_1, z_2, x_1, x_2 = virtual_teeth(smaller), virtual_teeth(larger), smaller.x, larger.x
    z_2 = inf if larger.internal else z_2
    terms = (1, 1 / z_1, 1 / z_2, x_1, x_1 / z_1, x_2, x_2 / z_2, x_1**2, x_2**2)
    theoretical = PER_MM_UM / sum(c * term for c, term in zip(COEFFICIENTS, terms, strict=True))
    rack = (basic_rack_factor(smaller) + basic_rack_factor(larger)) / 2
    light = min(1.0, line_load / LINE_LOAD_OF_STANDARD) ** 0.25
    return theoretical * C_M * C_R * rack * cos(smaller.beta) * light * _relative_modulus(pair)


@checked
def basic_rack_factor(gear: Gear) -> float:
    """Basic rack factor C_B from dedendum and pressure angle of the generating rack."""
    dedendum = gear.h_rack / gear.m_n + gear.x
    return (1 + 0.5 * (1.2 - dedendum)) * (1 - 0.02 * (20 - degrees(gear.alpha_n)))


@checked
def mesh_stiffness(
    pair: GearPair, line_load: float = LINE_LOAD_OF_STANDARD, *, C_R: float = 1.0, C_M: float = 0.8
) -> float:
    """Mean mesh stiffness c_gamma_alpha per face width [N/m^2] (ISO 6336-1:2006, 9.3).

    The standard gives it for eps_alpha >= 1.2; below, the same formula is used.
    """
    return single_stiffness(pair, line_load, C_R=C_R, C_M=C_M) * (0.75 * pair.eps_alpha + 0.25)


@checked
def face_load_stiffness(
    pair: GearPair, line_load: float = LINE_LOAD_OF_STANDARD, *, C_R: float = 1.0, C_M: float = 0.8
) -> float:
    """Mesh stiffness c_gamma_beta per face width [N/m^2], for the face load factor K_Hbeta (ISO 6336-1:2006, 9.3)."""
    return 0.85 * mesh_stiffness(pair, line_load, C_R=C_R, C_M=C_M)


def _relative_modulus(pair: GearPair) -> float:
    """Effective Young's modulus of the pair over that of the standard's steel."""
    E_1, E_2 = pair.pinion.material.E, pair.wheel.material.E
    return 2 * E_1 * E_2 / (E_1 + E_2) / STEEL_OF_STANDARD


@checked
@short(f_pb_eff="um", f_f_alpha_eff="um", C_a="um")
@dataclass(frozen=True)
class FlankDeviations:
    """Deviations of the flanks of a pair, for `dynamic_factor`.

    f_pb_eff        effective base pitch deviation f_pb - y_p, reduced by running in [m]
    f_f_alpha_eff   effective profile form deviation f_f_alpha - y_f, reduced by running in [m]
    C_a             tip relief, of the design or by running in [m]

    Raises ValueError for deviations outside [0, 1] mm.
    """

    f_pb_eff: float = 0.0
    f_f_alpha_eff: float = 0.0
    C_a: float = 0.0

    def __post_init__(self):
        as_floats(self)
        for field in fields(self):
            value = getattr(self, field.name)
            require(0 <= value < LARGEST_DEVIATION, f"{field.name} must lie in [0, 1] mm (pass metres), got {value} m")


@checked
def reduced_mass(pair: GearPair) -> float:
    """Reduced mass m_red of the gears on the line of action, per face width [kg/m] (ISO 6336-1:2006, 6.5.9).

    Each gear is a ring from its bore to the mean of its tip and root diameters, with the density of its material; an
    internal gear from there to the outside of its rim.
    """
    masses = [_mass_on_base_circle(gear) for gear in (pair.pinion, pair.wheel)]
    return masses[0] * masses[1] / sum(masses)


def _mass_on_base_circle(gear: Gear) -> float:
    """Moment of inertia over the square of the base radius, per face width [kg/m]."""
    mean = (gear.r_a + gear.r_f) / 2
    return pi / 2 * gear.material.density * abs(mean**4 - gear.r_clamp**4) / gear.r_b**2


@checked
def resonance_speed(
    pair: GearPair, line_load: float = LINE_LOAD_OF_STANDARD, *, C_R: float = 1.0, mass: float | None = None
) -> float:
    """Speed n_E1 of the pinion at the main resonance of the pair [rad/s] (ISO 6336-1:2006, 6.5.3).

    line_load, C_R   as for `single_stiffness`
    mass             reduced mass per face width [kg/m], by default `reduced_mass`
    """
    mass = reduced_mass(pair) if mass is None else mass
    require(0 < mass < np.inf, f"mass must be > 0 kg/m and finite, a mass per face width, got {mass}")
    return sqrt(mesh_stiffness(pair, line_load, C_R=C_R) / mass) / pair.pinion.z


@checked
def dynamic_factor(
    pair: GearPair,
    torque: float,
    speed: Numbers,
    *,
    deviations: FlankDeviations | None = None,
    K_A: float = 1.0,
    C_R: float = 1.0,
    mass: float | None = None,
) -> xr.DataArray:
    """Dynamic factor K_v over the speed of the pinion.

    torque      on the pinion > 0 [N m]
    speed       of the pinion: one or several values >= 0 [rad/s]
    deviations  of the flanks; by default none, which leaves the excitation by the varying mesh stiffness
    K_A         application factor, times the mesh load factor K_gamma
    C_R, mass   as for `resonance_speed`

    The coordinate "resonance_ratio" is the ratio N of the speed to that of the main resonance, the attribute
    "resonance_speed" is the latter [rad/s]. At the beginning N_S of the main resonance the factor jumps, as in the
    standard.

    Source: ISO 6336-1:2006, method B, 6.5.3 to 6.5.9 and table 8. Raises ValueError for values out of range.
    """
    require(0 < number("torque", torque) < np.inf, f"torque must be > 0 N m, got {torque}")
    require(0 < number("K_A", K_A) < np.inf, f"K_A must be > 0 and finite, got {K_A}")
    speeds = numbers("speed", speed)
    within = bool(((speeds >= 0) & np.isfinite(speeds)).all() and speeds.ndim < 2)
    require(within, f"speed must be >= 0 rad/s and finite, one or several, got {speed}")
    line_load = torque / pair.pinion.r * K_A / pair.b
    main_resonance = resonance_speed(pair, line_load, C_R=C_R, mass=mass)
    stiffness = single_stiffness(pair, line_load, C_R=C_R)
    ratio = speeds / main_resonance
    factor = _over_resonance_ratio(ratio, pair.eps_gamma, line_load, stiffness, deviations or FlankDeviations())
    dims = ("speed",) * speeds.ndim
    coordinates = {
        "speed": (dims, speeds, {"units": "rad/s", "long_name": "speed of the pinion"}),
        "resonance_ratio": (dims, ratio, {"units": "1", "long_name": "speed over that of the main resonance"}),
    }
    about = {"units": "1", "long_name": "dynamic factor by ISO 6336-1, method B", "resonance_speed": main_resonance}
    return xr.DataArray(factor, coordinates, dims, "K_v", about)


def _over_resonance_ratio(
    ratio: np.ndarray, eps_gamma: float, line_load: float, stiffness: float, deviations: FlankDeviations
) -> np.ndarray:
    """K_v at resonance ratios N, in the four ranges of ISO 6336-1:2006, 6.5.4 to 6.5.7."""
    C_v1, C_v2, C_v3, C_v4, C_v5, C_v6, C_v7 = _coefficients(eps_gamma)
    B_p = stiffness * deviations.f_pb_eff / line_load
    B_f = stiffness * deviations.f_f_alpha_eff / line_load
    B_k = abs(1 - stiffness * deviations.C_a / line_load)
    subcritical = 1 + ratio * (C_v1 * B_p + C_v2 * B_f + C_v3 * B_k)
    resonance = 1 + C_v1 * B_p + C_v2 * B_f + C_v4 * B_k
    supercritical = C_v5 * B_p + C_v6 * B_f + C_v7
    share = np.clip((SUPERCRITICAL - ratio) / (SUPERCRITICAL - END_OF_RESONANCE), 0, 1)
    above = supercritical + share * (resonance - supercritical)
    N_S = 0.5 + 0.35 * sqrt(min(1.0, line_load / LINE_LOAD_OF_STANDARD))
    return np.where(ratio <= N_S, subcritical, above)


def _coefficients(eps_gamma: float) -> tuple[float, ...]:
    """C_v1 to C_v7 of ISO 6336-1:2006, table 8."""
    C_v7 = 0.75 if eps_gamma <= 1.5 else 0.875 + 0.125 * sin(pi * (min(eps_gamma, 2.5) - 2))
    if eps_gamma <= 2:
        return 0.32, 0.34, 0.23, 0.90, 0.47, 0.47, C_v7
    C_v4 = (0.57 - 0.05 * eps_gamma) / (eps_gamma - 1.44)
    return 0.32, 0.57 / (eps_gamma - 0.3), 0.096 / (eps_gamma - 1.56), C_v4, 0.47, 0.12 / (eps_gamma - 1.74), C_v7
