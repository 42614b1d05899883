"""The loaded width: on which part of the face each tooth pair carries load, and the slices of that part.

Loaded widths are (n_pair, 2) axial ends [m] of that part; NaN for tooth pairs without load.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import inf, nan, sqrt
from typing import NamedTuple

import numpy as np

from fem.contact.contact_slices import ContactSlices
from fem.contact.contact_state import State
from fem.contact.face_grading import FaceGrading, axial_at, compiled_share, kink_shares, slices_over
from fem.contact.mesh_geometry import PairGeometry, pair_geometry
from fem.elasticity.face_symmetry import Face
from fem.pair.mesh_position import MeshPosition
from fem.support.numba_cache import kept_unchecked, unchecked

#: A loaded width reaches beyond the last section that touches by at least this share of the distance to the next.
LEAST_REACH = 1e-3
#: Flanks closer than this count as touching [modules]: their tooth pair joins at once instead of in the next round.
NEARLY = 4e-7
#: A loaded width is accepted if its ends lie inside the overlap, or outside it, by less than these shares of the
#: widest overlap.
SHORT, EXCESS = 0.02, 0.1
#: Rounds of the search; after WIDEN_FROM of them a width only grows, so that it cannot alternate between two values.
ROUNDS, WIDEN_FROM = 24, 6
#: Strips of slices with little load are as wide as for this share of the largest line load.
LEAST_LOAD = 0.05


@dataclass(frozen=True)
class FaceSlicing:
    """Slices and sections of the modelled face of all tooth pairs at one mesh position.

    slices      number of slices of the modelled face
    """

    position: MeshPosition
    face: Face
    slices: int

    @cached_property
    def mesh(self) -> PairGeometry:
        """The two gears for compiled code."""
        return pair_geometry(self.position)

    @cached_property
    def numbers(self) -> range:
        """Numbers of the tooth pairs."""
        return self.position.numbers()

    @cached_property
    def ends(self) -> tuple[float, float]:
        """Axial ends of the modelled face [m]."""
        return self.face.ends(*self.position.face)

    @cached_property
    def grading(self) -> FaceGrading:
        """Grading of the slices towards the end faces."""
        return FaceGrading(*map(float, (*self.position.face, self.face.start)))

    @cached_property
    def kinks(self) -> np.ndarray:
        """(n_pair, n) shares of the face where the gap may have a kink."""
        return kink_shares(self.position, self.grading, self.ends)

    @cached_property
    def whole(self) -> ContactSlices:
        """Slices of all tooth pairs over the whole modelled face."""
        return self.over(np.tile(self.ends, (len(self.numbers), 1)))

    @cached_property
    def station_shares(self) -> np.ndarray:
        """(n_pair, n) equidistant shares and `kinks`, at which the overlap of the flanks is evaluated."""
        even = np.linspace(0, 1, self.slices + 1)
        return np.hstack([np.tile(even, (len(self.numbers), 1)), self.kinks])

    @cached_property
    def stations(self) -> ContactSlices:
        """Sections at `station_shares`."""
        return self.sections(self.station_shares)

    def sections(self, shares: np.ndarray) -> ContactSlices:
        """Sections of no width at shares (n_pair, n) of the face, of all tooth pairs."""
        axial, numbers = axial_at(self.grading, shares).ravel(), np.array(self.numbers).repeat(shares.shape[1])
        return ContactSlices(self.position, numbers, axial, axial, mesh=self.mesh)

    def over(self, width: np.ndarray, te: float = 0.0) -> ContactSlices:
        """Slices over a loaded width, which end at kinks, as in `slices_over`."""
        number, low, high = slices_over(self.grading, self.slices, self.numbers.start, width, self.kinks)
        return ContactSlices(self.position, number, low, high, te, self.mesh)

    def overlap(self, state: State, misalignment: float) -> np.ndarray:
        """Part of the face on which the flanks of each tooth pair overlap under the transmission error of a state.

        Where they overlap between stations only, it is the part that the slices with load cover.
        """
        te, slices = state.te + NEARLY * self.position.pair.pinion.m_n, state.slices
        stations, mirrored = self.stations.low.reshape(len(self.numbers), -1), self.face.share < 1
        depths = (te - sections.first_touch(misalignment) for sections in (self.stations, slices))
        strips = SliceLoads(slices.number - self.numbers.start, slices.low, slices.high, state.force)
        return overlap_of(self.ends[0], mirrored, stations, *depths, strips)

    def loaded(self, guess: State, misalignment: float, solve: Callable[[ContactSlices, State], State]) -> State:
        """State on slices that cover all of the contact, and little more.

        guess       state from which the first loaded width follows
        solve       function of slices and the state of the last round that returns the state of these slices

        Raises RuntimeError where the loaded width does not converge.
        """
        state, width = guess, self.overlap(guess, misalignment)
        for step in range(ROUNDS):
            state = solve(self.over(width, state.te), state)
            touching = self.overlap(state, misalignment)
            if fits(self.grading, width, touching, EXCESS if step < WIDEN_FROM else inf):
                return state
            width = touching if step < WIDEN_FROM else union(touching, width)
        raise RuntimeError("the loaded width did not converge; try a neighbouring phase or more slices")


def union(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The smallest loaded width that covers both."""
    return np.stack([np.fmin(first[:, 0], second[:, 0]), np.fmax(first[:, 1], second[:, 1])], axis=1)


