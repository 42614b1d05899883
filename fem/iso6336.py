"""Tooth stiffness after ISO 6336-1, method B: a quick estimate beside the finite elements.

It knows neither rim nor hub: a gear clamped at its bore is softer by what its body yields, often by a third.
"""

from math import cos, degrees

from fem.checks import number
from fem.gear import STEEL, Gear, GearPair, require

LINE_LOAD_OF_STANDARD = 100e3
COEFFICIENTS = (0.04723, 0.15551, 0.25791, -0.00635, -0.11654, -0.00193, -0.24188, 0.00529, 0.00182)
PER_MM_UM = 1e9


def virtual_teeth(gear: Gear) -> float:
    """Number of teeth z_n of the virtual spur gear."""
    return gear.z / (cos(gear.beta_b) ** 2 * cos(gear.beta))


def single_stiffness(pair: GearPair, line_load: float = LINE_LOAD_OF_STANDARD) -> float:
    """Largest stiffness c' of one pair of teeth per face width [N/m^2] (solid discs, C_R = 1).

    line_load   F_t K_A / b [N/m]; below 100 N/mm the stiffness falls with its fourth root

    Index 1 of the standard is the smaller gear, whichever drives.

    Source: ISO 6336-1, 9.3; 1 N/(mm um) = 1e9 N/m^2. Raises ValueError for a line load <= 0.
    """
    require(number("line_load", line_load) > 0, f"line_load must be > 0 N/m (pass 100e3 for 100 N/mm), got {line_load}")
    pinion, wheel = sorted((pair.pinion, pair.wheel), key=lambda gear: (gear.z, gear.d_a))
    one, other = 1 / virtual_teeth(pinion), 1 / virtual_teeth(wheel)
    x_1, x_2 = pinion.x, wheel.x
    terms = (1, one, other, x_1, x_1 * one, x_2, x_2 * other, x_1**2, x_2**2)
    theoretical = PER_MM_UM / sum(c * term for c, term in zip(COEFFICIENTS, terms, strict=True))
    rack = (basic_rack_factor(pinion) + basic_rack_factor(wheel)) / 2
    light = min(1.0, line_load / LINE_LOAD_OF_STANDARD) ** 0.25
    return theoretical * 0.8 * rack * cos(pinion.beta) * light * _softness(pair)


def basic_rack_factor(gear: Gear) -> float:
    """C_B from dedendum and pressure angle of the generating rack."""
    dedendum = gear.h_rack / gear.m_n + gear.x
    return (1 + 0.5 * (1.2 - dedendum)) * (1 - 0.02 * (20 - degrees(gear.alpha_n)))


def mesh_stiffness(pair: GearPair, line_load: float = LINE_LOAD_OF_STANDARD) -> float:
    """Mean mesh stiffness c_gamma_alpha per face width [N/m^2], for eps_alpha >= 1.2 (ISO 6336-1, 9.3)."""
    return single_stiffness(pair, line_load) * (0.75 * pair.eps_alpha + 0.25)


def _softness(pair: GearPair) -> float:
    """Young's modulus of the pair over that of `STEEL`, to which the standard's stiffness of steel gears belongs."""
    one, other = pair.pinion.material.E, pair.wheel.material.E
    return 2 * one * other / (one + other) / STEEL.E
