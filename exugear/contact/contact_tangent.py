"""Exact slopes of the forces of a contact of two gears that spin, by the derivatives of the law itself.

No difference of forces meets the kink at the loss of contact: the slopes are those of the side on which the motion is.
"""

from typing import NamedTuple

import numpy as np

from exugear.contact.contact import contact_of_spins
from exugear.mesh_force.patches import phase_cell, range_of, table_of
from exugear.mesh_force.phase_curvature import phase_curvature
from fem.support.numba_cache import compiled, kept


class PushSlopes(NamedTuple):
    """Slopes of the force of a mesh by advance [N/m], phase of the driving flank [N per pitch] and rate [N s/m]."""

    by_advance: float
    by_phase: float
    by_rate: float


class SpinTangent(NamedTuple):
    """Contact of two gears that spin, linearized.

    force        mesh force [N], > 0 on the driving flank
    slopes       of the force
    by_angles    (2, 2) stiffness [N m/rad]: slopes of the torques on pinion and wheel by their angles, signs changed
    by_speeds    (2, 2) damping [N m s/rad], likewise
    """

    force: float
    slopes: PushSlopes
    by_angles: np.ndarray
    by_speeds: np.ndarray


@compiled
def push_slopes(law, push):
    """`PushSlopes` of a `Push` of a law without offsets."""
    penetration, side = push.static.penetration, push.flank.side
    if penetration <= 0.0:
        return PushSlopes(0.0, 0.0, 0.0)
    table = table_of(law, side)
    r = min(penetration / law.damping_ramp, 1.0)
    ramp = side * push.rate * law.damping * 6.0 * r * (1.0 - r) / law.damping_ramp
    recession = range_of(table, 0, phase_cell(table, push.flank.phase)).unloaded_slope
    return PushSlopes(push.static.stiffness + ramp, push.static.force_by_phase - ramp * recession, push.damping)


@kept
def tangent_of_spins(law, frame, q_1, q_2, v_1, v_2):
    """`SpinTangent` at angles q [rad] and speeds v [rad/s], without friction."""
    contact = contact_of_spins(law, frame, q_1, q_2, v_1, v_2)
    push = contact.push
    slopes, table = push_slopes(law, push), table_of(law, push.flank.side)
    turns, r_1, r_2 = frame.pitches_per_radian, frame.pinion.r_b, frame.wheel.r_b
    moment = turns * push.static.force_by_phase if table.conserves != 0 else 0.0
    bend = turns * turns * phase_curvature(table, push.flank.phase, push.flank.deflection)
    by_angles, by_speeds = np.empty((2, 2)), np.empty((2, 2))
    along = r_1 * slopes.by_advance + turns * slopes.by_phase
    by_angles[0, 0] = r_1 * along + r_1 * moment + (bend if table.conserves != 0 else 0.0)
    by_angles[0, 1] = r_2 * (r_1 * slopes.by_advance + moment)
    by_angles[1, 0], by_angles[1, 1] = r_2 * along, r_2 * r_2 * slopes.by_advance
    by_speeds[0, 0], by_speeds[1, 1] = r_1 * r_1 * slopes.by_rate, r_2 * r_2 * slopes.by_rate
    by_speeds[0, 1] = by_speeds[1, 0] = r_1 * r_2 * slopes.by_rate
    return SpinTangent(push.force, slopes, by_angles, by_speeds)
