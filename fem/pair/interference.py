"""Clearance between an undercut root and the tip of the mating gear, and remedies for interference."""

from math import atan, hypot, pi

import numpy as np

from fem.gear.gear import Gear
from fem.pair.path_of_contact import PathOfContact
from fem.units import mm


def tip_path(gear: Gear, mate: Gear, a: float, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """r [m] and psi [rad] of the mating gear's tip corner relative to tooth 0 of the gear, at centre distance a [m].

    turn        (n,) angle by which the gear has turned since the corner was on the line of action [rad]
    """
    path = PathOfContact(gear, mate, a)
    roll = path.on_wheel(mate.roll_tip)
    base = gear.psi_b - roll / gear.r_b
    corner = hypot(gear.r_b, roll) * np.exp(1j * (base + atan(roll / gear.r_b)))
    centre = a * np.exp(1j * (base + path.alpha_wt))
    points = np.exp(-1j * turn) * (centre + (corner - centre) * np.exp(-1j * turn * gear.z / mate.z))
    return np.abs(points), np.angle(points)


def root_clearance(gear: Gear, mate: Gear, a: float) -> float:
    """Least circumferential distance between the mating gear's tip corner and the root [m]; negative: interference."""
    r, psi = tip_path(gear, mate, a, np.linspace(-2, 2, 4001) * pi / gear.z)
    root_r, root_psi = gear.root.points(np.linspace(1, 0, 201))
    inside = r < gear.r_form
    return float((r * (psi - np.interp(r, root_r, root_psi)))[inside].min(initial=np.inf))


def remedies(gear: Gear, mate: Gear, name: str) -> str:
    """Changes of gear data, as text, that prevent interference at the root of the gear called name."""
    rounding = "fillet" if gear.rho_f is None else "rho_f"
    radius = f"{rounding} = {getattr(gear, rounding) / mm:.4g} mm"
    deeper = f"d_f = {gear.d_f / mm:.6g} mm (deepen it by the tool's addendum h_fP)"
    return f"reduce {radius} or {deeper} of the {name}, or the mate's d_a = {mate.d_a / mm:.6g} mm, or raise a"
