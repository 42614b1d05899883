"""Forces on a shaft that are no torque about its axis: external forces, unbalance, and how its weight adds to them."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from fem.support.arguments import checked
from fem.support.representation import short
from fem.support.validation import require

#: Largest force [N] or moment [N m], and acceleration [m/s^2], beyond which the user is taken to mean another unit.
LARGEST_FORCE, LARGEST_GRAVITY = 1e9, 1e3
#: Largest unbalance [kg m], beyond which the user is taken to mean g mm.
LARGEST_UNBALANCE = 10.0


@checked
@short(x="N", y="N", z="N", moment_x="N m", moment_y="N m")
@dataclass(frozen=True)
class ExternalForce:
    """A constant force on a shaft that does not turn with it: of a belt, an overhung load, the thrust of a propeller.

    x, y, z              [N]
    moment_x, moment_y   moment about x and y [N m]; torques about z are drives and loads

    Bearings must carry the shaft. Raises ValueError for a force without any component, and for values that suggest
    another unit.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    moment_x: float = 0.0
    moment_y: float = 0.0

    def __post_init__(self):
        for name, unit in {"x": "N", "y": "N", "z": "N", "moment_x": "N m", "moment_y": "N m"}.items():
            value = getattr(self, name)
            within = f"{name} of an external force must lie within {LARGEST_FORCE:g} {unit}, got {value}"
            require(abs(value) < LARGEST_FORCE, within)
        require(any(self.wrench), "an external force needs a component that is not 0: ExternalForce(y=-2000)")

    @property
    def wrench(self) -> tuple[float, ...]:
        """Force and moment over x, y, z and about x, y, z."""
        return self.x, self.y, self.z, self.moment_x, self.moment_y, 0.0


@checked
@short(moment="kg m", angle="deg")
@dataclass(frozen=True)
class Unbalance:
    """Mass of a shaft beside its axis, whose centrifugal force turns with the shaft.

    moment   mass times its distance from the axis [kg m]
    angle    of the mass from the x axis in the reference configuration [rad]

    The force is moment * speed^2. Along with it the shaft is braked by as much power as the force gives to its motion,
    so that energy is conserved; the force by a change of the speed, moment * acceleration, is left out. Balance quality
    G of ISO 21940-11: moment = G * mass / speed. Bearings must carry the shaft. Raises ValueError for values that
    suggest another unit.
    """

    moment: float
    angle: float = 0.0

    def __post_init__(self):
        unit = "pass kg m: 500 g mm are 500e-6"
        within = f"moment of an unbalance must lie in (0, {LARGEST_UNBALANCE:g}) kg m, got {self.moment}; {unit}"
        require(0 < self.moment < LARGEST_UNBALANCE, within)
        turn = f"angle of an unbalance must lie within a turn, got {self.angle} rad; pass radians: 90*deg"
        require(abs(self.angle) <= 2 * pi, turn)


def gravity_of(owner: str, values: Sequence[float]) -> tuple[float, float, float]:
    """Checked acceleration (x, y, z) [m/s^2]."""
    try:
        gravity = tuple(float(x) for x in values)
    except (TypeError, ValueError):
        gravity = ()
    vector = f"gravity of {owner} must be an acceleration (x, y, z) [m/s^2] such as (0, -9.81, 0), got {values!r}"
    require(len(gravity) == 3 and all(abs(x) < LARGEST_GRAVITY for x in gravity), vector)
    return gravity  # type: ignore[return-value]


def about(lever: float, wrench: Sequence[float]) -> np.ndarray:
    """(6,) force and moment about a point on the axis of those at an axial distance [m] above it."""
    moved = np.array(wrench, float)
    moved[3] -= lever * wrench[1]
    moved[4] += lever * wrench[0]
    return moved
