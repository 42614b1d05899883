"""Clearances between the tip of a gear and its mate, beside the path of contact; remedies for interference.

All hold for a ring with the signs of `fem.gear.gear`.
"""

from math import atan, hypot, pi

import numpy as np

from fem.gear import tooth_profile
from fem.gear.gear import Gear
from fem.gear.involute import involute
from fem.pair.path_of_contact import PathOfContact
from fem.units import mm


def tip_path(gear: Gear, mate: Gear, a: float, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """r [m] and psi [rad] of the mating gear's tip corner relative to tooth 0 of the gear, at centre distance a [m].

    turn        (n,) angle by which the gear has turned since the corner was on the line of action [rad]
    """
    path = PathOfContact(gear, mate, a)
    roll = path.on_wheel(mate.roll_tip)
    base = gear.psi_b - roll / gear.r_b
    corner = gear.sign * hypot(gear.r_b, roll) * np.exp(1j * (base + atan(roll / gear.r_b)))
    centre = a * np.exp(1j * (base + path.alpha_wt))
    points = gear.sign * np.exp(-1j * turn) * (centre + (corner - centre) * np.exp(-1j * turn * gear.z / mate.z))
    return gear.sign * np.abs(points), np.angle(points)


def root_clearance(gear: Gear, mate: Gear, a: float) -> float:
    """Least circumferential distance between the mating gear's tip corner and the root [m]; negative: interference."""
    r, psi = tip_path(gear, mate, a, np.linspace(-2, 2, 4001) * pi / gear.z)
    root_r, root_psi = gear.root.points(np.linspace(1, 0, 201))
    inside = r < gear.r_form
    return float((r * (psi - np.interp(r, root_r, root_psi)))[inside].min(initial=np.inf))


def tip_clearance(pinion: Gear, ring: Gear, a: float) -> float:
    """Least circumferential distance between the pinion's tip corner and the flank of a ring [m], about 0 in contact.

    < 0: the corner strikes the ring's tooth as it enters its space or leaves it (trochoidal interference).
    """
    r, psi = tip_path(ring, pinion, a, np.linspace(-1, 1, 8001) * pi / 2 * pinion.z / ring.z)
    among = (r < ring.r_a) & (r > ring.r_form)
    flank = ring.psi_b - involute(np.arccos(ring.r_b / r[among]))
    return float((r[among] * (psi[among] - flank)).min(initial=np.inf))


def radial_clearance(pinion: Gear, ring: Gear, a: float) -> float:
    """Least clearance across the direction in which the pinion is pushed radially into a ring [m]; < 0: it overlaps.

    A tooth of the pinion points to the middle of a space of the ring. Each tooth up to a quarter of the pinion away
    passes the tooth of the ring beside it: at each point of its flank no part of that tooth may be in the way.
    """
    share = np.linspace(0, 1, 101)
    least = np.inf
    for tooth in range(pinion.z // 4 + 1):
        r_1, psi_1 = tooth_profile.flank(pinion, pinion.roll_form + share * (pinion.roll_tip - pinion.roll_form))
        r_2, psi_2 = tooth_profile.flank(ring, ring.roll_form + share * (ring.roll_tip - ring.roll_form))
        on_pinion = r_1 * np.exp(1j * (2 * pi * tooth / pinion.z + psi_1)) - a
        on_ring = -r_2 * np.exp(1j * (-2 * pi * (tooth + 0.5) / ring.z + psi_2))
        in_way = on_ring.real < on_pinion.real[:, None]
        apart = np.where(in_way, on_ring.imag - on_pinion.imag[:, None], np.inf)
        least = min(least, float(apart.min()))
    return least


def remedies(gear: Gear, mate: Gear, name: str) -> str:
    """Changes of gear data, as text, that prevent interference at the root of the gear called name."""
    tip = f"the mate's d_a = {mate.d_a / mm:.6g} mm"
    if gear.cutter is not None:
        return f"raise |d_f|, reduce rho_a0 or z_0 of its cutter, or reduce {tip} or |a|"
    rounding = "fillet" if gear.rho_f is None else "rho_f"
    radius = f"{rounding} = {getattr(gear, rounding) / mm:.4g} mm"
    deeper = f"d_f = {gear.d_f / mm:.6g} mm (deepen it by the tool's addendum h_fP)"
    if gear.internal:
        return f"reduce {radius}, raise |d_f|, or reduce {tip} or |a|"
    if mate.internal:
        return f"reduce {radius} or {deeper} of the {name}, shorten the ring's teeth, {tip}, or reduce |a|"
    return f"reduce {radius} or {deeper} of the {name}, or {tip}, or raise a"
