"""Coordinates of the shafts' bodies, and their reference values."""

from enum import Enum

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.static_offsets import placed_on


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

    Planets are displaced and tilted with their carrier, too.
    """
    carrier = gearbox.planets.get(shaft.name)
    point, tilts = placed_on(shaft, carrier, shaft.centre, gearbox.shaft_positions)
    return [*point.tolist(), *tilts.tolist(), 0.0]
