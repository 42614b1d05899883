"""The gap between flanks before they deflect: exact involutes, modifications, offsets, cells that may touch.

A cell is a slice of the width of one pair of teeth; in it all is as in its middle section, along the line of contact.
"""

from dataclasses import dataclass
from functools import cached_property
from math import cos, tan

import numpy as np

from fem.elasticity import hertz
from fem.gear.tooth_profile import LEAST_ROLL
from fem.microgeometry.flank import pitch_deviations, removed, roundings, without_roundings
from fem.pair.mesh_position import MeshPosition

#: Places among which the closest one is found, and rounds of more of them between the neighbours of the last one.
SAMPLES, ROUNDS, AROUND = 41, 3, 17
#: Points and weights across a slice, and of a section of no width
GAUSS, MIDDLE = (np.polynomial.legendre.leggauss(points) for points in (3, 1))
#: Newton steps to the mate's tip corner; the last one is shorter than this share of the roll at the tip.
NEWTONS, SHORT = 12, 1e-8
#: Gap of flanks that cannot touch [m].
FAR = 1.0
#: Normals with a shorter lever about the mate count as if they had that one: flanks do not touch there.
LEAST_LEVER = 0.1
TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class ContactSlices:
    """Slices of pairs of teeth: number of the pair, axial ends low and high [m], each (n,).

    te is the transmission error [m] at which flanks are compared, or (n, 1) of each cell: there the gap is exact, and
    linear about it.

    The flank of `own` gear carries the strips of a cell, whose normals are the directions of contact: the pinion before
    the pitch point, the wheel behind it, so that only the mate's tip can end the strips.
    """

    meeting: MeshPosition
    number: np.ndarray
    low: np.ndarray
    high: np.ndarray
    te: float | np.ndarray = 0.0

    @property
    def middle(self) -> np.ndarray:
        """(n,) axial places of the cells [m]."""
        return (self.low + self.high) / 2

    @property
    def length(self) -> np.ndarray:
        """(n,) lengths of the line of contact in the cells [m]."""
        return (self.high - self.low) / cos(self.meeting.pair.beta_b)

    @cached_property
    def own_is_pinion(self) -> np.ndarray:
        """(n,) whether the pinion carries the strips."""
        meeting = self.meeting
        return meeting.nominal(self.number, self.middle) < meeting.path.pitch

    def _own(self, name: str) -> np.ndarray:
        pair = self.meeting.pair
        return np.where(self.own_is_pinion, getattr(pair.pinion, name), getattr(pair.wheel, name))

    def _mate(self, name: str) -> np.ndarray:
        pair = self.meeting.pair
        return np.where(self.own_is_pinion, getattr(pair.wheel, name), getattr(pair.pinion, name))

    @cached_property
    def radii(self) -> tuple[np.ndarray, np.ndarray]:
        """(n, 1) base radii of own and mate [m]."""
        return self._own("r_b")[:, None], self._mate("r_b")[:, None]

    @cached_property
    def nominal(self) -> np.ndarray:
        """(n, 1) roll lengths of own on the line of action [m]."""
        pinion = self.meeting.nominal(self.number, self.middle)
        wheel = self.meeting.path.on_wheel(pinion)
        return np.where(self.own_is_pinion, pinion, wheel)[:, None] + self.te / 2

    @cached_property
    def mate_nominal(self) -> np.ndarray:
        """(n, 1) roll lengths of the mate on the line of action [m]; they overlap by te."""
        return self.meeting.path.on_wheel(self.nominal) + self.te

    def half_width(self, line_load: np.ndarray) -> np.ndarray:
        """Hertzian half-widths (n,) [m] under forces per axial length (..., n) [N/m]."""
        pair = self.meeting.pair
        return hertz.half_width(line_load, self.radius, pair.pinion.material, pair.wheel.material)

    def hertz_pressure(self, force: np.ndarray) -> np.ndarray:
        """(..., n) largest pressures [Pa] under forces (..., n) [N] by Hertz, on the curvature of the involutes."""
        width = self.half_width(np.maximum(force, TINY) / (self.high - self.low))
        return 2 * force / (np.pi * width * self.length)

    @cached_property
    def set_back(self) -> np.ndarray:
        """(2, n, 1) material that pitch deviations remove from own and mate [m].

        They turn a flank as a whole, and its corner stays on the tip circle; the rest is removed, like misalignment.
        """
        if not self.modified:
            return np.zeros((2, *self.nominal.shape))
        none = np.zeros(self.nominal.shape)
        return self.by_gear(np.stack(self._removed(none, none, none, pitch_deviations)))

    def _arm(self, roll: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Own's points at roll (n, m) as the mate's centre sees them (x, y) [m], mate's roll length [m], its lever.

        Roll lengths of own are as made, those of the mate as set back. The lever is that of the normal about the mate
        over its base radius.
        """
        a, (r_own, r_mate), arm = self.meeting.a, self.radii, roll - self.set_back[0]
        beta = -self.meeting.alpha - (roll - self.nominal) / r_own
        n_x, n_y = -np.sin(beta), np.cos(beta)
        x, y = a - r_own * n_y - arm * n_x, r_own * n_x - arm * n_y
        mate_roll = np.sqrt(np.maximum(x**2 + y**2 - r_mate**2, 0.0))
        return x, y, mate_roll, np.maximum((a * n_y - r_own) / r_mate, LEAST_LEVER)

    def against(self, roll: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """How far the mate may turn until it touches, on its base circle [m], where (its roll length [m]), lever.

        roll        (n, m) roll lengths of own [m]

        The lever is that of own's normal about the mate over its base radius.
        """
        r_mate, (x, y, mate_roll, lever) = self.radii[1], self._arm(roll)
        turn = np.arctan2(y * r_mate - x * mate_roll, x * r_mate + y * mate_roll) + self.meeting.alpha
        mate_roll = mate_roll + self.set_back[1]
        return r_mate * turn + mate_roll - self.mate_nominal, mate_roll, lever

    @cached_property
    def mate_tip(self) -> np.ndarray:
        """(n, 1) roll lengths of the mate at its tip [m]."""
        return self._mate("roll_tip")[:, None]

    @cached_property
    def apart(self) -> np.ndarray:
        """(n, 1) whether all of own's flank is beyond the mate's tip, so that the two cannot touch."""
        ends = np.stack([self._own("roll_form"), self._own("roll_tip")], axis=1)
        return self._arm(ends)[2].min(axis=1, keepdims=True) > self.mate_tip

    @cached_property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """(n, 1) roll lengths of own between which the mate's flank can touch it: the mate's tip corner, own's tip.

        Flanks that cannot touch have their whole length.
        """
        low, high = self._own("roll_form")[:, None], self._own("roll_tip")[:, None]
        return np.where(self.apart, low, self.facing(self.mate_tip)), high

    def facing(self, mate_roll: np.ndarray) -> np.ndarray:
        """(n, 1) roll lengths of own whose normals meet the mate at roll lengths (n, 1) [m], within its flank."""
        low, high = self._own("roll_form")[:, None], self._own("roll_tip")[:, None]
        roll, (r_own, r_mate) = np.clip(self.nominal, low, high), self.radii
        for _ in range(NEWTONS):
            *_, met, lever = self._arm(roll)
            square = roll**2 + (met**2 - mate_roll**2) * r_own / (lever * r_mate)
            last, roll = roll, np.sqrt(np.clip(square, low**2, high**2))
            if (np.abs(roll - last) < SHORT * high).all():
                break
        return roll

    def clear(self, roll: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Normal gap under the transmission error te [m] and mate's roll length on own's normal [m], at roll (n, m).

        An involute is as far away on its own normal as it may turn; a corner moves along own's normal by the lever.
        The mate's roll length lies beyond its tip where its corner is what is nearest.
        """
        turn, mate_roll, lever = self.against(roll)
        foot = mate_roll - turn
        smooth = foot < self.mate_tip + self.set_back[1]
        gap = cos(self.meeting.pair.beta_b) * np.where(smooth, 1.0, lever) * turn
        gap += self.deviation(roll, np.where(smooth, foot, mate_roll))
        return np.where(self.apart, FAR, gap), foot

    def deviation(self, roll: np.ndarray, mate_roll: np.ndarray) -> np.ndarray:
        """(n, m) normal gap by material removed beside what is `set_back` [m], mean along the line of contact.

        Rounded edges, which lines of contact run over on less than a slice, are as in the middle.
        """
        if not self.modified:
            return 0 * roll
        beta_b, own_is_pinion = self.meeting.pair.beta_b, self.own_is_pinion[:, None]
        width = self.high - self.low
        points, weights = GAUSS if width.any() else MIDDLE
        ahead = (points[:, None] * width / 2)[..., None]
        axial, shift = self.middle[:, None] + ahead, ahead * tan(beta_b)
        pinion_roll, wheel_roll = (np.where(own_is_pinion, *two) for two in ((roll, mate_roll), (mate_roll, roll)))
        one, other = self._removed(pinion_roll + shift, wheel_roll - shift, axial, without_roundings)
        gap = np.einsum("p,pnm->nm", weights / 2, one + other) - self.set_back.sum(axis=0)
        return cos(beta_b) * (gap + sum(self._removed(pinion_roll, wheel_roll, self.middle[:, None], roundings)))

    def _removed(self, pinion_roll: np.ndarray, wheel_roll: np.ndarray, axial: np.ndarray, parts_of=tuple):
        """(..., n, m) material removed from pinion, and from wheel, in the transverse section [m], by parts of each."""
        pinion, wheel, tooth = self.meeting.pair.pinion, self.meeting.pair.wheel, self.number[:, None]
        one = removed(parts_of(pinion.drive_flank), pinion.face, pinion_roll, axial, tooth=tooth)
        behind = axial - self.meeting.axial
        other = removed(parts_of(wheel.drive_flank), wheel.face, wheel_roll, behind, tooth=-tooth)
        return one, other

    def tilts(self, roll: np.ndarray, foot: np.ndarray, slopes: np.ndarray, load: np.ndarray) -> np.ndarray:
        """(2, n, m) turns of the direction of contact from the normals of own and mate, towards their tips [rad].

        Pressure p on flanks with a difference of slopes h' settles where the integral of p h' is 0, as half-planes do
        not turn one another: the mean normals of both are then one, which is the direction of the force. Beside its
        mean the direction lies half way between the normals. load (n, m) is where pressure is expected, slopes (n, m)
        are as of `slopes`.
        """
        share, lean = load / load.sum(axis=1, keepdims=True), self._lean(roll, foot)
        mean = (share * (slopes + lean / 2)).sum(axis=1, keepdims=True)
        own = mean - lean / 2
        return cos(self.meeting.pair.beta_b) * np.stack([own, own + lean])

    def _lean(self, roll: np.ndarray, foot: np.ndarray) -> np.ndarray:
        """(n, m) angle between own's normal at roll and the mate's at foot in the transverse section [rad]."""
        r_own, r_mate = self.radii
        return (roll - self.nominal) / r_own - (foot - self.mate_nominal) / r_mate

    def approach(self, roll: np.ndarray, foot: np.ndarray, tilts: np.ndarray) -> np.ndarray:
        """(n, m) normal approach per transmission error, of which each gear turns one half; tilts as of `tilts`."""
        r_own, r_mate = self.radii
        inclined = cos(self.meeting.pair.beta_b)
        own, mate = tilts / inclined
        return inclined * (lever(own, roll / r_own) + lever(mate, np.minimum(foot, self.mate_tip) / r_mate)) / 2

    def slopes(self, roll: np.ndarray) -> np.ndarray:
        """(n, m) change of the material removed from own along the profile between rolls (n, m + 1)."""
        if not self.modified:
            return np.zeros_like(roll[:, 1:])
        one, other = self._removed(roll, roll, self.middle[:, None])
        added = np.where(self.own_is_pinion[:, None], one, other)
        return np.diff(added) / np.diff(roll**2 / (2 * self.radii[0]))

    @property
    def modified(self) -> bool:
        """Whether a flank that drives is modified."""
        return bool(self.meeting.pair.pinion.drive_flank or self.meeting.pair.wheel.drive_flank)

    @property
    def closest(self) -> np.ndarray:
        """(n, 1) roll lengths of own where the two are closest [m]."""
        return self._at_closest[0]

    @cached_property
    def _at_closest(self) -> list[np.ndarray]:
        """Those, and what `clear` finds there, each (n, 1)."""
        low, high = self.limits
        roll = np.clip(self.nominal, low, high)
        if self.modified:
            step, around = (high - low) / (SAMPLES - 1), np.linspace(-1, 1, AROUND)
            roll = np.concatenate([low + step * np.arange(SAMPLES), roll], axis=1)
            for _ in range(ROUNDS):
                roll = np.clip(self._closest_of(roll)[0] + step * around, low, high)
                step = step * 2 / (AROUND - 1)
        return self._closest_of(roll)

    def _closest_of(self, roll: np.ndarray) -> list[np.ndarray]:
        """That one of roll (n, m) where the two are closest, and what `clear` finds there, each (n, 1)."""
        gap, foot = self.clear(roll)
        best = np.argmin(gap, axis=1)[:, None]
        return [np.take_along_axis(each, best, axis=1) for each in (roll, gap, foot)]

    @cached_property
    def nearest(self) -> tuple[np.ndarray, np.ndarray]:
        """Normal gap, aligned [m], and approach per transmission error where the flanks are closest, each (n,)."""
        roll, gap, foot = self._at_closest
        none, there = np.zeros_like(foot), np.ones_like(foot)
        per_error = self.approach(roll, foot, self.tilts(roll, foot, none, there))
        return (gap + per_error * self.te)[:, 0], per_error[:, 0]

    @property
    def touching(self) -> np.ndarray:
        """(2, n, 1) arc lengths on pinion and wheel where the two are closest [m]."""
        roll, _, foot = self._at_closest
        return self.arcs(roll, np.minimum(foot, self.mate_tip))

    @cached_property
    def radius(self) -> np.ndarray:
        """(n,) relative transverse radius of curvature where the flanks are closest [m]."""
        rolls = self.closest, self.against(self.closest)[1]
        tips = (side("roll_tip")[:, None] for side in (self._own, self._mate))
        own, mate = (np.maximum(roll, LEAST_ROLL * tip) for roll, tip in zip(rolls, tips, strict=True))
        return (own * mate / (own + mate))[:, 0]

    def arcs(self, roll: np.ndarray, mate_roll: np.ndarray) -> np.ndarray:
        """(2, n, m) arc lengths on pinion and wheel at roll lengths of own and mate [m]."""
        r_own, r_mate = self.radii
        return self.by_gear(np.stack([roll**2 / (2 * r_own), mate_roll**2 / (2 * r_mate)]))

    def by_gear(self, both: np.ndarray) -> np.ndarray:
        """(2, n, m) of pinion and wheel out of those of own and mate, or these out of those."""
        return np.where(self.own_is_pinion[:, None], both, both[::-1])


def lever(tilt: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """Of a direction about the centre over the base radius; tilt from the normal, turned: roll length over r_b."""
    return np.cos(tilt) - turned * np.sin(tilt)
