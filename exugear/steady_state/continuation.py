"""Continuation of a branch by its arc length (Keller 1977), through folds, with its bifurcations located."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import nan
from typing import NamedTuple

import numpy as np
import scipy

from exugear.steady_state.periodic_orbit import OrbitPoint, PeriodicOrbits

#: Largest relative change of the frequency in a step of the continuation, largest and least length of a step in
#: unknowns, and length of the first step.
FREQUENCY_CHANGE, LONGEST, SHORTEST, FIRST = 0.02, 0.4, 1e-7, 0.01
#: Effort of Newton's iteration up to which steps grow, above which they shrink; factor.
FEW_ITERATIONS, MANY_ITERATIONS, GROWTH = 3, 5, 1.6
#: Least cosine between the tangents at both ends of a step.
LEAST_COSINE = 0.97
#: Component of the tangent along the frequency below which a point is a fold, or one of many at the same frequency, as
#: on a subharmonic branch along which no teeth part.
LEAST_FREQUENCY_COMPONENT = 1e-4
#: Points of a branch at most, and points from which on it may close.
MOST_POINTS, FEW_POINTS = 5000, 8
#: Position of a bifurcation in its step, relative tolerance and iterations at most.
LOCATED, LOCATING = 1e-6, 30
#: Rounding of the ends of a range.
ROUNDING = 1e-12
#: Distance of the first point of a closed branch from the last chord, over its length.
CLOSED = 0.1


@dataclass(frozen=True)
class Range:
    """Range of the mesh frequency over the resonance."""

    low: float
    high: float

    def holds(self, point: OrbitPoint) -> bool:
        """Whether a point lies within the range."""
        return self.low * (1 - ROUNDING) <= point.unknowns[-1] <= self.high * (1 + ROUNDING)


class Trace(NamedTuple):
    """Points of a branch, and whether it ends as a branch can: else it leaves the map, or Newton's iteration fails."""

    points: list[OrbitPoint]
    complete: bool


def traced(orbits: PeriodicOrbits, start: OrbitPoint, within: Range, ended: Callable[[OrbitPoint], bool]) -> Trace:
    """The points of a branch from start along its tangent, until it leaves the range, closes or has ended.

    Bifurcations stand as points of their own between the others.
    """
    points, point, length = [start], start, FIRST
    while len(points) < MOST_POINTS:
        following, length = _step(orbits, point, length)
        if following is None:
            return Trace(points, complete=False)
        inside = within.holds(following)
        reached = [following] if inside else points_at_borders(orbits, point, following, within)
        if not reached or ended(reached[0]):
            return Trace(points, complete=True)
        points = [*_with_fold(points, reached[0]), *located(orbits, point, reached[0]), reached[0]]
        if not inside or (len(points) > FEW_POINTS and _returns(start, point, following)):
            return Trace(points, complete=True)
        point = following
    return Trace(points, complete=False)


def _step(orbits: PeriodicOrbits, point: OrbitPoint, length: float) -> tuple[OrbitPoint | None, float]:
    """(the next point, length of the following step); the point is None where the shortest step fails."""
    while length > SHORTEST:
        step = min(length, FREQUENCY_CHANGE * point.unknowns[-1] / max(abs(point.tangent[-1]), SHORTEST))
        following = _following(orbits, point, step)
        if following is not None and following.tangent @ point.tangent > LEAST_COSINE:
            slower = step / GROWTH if following.effort > MANY_ITERATIONS else step
            return following, min(LONGEST, step * GROWTH) if following.effort <= FEW_ITERATIONS else slower
        length = step / 2
    return None, length


def _following(orbits: PeriodicOrbits, point: OrbitPoint, step: float) -> OrbitPoint | None:
    """The point at a step from another one along its tangent; None where there is none."""
    try:
        following = orbits.solved(point.unknowns + step * point.tangent, point.tangent, point)
    except ValueError:
        return None
    far = following is not None and np.linalg.norm(following.unknowns - point.unknowns) > 2 * step
    return None if far else following


