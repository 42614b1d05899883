"""Where two gears stand: phase of the mesh cycle, centre distance and axial place; lines of contact of rigid flanks.

The gears turn so that the contact moves from the root to the tip of the pinion. Pair k runs k pitches ahead of pair 0,
whose flanks touch at the pitch point in mid-plane at phase 0; its teeth have number k on the pinion, -k on the wheel.
Under the transmission error delta > 0 the pinion has run ahead by delta / (2 r_b1) and the wheel stayed behind by
delta / (2 r_b2), so that neither gear is preferred.
"""

from dataclasses import dataclass
from functools import cached_property
from math import acos, sin, tan

import numpy as np

from fem.pair.pair import GearPair


@dataclass(frozen=True)
class MeshPosition:
    """A pair of gears at one phase and place; angle, distances and axial places [m] count from the pinion.

    a           working centre distance [m]
    axial       place of the wheel's mid-plane [m]
    phase       position in the mesh cycle
    """

    pair: GearPair
    a: float
    axial: float
    phase: float

    @cached_property
    def alpha(self) -> float:
        """Working transverse pressure angle [rad]."""
        return acos((self.pair.pinion.r_b + self.pair.wheel.r_b) / self.a)

    @property
    def face(self) -> tuple[float, float]:
        """Ends of the width common to both gears [m]."""
        pinion, wheel = self.pair.pinion.b / 2, self.pair.wheel.b / 2
        return max(-pinion, self.axial - wheel), min(pinion, self.axial + wheel)

    @property
    def path(self) -> tuple[float, float]:
        """Roll lengths of the pinion where the path of contact begins, and ends [m]."""
        pinion, wheel, across = self.pair.pinion, self.pair.wheel, self.a * sin(self.alpha)
        return max(across - wheel.roll_tip, pinion.roll_form), min(pinion.roll_tip, across - wheel.roll_form)

    def nominal(self, number, axial):
        """Roll length of the pinion on the line of action of a pair of teeth at an axial place [m]."""
        pair = self.pair
        return pair.pinion.r_b * np.tan(self.alpha) + (self.phase + number) * pair.p_bt + axial * tan(pair.beta_b)

    def numbers(self) -> range:
        """Numbers of all pairs of teeth within half a pitch of the path of contact."""
        p_bt, ends = self.pair.p_bt, [self.nominal(0, z) for z in self.face]
        low, high = self.path
        return range(int(np.ceil((low - max(ends)) / p_bt - 0.5)), int(np.floor((high - min(ends)) / p_bt + 0.5)) + 1)

    def lines(self) -> dict[int, tuple[float, float]]:
        """Axial ends of the line of contact of each pair of teeth on the path of contact [m]."""
        found, slope = {}, tan(self.pair.beta_b)
        for number in self.numbers():
            start = self.nominal(number, 0.0)
            ends = [(end - start) / slope if slope else end for end in (self.path if slope else self.face)]
            low, high = max(min(ends), self.face[0]), min(max(ends), self.face[1])
            if low < high and (slope or self.path[0] <= start <= self.path[1]):
                found[number] = low, high
        return found
