"""Damping of a mesh as a share of the critical damping of its two shafts: what a damping ratio means in exugear."""

from math import sqrt

import numpy as np

from exugear.gearbox.shaft import Shaft
from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.ring_pair import RingPair
from fem.pair.pair import GearPair
from fem.support.plausibility import check_damping_ratio
from fem.support.validation import require

#: Range of values [N s/m] that a user means as ratios where they lie below the least share of the critical damping;
#: least and largest ratio of gears.
MEANT_AS_RATIO, LEAST_RATIO, LARGEST_RATIO = (1e-3, 1.0), 1e-3, 10.0


def reduced_mass(pair: GearPair | RingPair, fast: Shaft, slow: Shaft) -> float:
    """Mass [kg] of two spinning shafts on the line of action: 1 / (r_b1^2 / J_1 + r_b2^2 / J_2)."""
    return 1 / (pair.pinion.r_b**2 / fast.inertia + pair.wheel.r_b**2 / slow.inertia)


def mean_stiffness(force: MeshForce, pair: GearPair | RingPair) -> float:
    """Mean tangent stiffness over a pitch [N/m] at the law's largest deflection, the gears aligned within its axes."""
    aligned = {"a": pair.a, "misalignment": 0.0, "axial": 0.0}
    within = {name: float(np.clip(aligned[name], axis[0], axis[-1])) for name, axis in force.offsets.items()}
    law = force.flank_at(1, **within)
    return float(law.table.head.last_stiffness)


def critical_damping(force: MeshForce, pair: GearPair | RingPair, fast: Shaft, slow: Shaft) -> float:
    """2 sqrt(k m) [N s/m] of the mesh of two shafts that are free to spin: the damping of a damping ratio of 1.

    k is the `mean_stiffness` of the mesh, m the `reduced_mass` of the shafts.
    """
    return 2 * sqrt(mean_stiffness(force, pair) * reduced_mass(pair, fast, slow))


def check_damping(damping: float, critical: float) -> None:
    """Require a damping [N s/m] that is no ratio, and with which the gears still move on their mesh."""
    (low, high), got = MEANT_AS_RATIO, f"got {damping:g} of a critical {critical:.3g} N s/m"
    meant = low <= damping < min(high, LEAST_RATIO * critical)
    require(not meant, f"damping is meant as ratio, {got}; pass damping_ratio={damping:g}")
    remedy = "pass N s/m, or damping_ratio=0.06"
    stuck = f"damping holds the gears as if they were stuck together, {got}; {remedy}"
    require(damping <= LARGEST_RATIO * critical, stuck)
    check_damping_ratio(damping, critical)
