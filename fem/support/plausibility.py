"""Values that no machine has, most often given in another unit: a UserWarning with value, unit and remedy.

Values that are impossible are refused where they enter. The ranges here are wider than those of machines by one to two
orders of magnitude, so that a factor of a thousand, which is that of mm, kN, kg/dm^3 or N/um, stands out. What has no
range of its own is compared with the gears beside it, so that it holds for watches and for mills. Bearings, backlash,
clearances, viscosities, roughness and drag have bounds beyond which they are refused (in N/m: 1e4 to 1e13).
"""

from fem.support.user_warning import warn_user
from fem.support.validation import require_finite

#: Density [kg/m^3] from balsa wood, 150, to tungsten, 19,300.
DENSITIES = (100.0, 25e3)
#: Normal module [m] from watches, 0.05 mm, down; larger than 100 mm is refused.
LEAST_MODULE = 0.01e-3
#: Mass of a rotor [kg]: the heaviest turbine rotors have 3e5 kg.
LARGEST_MASS = 5e5
#: Mass of a disc over that of the gears on its shaft: a flywheel or a rotor of a wind turbine has up to a thousand.
LARGEST_MASS_RATIO = 1e4
#: K factor 2 T / (d^2 b) of a lightly loaded gear [Pa], where steel gears carry 1 MPa and more; twist [rad] of a
#: coupling under that torque. Elastic couplings twist by 0.2 rad under their full torque.
LIGHT_LOAD, LARGEST_TWIST = 0.1e6, 0.5
#: Share of the critical damping of a mesh: measured 0.03 to 0.17; that of the material alone is 1e-3.
LEAST_DAMPING_RATIO = 1e-3


def check_density(density: float) -> None:
    """Warn of a density [kg/m^3] that no material has."""
    require_finite("density", density)
    low, high = DENSITIES
    if not low <= density <= high:
        text = f"density {density:g} kg/m^3 is that of no gear material, which lie within {low:g} and {high:g}"
        warn_user(f"{text}; pass kg/m^3: steel has 7850")


def check_module(m_n: float) -> None:
    """Warn of a normal module [m] below those of watches."""
    if m_n < LEAST_MODULE:
        warn_user(f"m_n {m_n:g} m is below the modules of watches; pass metres: 2.6*mm")


def check_rotor_mass(mass: float, gears: float | None = None) -> None:
    """Warn of the mass of a disc [kg] that no rotor has, or none beside the gears of a mass [kg] on its shaft."""
    remedy = "pass sizes in metres, 30*mm, and kg"
    if mass > LARGEST_MASS:
        warn_user(f"a disc of {mass:.3g} kg is heavier than the rotor of any machine; {remedy}")
    elif gears is not None and mass > LARGEST_MASS_RATIO * gears:
        warn_user(f"a disc of {mass:.3g} kg is {mass / gears:.2g} times as heavy as the gears beside it; {remedy}")


def check_torsion(torsion: float, d: float, b: float) -> None:
    """Warn of a coupling's stiffness [N m/rad] too soft for a gear of a diameter and a face width [m]."""
    torque = LIGHT_LOAD * d**2 * b / 2
    if torsion * LARGEST_TWIST < torque:
        twisted = f"torsion {torsion:g} N m/rad lets a coupling twist by {torque / torsion:.2g} rad"
        text = f"{twisted} under {torque:.2g} N m, a light load of the gear on its shaft"
        warn_user(f"{text}; pass N m/rad: 20 kN m/rad are 20e3")


def check_damping_ratio(damping: float, critical: float) -> None:
    """Warn of a damping of a mesh [N s/m] below that of its material, beside the critical one."""
    if 0 < damping < LEAST_DAMPING_RATIO * critical:
        share = f"damping {damping:g} N s/m is {damping / critical:.1e} of the critical {critical:.3g} N s/m"
        remedy = "pass N s/m: 3.6 N s/mm are 3600, or damping_ratio=0.06"
        warn_user(f"{share}, gears have 0.03 to 0.17; {remedy}")
