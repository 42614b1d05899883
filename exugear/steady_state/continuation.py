"""Continuation of a branch by its arc length (Keller 1977), through folds, with its bifurcations located."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from exugear.steady_state.orbits.periodic_orbit import OrbitPoint, PeriodicOrbits

#: Largest relative change of the frequency in a step of the continuation, largest and least length of a step in
#: unknowns, and length of the first step.
FREQUENCY_CHANGE, LONGEST, SHORTEST, FIRST = 0.02, 0.4, 1e-7, 0.01
#: Number of Newton iterations below which steps grow, above which they shrink; factor.
QUICK, SLOW, GROWTH = 3, 5, 1.6
#: Least cosine between the tangents at both ends of a step.
LEAST_COSINE = 0.97
#: Component of the tangent along the frequency below which a branch does not leave the frequency, as at a subharmonic
#: branch of a linear system.
UPRIGHT = 1e-4
#: Points of a branch at most.
MOST_POINTS = 5000
#: Located bifurcations: relative change of the frequency that counts as converged, iterations at most.
LOCATED, LOCATING = 1e-7, 30
#: Distance from the first point, over the step, at which a closed branch ends.
CLOSED = 1.0


@dataclass(frozen=True)
class Range:
    """Range of the mesh frequency over the resonance."""

    low: float
    high: float

    def holds(self, point: OrbitPoint) -> bool:
        return self.low <= point.unknowns[-1] <= self.high


def traced(
    orbits: PeriodicOrbits, start: OrbitPoint, within: Range, ended: Callable[[OrbitPoint], bool]
) -> list[OrbitPoint]:
    """The points of a branch from start along its tangent, until it leaves the range, closes or has ended.

    Bifurcations stand as points of their own between the others. Where the orbits leave the map the branch ends.
    """
    points = [start]
    for point in _steps(orbits, start, within):
        if ended(point) or len(points) > MOST_POINTS:
            break
        points.extend(located(orbits, points[-1], point))
        points.append(point)
    return points


def _steps(orbits: PeriodicOrbits, start: OrbitPoint, within: Range) -> Iterator[OrbitPoint]:
    """The points that follow start."""
    point, length, travelled = start, FIRST, 0.0
    while True:
        step = min(length, FREQUENCY_CHANGE * point.unknowns[-1] / max(abs(point.tangent[-1]), 1e-9))
        following = _following(orbits, point, step)
        if following is None or following.tangent @ point.tangent < LEAST_COSINE and step > SHORTEST * 10:
            length = step / 2
            if length < SHORTEST:
                return
            continue
        if not within.holds(following):
            border = within.low if following.unknowns[-1] < within.low else within.high
            last = _at_border(orbits, point, following, border)
            if last is not None:
                yield last
            return
        yield following
        travelled += step
        if travelled > 10 * step and _returns(start, point, following):
            return
        length = _next_length(step, following)
        point = following


def _following(orbits: PeriodicOrbits, point: OrbitPoint, step: float) -> OrbitPoint | None:
    """The point at a step from another one along its tangent; None where there is none."""
    try:
        following = orbits.solved(point.unknowns + step * point.tangent, point.tangent, point)
    except ValueError:
        return None
    far = following is not None and np.linalg.norm(following.unknowns - point.unknowns) > 2 * step
    return None if far else following


def _next_length(step: float, point: OrbitPoint) -> float:
    if point.effort <= QUICK:
        return min(LONGEST, step * GROWTH)
    return step / GROWTH if point.effort > SLOW else step


def _at_border(orbits: PeriodicOrbits, point: OrbitPoint, following: OrbitPoint, border: float) -> OrbitPoint | None:
    """The point at the border of the range between two points."""
    share = (border - point.unknowns[-1]) / (following.unknowns[-1] - point.unknowns[-1])
    guess = point.unknowns + share * (following.unknowns - point.unknowns)
    guess[-1] = border
    try:
        last = orbits.solved(guess, np.eye(guess.size)[-1], point)
    except ValueError:
        return None
    if last is None or share <= 0:
        return None
    return replace(last, tangent=last.tangent * np.sign(last.tangent @ point.tangent))


def _returns(start: OrbitPoint, point: OrbitPoint, following: OrbitPoint) -> bool:
    """Whether a step passes the first point of the branch, in the same direction."""
    chord = following.unknowns - point.unknowns
    length = np.linalg.norm(chord)
    along = (start.unknowns - point.unknowns) @ chord / length**2
    across = np.linalg.norm(start.unknowns - point.unknowns - along * chord)
    return 0 < along <= 1 and across < 0.1 * length and start.tangent @ chord > 0


def located(orbits: PeriodicOrbits, before: OrbitPoint, after: OrbitPoint) -> list[OrbitPoint]:
    """Folds and period doublings between two points of a branch, in the order along it."""
    tests = {"fold": _along_frequency, "period doubling": lambda point: point.doubling}
    bifurcations = []
    for name, test in tests.items():
        if test(before) * test(after) < 0 and not before.bifurcation == name:
            point = _zero(orbits, before, after, test)
            if point is not None:
                bifurcations.append(replace(point, bifurcation=name))
    return sorted(bifurcations, key=lambda point: float((point.unknowns - before.unknowns) @ before.tangent))


def _along_frequency(point: OrbitPoint) -> float:
    """Component of the tangent along the frequency; 0 where rounding decides its sign."""
    return float(point.tangent[-1]) if abs(point.tangent[-1]) > UPRIGHT else 0.0


def _zero(orbits: PeriodicOrbits, before: OrbitPoint, after: OrbitPoint, test) -> OrbitPoint | None:
    """The point between two others at which a test function is 0, by the method of Illinois."""
    low, high = 0.0, float((after.unknowns - before.unknowns) @ before.tangent)
    at_low, at_high = test(before), test(after)
    point, frequency, side = None, 0.0, 0
    for _ in range(LOCATING):
        step = (low * at_high - high * at_low) / (at_high - at_low)
        point = _following(orbits, before, step)
        if point is None:
            return None
        value, change = test(point), abs(point.unknowns[-1] - frequency)
        frequency = point.unknowns[-1]
        if value == 0 or change < LOCATED * frequency:
            return point
        if value * at_high > 0:
            high, at_high = step, value
            at_low = at_low / 2 if side > 0 else at_low
            side = 1
        else:
            low, at_low = step, value
            at_high = at_high / 2 if side < 0 else at_high
            side = -1
    return point