def points_at_borders(orbits: PeriodicOrbits, before: OrbitPoint, after: OrbitPoint, within: Range) -> list[OrbitPoint]:
    """The points between two others at the borders of a range, in the order along the branch."""
    rise = after.unknowns[-1] - before.unknowns[-1]
    borders = (within.low, within.high) if rise > 0 else (within.high, within.low)
    shares = [(border - before.unknowns[-1]) / rise if rise else -1.0 for border in borders]
    inside = [pair for pair in zip(shares, borders, strict=True) if ROUNDING < pair[0] < 1 - ROUNDING]
    points = [_at_border(orbits, before, after, share, border) for share, border in inside]
    return [point for point in points if point is not None]


def _at_border(
    orbits: PeriodicOrbits, before: OrbitPoint, after: OrbitPoint, share: float, border: float
) -> OrbitPoint | None:
    """The point at a border, near a share of the way between two points; None where Newton's iteration fails."""
    guess = before.unknowns + share * (after.unknowns - before.unknowns)
    guess[-1] = border
    try:
        point = orbits.solved(guess, np.eye(guess.size)[-1], before)
    except ValueError:
        return None
    return None if point is None else replace(point, tangent=point.tangent * np.sign(point.tangent @ before.tangent))


def _returns(start: OrbitPoint, point: OrbitPoint, following: OrbitPoint) -> bool:
    """Whether a step passes the first point of the branch, in the same direction."""
    chord = following.unknowns - point.unknowns
    length = np.linalg.norm(chord)
    along = (start.unknowns - point.unknowns) @ chord / length**2
    across = np.linalg.norm(start.unknowns - point.unknowns - along * chord)
    return 0 < along <= 1 and across < CLOSED * length and start.tangent @ chord > 0


def located(orbits: PeriodicOrbits, before: OrbitPoint, after: OrbitPoint) -> list[OrbitPoint]:
    """Folds and period doublings between two points of a branch, in the order along it."""
    tests = {"fold": _along_frequency, "period doubling": lambda point: point.doubling}
    bifurcations = []
    for name, test in tests.items():
        if test(before) * test(after) < 0 and before.bifurcation != name:
            point = _zero(orbits, before, after, test)
            if point is not None:
                bifurcations.append(replace(point, bifurcation=name))
    return sorted(bifurcations, key=lambda point: float((point.unknowns - before.unknowns) @ before.tangent))


def _with_fold(points: list[OrbitPoint], following: OrbitPoint) -> list[OrbitPoint]:
    """The points, the last of them marked where it is a fold itself, between its neighbours."""
    sides = [_along_frequency(point) for point in (*points[-2:], following)]
    turns = len(sides) == 3 and sides[1] == 0 and sides[0] * sides[2] < 0
    return [*points[:-1], replace(points[-1], bifurcation="fold")] if turns else points


def _along_frequency(point: OrbitPoint) -> float:
    """Component of the tangent along the frequency; 0 below `LEAST_FREQUENCY_COMPONENT`."""
    return float(point.tangent[-1]) if abs(point.tangent[-1]) > LEAST_FREQUENCY_COMPONENT else 0.0


def _zero(orbits: PeriodicOrbits, before: OrbitPoint, after: OrbitPoint, test) -> OrbitPoint | None:
    """The point between two others at which a test function of points is 0, to the rounding of its frequency.

    None where there is no orbit at a step between them.
    """
    points: dict[float, OrbitPoint | None] = {}

    def value(step: float) -> float:
        point = points[step] = _following(orbits, before, step) if step > 0 else before
        return nan if point is None else test(point)

    end = float((after.unknowns - before.unknowns) @ before.tangent)
    try:
        root = scipy.optimize.brentq(value, 0.0, end, rtol=LOCATED, maxiter=LOCATING, disp=False)
    except ValueError:
        return None
    return points.get(root)
