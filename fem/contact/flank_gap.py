"""The gap between two flanks before they deflect: exact involutes, modifications, offsets.

The face width of each tooth pair is cut into slices; in a slice gap and load are those of its middle section, along the
line of contact. `closest_point` searches along the profile here, and across the face in `tooth_contact`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import cos, tan

import numpy as np

from fem.gear.tooth_profile import LEAST_ROLL
from fem.microgeometry.flank import pitch_deviations, removed, roundings, without_roundings
from fem.pair import hertz
from fem.pair.mesh_position import MeshPosition

#: Number of positions on a modified profile, with steps shorter than reliefs; number of rounds of the search around the
#: closest position, and positions in a round: steps shrink by 8 in each round, to 1e-5 of a flank.
SAMPLES, ROUNDS, AROUND = 41, 3, 17
#: Gauss points and weights across a slice, and for a section of no width.
GAUSS, MIDDLE = (np.polynomial.legendre.leggauss(points) for points in (3, 1))
#: Newton steps to the mate's tip corner; they end with a step shorter than this share of the roll length at the tip.
NEWTON_STEPS, SHORTEST = 12, 1e-8
#: Gap of flanks that cannot touch [m]; least lever of a normal about the mate: normals of contacts have longer ones.
OUT_OF_REACH, LEAST_LEVER = 1.0, 0.1
GapFunction = Callable[[np.ndarray], tuple[np.ndarray, ...]]


def closest_point(gaps: GapFunction, positions: np.ndarray, step, limits, *, rounds, around) -> list[np.ndarray]:
    """Position (n, 1) of the smallest gap, and the values of `gaps` there.

    gaps        gap (n, m), and further values, at positions (n, m) along a line
    positions   (n, m) positions of the first round; each of the next `rounds` has `around` positions within a step of
                the closest, and a smaller step
    limits      least and largest position
    """
    closest = _closest_of(gaps, positions)
    for _ in range(rounds):
        closest = _closest_of(gaps, np.clip(closest[0] + step * np.linspace(-1, 1, around), *limits))
        step = step * 2 / (around - 1)
    return closest


def _closest_of(gaps: GapFunction, positions: np.ndarray) -> list[np.ndarray]:
    values = gaps(positions)
    smallest = np.argmin(values[0], axis=1)[:, None]
    return [np.take_along_axis(value, smallest, axis=1) for value in (positions, *values)]


@dataclass(frozen=True)
class ContactSlices:
    """Slices of tooth pairs: number of the tooth pair, axial ends low and high [m], each (n,).

    te is the transmission error [m], a number or (n, 1), about which gap and approach are linearized.

    One gear, the host, carries the strips of a slice; the normals of its flank are the directions of contact. It is the
    pinion before the pitch point and the wheel behind it, so that only the tip of the mate can end the strips.
    """

    position: MeshPosition
    number: np.ndarray
    low: np.ndarray
    high: np.ndarray
    te: float | np.ndarray = 0.0

    @property
    def middle(self) -> np.ndarray:
        """(n,) axial positions of the middle sections [m]."""
        return (self.low + self.high) / 2

    @property
    def width(self) -> np.ndarray:
        """(n,) axial widths [m]."""
        return self.high - self.low

    @property
    def length(self) -> np.ndarray:
        """(n,) lengths of the line of contact in the slices [m]."""
        return self.width / cos(self.position.pair.beta_b)

    @cached_property
    def pinion_is_host(self) -> np.ndarray:
        """(n,) whether the pinion carries the strips."""
        return self.position.nominal(self.number, self.middle) < self.position.path.pitch

    def host(self, name: str) -> np.ndarray:
        """(n, 1) a quantity of the hosts."""
        return np.where(self.pinion_is_host, *self._of_gears(name))[:, None]

    def mate(self, name: str) -> np.ndarray:
        """(n, 1) a quantity of the mates."""
        return np.where(self.pinion_is_host, *self._of_gears(name)[::-1])[:, None]

    def _of_gears(self, name: str) -> tuple[float, float]:
        return getattr(self.position.pair.pinion, name), getattr(self.position.pair.wheel, name)

    @property
    def modified(self) -> bool:
        """Whether a flank that drives is modified."""
        return bool(self.position.pair.pinion.drive_flank or self.position.pair.wheel.drive_flank)

    @cached_property
    def radii(self) -> tuple[np.ndarray, np.ndarray]:
        """(n, 1) base radii of host and mate [m]."""
        return self.host("r_b"), self.mate("r_b")

    @cached_property
    def nominal(self) -> np.ndarray:
        """(n, 1) roll lengths of the host on the line of action [m]."""
        pinion = self.position.nominal(self.number, self.middle)
        return np.where(self.pinion_is_host, pinion, self.position.path.on_wheel(pinion))[:, None] + self.te / 2

    @cached_property
    def mate_nominal(self) -> np.ndarray:
        """(n, 1) roll lengths of the mate on the line of action [m]; they overlap by te."""
        return self.position.path.on_wheel(self.nominal) + self.te

    def half_width(self, line_load: np.ndarray) -> np.ndarray:
        """Hertzian half-widths (n,) [m] under forces per axial length (..., n) [N/m]."""
        pair = self.position.pair
        return hertz.half_width(line_load, self.radius, pair.pinion.material, pair.wheel.material)

    @cached_property
    def set_back(self) -> np.ndarray:
        """(2, n, 1) material that pitch deviations remove from host and mate [m].

        A pitch deviation turns the whole flank, whose corner stays on the tip circle; other material changes the gap.
        """
        if not self.modified:
            return np.zeros((2, *self.nominal.shape))
        none = np.zeros(self.nominal.shape)
        return self.by_gear(np.stack(self._removed(none, none, none, pitch_deviations)))

    def _seen_from_mate(self, roll: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The host's points at roll (n, m) from the mate's centre (x, y) [m], the mate's roll length [m], the lever.

        Pitch deviations shorten roll lengths by `set_back`: roll is given before, the mate's is that after it.
        The lever is that of the host's normal about the mate's centre over the mate's base radius.
        """
        a, (r_host, r_mate), shortened = self.position.a, self.radii, roll - self.set_back[0]
        angle = -self.position.alpha - (roll - self.nominal) / r_host
        n_x, n_y = -np.sin(angle), np.cos(angle)
        x, y = a - r_host * n_y - shortened * n_x, r_host * n_x - shortened * n_y
        mate_roll = np.sqrt(np.maximum(x**2 + y**2 - r_mate**2, 0.0))
        return x, y, mate_roll, np.maximum((a * n_y - r_host) / r_mate, LEAST_LEVER)

    def free_turn(self, roll: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Turn of the mate until it touches the host at roll (n, m), on the mate's base circle [m].

        Also the mate's roll length there [m], and the lever of `_seen_from_mate`.
        """
        r_mate, (x, y, mate_roll, lever) = self.radii[1], self._seen_from_mate(roll)
        turn = np.arctan2(y * r_mate - x * mate_roll, x * r_mate + y * mate_roll) + self.position.alpha
        mate_roll = mate_roll + self.set_back[1]
        return r_mate * turn + mate_roll - self.mate_nominal, mate_roll, lever

    @cached_property
    def out_of_reach(self) -> np.ndarray:
        """(n, 1) whether all of the host's flank is beyond the mate's tip, so that the two cannot touch."""
        ends = np.hstack([self.host("roll_form"), self.host("roll_tip")])
        return self._seen_from_mate(ends)[2].min(axis=1, keepdims=True) > self.mate("roll_tip")

    @cached_property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """(n, 1) roll lengths of the host at the mate's tip corner and at the host's tip; all of it out of reach."""
        corner = self.facing(self.mate("roll_tip"))
        return np.where(self.out_of_reach, self.host("roll_form"), corner), self.host("roll_tip")

    def facing(self, mate_roll: np.ndarray) -> np.ndarray:
        """(n, 1) roll lengths of the host whose normals meet the mate at roll lengths (n, 1) [m], within its flank."""
        low, high = self.host("roll_form"), self.host("roll_tip")
        roll, (r_host, r_mate) = np.clip(self.nominal, low, high), self.radii
        for _ in range(NEWTON_STEPS):
            *_, met, lever = self._seen_from_mate(roll)
            square = roll**2 + (met**2 - mate_roll**2) * r_host / (lever * r_mate)
            last, roll = roll, np.sqrt(np.clip(square, low**2, high**2))
            if (np.abs(roll - last) < SHORTEST * high).all():
                break
        return roll

    def gap_at(self, roll: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Normal gap under te [m] and roll length of the mate on the host's normal [m], at roll lengths (n, m) [m].

        The normal gap of an involute is its free turn; a corner moves along the host's normal by the lever. The mate's
        roll length lies beyond its tip where its corner is closest.
        """
        turn, mate_roll, lever = self.free_turn(roll)
        foot = mate_roll - turn
        smooth = foot < self.mate("roll_tip") + self.set_back[1]
        gap = cos(self.position.pair.beta_b) * np.where(smooth, 1.0, lever) * turn
        gap += self._removed_gap(roll, np.where(smooth, foot, mate_roll))
        return np.where(self.out_of_reach, OUT_OF_REACH, gap), foot

    def _removed_gap(self, roll: np.ndarray, mate_roll: np.ndarray) -> np.ndarray:
        """(n, m) normal gap by material removed beside `set_back` [m], mean along the line of contact.

        Rounded edges, which lines of contact cross on less than a slice, count as in the middle section.
        """
        if not self.modified:
            return 0 * roll
        beta_b, pinion_is_host = self.position.pair.beta_b, self.pinion_is_host[:, None]
        points, weights = GAUSS if self.width.any() else MIDDLE
        ahead = (points[:, None] * self.width / 2)[..., None]
        axial, shift = self.middle[:, None] + ahead, ahead * tan(beta_b)
        pinion_roll, wheel_roll = np.where(pinion_is_host, (roll, mate_roll), (mate_roll, roll))
        of_gears = self._removed(pinion_roll + shift, wheel_roll - shift, axial, without_roundings)
        gap = np.einsum("p,pnm->nm", weights / 2, sum(of_gears)) - self.set_back.sum(axis=0)
        return cos(beta_b) * (gap + sum(self._removed(pinion_roll, wheel_roll, self.middle[:, None], roundings)))

    def _removed(self, pinion_roll: np.ndarray, wheel_roll: np.ndarray, axial: np.ndarray, parts_of=tuple):
        """(..., n, m) material removed from pinion and wheel in transverse sections [m], by `parts_of` each flank."""
        pinion, wheel, tooth = self.position.pair.pinion, self.position.pair.wheel, self.number[:, None]
        of_pinion = removed(parts_of(pinion.drive_flank), pinion.face, pinion_roll, axial, tooth=tooth)
        on_wheel = axial - self.position.axial
        return of_pinion, removed(parts_of(wheel.drive_flank), wheel.face, wheel_roll, on_wheel, tooth=-tooth)

    def tilts(self, roll: np.ndarray, foot: np.ndarray, slopes: np.ndarray, load: np.ndarray) -> np.ndarray:
        """(2, n, m) angles of the direction of contact from the normals of host and mate, towards their tips [rad].

        Half-planes do not turn one another: under pressure p on flanks with a difference of slopes h' the integral of
        p h' vanishes. The mean normals of both flanks are then the direction of the force; about its mean the direction
        lies half-way between the normals. load (n, m) is the expected pressure, slopes (n, m) are those
        of `slopes`.
        """
        r_host, r_mate = self.radii
        between_normals = (roll - self.nominal) / r_host - (foot - self.mate_nominal) / r_mate
        share = load / load.sum(axis=1, keepdims=True)
        from_host = (share * (slopes + between_normals / 2)).sum(axis=1, keepdims=True) - between_normals / 2
        return cos(self.position.pair.beta_b) * np.stack([from_host, from_host + between_normals])

    def approach(self, roll: np.ndarray, foot: np.ndarray, tilts: np.ndarray) -> np.ndarray:
        """(n, m) normal approach per transmission error, of which each gear turns one half; tilts of `tilts`."""
        r_host, r_mate = self.radii
        inclined = cos(self.position.pair.beta_b)
        of_host, of_mate = tilts / inclined
        tilted = np.sin(of_host) * roll / r_host + np.sin(of_mate) * np.minimum(foot, self.mate("roll_tip")) / r_mate
        return inclined * (np.cos(of_host) + np.cos(of_mate) - tilted) / 2

    def slopes(self, roll: np.ndarray) -> np.ndarray:
        """(n, m) change of the material removed from the host along its profile between rolls (n, m + 1)."""
        if not self.modified:
            return np.zeros_like(roll[:, 1:])
        material = np.where(self.pinion_is_host[:, None], *self._removed(roll, roll, self.middle[:, None]))
        return np.diff(material) / np.diff(roll**2 / (2 * self.radii[0]))

    @cached_property
    def _closest(self) -> list[np.ndarray]:
        """Roll length of the host where the flanks are closest, gap and roll length of the mate there, each (n, 1)."""
        low, high = self.limits
        roll = np.clip(self.nominal, low, high)
        if not self.modified:
            return _closest_of(self.gap_at, roll)
        step = (high - low) / (SAMPLES - 1)
        rolls = np.concatenate([low + step * np.arange(SAMPLES), roll], axis=1)
        return closest_point(self.gap_at, rolls, step, (low, high), rounds=ROUNDS, around=AROUND)

    @property
    def closest(self) -> np.ndarray:
        """(n, 1) roll lengths of the host where the flanks are closest [m]."""
        return self._closest[0]

    @property
    def closest_arcs(self) -> np.ndarray:
        """(2, n, 1) arc lengths on pinion and wheel where the flanks are closest [m]."""
        roll, _, foot = self._closest
        return self.arcs(roll, foot)

    @cached_property
    def smallest_gap(self) -> tuple[np.ndarray, np.ndarray]:
        """Smallest normal gap, aligned [m], and approach per transmission error there, each (n,)."""
        roll, gap, foot = self._closest
        approach = self.approach(roll, foot, self.tilts(roll, foot, np.zeros_like(foot), np.ones_like(foot)))
        return (gap + approach * self.te)[:, 0], approach[:, 0]

    def gap_by(self, misalignment) -> np.ndarray:
        """(..., n) normal gap that misalignments (...) [rad], as in `fem.Offsets`, add [m]."""
        return cos(self.position.pair.beta_b) * np.multiply.outer(misalignment, self.middle)

    def first_touch(self, misalignment) -> np.ndarray:
        """(..., n) transmission errors at which the slices touch without load under misalignments (...) [rad]."""
        gap, approach = self.smallest_gap
        return (gap + self.gap_by(misalignment)) / approach

    @cached_property
    def radius(self) -> np.ndarray:
        """(n,) relative transverse radius of curvature where the flanks are closest [m]."""
        host = np.maximum(self.closest, LEAST_ROLL * self.host("roll_tip"))
        mate = np.maximum(self.free_turn(self.closest)[1], LEAST_ROLL * self.mate("roll_tip"))
        return (host * mate / (host + mate))[:, 0]

    def arcs(self, roll: np.ndarray, mate_roll: np.ndarray) -> np.ndarray:
        """(2, n, m) arc lengths on pinion and wheel at roll lengths of host and mate, up to the mate's tip [m]."""
        (r_host, r_mate), mate_roll = self.radii, np.minimum(mate_roll, self.mate("roll_tip"))
        return self.by_gear(np.stack([roll**2 / (2 * r_host), mate_roll**2 / (2 * r_mate)]))

    def by_gear(self, values: np.ndarray) -> np.ndarray:
        """(2, n, m) values of host and mate, (2, n, m) or (2, n, 1), by pinion and wheel; also the reverse."""
        return np.where(self.pinion_is_host[:, None], values, values[::-1])
