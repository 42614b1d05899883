"""Left and right flanks without load: against outlines of both gears, turned until they touch."""

import numpy as np
import pytest
from involutes import involute_flank
from modified_pairs import material_removed

import fem
from fem import Density
from fem.units import deg, mm, um

ROUGH = fem.Resolution(Density(flank=8, fillet=1, tooth=2, rim=1, body=2, width=1), 60)
LEFT = fem.TipRelief(12 * um, 1.2 * mm), fem.HelixSlope(6 * um)
RIGHT = fem.ProfileCrowning(5 * um), fem.LeadCrowning(4 * um), fem.HelixSlope(-3 * um)


def gear(z: int, beta: float, x: float, **flank) -> fem.Gear:
    random = np.random.default_rng(z)
    deviations = {side: fem.PitchDeviation(random.uniform(0, 8 * um, z)) for side in flank}
    sides = fem.Sides(**{side: (*parts, deviations[side]) for side, parts in flank.items()})
    return fem.Gear(z=z, m_n=2 * mm, b=12 * mm, d_bore=15 * mm, beta=beta, x=x, flank=sides)


def pair_of(beta: float) -> fem.GearPair:
    pinion, wheel = gear(18, beta, 0.2, left=LEFT, right=RIGHT), gear(25, -beta, 0.1, left=RIGHT, right=LEFT)
    return fem.GearPair(pinion, wheel, a=fem.GearPair(pinion, wheel).a + 0.1 * mm)


def angle(gear: fem.Gear, side: int, tooth: int, roll, axial: float):
    """Angle of a left (side 1) or right flank (-1) from the middle of tooth 0 in mid-plane, counter-clockwise."""
    parts = gear.flank.left if side > 0 else gear.flank.right
    half = involute_flank(gear, roll)[1] - material_removed(parts, gear.face, roll, axial, tooth=tooth) / gear.r_b
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
def test_both_sides_of_a_map_touch_where_the_outlines_do(beta):
    pair, phase, delta, lean = pair_of(beta), np.linspace(0.1, 3.7, 10), 2e-4, 1e-4
    offsets = fem.Offsets(f_sigma_delta=delta, f_sigma_beta=lean)
    ste = fem.static_transmission_error(pair, [-1, 0], phase, offsets=offsets, resolution=ROUGH, progress=False)
    sides = (1, ste["te"].sel(torque=0), 0.0), (-1, -ste["te_unloaded_right"], pair.backlash)
    for side, te, known in sides:
        turns = [play(pair, side, at, delta + 1j * lean) - known for at in phase]
        assert te.values == pytest.approx(turns, abs=0.05 * um)
        assert np.ptp(te.values) > 3 * um
