"""Coordinates of the shafts' bodies, and their reference values."""

from enum import Enum

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.static_offsets import displacement_at


class Coordinates(Enum):
    """The motion of a shaft: its coordinates and their support."""

    SPIN = "1 coordinate, spin about z"
    PLANAR = "3 coordinates, planar body on elastic bearings"
    BEARINGS = "6 coordinates, rigid body on elastic bearings"
    JOINT = "6 coordinates, rigid body on an ideal revolute joint"

    @property
    def on_bearings(self) -> bool:
        """Whether elastic bearings carry the shaft."""
        return self in (Coordinates.PLANAR, Coordinates.BEARINGS)

    @property
    def components(self) -> list[int]:
        """Which of x, y, z, the tilts about x and y, and the spin (numbers 0 to 5) are its coordinates, in order."""
        return {Coordinates.SPIN: [5], Coordinates.PLANAR: [0, 1, 5]}.get(self, [0, 1, 2, 3, 4, 5])

    @property
    def spin_index(self) -> int:
        """Index of the spin among its coordinates: the last one."""
        return len(self.components) - 1


def pose(gearbox: Gearbox, shaft: Shaft) -> list[float]:
    """Reference coordinates (6) [m, rad] of a shaft's centre of mass, its static displacement included.

    Planets are displaced with their carrier, too.
    """
    x, y, z = np.array([*gearbox.shaft_positions[shaft.name], 0.0]) + shaft.offset.at(shaft.centre)
    if carrier := gearbox.planets.get(shaft.name):
        x, y, z = np.array([x, y, z]) + displacement_at(carrier, shaft.centre)
    return [float(x), float(y), float(z), shaft.offset.tilt_x, shaft.offset.tilt_y, 0.0]
