"""Outline of a tooth in the transverse section: involute flank, root fillet, root circle (ISO 21771).

Polar coordinates about the gear's centre: radius r [m] and angle psi [rad] from the tooth's centre line, psi >= 0 on
the left flank, which faces counter-clockwise. A point of the flank is named by its roll length, the radius of curvature
of the involute there.

Radii, roll and arc lengths and numbers of teeth of an internal gear are < 0, and so are psi of its left flank and the
angle of a pitch. Tooth 0 then lies at -y instead of y: with the tip up, the left flank on the left, all lengths growing
from root to tip, as of an external gear. The teeth count clockwise.
"""

from typing import NamedTuple

import numpy as np

from fem.gear.gear import Gear
from fem.gear.involute import involute

#: Least roll length for curvatures, over the roll length at the tip: on the base circle the radius of curvature is 0.
LEAST_ROLL = 0.01


class Polar(NamedTuple):
    """Points in polar coordinates: r (n,) [m], psi (n,) [rad]."""

    r: np.ndarray
    psi: np.ndarray


def flank(gear: Gear, roll) -> Polar:
    """Involute at roll lengths roll (n,) [m]."""
    roll = np.asarray(roll, float)
    return Polar(gear.sign * np.hypot(gear.r_b, roll), gear.psi_b - involute(np.arctan(roll / gear.r_b)))


def fillet(gear: Gear, share) -> Polar:
    """Root fillet at shares (n,) of the way from the involute (0) to the root circle (1)."""
    return Polar(*gear.root.points(share))


def root_land(gear: Gear, n: int) -> Polar:
    """n equal steps on the root circle from the end of the fillet (excluded) to the middle of the space (included)."""
    psi = np.linspace(gear.root.psi_f, np.pi / gear.z, n + 1)[1:]
    return Polar(np.full(n, gear.r_f), psi)


def arc_length(gear: Gear, roll):
    """Arc length [m] of the flank from the base circle to roll lengths roll [m]."""
    return np.square(roll) / (2 * gear.r_b)


def roll_at(gear: Gear, arc):
    """Roll lengths [m] at arc lengths arc [m]; inverse of `arc_length`."""
    return gear.sign * np.sqrt(2 * gear.r_b * np.asarray(arc))


def cartesian(polar: Polar, turn=0.0) -> np.ndarray:
    """(2, n) points of a tooth whose centre line stands turn [rad] from the y axis, counter-clockwise."""
    angle = polar.psi + turn
    return np.stack([-polar.r * np.sin(angle), polar.r * np.cos(angle)])


def flank_points(gear: Gear, arc, tooth: int = 0) -> np.ndarray:
    """(2, ...) points [m] at arc lengths (...) on the left flank of a tooth."""
    return cartesian(flank(gear, roll_at(gear, arc)), 2 * np.pi * tooth / gear.z)


def arc_at(gear: Gear, points: np.ndarray):
    """Arc lengths (...) [m] of points (2, ...) of a flank: inverse of `flank_points`, 0 inside the base circle."""
    return np.maximum(points[0] ** 2 + points[1] ** 2 - gear.r_b**2, 0.0) / (2 * gear.r_b)


def polar(gear: Gear, points: np.ndarray) -> Polar:
    """Polar coordinates (...) of points (2, ...), psi from the centre line of tooth 0: inverse of `cartesian`."""
    x, y = gear.sign * points
    return Polar(gear.sign * np.hypot(x, y), np.arctan2(-x, y))


def tangent_angle(gear: Gear, arc, tooth: int = 0):
    """Angle from the x axis of the flank's tangent towards the tip at arc lengths (...) [rad]."""
    return np.pi / 2 + gear.psi_b + 2 * np.pi * tooth / gear.z - roll_at(gear, arc) / gear.r_b
