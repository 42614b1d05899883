"""A branch of periodic orbits: the chord on which an orbit lies, and how far stable orbits reach from there."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exugear.steady_state.periodic_orbit import OrbitPoint, PeriodicOrbits
from exugear.steady_state.steady_system import SteadySystem

#: Distance from a chord of a branch over its length, and in unknowns, within which an orbit may lie on the branch.
OFF_CHORD, OFF_BRANCH = 0.2, 1e-2
#: Difference of unknowns of the same orbit; share of a chord by which its ends are rounded.
SAME, ROUNDING = 1e-5, 1e-9


@dataclass(frozen=True, eq=False)
class Branch:
    """Successive periodic orbits, with their period in common periods; whether it is `Trace.complete`."""

    points: list[OrbitPoint]
    period: int
    complete: bool

    @cached_property
    def unknowns(self) -> np.ndarray:
        """(n_point, 2 n + 1) unknowns of the points."""
        return np.array([point.unknowns for point in self.points])

    @property
    def doublings(self) -> list[OrbitPoint]:
        """Points at which the period doubles."""
        return [point for point in self.points if point.bifurcation == "period doubling"]

    @cached_property
    def stable(self) -> np.ndarray:
        """(n_point,) whether the orbits are stable."""
        return np.array([point.stable for point in self.points])

    def along(self, chord: int, frequency: float) -> tuple[int, bool]:
        """The chord that stable orbits reach from a chord on towards a frequency over the resonance, and whether it
        holds that frequency.
        """
        frequencies = self.unknowns[:, -1]
        forward = (frequency > frequencies[chord]) == (frequencies[chord + 1] > frequencies[chord])
        while not min(frequencies[chord : chord + 2]) <= frequency <= max(frequencies[chord : chord + 2]):
            end = chord + 1 if forward else chord
            beyond = end + 1 if forward else end - 1
            if not 0 <= beyond < frequencies.size or not self.stable[[end, beyond]].all():
                return chord, False
            if (frequencies[beyond] > frequencies[end]) != (frequency > frequencies[end]):
                return chord, False
            chord = min(end, beyond)
        return chord, True


def shifted(system: SteadySystem, point: OrbitPoint) -> np.ndarray:
    """Unknowns of an orbit one common period later."""
    orbits = PeriodicOrbits(system, point.period)
    states = system.settled(orbits.states_of(point.unknowns), orbits.frequency_of(point.unknowns), 1)
    return np.append(states / system.static_deflection, point.unknowns[-1])


def chord_of(branch: Branch, point: OrbitPoint, system: SteadySystem) -> int | None:
    """Number of the chord of a branch on which an orbit lies; None where it lies on none."""
    if branch.period != point.period:
        return None
    candidates = [point.unknowns] if point.period == 1 else [point.unknowns, shifted(system, point)]
    chords = (_chord_through(branch, unknowns, system) for unknowns in candidates)
    return next((chord for chord in chords if chord is not None), None)


def _chord_through(branch: Branch, unknowns: np.ndarray, system: SteadySystem) -> int | None:
    """Number of the chord on which a branch passes through unknowns; None where it does not."""
    corners, frequency = branch.unknowns, unknowns[-1]
    low, high = corners[:-1], corners[1:]
    rises = high[:, -1] - low[:, -1]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(rises == 0, 0.0, (frequency - low[:, -1]) / rises)
    for i in np.flatnonzero(np.abs(share - 0.5) <= 0.5 + ROUNDING):
        guess = low[i] + share[i] * (high[i] - low[i])
        if np.linalg.norm(guess - unknowns) < OFF_CHORD * np.linalg.norm(high[i] - low[i]) + OFF_BRANCH:
            orbits = PeriodicOrbits(system, branch.period)
            point = orbits.at_frequency(orbits.states_of(guess), orbits.frequency_of(unknowns))
            if point is not None and np.abs(point.unknowns - unknowns).max() < SAME:
                return int(i)
    return None
