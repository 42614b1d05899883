"""Position of two gears in the mesh cycle, and the lines of contact of their rigid flanks.

The gears turn so that the contact moves from the root to the tip of the pinion. Tooth pair k runs k pitches ahead of
tooth pair 0, whose flanks touch at the pitch point in mid-plane at phase 0; it consists of tooth k of the pinion and
tooth -k of the wheel. Under the transmission error te > 0 the pinion runs ahead by te / (2 r_b1) and the wheel stays
behind by te / (2 r_b2), so that results do not depend on which gear is called the pinion.
"""

from dataclasses import dataclass
from functools import cached_property
from math import ceil, floor, pi, tan

from fem.pair.pair import GearPair
from fem.pair.path_of_contact import PathOfContact


@dataclass(frozen=True)
class MeshPosition:
    """A pair of gears at one phase; axial positions count from the pinion's mid-plane.

    a           working centre distance [m]
    axial       axial position of the wheel's mid-plane [m]
    phase       position in the mesh cycle
    ring_angle  position of the mesh on a ring, which grows by a pitch with each pitch of the phase [rad]; None: 2 pi
                phase / |z|, as the phase counts from tooth 0 of the ring on
    candidates  numbers of the only tooth pairs that may touch; None: all within half a pitch of the path of contact
    """

    pair: GearPair
    a: float
    axial: float
    phase: float
    ring_angle: float | None = None
    candidates: range | None = None

    @cached_property
    def path(self) -> PathOfContact:
        """Path of contact at this centre distance."""
        return PathOfContact(self.pair.pinion, self.pair.wheel, self.a)

    @property
    def alpha(self) -> float:
        """Working transverse pressure angle [rad]."""
        return self.path.alpha_wt

    @property
    def tooth_angle(self) -> float:
        """Angle of the middle of the tooth of a ring in tooth pair 0 from the angle 0 of its supports [rad]."""
        return 0.0 if self.ring_angle is None else self.ring_angle - 2 * pi * self.phase / abs(self.pair.wheel.z)

    @property
    def face(self) -> tuple[float, float]:
        """Axial ends of the face width common to both gears [m]."""
        pinion, wheel = self.pair.pinion.b / 2, self.pair.wheel.b / 2
        return max(-pinion, self.axial - wheel), min(pinion, self.axial + wheel)

    @property
    def eps_gamma(self) -> float:
        """Total contact ratio over the common face width."""
        low, high = self.face
        path, overlap = self.path.end - self.path.start, (high - low) * abs(tan(self.pair.beta_b))
        return (path + overlap) / self.pair.p_bt

    def nominal(self, number, axial):
        """Roll length of the pinion where a tooth pair crosses the line of action at an axial position [m]."""
        return self.path.pitch + (self.phase + number) * self.pair.p_bt + axial * tan(self.pair.beta_b)

    def numbers(self) -> range:
        """Numbers of all tooth pairs within half a pitch of the path of contact, or of the candidates."""
        if self.candidates is not None:
            return self.candidates
        p_bt, rolls = self.pair.p_bt, [self.nominal(0, axial) for axial in self.face]
        first = ceil((self.path.start - max(rolls)) / p_bt - 0.5)
        last = floor((self.path.end - min(rolls)) / p_bt + 0.5)
        return range(first, last + 1)

    def lines(self) -> dict[int, tuple[float, float]]:
        """Axial ends of the line of contact of each tooth pair on the path of contact [m], by its number."""
        lines = ((number, self._line(self.nominal(number, 0.0))) for number in self.numbers())
        return {number: (low, high) for number, (low, high) in lines if low < high}

    def _line(self, roll: float) -> tuple[float, float]:
        """Axial ends of the line of contact that crosses mid-plane at a roll length; low >= high without contact."""
        slope, (start, end) = tan(self.pair.beta_b), (self.path.start, self.path.end)
        if not slope:
            return self.face if start <= roll <= end else (0.0, 0.0)
        low, high = sorted([(start - roll) / slope, (end - roll) / slope])
        return max(low, self.face[0]), min(high, self.face[1])
