"""Search of all branches: sweeps over the speed up and down, continuation from each new orbit, subharmonic branches."""

import time
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from math import ceil, log
from typing import NamedTuple

import numpy as np

from exugear.steady_state.branch import SAME, Branch, chord_of, shifted
from exugear.steady_state.continuation import FREQUENCY_CHANGE, Range, points_at_borders, traced
from exugear.steady_state.periodic_orbit import OrbitPoint, PeriodicOrbits, reversed_point
from exugear.steady_state.steady_system import SteadySystem
from fem.support.progress import share_done

#: Range of the mesh frequency over the resonances of the meshes that is searched at least, unless a common period of
#: several cycles would make that long: branches enter other ranges from there.
SEARCHED = Range(0.5, 1.6)
#: Number of speeds of a sweep; share to which vibrations decay at each of them, least and largest number of cycles.
SPEEDS, SETTLED, FEWEST_CYCLES, MOST_CYCLES = 48, 1e-3, 2, 400
#: Change over a period, relative to the static deflection, below which a state may be near an orbit of that period;
#: distance up to which the orbit is that of the state.
NEAR, SAME_ORBIT = 0.05, 0.3
#: Amplitudes over the static deflection at which a subharmonic branch is started.
SUBHARMONIC = (0.02, 0.1, 0.005)
#: Time of a point of a branch over that of a common period, measured, with points set closer where a branch bends;
#: frequencies at which the cost is summed.
PERIODS_OF_A_POINT, COST_FREQUENCIES = 9, 64
#: Rate of decay over the resonance [1] that is rounding.
UNDAMPED = 1e-6
#: Difference of the unknowns of the end of a subharmonic branch and the period doubling at which it ends.
JOINED = 0.5


def all_branches(system: SteadySystem, within: Range) -> list[Branch]:
    """Branches of orbits of one and of two common periods in a range of the mesh frequency.

    Orbits of one period are reached by sweeps, those of two also from period doublings. Raises ValueError where all
    motions leave the maps, RuntimeError where a mode is not damped or no periodic orbit is reached otherwise.
    """
    if not system.decay > UNDAMPED * system.resonance:
        undamped = (
            "steady states need damping: a mode that the meshes excite is not damped, its vibrations do not settle"
        )
        raise RuntimeError(f"{undamped}; give Stage(damping_ratio=0.06)")
    branches: list[Branch] = []
    left_maps: list[str] = []
    searched = within
    if system.cycles == 1:
        resonances = system.resonances / system.resonance
        low, high = SEARCHED.low * resonances.min(), SEARCHED.high * resonances.max()
        searched = Range(min(within.low, low), max(within.high, high))
    frequencies = np.geomspace(searched.low, searched.high, SPEEDS)
    covered = Coverage(system, searched)
    with share_done(f"steady states, {covered}") as covered.done:
        search = Search(searched, covered)
        for sweep in (frequencies, frequencies[::-1]):
            left_maps += _sweep(system, branches, search, sweep)
    inside = [piece for branch in branches for piece in _pieces(system, branch, within)]
    if not inside:
        raise _not_reached(system, within, left_maps)
    return inside


class Coverage:
    """The share of a range that branches have covered, by the steps that its points take, for a progress bar.

    expected   time of a branch over the whole range [s], by that of a common period from rest at the upper end
    """

    def __init__(self, system: SteadySystem, searched: Range):
        self.low, self.high, self.done = searched.high, searched.low, lambda share: None
        self.ratios = np.geomspace(searched.low, searched.high, COST_FREQUENCIES)
        steps = np.array([system.pieces(ratio * system.resonance)[:, 2].sum() for ratio in self.ratios])
        between = (steps[1:] + steps[:-1]) / 2 * np.diff(np.log(self.ratios)) / FREQUENCY_CHANGE
        self.steps = np.append(0.0, np.cumsum(between))
        self.expected = PERIODS_OF_A_POINT * self.steps[-1] * _time_of_step(system, searched.high * system.resonance)

    def __call__(self, ratio: float) -> None:
        """Note that a branch has reached a frequency over the resonance."""
        self.low, self.high = min(self.low, ratio), max(self.high, ratio)
        begin, end = np.interp([self.low, self.high], self.ratios, self.steps)
        self.done(max(float(end - begin), 0.0) / float(self.steps[-1]))

    def __str__(self) -> str:
        minutes = self.expected / 60
        return f"about {minutes:.0f} min" if minutes > 1.5 else f"about {max(self.expected, 1.0):.0f} s"


