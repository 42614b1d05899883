"""Gearboxes whose modes are known or computed otherwise."""

import exudyn as exu
import numpy as np
import planetary_set
from paper_gears import paper_gear, paper_pair
from scenes import INERTIA, linear_law, smooth_stage

import exugear
from exugear.multibody.model import matrices_without_meshes
from fem.units import mm

MASS = 3.1145
#: Lin & Parker, J. Vib. Acoust. 121 (1999) [Hz].
THREE_PLANETS = (
    *(0, 743.2, 743.2, 1102.4, 1102.4, 1475.7, 1896.0, 1896.0, 1930.3, 2276.4, 2276.4, 2658.3),
    *(6986.3, 6986.3, 7462.8, 9647.9, 9647.9, 11775.3),
)
FOUR_PLANETS = (
    *(0, 727.0, 727.0, 1091.0, 1091.0, 1536.6, 1808.2, 1892.8, 1892.8, 1970.6, 2342.5, 2342.5, 2625.7),
    *(5963.8, 6981.7, 7189.9, 7189.9, 7773.6, 10437.6, 10437.6, 13071.1),
)


def pair_of_shafts(*parts, fast=(), law=None, ratio: float = 1.0) -> exugear.Model:
    """The paper's pair on a mesh of constant stiffness; ratio: inertia of the slow over that of the fast shaft."""
    on = {"fast": [paper_gear(), *parts, *fast], "slow": [paper_gear(), *parts]}
    inertia = {"fast": INERTIA, "slow": ratio * INERTIA}
    shafts = [exugear.Shaft(name, {0.0: on[name]}, inertia=inertia[name], mass=MASS) for name in on]
    return exugear.build(exugear.Gearbox([exugear.Stage(*shafts, law or linear_law(), pair=paper_pair())]))


def three_shafts(damping: float = 2700.0, bearing_damping: float = 1e-6) -> exugear.Model:
    """Two stages of the paper's pair on bearings, the input shaft behind a coupling."""
    bearing, gear = exugear.Bearing(5e8, 3e8, 2e5, bearing_damping), paper_gear()
    motor = exugear.Coupling(5e4, 0.0, inertia=0.02)
    fast = exugear.Shaft("input", {0.0: bearing, 30 * mm: [gear, motor]})
    middle = exugear.Shaft("middle", {0.0: bearing, 30 * mm: gear, 80 * mm: gear})
    slow = exugear.Shaft("output", {0.0: bearing, 80 * mm: gear})
    stages = [smooth_stage(*ends, damping=damping) for ends in ((fast, middle), (middle, slow))]
    return exugear.build(exugear.Gearbox(stages))


def planets(number: int, depth: float = planetary_set.DEPTH) -> exu.MainSystem:
    """Published planetary set, all teeth pressed."""
    gears = planetary_set.build(planets=number)
    gears.mbs.Assemble()
    planetary_set.put_into_mesh(gears, depth)
    return gears.mbs


def train_matrices(box: exugear.Gearbox, plan: exugear.Plan | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness of a built train without its meshes."""
    mass, stiffness, _ = matrices_without_meshes(exugear.build(box, plan=plan))
    return mass, stiffness
