"""Trains of gears with stiff meshes."""

import numpy as np
from scenes import linear_law, paper_gear, paper_pair
from strategies import involute, without_backlash

import fem
from exugear import Gearbox, Shaft, Stage
from fem.units import deg, mm

STIFF = linear_law(reach=9e-3, backlash=2e-4)


def gear(z: int, x: float = 0.0, beta: float = 0.0) -> fem.Gear:
    return fem.Gear(z=z, m_n=2.5 * mm, b=20 * mm, d_bore=15 * mm, x=x, beta=beta)


def loose_pair(pinion: fem.Gear, wheel: fem.Gear) -> fem.GearPair:
    return fem.GearPair(pinion, wheel, a=without_backlash(pinion, wheel) + 0.1 * mm)


def on(name: str, *gears: fem.Gear) -> Shaft:
    """Shaft with gears every 50 mm."""
    return Shaft(name, {i * 50 * mm: gear for i, gear in enumerate(gears)})


def wheels(*names: str) -> list[Shaft]:
    """Shafts with the paper's gear."""
    return [on(name, paper_gear()) for name in names]


def coupled(fast: Shaft, slow: Shaft, angle: float = 0.0, **changes) -> Stage:
    return Stage(fast, slow, STIFF, pair=paper_pair(), angle=angle, **changes)


def square(angle: float = 90 * deg, **changes) -> Gearbox:
    """Rhombus of four equal gears, b and c between a and d."""
    a, b, c, d = wheels("a", "b", "c", "d")
    rhombus = [coupled(a, b, 0.0, **changes), coupled(a, c, angle), coupled(b, d, angle), coupled(c, d, 0.0)]
    return Gearbox(rhombus)


def half_angles(gear: fem.Gear, r: np.ndarray) -> np.ndarray:
    """Half the tooth's angle at radii (n,)."""
    alpha = np.arccos(gear.r_b / r)
    return gear.psi_b - involute(alpha)


def pressed(pair: fem.GearPair, gear: fem.Gear, psi: float, towards: float, side: int) -> tuple[float, float]:
    """Angle [rad] of a tooth of the mate that a gear presses with its flanks of a side (+1: left), and the phase.

    psi is the angle of a tooth of the gear, towards the direction to the mate [rad]. By brute force: all points of the
    gear's flanks are transformed to the mate, where a flank must pass through the point that reaches furthest.
    """
    mate = pair.wheel if gear is pair.pinion else pair.pinion
    line = pair.a * np.sin(pair.alpha_wt)
    roll = np.linspace(max(gear.roll_form, line - mate.roll_tip), gear.roll_tip, 20001)
    r = np.hypot(gear.r_b, roll)
    for k in range(gear.z):
        polar = psi - towards + 2 * np.pi * k / gear.z + side * half_angles(gear, r)
        x, y = pair.a - r * np.cos(polar), r * np.sin(polar)
        r_mate = np.hypot(x, y)
        near = (r_mate > max(mate.r_form, mate.r_b)) & (r_mate < mate.r_a) & (x > 0)
        if not near.any():
            continue
        angle = np.arctan2(-y, x)[near] - side * half_angles(mate, r_mate[near])
        furthest = np.argmin(side * angle)
        if 0 < furthest < near.sum() - 1:
            along = roll[near][furthest]
            pinion_roll = along if gear is pair.pinion else line - along
            return towards + np.pi + angle[furthest], (pinion_roll - pair.roll_pitch) / pair.p_bt
    raise AssertionError("no tooth stands in the path of contact")


def apart(phase_1: float, phase_2: float) -> float:
    """Distance of two phases, in shares of a pitch."""
    return abs((phase_1 - phase_2 + 0.5) % 1.0 - 0.5)