def _time_of_step(system: SteadySystem, frequency: float) -> float:
    """Time of a step [s] at a mesh frequency [Hz]; 0 where the motion from rest leaves the maps."""
    try:
        system.settled(system.at_start, frequency, 1)
        began = time.perf_counter()
        system.settled(system.at_start, frequency, 1)
    except ValueError:
        return 0.0
    return (time.perf_counter() - began) / float(system.pieces(frequency)[:, 2].sum())


class Search(NamedTuple):
    """A range of the mesh frequency over the resonance that is searched, and what notes how far."""

    within: Range
    covered: Coverage


def _not_reached(system: SteadySystem, within: Range, left_maps: list[str]) -> Exception:
    """The reason why no orbit was reached; left_maps: messages of motions that left the maps."""
    low, high = (system.resonance * ratio for ratio in (within.low, within.high))
    cycles = f"at mesh frequencies of {low:.4g} to {high:.4g} Hz"
    if left_maps:
        return ValueError(f"load: all motions {cycles} leave the maps: {left_maps[0]}")
    settled = "motions settled on none of one or two common periods"
    return RuntimeError(f"no periodic orbit was reached {cycles}: {settled}; widen speed, or add damping")


def _pieces(system: SteadySystem, branch: Branch, within: Range) -> list[Branch]:
    """The pieces of a branch inside a range, with points at its borders."""
    orbits = PeriodicOrbits(system, branch.period)
    pieces = [branch.points[:1] if within.holds(branch.points[0]) else []]
    for before, after in pairwise(branch.points):
        pieces[-1].extend(points_at_borders(orbits, before, after, within))
        if within.holds(after):
            pieces[-1].append(after)
        elif pieces[-1]:
            pieces.append([])
    return [Branch(points, branch.period, branch.complete) for points in pieces if len(points) > 1]


def _sweep(system: SteadySystem, branches: list[Branch], search: Search, frequencies: Iterable[float]) -> list[str]:
    """Add the branches that a sweep over frequencies over the resonance settles on, after the stable end of each.

    Returns messages of motions that left the maps.
    """
    states, branch, chord = system.at_start, None, 0
    left_maps: list[str] = []
    for ratio in frequencies:
        if branch is not None:
            chord, reached = branch.along(chord, ratio)
            if reached:
                continue
            end = min(branch.points[chord : chord + 2], key=lambda point: abs(point.unknowns[-1] - ratio))
            states = PeriodicOrbits(system).states_of(end.unknowns)
        branch, frequency = None, ratio * system.resonance
        try:
            states = system.settled(states, frequency, _settling_periods(system, frequency))
            point = _orbit_near(system, states, frequency)
        except ValueError as error:
            left_maps.append(str(error))
            states, point = system.at_start, None
        if point is not None:
            branch, chord = _branch_of(system, branches, search, point)
        if branch is None:
            search.covered(float(ratio))
    return left_maps


def _branch_of(
    system: SteadySystem, branches: list[Branch], search: Search, point: OrbitPoint
) -> tuple[Branch | None, int]:
    """The branch through an orbit and its chord there; a new one is added, with those that leave its doublings."""
    for branch in branches:
        chord = chord_of(branch, point, system)
        if chord is not None:
            return branch, chord
    branch = _through(system, point, search)
    branches.append(branch)
    if point.period == 1:
        branches.extend(_subharmonic(system, branches, search))
    start = int(np.abs(branch.unknowns - point.unknowns).max(axis=1).argmin())
    return (branch, min(start, len(branch.points) - 2)) if len(branch.points) > 1 else (None, 0)


def _settling_periods(system: SteadySystem, frequency: float) -> int:
    """Even number of common periods in which vibrations decay."""
    cycles = log(1 / SETTLED) / system.decay * frequency if system.decay > 0 else MOST_CYCLES
    return 2 * ceil(min(max(cycles, FEWEST_CYCLES), MOST_CYCLES) / system.cycles / 2)


