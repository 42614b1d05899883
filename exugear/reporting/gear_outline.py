"""Outline of a tooth and of one pitch of a gear in the transverse section."""

from math import ceil, pi

import numpy as np

from fem.gear import tooth_profile
from fem.gear.gear import Gear

BORE_CORNERS = 120


def half_outline(gear: Gear, n: int) -> tooth_profile.Polar:
    """n points of half a tooth from where its root begins up to the tip, each on the true outline."""
    below = max(2, n // 3)
    root = tooth_profile.fillet(gear, np.linspace(1, 0, below, endpoint=False))
    low, high = tooth_profile.arc_length(gear, np.array([gear.roll_form, gear.roll_tip]))
    involute = tooth_profile.flank(gear, tooth_profile.roll_at(gear, np.linspace(low, high, n - below)))
    return tooth_profile.Polar(np.append(root.r, involute.r), np.append(root.psi, involute.psi))


def pitch_section(gear: Gear, points_per_tooth: int) -> tuple[np.ndarray, np.ndarray]:
    """Outline and bore of one pitch about the x axis as points x + iy, counter-clockwise.

    Each begins at the middle of the tooth space; the outline runs up the right flank and down the left flank.
    """
    half = half_outline(gear, points_per_tooth // 2)
    foot = min(half.psi[0], (1 - 1e-3) * pi / gear.z)
    psi = np.r_[-pi / gear.z, -foot, -half.psi[1:], half.psi[:0:-1], foot]
    parts = 3 * ceil(BORE_CORNERS / (3 * gear.z))
    bore = np.interp(np.arange(parts) * 3 / parts, range(4), [-pi / gear.z, -foot, foot, pi / gear.z])
    return np.r_[gear.r_f, half.r, half.r[::-1]] * np.exp(1j * psi), gear.d_bore / 2 * np.exp(1j * bore)
