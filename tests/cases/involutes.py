"""The involute in closed form, beside the outlines of `fem.gear`."""

import numpy as np

import fem


def involute(angle):
    """inv alpha = tan alpha - alpha."""
    return np.tan(angle) - angle


def involute_flank(gear: fem.Gear, roll) -> tuple[np.ndarray, np.ndarray]:
    """Radius [m] of points of a flank at roll lengths [m], and their angle from the middle of the tooth [rad]."""
    roll = np.asarray(roll, float)
    half_angle = gear.s_t / (2 * gear.r) + involute(gear.alpha_t)
    return np.hypot(gear.r_b, roll), half_angle - involute(np.arctan(roll / gear.r_b))


def arc_length(gear: fem.Gear, roll):
    """Length [m] of the involute from the base circle to roll lengths [m]."""
    return np.square(roll) / (2 * gear.r_b)


def flank_points(gear: fem.Gear, arc, tooth: int = 0) -> np.ndarray:
    """(2, ...) points of the driving flank of a tooth at arc lengths from the base circle [m]; tooth 0 points up."""
    r, psi = involute_flank(gear, np.sqrt(2 * gear.r_b * np.asarray(arc)))
    angle = np.pi / 2 + psi + 2 * np.pi * tooth / gear.z
    return r * np.stack([np.cos(angle), np.sin(angle)])


def fillet_point(gear: fem.Gear, share: float) -> np.ndarray:
    """(2,) point at a share of the fillet from the involute (0) to the root circle (1), below the driving flank."""
    (r,), (psi,) = gear.root.points(np.array([share]))
    return r * np.array([-np.sin(psi), np.cos(psi)])


def turned(points, angle) -> np.ndarray:
    """(2, ...) points turned by angles [rad], counter-clockwise."""
    x, y = points
    return np.stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y])