def _orbit_near(system: SteadySystem, states: np.ndarray, frequency: float) -> OrbitPoint | None:
    """The orbit of a single common period, else of two, near states [m]; None where neither exists."""
    for period in (1, 2):
        moved = system.settled(states, frequency, period)
        if np.abs(moved - states).max() < NEAR * system.static_deflection:
            point = PeriodicOrbits(system, period).at_frequency(moved, frequency)
            if point is not None and np.abs(point.unknowns[:-1] - moved / system.static_deflection).max() < SAME_ORBIT:
                return point if period == 1 or _is_subharmonic(system, point) else None
    return None


def _is_subharmonic(system: SteadySystem, point: OrbitPoint) -> bool:
    """Whether an orbit of two common periods is none of a single one."""
    return bool(np.abs(shifted(system, point) - point.unknowns).max() > SAME)


def _through(system: SteadySystem, start: OrbitPoint, search: Search) -> Branch:
    """The branch through an orbit, in the direction of rising speed at that orbit."""
    start = start if start.tangent[-1] > 0 else reversed_point(start)
    orbits = PeriodicOrbits(system, start.period)
    forwards = traced(orbits, start, search.within, Ending(system, start, search.covered))
    backwards = traced(orbits, reversed_point(start), search.within, Ending(system, start, search.covered))
    points = [reversed_point(point) for point in backwards.points[:0:-1]] + forwards.points
    return Branch(points, start.period, forwards.complete and backwards.complete)


class Ending:
    """Whether a subharmonic branch has passed the orbits of one common period from which it came."""

    def __init__(self, system: SteadySystem, start: OrbitPoint, covered: Coverage):
        self.system, self.merged, self.covered = system, False, covered
        self.last = self._difference(start)

    def _difference(self, point: OrbitPoint) -> np.ndarray:
        """(2 n,) change of the states over a common period, over the static deflection; 0 for orbits of one period."""
        if point.period == 1:
            return np.zeros(0)
        return shifted(self.system, point)[:-1] - point.unknowns[:-1]

    def __call__(self, point: OrbitPoint) -> bool:
        self.covered(float(point.unknowns[-1]))
        difference = self._difference(point)
        self.merged = bool(difference @ self.last < 0)
        self.last = difference
        return self.merged


def _subharmonic(system: SteadySystem, branches: list[Branch], search: Search) -> list[Branch]:
    """Branches of two common periods from the period doublings of the last branch."""
    new: list[Branch] = []
    doublings = branches[-1].doublings
    for doubling in doublings:
        ends = [branch.points[-1] for branch in new]
        if any(np.abs(end.unknowns - doubling.unknowns).max() < SAME for end in ends):
            continue
        branch = _doubled(system, doubling, search, doublings)
        if branch is not None:
            new.append(branch)
    return new


def _doubled(system: SteadySystem, doubling: OrbitPoint, search: Search, doublings: list[OrbitPoint]) -> Branch | None:
    """The branch of two common periods that leaves a period doubling, and ends at another if it does."""
    values, vectors = np.linalg.eig(doubling.jacobian[:, :-1])
    nearest = int(np.abs(values + 2.0).argmin())
    direction = np.append(vectors[:, nearest].real, 0.0)
    direction /= np.linalg.norm(direction)
    orbits = PeriodicOrbits(system, 2)
    for amplitude in SUBHARMONIC:
        start = orbits.solved(doubling.unknowns + amplitude * direction, direction)
        if start is not None and search.within.holds(start):
            break
    else:
        return None
    ending = Ending(system, start, search.covered)
    trace = traced(orbits, start, search.within, ending)
    first = replace(doubling, period=2, bifurcation="", tangent=direction)
    points = [first, *trace.points]
    if ending.merged:
        last = min(doublings, key=lambda point: float(np.abs(point.unknowns - points[-1].unknowns).max()))
        if np.abs(last.unknowns - points[-1].unknowns).max() < JOINED:
            points.append(replace(last, period=2, bifurcation="", tangent=points[-1].tangent))
    return Branch(points, 2, trace.complete)
