"""Pairs with modified flanks: type C of FZG, a wide helical pair, the paper's pair with end relief."""

from dataclasses import replace

import numpy as np
from paper_gears import paper_gear

import fem
from fem.units import mm, um

#: One modification of each kind.
ALL_KINDS = (
    fem.TipRelief(15 * um, 2.5 * mm),
    fem.RootRelief(8 * um, 2 * mm, power=2),
    fem.ProfileCrowning(4 * um),
    fem.LeadCrowning(10 * um),
    fem.HelixSlope(6 * um),
    fem.EndRelief(12 * um, 3 * mm),
)


def fzg_type_c(C_a: float) -> fem.GearPair:
    """Type C of FZG with tip relief and crowning, teeth 0.06 mm thinner than nominal."""
    flank = (fem.TipRelief(C_a, 4.5 * mm), fem.LeadCrowning(4 * um))
    common = {"m_n": 4.5 * mm, "b": 14 * mm, "d_bore": 30 * mm, "flank": flank}
    pinion = fem.Gear(z=16, x=0.1824, d_a=82.45 * mm, **common)
    wheel = fem.Gear(z=24, x=0.1715, d_a=118.35 * mm, **common)
    thinner = (replace(gear, s_n=gear.s_n - 0.06 * mm) for gear in (pinion, wheel))
    return fem.GearPair(*thinner, a=91.5 * mm)


def wide_helical() -> fem.GearPair:
    """Helix 14 deg over 200 mm, parabolic tip relief and crowning on both gears."""
    flank = (fem.TipRelief(70 * um, 8 * mm, power=2), fem.LeadCrowning(25 * um))
    common = {"m_n": 8 * mm, "flank": flank}
    pinion = fem.Gear(z=25, b=210 * mm, beta=0.24434609527920614, x=0.25, d_bore=120 * mm, **common)
    wheel = fem.Gear(z=98, b=200 * mm, beta=-0.24434609527920614, x=-0.05, d_bore=500 * mm, **common)
    return fem.GearPair(pinion, wheel, a=fem.GearPair(pinion, wheel).a + 0.2 * mm)


def end_relieved(beta: float) -> fem.GearPair:
    """The paper's pair with end relief, helical ones by a helix of their own."""
    changes = {"d_a": None, "d_f": None, "s_n": None} if beta else {}
    relief = (fem.EndRelief(30 * um, 4 * mm),)
    pinion, wheel = (paper_gear(beta=hand * beta, flank=relief, **changes) for hand in (1, -1))
    return fem.GearPair(pinion, wheel, a=None if beta else 150 * mm)


def material_removed(parts, face, roll, axial, *, tooth=0):
    """Sum of what modifications remove [m]; beyond the ends of the flank each continues with its value there."""
    face, roll = face._replace(tooth=tooth), np.clip(roll, face.roll_form, face.roll_tip)
    return sum(part.removed(face, roll, axial) for part in parts)
