"""The gap between two flanks before they deflect: exact involutes, modifications, misalignment, strips that may touch.

The gears turn so that the contact moves from the root to the tip of the pinion. Pair k runs k pitches ahead of pair 0,
which stands at the pitch point at phase 0. Under the transmission error delta > 0 the pinion has run ahead by
delta / (2 r_b1) and the wheel stayed behind by delta / (2 r_b2), so that neither gear is preferred.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem import profile
from fem.flank import removed
from fem.gear import Gear, GearPair

STRIPS = 17
WINDOW = 1.5
SAMPLES = 201


@dataclass(frozen=True)
class Deviation:
    """What the flanks' modifications and the misalignment add to the gap, as means over the slices.

    misalignment    angle in the plane of action by which the gap opens towards positive z [rad]
    slices          (n_slice + 1,) edges [m]
    """

    pair: GearPair
    misalignment: float
    slices: np.ndarray

    def __bool__(self) -> bool:
        return bool(self.pair.pinion.flank or self.pair.wheel.flank or self.misalignment)

    def gap(self, pinion_roll: np.ndarray, wheel_roll: np.ndarray) -> np.ndarray:
        """(n_slice, n) gap [m] where pinion and wheel touch at roll lengths (n,)."""
        points, weights = np.polynomial.legendre.leggauss(3)
        low, high = self.slices[:-1, None, None], self.slices[1:, None, None]
        axial = (low + high) / 2 + (high - low) / 2 * points[:, None]
        gap = self.misalignment * axial
        for gear, roll in ((self.pair.pinion, pinion_roll), (self.pair.wheel, wheel_roll)):
            gap = gap + removed(gear.flank, gear.face, roll, axial)
        return np.einsum("zgn,g->zn", gap + 0 * pinion_roll, weights / 2)


@dataclass(frozen=True)
class Flanks:
    """Two tooth flanks that may touch: `own` carries the strips, whose normals are the directions of contact.

    own, mate       the gears; own is the pinion before the pitch point, the wheel behind it, so that only the
                    mate's tip can end the strips
    a, alpha        centre distance [m], working transverse pressure angle [rad]
    roll_nominal    roll length of own's flank on the line of action [m]
    pair            number of the pair of teeth
    """

    own: Gear
    mate: Gear
    a: float
    alpha: float
    roll_nominal: float
    pair: int
    own_is_pinion: bool
    deviation: Deviation

    def against(self, roll: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Normal gap [m], mate's roll length [m], lever of the normal about the mate over its base radius."""
        beta = -self.alpha - (roll - self.roll_nominal) / self.own.r_b
        normal = np.stack([-np.sin(beta), np.cos(beta)])
        arm = np.array([[self.a], [0.0]]) - self.own.r_b * np.stack([normal[1], -normal[0]]) - roll * normal
        mate_roll = np.sqrt(np.maximum((arm**2).sum(axis=0) - self.mate.r_b**2, 0.0))
        turn = np.arctan2(arm[1], arm[0]) - np.arctan2(mate_roll, self.mate.r_b) + self.alpha
        lever = (arm[0] * normal[1] - arm[1] * normal[0]) / self.mate.r_b
        mate_nominal = self.a * np.sin(self.alpha) - self.roll_nominal
        return lever * (self.mate.r_b * turn + mate_roll - mate_nominal), mate_roll, lever

    @cached_property
    def roll_limits(self) -> tuple[float, float]:
        """Roll lengths of own's flank between which the mate's flank can touch it: the mate's tip corner, own's tip."""
        low, high = self.own.roll_form, self.own.roll_tip
        corner, inside = low, high
        if self.against(np.array([low]))[1][0] > self.mate.roll_tip:
            for _ in range(60):
                middle = (corner + inside) / 2
                beyond = self.against(np.array([middle]))[1][0] > self.mate.roll_tip
                corner, inside = (middle, inside) if beyond else (corner, middle)
        return inside if corner > low else low, high

    def gap(self, roll: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Normal gap (n_slice or 1, n) [m], mate's roll length (n,) [m] and approach (n,) at own's roll (n,)."""
        gap, mate_roll, lever = self.against(roll)
        both = (roll, mate_roll) if self.own_is_pinion else (mate_roll, roll)
        added = self.deviation.gap(*both) if self.deviation else np.zeros((1, 1))
        return gap + added, mate_roll, approach(lever)

    @cached_property
    def closest(self) -> float:
        """Roll length of own's flank where the two are closest [m]."""
        low, high = self.roll_limits
        nominal = min(max(self.roll_nominal, low), high)
        if not self.deviation:
            return nominal
        roll = np.append(np.linspace(low, high, SAMPLES), nominal)
        for _ in range(2):
            gap, _, per_error = self.gap(roll)
            best = roll[np.argmin((gap / per_error).min(axis=0))]
            step = (high - low) / (SAMPLES - 1)
            roll = np.clip(np.append(best + step * np.linspace(-1, 1, SAMPLES), best), low, high)
        return float(best)

    @cached_property
    def separation(self) -> float:
        """Transmission error at which the two just touch [m]."""
        gap, _, per_error = self.gap(np.array([self.closest]))
        return float(gap.min() / per_error[0])

    @cached_property
    def radius(self) -> float:
        """Relative radius of curvature where the two are closest [m]."""
        mate = self.against(np.array([self.closest]))[1][0]
        return self.closest * mate / (self.closest + mate)

    def strips(self, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Arc lengths on pinion and wheel (2, n), gap (n_slice or 1, n), approach (n,), width of n equal strips [m].

        The strips cover the flank as far as reach [m] on either side of the closest point.
        """
        low, high = profile.arc_length(self.own, np.array(self.roll_limits))
        centre = profile.arc_length(self.own, self.closest)
        edges = np.linspace(max(low, centre - reach), min(high, centre + reach), STRIPS + 1)
        arcs = (edges[1:] + edges[:-1]) / 2
        gap, mate_roll, per_error = self.gap(profile.roll_at(self.own, arcs))
        both = np.stack([arcs, profile.arc_length(self.mate, mate_roll)])
        return both if self.own_is_pinion else both[::-1], gap, per_error, edges[1] - edges[0]

    def expected(self, arcs: np.ndarray, reach: float) -> np.ndarray:
        """(n,) strips within Hertz's half-width, if reach is WINDOW times that."""
        own = arcs[0] if self.own_is_pinion else arcs[1]
        return np.abs(own - profile.arc_length(self.own, self.closest)) <= reach / WINDOW

    def spills(self, reach: float, load: np.ndarray) -> bool:
        """Whether load (n_slice, n) presses on an end strip that could have more flank beside it."""
        low, high = profile.arc_length(self.own, np.array(self.roll_limits))
        centre = profile.arc_length(self.own, self.closest)
        pressed = np.any(load > 0, axis=0)
        left, right = centre - reach > low, centre + reach < high
        return bool((pressed[0] and left) or (pressed[-1] and right))


def approach(lever: np.ndarray) -> np.ndarray:
    """Normal approach per transmission error of which each gear turns one half; own's lever is its base radius."""
    return (1 + lever) / 2


def flanks_at(pair: GearPair, phase: float, deviation: Deviation) -> list[Flanks]:
    """All pairs of teeth within half a pitch of the path of contact, in the order of their separation."""
    found = []
    k_low = np.ceil((pair.roll_start - pair.roll_pitch) / pair.p_bt - phase - 0.5)
    k_high = np.floor((pair.pinion.roll_tip - pair.roll_pitch) / pair.p_bt - phase + 0.5)
    for k in range(int(k_low), int(k_high) + 1):
        roll = pair.roll_pitch + (phase + k) * pair.p_bt
        if roll < pair.roll_pitch:
            found.append(Flanks(pair.pinion, pair.wheel, pair.a, pair.alpha_wt, roll, k, True, deviation))
        else:
            roll = pair.a * np.sin(pair.alpha_wt) - roll
            found.append(Flanks(pair.wheel, pair.pinion, pair.a, pair.alpha_wt, roll, k, False, deviation))
    return sorted(found, key=lambda flanks: flanks.separation)
