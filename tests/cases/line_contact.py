"""Hertz's contact of two cylinders (Johnson, Contact Mechanics, 4.2), written out beside `fem.pair.hertz`."""

import numpy as np

from fem import STEEL, Material


def modulus(material: Material = STEEL, mate: Material | None = None) -> float:
    """E* of two bodies in contact, by default of one material [Pa]."""
    return 1 / sum((1 - body.nu**2) / body.E for body in (material, mate or material))


def half_width(line_load: float, radius: float) -> float:
    """Of the contact of steel under a line load [N/m] with the relative radius of curvature [m]."""
    return np.sqrt(4 * line_load * radius / (np.pi * modulus()))


def largest_pressure(line_load: float, radius: float) -> float:
    """In the middle of the contact of steel [Pa]."""
    return np.sqrt(line_load * modulus() / (np.pi * radius))


def torque_of_pressure(pair, pressure: float) -> float:
    """Pinion torque [N m] under which a single tooth pair has this largest pressure [Pa] at the pitch point."""
    roll = pair.roll_pitch, pair.path_of_contact.on_wheel(pair.roll_pitch)
    radius = roll[0] * roll[1] / (roll[0] + roll[1])
    line_load = np.pi * radius * pressure**2 / modulus(pair.pinion.material, pair.wheel.material)
    return pair.pinion.r_b * pair.b * line_load
