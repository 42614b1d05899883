"""The path of contact: that part of the line of action on which the flanks of two gears touch (ISO 21771).

A point of the line of action is named by its roll length on the pinion: its distance from the point where the line
touches the pinion's base circle. The contact moves from the start to the end of the path, from the root to the tip of
the pinion, while the pinion drives.
"""

from dataclasses import dataclass
from functools import cached_property
from math import acos, cos, sin, tan

from fem.gear.gear import Gear


@dataclass(frozen=True)
class PathOfContact:
    """Path of contact of two gears at the working centre distance a [m]; all roll lengths are the pinion's [m]."""

    pinion: Gear
    wheel: Gear
    a: float

    @cached_property
    def alpha_wt(self) -> float:
        """Working transverse pressure angle [rad]."""
        return acos((self.pinion.r_b + self.wheel.r_b) / self.a)

    @property
    def r_w(self) -> tuple[float, float]:
        """Working pitch radii of pinion and wheel [m]."""
        return self.pinion.r_b / cos(self.alpha_wt), self.wheel.r_b / cos(self.alpha_wt)

    @cached_property
    def length(self) -> float:
        """Distance between the base circles along the line of action [m]."""
        return self.a * sin(self.alpha_wt)

    def on_wheel(self, roll):
        """Roll length of the wheel [m] where the pinion has the roll length roll [m], and the other way round."""
        return self.length - roll

    @cached_property
    def pitch(self) -> float:
        """Roll length at the pitch point [m]."""
        return self.pinion.r_b * tan(self.alpha_wt)

    @cached_property
    def start(self) -> float:
        """Roll length where the contact begins: at the wheel's tip, or at the undercut end of the pinion's flank."""
        return max(self.on_wheel(self.wheel.roll_tip), self.pinion.roll_form)

    @cached_property
    def end(self) -> float:
        """Roll length where the contact ends: at the pinion's tip, or at the undercut end of the wheel's flank."""
        return min(self.pinion.roll_tip, self.on_wheel(self.wheel.roll_form))
