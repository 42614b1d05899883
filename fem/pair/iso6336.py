"""Tooth stiffness by ISO 6336-1, method B: a quick estimate to compare with finite elements.

It does not take rim and hub into account: a gear that is clamped at its bore is softer, often by a third.
"""

from math import cos, degrees

from fem.gear.gear import Gear
from fem.pair.pair import GearPair
from fem.support.arguments import checked
from fem.support.validation import number, require
from fem.units import GPa

__all__ = ["basic_rack_factor", "face_load_stiffness", "mesh_stiffness", "single_stiffness", "virtual_teeth"]

#: Line load from which on the stiffness is constant [N/m].
LINE_LOAD_OF_STANDARD = 100e3
#: Young's modulus E_St of steel that the coefficients hold for; the stiffness of other materials is scaled with E.
STEEL_OF_STANDARD = 206 * GPa
#: C_1 to C_9 of the standard, for the compliance of a tooth pair [mm um/N].
COEFFICIENTS = (0.04723, 0.15551, 0.25791, -0.00635, -0.11654, -0.00193, -0.24188, 0.00529, 0.00182)
#: 1 N/(mm um) in N/m^2.
PER_MM_UM = 1e9


@checked
def virtual_teeth(gear: Gear) -> float:
    """Number of teeth z_n of the virtual spur gear."""
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

    Index 1 of the standard is the smaller gear, whichever drives. With the default `Material`, E = 210 GPa, the
    stiffness is 210 / 206 of that of the standard for steel.

    Source: ISO 6336-1, 9.3; 1 N/(mm um) = 1e9 N/m^2. Raises ValueError for a line load <= 0, factors outside (0, 1].
    """
    require(number("line_load", line_load) > 0, f"line_load must be > 0 N/m (pass 100e3 for 100 N/mm), got {line_load}")
    for name, factor in (("C_R", C_R), ("C_M", C_M)):
        require(0 < number(name, factor) <= 1, f"{name} must lie in (0, 1] (solid discs: C_R = 1), got {factor}")
    smaller, larger = sorted((pair.pinion, pair.wheel), key=lambda gear: (gear.z, gear.d_a))
    z_1, z_2, x_1, x_2 = virtual_teeth(smaller), virtual_teeth(larger), smaller.x, larger.x
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
    """Mean mesh stiffness c_gamma_alpha per face width [N/m^2], for eps_alpha >= 1.2 (ISO 6336-1, 9.3)."""
    return single_stiffness(pair, line_load, C_R=C_R, C_M=C_M) * (0.75 * pair.eps_alpha + 0.25)


@checked
def face_load_stiffness(
    pair: GearPair, line_load: float = LINE_LOAD_OF_STANDARD, *, C_R: float = 1.0, C_M: float = 0.8
) -> float:
    """Mesh stiffness c_gamma_beta per face width [N/m^2], for the face load factor K_Hbeta (ISO 6336-1, 9.3)."""
    return 0.85 * mesh_stiffness(pair, line_load, C_R=C_R, C_M=C_M)


def _relative_modulus(pair: GearPair) -> float:
    """Effective Young's modulus of the pair over that of the standard's steel."""
    E_1, E_2 = pair.pinion.material.E, pair.wheel.material.E
    return 2 * E_1 * E_2 / (E_1 + E_2) / STEEL_OF_STANDARD
