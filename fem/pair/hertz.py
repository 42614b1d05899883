"""Local flattening of a line contact: half-planes under strips of pressure (Johnson, Contact Mechanics, ch. 2, 4).

Formulas of numbers or arrays, which compiled code shares.
"""

import numpy as np

from fem.gear.material import Material
from fem.pair.pair import GearPair

#: Line load over E from which contacts are solved [m].
LEAST_LOAD = 1e-13
TINY = np.finfo(float).tiny


def flattening(material: Material) -> float:
    """2 (1 - nu^2) / (pi E) [m^2/N]: displacement per line load and per unit of -ln(distance), plane strain."""
    return 2 * (1 - material.nu**2) / (np.pi * material.E)


def half_width(line_load, radius, flattening):
    """Half-width of the contact of two cylinders [m] under a line load [N/m].

    radius       R1 R2 / (R1 + R2) [m]
    flattening   sum of `flattening` of both materials [m^2/N]
    """
    return np.sqrt(2 * line_load * radius * flattening)


def pressure(line_load, half_width):
    """Largest pressure of the contact of two cylinders [Pa] under a line load [N/m]."""
    return 2 * line_load / (np.pi * half_width)


def log_mean(distance, width, mate_width):
    """Mean of -ln|s - t| over two strips of given widths whose middles lie a distance apart; broadcasts."""

    def log_integral(x):
        """Second antiderivative of ln|x|, 0 at 0."""
        return x * x * (np.log(np.maximum(np.abs(x), TINY)) / 2 - 0.75)

    inner, outer = (width - mate_width) / 2, (width + mate_width) / 2
    far, near = log_integral(distance + outer), log_integral(distance - outer)
    return -(far - log_integral(distance + inner) - log_integral(distance - inner) + near) / (width * mate_width)


def largest_torque(pair: GearPair) -> float:
    """Pinion torque at which Hertz pressure at the pitch point reaches E/20, far beyond any elastic gear [N m]."""
    pinion, wheel = pair.pinion.material, pair.wheel.material
    roll = pair.roll_pitch, pair.path_of_contact.on_wheel(pair.roll_pitch)
    curvature = 1 / roll[0] + 1 / roll[1]
    modulus = 2 / (np.pi * (flattening(pinion) + flattening(wheel)))
    pressure = min(pinion.E, wheel.E) / 20
    return pair.pinion.r_b * pair.b * np.pi * pressure**2 / (modulus * curvature)


def least_torque(pair: GearPair) -> float:
    """Pinion torque below which the deflection, some 15 line loads over E, is lost in the rounding of the gaps [N m].

    Of 30 random pairs at line loads from 1e-16 m times E, no contact failed and no te fell from 3e-14 m on.
    """
    E = min(pair.pinion.material.E, pair.wheel.material.E)
    return LEAST_LOAD * E * pair.b * pair.pinion.r_b