class SliceLoads(NamedTuple):
    """(m,) tooth pair, counted from the first, lower and upper end [m] and force [N] of each slice."""

    pair: np.ndarray
    low: np.ndarray
    high: np.ndarray
    force: np.ndarray


@kept_unchecked
def overlap_of(begin, mirrored, stations, at_stations, at_slices, strips):
    """`FaceSlicing.overlap` from depths of the overlap [m] at stations (n_pair, n) and in the middle of slices (m,).

    begin       axial position at which the modelled face begins [m]
    mirrored    whether the other half of the face carries the mirror image
    strips      `SliceLoads` of the slices
    """
    pair_of, low, high, force = strips
    pairs, n = stations.shape
    width, axial, depth = np.full((pairs, 2), nan), np.empty(n + low.size + 1), np.empty(n + low.size + 1)
    for k in range(pairs):
        used, start, end = 0, inf, -inf
        for i in range(n):
            used = _insert(stations[k, i], at_stations[k * n + i], used, axial, depth)
        for i in range(low.size):
            if pair_of[i] == k:
                used = _insert((low[i] + high[i]) / 2, at_slices[i], used, axial, depth)
                if force[i] > 0:
                    start, end = min(start, low[i]), max(end, high[i])
        if mirrored:
            used = _insert(-axial[1], depth[1], used, axial, depth)
        deepest = -inf
        for i in range(used):
            deepest = max(deepest, depth[i])
        if deepest > 0:
            ends = positive_range(axial[:used], depth[:used])
            width[k, 0], width[k, 1] = max(ends[0], begin), ends[1]
        elif end > start:
            width[k, 0], width[k, 1] = start, end
    return width


@unchecked
def _insert(position, value, used, axial, depth):
    """Insert a value at an axial position into increasing ones unless it is there; returns the number of positions."""
    k = used
    while k > 0 and axial[k - 1] > position:
        k -= 1
    if k > 0 and axial[k - 1] == position:
        return used
    for i in range(used, k, -1):
        axial[i], depth[i] = axial[i - 1], depth[i - 1]
    axial[k], depth[k] = position, value
    return used + 1


@unchecked
def positive_range(axial, values):
    """Ends of the range in which values (n,) at axial positions (n,), increasing, are positive."""
    first, last = 0, axial.size - 1
    while not values[first] > 0:
        first += 1
    while not values[last] > 0:
        last -= 1
    low = axial[0] if first == 0 else _root(axial, values, first + 1, first, first - 1)
    high = axial[last] if last == axial.size - 1 else _root(axial, values, last - 1, last, last + 1)
    return low, high


@unchecked
def _root(x, y, before, inside, outside):
    """Where the parabola through three points, or the line through two, falls to 0 between the last two."""
    step, fall, bend = x[outside] - x[inside], y[outside] - y[inside], 0.0
    if 0 <= before < x.size:
        behind = (x[inside] - x[before]) / step
        bend = (y[before] - y[inside] + behind * fall) / (behind**2 + behind)
    slope = fall - bend
    share = 2 * y[inside] / (sqrt(max(slope**2 - 4 * bend * y[inside], 0.0)) - slope)
    return x[inside] + step * max(share, LEAST_REACH)


@kept_unchecked
def fits(grading, width, touching, excess):
    """Whether a loaded width covers the touching part, and exceeds it by less than a share of the widest part."""
    widest, short, far = 0.0, -inf, -inf
    for k in range(len(width)):
        if touching[k, 1] >= touching[k, 0]:
            if not width[k, 1] >= width[k, 0]:
                return False
            low, high = compiled_share(grading, touching[k, 0]), compiled_share(grading, touching[k, 1])
            below, above = low - compiled_share(grading, width[k, 0]), compiled_share(grading, width[k, 1]) - high
            widest = max(widest, high - low)
            short, far = max(short, -below, -above), max(far, below, above)
    return short < SHORT * widest and far < excess * widest


def line_loads(slices: ContactSlices, last: State, force: float) -> tuple[np.ndarray, np.ndarray]:
    """(n,) line loads of slices [N/m], interpolated from those of the last state by tooth pair, and (n,) which count.

    Line loads below LEAST_LOAD of the largest are raised to it, and do not count. The sum of all is at least the force
    on the modelled face [N].
    """
    known = last.slices.number, last.slices.middle, last.force / last.slices.width
    return interpolated_loads(slices.number, slices.middle, slices.width, *known, force)


@kept_unchecked
def interpolated_loads(number, middle, width, last_number, last_middle, known, force):
    """`line_loads` of slices (n,) from line loads known in the middles of slices (m,)."""
    loads, loaded, largest, total = np.zeros(number.size), np.zeros(number.size, np.bool_), 0.0, 0.0
    for i in range(number.size):
        before, after = -1, -1
        for j in range(last_number.size):
            if last_number[j] == number[i]:
                largest = max(largest, known[j])
                before = j if last_middle[j] <= middle[i] else before
                after = j if last_middle[j] > middle[i] and after < 0 else after
        if before >= 0 and after >= 0:
            share = (middle[i] - last_middle[before]) / (last_middle[after] - last_middle[before])
            loads[i] = known[before] + (known[after] - known[before]) * share
        elif before >= 0 or after >= 0:
            loads[i] = known[max(before, after)]
    for i in range(number.size):
        loaded[i], loads[i] = loads[i] > LEAST_LOAD * largest, max(loads[i], LEAST_LOAD * largest)
        total += loads[i] * width[i]
    for i in range(number.size):
        loads[i] *= max(1.0, force / total)
    return loads, loaded
