"""The loaded width: on which part of the face each tooth pair carries load, and the slices of that part."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil, inf, sqrt, tan

import numpy as np

from fem.contact.contact_state import State
from fem.contact.flank_gap import ContactSlices
from fem.elasticity.face_symmetry import Face
from fem.microgeometry.flank import edges, edges_across
from fem.pair.mesh_position import MeshPosition

#: Slices are narrower towards the end faces by this power, as the line load changes there.
GRADING = 1.6
#: Kinks keep this distance from one another and from the ends, graded edges from kinks, as shares of an even slice:
#: beside a narrow slice the load on it would be inaccurate.
BETWEEN_KINKS, BESIDE_KINKS = 0.02, 0.2
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

#: Axial ends [m] of the part of the face that carries load, by number of the tooth pair
LoadedWidth = dict[int, tuple[float, float]]


@dataclass(frozen=True)
class FaceGrading:
    """Axial positions at shares of the modelled face, closer together towards the end faces.

    low, high   axial ends of the common face [m]
    start       relative distance from its middle at which the modelled part begins: `WholeFace.start`, `HalfFace.start`
    """

    low: float
    high: float
    start: float

    def axial(self, share: np.ndarray) -> np.ndarray:
        """Axial positions [m] at shares of the modelled part in [0, 1]."""
        side = self.start + (1 - self.start) * share
        graded = np.sign(side) * (1 - (1 - np.abs(side)) ** GRADING)
        return (self.low + self.high) / 2 + (self.high - self.low) / 2 * graded

    def share(self, axial: np.ndarray) -> np.ndarray:
        """Inverse of `axial`."""
        graded = (axial - (self.low + self.high) / 2) / ((self.high - self.low) / 2)
        side = np.sign(graded) * (1 - (1 - np.minimum(np.abs(graded), 1)) ** (1 / GRADING))
        return (side - self.start) / (1 - self.start)


@dataclass(frozen=True)
class FaceSlicing:
    """Slices and sections of the modelled face of all tooth pairs at one mesh position.

    slices      number of slices of the modelled face
    """

    position: MeshPosition
    face: Face
    slices: int

    @property
    def ends(self) -> tuple[float, float]:
        """Axial ends of the modelled face [m]."""
        return self.face.ends(*self.position.face)

    @cached_property
    def grading(self) -> FaceGrading:
        """Grading of the slices towards the end faces."""
        return FaceGrading(*self.position.face, self.face.start)

    @cached_property
    def whole(self) -> ContactSlices:
        """Slices of all tooth pairs over the whole modelled face."""
        return self.over(dict.fromkeys(self.position.numbers(), self.ends))

    @cached_property
    def kink_shares(self) -> dict[int, np.ndarray]:
        """(n,) shares of the face where the gap may have a kink, by number of the tooth pair."""
        shares = self.grading.share(np.clip(kinks(self.position), *self.ends))
        return dict(zip(self.position.numbers(), shares, strict=True))

    @cached_property
    def station_shares(self) -> np.ndarray:
        """(n_pair, n) equidistant shares and `kink_shares`, at which the overlap of the flanks is evaluated."""
        even = np.linspace(0, 1, self.slices + 1)
        return np.stack([np.append(even, kink) for kink in self.kink_shares.values()])

    @cached_property
    def stations(self) -> ContactSlices:
        """Sections at `station_shares`."""
        return self.sections(self.station_shares)

    def sections(self, shares: np.ndarray) -> ContactSlices:
        """Sections of no width at shares (n_pair, n) of the face, of all tooth pairs."""
        numbers, axial = np.array(self.position.numbers()), self.grading.axial(shares)
        return ContactSlices(self.position, np.repeat(numbers, shares.shape[1]), axial.ravel(), axial.ravel())

    def over(self, width: LoadedWidth, te: float = 0.0) -> ContactSlices:
        """Slices over a loaded width, which end at kinks.

        The widest gets `slices` times the fourth root of its share of the face; the numbers of the tooth pairs are in
        proportion to the square roots of their shares.
        """
        parts, shares = {}, {number: self.grading.share(np.array(ends)) for number, ends in width.items()}
        even = self.slices / max(map(np.ptp, shares.values()), default=1.0) ** 0.25
        for number, (start, end) in shares.items():
            steps = np.linspace(start, end, max(1, ceil(even * sqrt(end - start))) + 1)
            parts[number] = self.grading.axial(with_kinks(steps, self.kink_shares[number]))
        empty = np.zeros(0)
        numbers = np.concatenate([empty.astype(int), *(np.full(part.size - 1, k) for k, part in parts.items())])
        low = np.concatenate([empty, *(part[:-1] for part in parts.values())])
        high = np.concatenate([empty, *(part[1:] for part in parts.values())])
        return ContactSlices(self.position, numbers, low, high, te)

    def overlap(self, state: State, misalignment: float) -> LoadedWidth:
        """Part of the face on which the flanks of each tooth pair overlap under the transmission error of a state.

        Where they overlap between stations only, it is the part that the slices with load cover.
        """
        width: LoadedWidth = {}
        te, stations, slices = state.te + NEARLY * self.position.pair.pinion.m_n, self.stations, state.slices
        at_stations, at_slices = (te - sections.first_touch(misalignment) for sections in (stations, slices))
        for number in self.position.numbers():
            of_stations, of_slices = stations.number == number, slices.number == number
            axial, order = np.unique(np.append(stations.low[of_stations], slices.middle[of_slices]), return_index=True)
            depth = np.append(at_stations[of_stations], at_slices[of_slices])[order]
            loaded = of_slices & (state.force > 0)
            if depth.max() > 0:
                low, high = positive_range(*self.face.continued(axial, depth))
                width[number] = max(low, self.ends[0]), high
            elif loaded.any():
                width[number] = float(slices.low[loaded].min()), float(slices.high[loaded].max())
        return width

    def fits(self, width: LoadedWidth, touching: LoadedWidth, excess: float) -> bool:
        """Whether a loaded width covers the touching part, and exceeds it by less than a share of the widest part."""
        if touching.keys() - width.keys():
            return False
        wanted = self.grading.share(np.array(list(touching.values())))
        outwards = (self.grading.share(np.array([width[k] for k in touching])) - wanted) * [-1, 1]
        outwards /= np.ptp(wanted, axis=1).max()
        return bool(outwards.min() > -SHORT and outwards.max() < excess)

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
            if self.fits(width, touching, EXCESS if step < WIDEN_FROM else inf):
                return state
            width = touching if step < WIDEN_FROM else union(touching, width)
        raise RuntimeError("the loaded width did not converge; try a neighbouring phase or more slices")


def flank_positions(position: MeshPosition, positions_of) -> np.ndarray:
    """(n,) axial positions on both flanks [m], from a function of flank and extent such as `edges_across`."""
    pinion, wheel = ((gear.drive_flank, gear.face) for gear in (position.pair.pinion, position.pair.wheel))
    return np.array([*positions_of(*pinion), *(position.axial + axial for axial in positions_of(*wheel))])


def kinks(position: MeshPosition) -> np.ndarray:
    """(n_pair, n) axial positions where the slope of a modification jumps along the line of contact [m]."""
    pair = position.pair
    pinion, wheel = ((gear.drive_flank, gear.face) for gear in (pair.pinion, pair.wheel))
    across = flank_positions(position, edges_across)
    rolls = np.array([*edges(*pinion), *(position.path.on_wheel(roll) for roll in edges(*wheel))])
    start = position.nominal(np.array(position.numbers())[:, None], 0.0)
    along = (rolls - start) / tan(pair.beta_b) if pair.beta_b else np.zeros((start.size, 0))
    return np.concatenate([np.tile(across, (start.size, 1)), along], axis=1)


def with_kinks(steps: np.ndarray, kinks: np.ndarray) -> np.ndarray:
    """Equidistant steps (n,) and the kinks among them.

    The first and the last step stay; kinks too close to them or to one another, and steps beside kinks are left out.
    """
    least, distance = (share * (steps[1] - steps[0]) for share in (BETWEEN_KINKS, BESIDE_KINKS))
    inside = np.unique(kinks[(kinks > steps[0] + least) & (kinks < steps[-1] - least)])
    if not inside.size:
        return steps
    inside = inside[np.diff(inside, prepend=steps[0]) > least]
    kept = np.abs(steps[:, None] - inside).min(axis=1) > distance
    kept[[0, -1]] = True
    return np.sort(np.concatenate([steps[kept], inside]))


def union(first: LoadedWidth, second: LoadedWidth) -> LoadedWidth:
    """The smallest loaded width that covers both."""
    ends = {k: [width[k] for width in (first, second) if k in width] for k in sorted(first.keys() | second.keys())}
    return {k: (min(low for low, _ in pairs), max(high for _, high in pairs)) for k, pairs in ends.items()}


def positive_range(axial: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """Ends of the range in which values (n,) at axial positions (n,), increasing, are positive."""
    inside = np.flatnonzero(values > 0)
    first, last, end = int(inside[0]), int(inside[-1]), axial.size - 1
    low = axial[0] if first == 0 else _root(axial, values, first + 1, first, first - 1)
    high = axial[end] if last == end else _root(axial, values, last - 1, last, last + 1)
    return float(low), float(high)


def _root(x: np.ndarray, y: np.ndarray, before: int, inside: int, outside: int) -> float:
    """Where the parabola through three points, or the line through two, falls to 0 between the last two."""
    step, fall, bend = x[outside] - x[inside], y[outside] - y[inside], 0.0
    if 0 <= before < x.size:
        behind = (x[inside] - x[before]) / step
        bend = (y[before] - y[inside] + behind * fall) / (behind**2 + behind)
    slope = fall - bend
    share = 2 * y[inside] / (sqrt(max(slope**2 - 4 * bend * y[inside], 0.0)) - slope)
    return x[inside] + step * max(share, LEAST_REACH)


def line_loads(slices: ContactSlices, last: State, force: float) -> np.ndarray:
    """(n,) line loads of slices, interpolated from those of the last state by tooth pair [N/m].

    They are at least LEAST_LOAD of the largest line load; their sum is at least the force on the modelled face [N].
    """
    loads, known = np.zeros(slices.low.size), last.force / last.slices.width
    for number in np.unique(slices.number):
        target, source = slices.number == number, last.slices.number == number
        if source.any():
            loads[target] = np.interp(slices.middle[target], last.slices.middle[source], known[source])
    largest = known[np.isin(last.slices.number, slices.number)].max(initial=0.0)
    loads = np.maximum(loads, LEAST_LOAD * largest)
    return loads * max(1.0, force / float(loads @ slices.width))
