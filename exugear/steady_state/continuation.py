"""Continuation of a branch by its arc length (Keller 1977), through folds, with its bifurcations located."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import acos, nan, pi
from typing import NamedTuple

import numpy as np
import scipy

from exugear.steady_state.periodic_orbit import SMALL, OrbitPoint, PeriodicOrbits

#: Largest relative change of the frequency in a step of the continuation, largest and least length of a step in
#: unknowns, and length of the first step.
FREQUENCY_CHANGE, LONGEST, SHORTEST, FIRST = 0.02, 0.4, 1e-7, 0.01
#: Effort of Newton's iteration up to which steps grow, above which they shrink; factor.
FEW_ITERATIONS, MANY_ITERATIONS, GROWTH = 3, 5, 1.6
#: Least cosine between the tangents at both ends of a step, and the one that a step aims at; factor to reach it.
LEAST_COSINE, COSINE, SHORTER = 0.97, 0.975, 0.9
#: Component of the tangent along the frequency below which a point is a fold, or one of many at the same frequency, as
#: on a subharmonic branch along which no teeth part.
LEAST_FREQUENCY_COMPONENT = 1e-4
#: Points of a branch at most, and points from which on it may close.
MOST_POINTS, FEW_POINTS = 5000, 8
#: Number of points, and distance over which they must lead where a common period of several mesh cycles is costly: a
#: branch that creeps has no derivatives that guide it, as where teeth hit each other irregularly.
CREEPING, LEAST_ADVANCE = 60, 0.02
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
    points, point, length, path = [start], start, FIRST, Path(start, start)
    while len(points) < MOST_POINTS:
        following, length = _step(orbits, path, length)
        if following is None or (orbits.system.cycles > 1 and _creeps(points)):
            return Trace(points, complete=False)
        inside = within.holds(following)
        reached = [following] if inside else points_at_borders(orbits, point, following, within)
        if not reached or ended(reached[0]):
            return Trace(points, complete=True)
        points = [*_with_fold(points, reached[0]), *located(orbits, point, reached[0]), reached[0]]
        if not inside or (len(points) > FEW_POINTS and _returns(start, point, following)):
            return Trace(points, complete=True)
        path, point = Path(point, following), following
    return Trace(points, complete=False)


def _creeps(points: list[OrbitPoint]) -> bool:
    """Whether many points have led nowhere."""
    before = points[-CREEPING:][0].unknowns
    return len(points) > CREEPING and bool(np.linalg.norm(points[-1].unknowns - before) < LEAST_ADVANCE)


class Path:
    """A cubic curve over its length, and jacobians along it, by two successive points of a branch; 0 is the second.

    A single point gives its tangent.
    """

    def __init__(self, before: OrbitPoint, after: OrbitPoint):
        half_angle = acos(min(float(before.tangent @ after.tangent), 1.0)) / 2
        length = float(np.linalg.norm(after.unknowns - before.unknowns) / np.sinc(half_angle / pi))
        first, self.end, self.start = before.unknowns, after, -length
        if before is after:
            self.start, first = -FIRST, after.unknowns - FIRST * after.tangent
        self.jacobians = before.jacobian, after.jacobian
        self.curve = scipy.interpolate.CubicHermiteSpline(
            [self.start, 0.0], [first, after.unknowns], [before.tangent, after.tangent]
        )

    def cosine(self, position: float) -> float:
        """Cosine between the tangents at a position and at the second point."""
        tangent = self.curve(position, 1)
        return float(tangent @ self.end.tangent / np.linalg.norm(tangent))

    def jacobian(self, position: float) -> np.ndarray | None:
        """The jacobian at a position; None where the curve is so near the orbit that the iteration is worth its own."""
        ratio = position / -self.start
        if self.end.missed * ratio**2 * (1 + ratio) ** 2 / 4 < SMALL / 2:
            return None
        first, last = self.jacobians
        return last + (last - first) * ratio

    def solved(self, orbits: PeriodicOrbits, position: float) -> OrbitPoint | None:
        """The point of the branch near a position, across the tangent of the second point; None where there is none."""
        guess = self.curve(position)
        try:
            point = orbits.solved(guess, self.end.tangent, self.jacobian(position))
        except ValueError:
            return None
        reach = 2 * np.linalg.norm(guess - self.end.unknowns)
        return None if point is None or np.linalg.norm(point.unknowns - self.end.unknowns) > reach else point


def _step(orbits: PeriodicOrbits, path: Path, length: float) -> tuple[OrbitPoint | None, float]:
    """(the next point of the path, length of the following step); the point is None where the shortest step fails."""
    point = path.end
    while length > SHORTEST:
        step = min(length, FREQUENCY_CHANGE * point.unknowns[-1] / max(abs(point.tangent[-1]), SHORTEST))
        while step > FIRST and path.cosine(step) < COSINE:
            step *= SHORTER
        following = path.solved(orbits, step)
        if following is not None and following.tangent @ point.tangent > LEAST_COSINE:
            slower = step / GROWTH if following.effort > MANY_ITERATIONS else step
            return following, min(LONGEST, step * GROWTH) if following.effort <= FEW_ITERATIONS else slower
        length = step / 2
    return None, length


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
        point = orbits.solved(guess, np.eye(guess.size)[-1], before.jacobian)
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
    path = Path(before, after)
    points: dict[float, OrbitPoint | None] = {path.start: before, 0.0: after}

    def value(position: float) -> float:
        if position not in points:
            points[position] = path.solved(orbits, position)
        return nan if points[position] is None else test(points[position])

    try:
        root = scipy.optimize.brentq(value, path.start, 0.0, rtol=LOCATED, maxiter=LOCATING, disp=False)
    except ValueError:
        return None
    return points.get(root)
