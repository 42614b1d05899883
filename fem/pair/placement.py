"""Placement of the gears of a pair in the plane: their centres, and the angles of their teeth.

The pinion's mid-plane lies at the origin, the wheel's centre in the direction of x, the axes along z; the pinion drives
counter-clockwise, and angles count counter-clockwise. The driving flank of tooth 0 touches the line of action at the
roll length roll where the middle of the tooth stands roll / r_b - alpha_wt - psi_b ahead of the line of centres: this
holds for either gear, as seen from its centre, and for a ring with the signs of `fem.gear.gear`: its centre lies at
a < 0, and its tooth opposite to its angle.
"""

from math import pi
from typing import NamedTuple

import numpy as np

from fem.gear.gear import Gear
from fem.pair.mesh_position import MeshPosition
from fem.pair.pair import GearPair
from fem.support.arguments import Finite, checked


class Placement(NamedTuple):
    """Position and angle of a gear.

    centre          (3,) centre of its mid-plane [m]
    angle           angle of the middle of tooth 0 in the mid-plane, from the x axis [rad]; of a ring the opposite one
    turn_per_te     angle by which the gear turns per transmission error [rad/m]
    """

    gear: Gear
    centre: np.ndarray
    angle: float
    turn_per_te: float

    @property
    def rotation(self) -> float:
        """Rotation of a section whose tooth 0 lies along y before it is placed [rad]."""
        return self.angle - pi / 2


def placements(position: MeshPosition, te: float = 0.0, *, lag: float = 0.5) -> tuple[Placement, Placement]:
    """Placements of pinion and wheel under the transmission error te [m].

    lag     share of te by which the wheel stays behind; the pinion runs ahead by the rest
    """
    pair, path = position.pair, position.path
    rolls = position.nominal(0, 0.0), path.on_wheel(position.nominal(0, position.axial))

    def placed(gear: Gear, centre, towards_mate: float, roll: float, share: float) -> Placement:
        turn_per_te = share / gear.r_b
        ahead = roll / gear.r_b - path.alpha_wt - gear.psi_b
        return Placement(gear, np.array(centre), float(towards_mate + ahead + turn_per_te * te), turn_per_te)

    pinion = placed(pair.pinion, [0.0, 0.0, 0.0], 0.0, rolls[0], 1 - lag)
    return pinion, placed(pair.wheel, [position.a, 0.0, position.axial], pi, rolls[1], lag)


@checked
def meshing_angles(
    pair: GearPair, theta: Finite = 0.0, direction: int = 1, *, phase: Finite = 0.0, axial: Finite = 0.0
) -> tuple[float, float]:
    """Angles of a tooth of pinion and wheel [rad] whose driving flanks touch, by default at the pitch point (phase 0).

    Each angle is that of the middle of the tooth in the mid-plane of its gear.

    theta       direction from the pinion's to the wheel's centre, from a ring's to the pinion's [rad]
    direction   +1: the pinion drives counter-clockwise, -1: clockwise
    phase       position in the mesh cycle
    axial       position of the wheel's mid-plane from the pinion's along z [m]
    """
    pinion, wheel = placements(MeshPosition(pair, pair.a, direction * axial, phase))
    opposite = pi if pair.internal else 0.0
    return theta + direction * pinion.angle, theta + pi + opposite + direction * (wheel.angle - pi)
