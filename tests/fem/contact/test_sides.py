"""The right flanks' map is that of the pair in a mirror: against outlines of both gears, turned until they touch."""

from dataclasses import replace

import numpy as np
import pytest

import fem
from fem.elasticity.mesh_density import Density
from fem.gear import tooth_profile
from fem.microgeometry.flank import removed
from fem.units import deg, mm, um

ROUGH = fem.Resolution(Density(flank=8, fillet=1, tooth=2, rim=1, body=2, width=1), 60)
RNG = np.random.default_rng(3)
LEFT = fem.TipRelief(12 * um, 1.2 * mm), fem.HelixSlope(6 * um)
RIGHT = fem.ProfileCrowning(5 * um), fem.LeadCrowning(4 * um), fem.HelixSlope(-3 * um)


def gear(z: int, beta: float, x: float, **flank) -> fem.Gear:
    deviations = {side: fem.PitchDeviation(RNG.uniform(0, 8 * um, z)) for side in flank}
    sides = fem.Sides(**{side: (*parts, deviations[side]) for side, parts in flank.items()})
    return fem.Gear(z=z, m_n=2 * mm, b=12 * mm, d_bore=15 * mm, beta=beta, x=x, flank=sides)


def pair_of(beta: float) -> fem.GearPair:
    pinion, wheel = gear(18, beta, 0.2, left=LEFT, right=RIGHT), gear(25, -beta, 0.1, left=RIGHT, right=LEFT)
    return fem.GearPair(pinion, wheel, a=fem.GearPair(pinion, wheel).a + 0.1 * mm)


def mirrored(gear: fem.Gear, first: int) -> fem.Gear:
    """Mirror image of a gear by the rule in `fem.Sides`; first is the number that tooth 0 gets."""

    def reversed_teeth(part):
        turned = isinstance(part, fem.PitchDeviation)
        return fem.PitchDeviation(np.roll(part.values[::-1], 1 + first)) if turned else part

    left, right = (tuple(map(reversed_teeth, side)) for side in (gear.flank.left, gear.flank.right))
    return replace(gear, beta=-gear.beta, flank=fem.Sides(left=right, right=left))


def angle(gear: fem.Gear, side: int, tooth: int, roll, axial: float):
    """Angle of a left (side 1) or right flank (-1) from the middle of tooth 0 in mid-plane, counter-clockwise."""
    parts = gear.flank.left if side > 0 else gear.flank.right
    half = tooth_profile.flank(gear, roll).psi - removed(parts, gear.face, roll, axial, tooth=tooth) / gear.r_b
    return side * half + 2 * np.pi * tooth / gear.z + gear.twist * axial


def play(pair: fem.GearPair, side: int, phase: float, tilt: complex) -> float:
    """Turn of the wheel to its contact from where unmodified left flanks touch, at their phase, on its base circle [m].

    tilt    tilt of the wheel's axis: in the plane of the axes, and in the direction of the left flanks' force on it
    """
    (pinion, wheel), turns = (pair.pinion, pair.wheel), []
    roll = np.linspace(pinion.roll_form, pinion.roll_tip, 1001)
    half = [g.thickness(g.r_b / np.cos(pair.alpha_wt)) * np.cos(pair.alpha_wt) / g.r_b / 2 for g in (pinion, wheel)]
    turned = 2 * np.pi * phase / pinion.z - half[0], -2 * np.pi * phase / wheel.z - half[1]
    nearest = round(-phase)
    for axial in np.linspace(-5.9, 5.9, 60) * mm:
        for tooth in range(nearest - 3, nearest + 4):
            mate = -tooth if side > 0 else 1 - tooth
            points = np.hypot(pinion.r_b, roll) * np.exp(1j * (angle(pinion, side, tooth, roll, axial) + turned[0]))
            seen = pair.a + tilt * axial - points
            on_wheel = (abs(seen) > wheel.r_form) & (abs(seen) <= wheel.r_a)
            seen = seen[on_wheel]
            if seen.size:
                mate_roll = np.sqrt(abs(seen) ** 2 - wheel.r_b**2)
                ahead = np.angle(seen * np.exp(-1j * (angle(wheel, side, mate, mate_roll, axial) + turned[1])))
                turns.append((side * ahead).min())
    return min(turns) * wheel.r_b


@pytest.mark.parametrize("beta", [0.0, 15 * deg])
@pytest.mark.parametrize("side", [1, -1])
def test_right_flanks_touch_where_left_ones_do_in_a_mirror(beta, side):
    pair, at, delta, lean = pair_of(beta), np.linspace(0.1, 3.7, 10), 2e-4, 1e-4
    mirror = fem.GearPair(mirrored(pair.pinion, 0), mirrored(pair.wheel, 1), a=pair.a)
    which, phase, known = (pair, at, 0.0) if side > 0 else (mirror, pair.back_phase - at, pair.backlash)
    offsets = fem.Offsets(f_sigma_delta=delta, f_sigma_beta=side * lean)
    te = fem.static_transmission_error(which, 0, at, offsets=offsets, resolution=ROUGH, progress=False)["te"].values[0]
    assert te == pytest.approx([play(pair, side, p, delta + 1j * lean) - known for p in phase], abs=0.05 * um)
    assert np.ptp(te) > 3 * um
