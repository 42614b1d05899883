"""Transverse tooth outline: involute flank and the root that a generating rack leaves (ISO 21771; trochoid by rolling).

Polar coordinates about the gear's centre: radius r [m] and angle psi [rad] from the tooth's centre line, psi >= 0 on
the flank that faces counter-clockwise. A point of the flank is named by its roll length rho, the radius of curvature.
"""

from typing import NamedTuple

import numpy as np

from fem.gear import Gear, involute


class Polar(NamedTuple):
    """Points in polar coordinates: r (n,) [m], psi (n,) [rad]."""

    r: np.ndarray
    psi: np.ndarray


def flank(gear: Gear, roll) -> Polar:
    """Involute at roll lengths roll (n,) [m]."""
    roll = np.asarray(roll, float)
    alpha = np.arctan(roll / gear.r_b)
    base_half_angle = gear.s_t / (2 * gear.r) + involute(gear.alpha_t)
    return Polar(np.hypot(gear.r_b, roll), base_half_angle - (np.tan(alpha) - alpha))


def fillet(gear: Gear, theta) -> Polar:
    """Trochoid at inclinations theta (n,) [rad] of its normal: alpha_t at the flank, pi/2 on the root circle."""
    theta = np.asarray(theta, float)
    centre_depth = gear.h_rack - gear.rho_f
    offset = centre_depth / np.tan(theta)
    across = offset + gear.rho_f * np.cos(theta)
    up = gear.r - centre_depth - gear.rho_f * np.sin(theta)
    shift = offset - rack_tip_centre(gear)
    return Polar(np.hypot(across, up), np.pi / gear.z - (np.arctan2(across, up) - shift / gear.r))


def rack_tip_centre(gear: Gear) -> float:
    """Distance of the centre of the rack's tip rounding from the middle of the rack's tooth [m]."""
    half_space = (np.pi * gear.m_t - gear.s_t) / 2
    straight = (gear.h_rack - gear.rho_f) * np.tan(gear.alpha_t)
    return half_space - straight - gear.rho_f / np.cos(gear.alpha_t)


def root_land(gear: Gear, n: int) -> Polar:
    """n equal steps on the root circle from the end of the fillet (excluded) to the middle of the space (included)."""
    end = np.pi / gear.z - rack_tip_centre(gear) / gear.r
    psi = np.linspace(end, np.pi / gear.z, n + 1)[1:]
    return Polar(np.full(n, gear.r_f), psi)


def arc_length(gear: Gear, roll):
    """Length of the flank between base circle and roll length roll [m]."""
    return np.square(roll) / (2 * gear.r_b)


def roll_at(gear: Gear, arc):
    """Inverse of `arc_length`."""
    return np.sqrt(2 * gear.r_b * np.asarray(arc))


def cartesian(polar: Polar, turn=0.0) -> np.ndarray:
    """(2, n) points; psi is measured from the y axis, counter-clockwise, after turning the tooth by turn [rad]."""
    angle = polar.psi + turn
    return np.stack([-polar.r * np.sin(angle), polar.r * np.cos(angle)])
