"""Coordinates of the shafts' bodies: which ones a shaft has, and where its body stands."""

from enum import Enum

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.shaft import Shaft
from exugear.kernels import contact_kernels
from exugear.kernels.contact_kernels import PLANAR, SPATIAL


class Coordinates(Enum):
    """What a shaft may do."""

    SPIN = "1 coordinate, spin about z"
    PLANAR = "3 coordinates, planar body on elastic bearings"
    BEARINGS = "6 coordinates, rigid body on elastic bearings"
    JOINT = "6 coordinates, rigid body on an ideal revolute joint"

    @property
    def on_bearings(self) -> bool:
        """Whether bearings hold the shaft."""
        return self in (Coordinates.PLANAR, Coordinates.BEARINGS)


#: Coordinates of a shaft's body among displacements and tilts
TAKEN = dict.fromkeys(Coordinates, contact_kernels.TAKEN[SPATIAL]) | {
    Coordinates.SPIN: [5],
    Coordinates.PLANAR: contact_kernels.TAKEN[PLANAR],
}
#: Place of the spin among them
SPIN_PLACE = {kind: len(taken) - 1 for kind, taken in TAKEN.items()}


def pose(gearbox: Gearbox, shaft: Shaft) -> list[float]:
    """Reference coordinates (6) of a shaft's centre of mass, displaced as it is mounted."""
    x, y, z = np.array([*gearbox.shaft_positions[shaft.name], 0.0]) + shaft.offset.at(shaft.centre)
    return [float(x), float(y), float(z), shaft.offset.tilt_x, shaft.offset.tilt_y, 0.0]
