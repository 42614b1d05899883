"""Pairs with tip relief on coarse meshes, as functions of variables that processes can import."""

from dataclasses import replace

from paper_gears import paper_pair

import exugear
import fem
from fem import Density
from fem.units import mm, um

FAST = fem.Slices(Density(flank=8, fillet=1, tooth=2, rim=1, body=2, width=1), 6)
AMOUNT = exugear.Variable(0, 40 * um, step=1 * um, unit="um")
LENGTH = exugear.Variable(0.5 * mm, 5 * mm, step=0.1 * mm, unit="mm")


def relieved(C_a=0.0, length=3.5 * mm, crowning=0.0, slope=0.0) -> fem.GearPair:
    """The paper's pair with linear relief of both tips, crowning, and helix slopes of both gears."""
    pair = paper_pair()
    gear = replace(pair.pinion, flank=[fem.TipRelief(C_a, length), fem.LeadCrowning(crowning), fem.HelixSlope(slope)])
    return fem.GearPair(gear, gear, a=pair.a)


def loudness(C_a, misalignment):
    """Peak to peak at two loads, on coarse meshes."""
    tilted = fem.Offsets(misalignment=misalignment)
    options = {"phases": 8, "offsets": tilted, "resolution": FAST, "progress": False}
    return fem.flank_measures(relieved(C_a), [150.0, 350.0], **options)


def spinning(ste) -> exugear.Gearbox:
    """Two shafts that only spin."""
    pair = fem.pair_of(ste)
    shafts = [exugear.Shaft(name, {0.0: gear}) for name, gear in (("fast", pair.pinion), ("slow", pair.wheel))]
    return exugear.Gearbox([exugear.Stage(*shafts, ste, damping_ratio=0.08)])


def on_bearings(ste) -> exugear.Gearbox:
    """Each gear midway between two bearings."""
    pair, ball = fem.pair_of(ste), exugear.Bearing(radial=4e8, axial=1e8, damping_time=2e-5)
    parts = [{-30 * mm: ball, 0.0: gear, 30 * mm: ball} for gear in (pair.pinion, pair.wheel)]
    shafts = [exugear.Shaft(name, part) for name, part in zip(("fast", "slow"), parts, strict=True)]
    return exugear.Gearbox([exugear.Stage(*shafts, ste, damping_ratio=0.08)])
