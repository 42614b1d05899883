"""Damping of a mesh as a share of the critical damping of its two shafts."""

from math import sqrt

import numpy as np

from exugear.gearbox.shaft import Shaft
from exugear.mesh_force.force import MeshForce
from fem.pair.pair import GearPair
from fem.support.validation import require

#: Range of values [N s/m] that a user means as ratios where they lie below the least share of the critical damping;
#: least and largest ratio of gears.
MEANT_AS_RATIO, LEAST_RATIO, LARGEST_RATIO = (1e-3, 1.0), 1e-3, 10.0


def reduced_mass(pair: GearPair, fast: Shaft, slow: Shaft) -> float:
    """Mass [kg] of two spinning shafts on the line of action: 1 / (r_b1^2 / J_1 + r_b2^2 / J_2)."""
    return 1 / (pair.pinion.r_b**2 / fast.inertia + pair.wheel.r_b**2 / slow.inertia)


def mean_stiffness(force: MeshForce, pair: GearPair) -> float:
    """Mean tangent stiffness over a pitch [N/m] at the law's largest deflection, the gears aligned within its axes."""
    aligned = {"a": pair.a, "misalignment": 0.0, "axial": 0.0}
    within = {name: float(np.clip(aligned[name], axis[0], axis[-1])) for name, axis in force.offsets.items()}
    law = force.flank_at(1, **within)
    return float(law.table.head.last_stiffness)


def damping_of(ratio: float, stiffness: float, mass: float) -> float:
    """c = 2 ratio sqrt(k m) [N s/m]."""
    return 2 * ratio * sqrt(stiffness * mass)


def check_damping(force: MeshForce, mass: float) -> None:
    """Require a damping that is no ratio and with which the mass [kg] still moves on the mesh."""
    c, critical = force.damping, damping_of(1.0, force.stiffness_max, mass)
    (low, high), got = MEANT_AS_RATIO, f"got {c:g} of a critical {critical:.3g} N s/m"
    meant = low <= c < min(high, LEAST_RATIO * critical)
    require(not meant, f"damping is meant as ratio, {got}; pass damping_ratio={c:g}")
    remedy = "pass N s/m, or damping_ratio=0.06"
    require(c <= LARGEST_RATIO * critical, f"damping holds the gears as if they were stuck together, {got}; {remedy}")
