"""How the gap varies across the slices: a parabola through both ends and the middle of each."""

from typing import NamedTuple

import numpy as np

from fem.contact.closest_point import Closest
from fem.contact.contact_slices import ContactSlices, closest_in
from fem.contact.flank_gap import OUT_OF_REACH
from fem.support.numba_cache import kept_unchecked


class GapAcross(NamedTuple):
    """Gap middle + slope x + bend x^2 [m] of n slices at x from -1, the low, to 1, the high end; each (n,).

    approach    normal approach per transmission error
    """

    middle: np.ndarray
    slope: np.ndarray
    bend: np.ndarray
    approach: np.ndarray

    def misaligned(self, slices: ContactSlices, misalignment: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gaps in the middle and slopes (m, n) [m] under misalignments (m,) [rad], as in `fem.Offsets`."""
        return self.middle + slices.gap_by(misalignment), self.slope + slices.slope_by(misalignment)


def gap_across(slices: ContactSlices) -> tuple[ContactSlices, GapAcross]:
    """Slices that adjoin within each tooth pair, closest in their middle sections, and the aligned gap across them."""
    first = np.append(True, np.diff(slices.number) != 0)
    last = np.append(first[1:], True)
    number = np.concatenate([slices.number, slices.number[last], slices.number])
    axial = np.concatenate([slices.low, slices.high[last], slices.middle])
    closest = closest_in(slices.mesh, number, axial, axial, slices.te)
    n, ends = first.size, closest[2, : -first.size]
    high = np.append(ends[1:n], 0.0)
    high[last] = ends[n:]
    slices = slices.closest_at(Closest(*closest[:, -n:]))
    roll, path = slices.position.nominal(slices.number, slices.middle), slices.position.path
    beyond = (roll < path.start) | (roll > path.end)
    middle, slope, bend = parabolas(ends[:n], slices.closest.gap, high, beyond)
    return slices, GapAcross(middle, slope, bend, slices.closest.approach)


@kept_unchecked
def parabolas(low, middle, high, beyond):
    """(3, n) middle, slope and bend of gaps (n,) at the ends and in the middle of slices.

    An end out of reach continues the gap linearly. Slices beyond the path of contact are closest at an end.
    """
    parts = np.empty((3, low.size))
    for i in range(low.size):
        at_low, at_high = low[i], high[i]
        if at_low >= OUT_OF_REACH:
            at_low = 2 * middle[i] - at_high
        elif at_high >= OUT_OF_REACH:
            at_high = 2 * middle[i] - at_low
        slope, bend = (at_high - at_low) / 2, (at_high + at_low) / 2 - middle[i]
        if beyond[i]:
            bend = min(bend, abs(slope) / 2)
        parts[0, i], parts[1, i], parts[2, i] = min(at_low, at_high) + abs(slope) - bend, slope, bend
    return parts


@kept_unchecked
def least_gaps(middle, slope, bend):
    """(m, n) least gaps [m] across slices with gaps and slopes (m, n) and bends (n,)."""
    least = np.empty(middle.shape)
    for k in range(len(middle)):
        for i in range(bend.size):
            least[k, i] = middle[k, i] + bend[i] - abs(slope[k, i])
            if 2 * bend[i] > abs(slope[k, i]):
                least[k, i] = middle[k, i] - slope[k, i] ** 2 / (4 * bend[i])
    return least
