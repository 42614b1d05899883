"""Local flattening of a line contact: half-planes under strips of pressure (Johnson, Contact Mechanics, ch. 2, 4).

`fem.contact.line_contact.Flattening` takes it as the law of one line load, `fem.contact.strip_bounds` between strips.
"""

import numpy as np

from fem.gear.material import Material
from fem.pair.pair import GearPair

#: Line load over E from which contacts are solved [m].
LEAST_LOAD = 1e-13


def flattening(material: Material) -> float:
    """2 (1 - nu^2) / (pi E) [m^2/N]: displacement per line load and per unit of -ln(distance), plane strain."""
    return 2 * (1 - material.nu**2) / (np.pi * material.E)


def half_width(line_load, radius, pinion: Material, wheel: Material):
    """Half-width of the contact of two cylinders [m] under line_load [N/m], radius = R1 R2 / (R1 + R2) [m]."""
    return np.sqrt(2 * line_load * radius * (flattening(pinion) + flattening(wheel)))


def log_mean(distance, width, mate_width):
    """Mean of -ln|s - t| over two strips of given widths whose middles lie a distance apart; broadcasts."""
    inner, outer = (width - mate_width) / 2, (width + mate_width) / 2
    ends = [_log_integral(distance + end) for end in (outer, inner, -inner, -outer)]
    return -(ends[0] - ends[1] - ends[2] + ends[3]) / (width * mate_width)


def _log_integral(x):
    """Second antiderivative of ln|x|."""
    x = np.asarray(x, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        log = np.where(x == 0, 0.0, np.log(np.abs(x)))
    return x * x * (log / 2 - 0.75)


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
