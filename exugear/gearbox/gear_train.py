"""Where the shafts of a gearbox lie and how fast they turn; loops must close and agree."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import cos, hypot, sin

import numpy as np

from exugear.gearbox.stage import Stage
from fem.support.validation import require
from fem.units import mm

Edge = tuple[Hashable, Hashable]


@dataclass(frozen=True)
class Walk:
    """Edges of a graph as they are reached from a node, those with the lowest number first.

    tree      (number, whether from the first to the second end) of the edges that reach a new node
    closing   numbers of the edges that close a loop
    ways      node -> edges that lead to it from the start: (number, +1 from the first to the second end, -1 back)
    """

    tree: tuple[tuple[int, bool], ...]
    closing: tuple[int, ...]
    ways: dict[Hashable, tuple[tuple[int, int], ...]]

    def loop(self, number: int, edge: Edge) -> tuple[tuple[int, int], ...]:
        """The loop that an edge closes, once round: (number, sense) of its edges, those reached last at the end."""
        out, back = (self.ways[node] for node in edge)
        shared = set(out) & set(back)
        sense = dict((*out, (number, 1), *((i, -way) for i, way in back)))
        reached = [i for i, _ in self.tree] + [number]
        around = {i for i, _ in (*out, (number, 1), *back)} - {i for i, _ in shared}
        return tuple((i, sense[i]) for i in sorted(around, key=reached.index))


def walk(edges: Sequence[Edge], start: Hashable) -> Walk:
    """The walk over all edges that can be reached from start."""
    tree: list[tuple[int, bool]] = []
    closing: list[int] = []
    ways: dict[Hashable, tuple[tuple[int, int], ...]] = {start: ()}
    waiting = dict(enumerate(edges))
    while near := [i for i, edge in waiting.items() if ways.keys() & set(edge)]:
        number = near[0]
        one, other = waiting.pop(number)
        if one in ways and other in ways:
            closing.append(number)
        elif one in ways:
            tree.append((number, True))
            ways[other] = (*ways[one], (number, 1))
        else:
            tree.append((number, False))
            ways[one] = (*ways[other], (number, -1))
    return Walk(tuple(tree), tuple(closing), ways)


#: Of the centre distance.
CLOSED = 1e-6
ITERATIONS = 50
Loop = tuple[tuple[int, int], ...]


def walk_over_shafts(stages: Sequence[Stage]) -> Walk:
    """From the first stage's fast shaft on; ValueError for stages out of its reach."""
    edges = [(stage.fast.name, stage.slow.name) for stage in stages]
    found = walk(edges, edges[0][0])
    unreached = [edge for edge in edges if edge[0] not in found.ways]
    require(not unreached, f"stages {unreached} are not coupled to shaft {edges[0][0]!r}; connect them")
    return found


def speed_ratios(stages: Sequence[Stage], found: Walk) -> dict[str, Fraction]:
    """Speed of every shaft over that of the driving one, < 0 the other way round; ValueError where loops disagree."""
    ratios = {stages[0].fast.name: Fraction(1)}
    for i, onward in found.tree:
        fast, slow, ratio = stages[i].fast.name, stages[i].slow.name, _ratio(stages[i])
        if onward:
            ratios[slow] = ratios[fast] * ratio
        else:
            ratios[fast] = ratios[slow] / ratio
    for i in found.closing:
        here, there = ratios[stages[i].slow.name], ratios[stages[i].fast.name] * _ratio(stages[i])
        loop = f"the loop {_names(stages, found, i)}"
        senses = f"{loop} jams: an odd number of meshes turns shaft {stages[i].slow.name!r} both ways"
        require(here * there > 0, f"{senses}; drop a stage or add an idler")
        teeth = f"{loop} jams: shaft {stages[i].slow.name!r} would turn at {here} and at {there} of the driving shaft"
        require(here == there, f"{teeth}; change numbers of teeth")
    return ratios


def shaft_places(stages: Sequence[Stage], found: Walk) -> dict[str, tuple[float, float]]:
    """x, y of every shaft [m], the driving one at 0; ValueError where a loop does not close."""
    places = {stages[0].fast.name: (0.0, 0.0)}
    for i, onward in found.tree:
        stage, sense = stages[i], 1 if onward else -1
        old, new = (stage.fast.name, stage.slow.name)[::sense]
        x, y = places[old]
        way = sense * stage.pair.a
        places[new] = (x + way * cos(stage.angle), y + way * sin(stage.angle))
    for i in found.closing:
        stage = stages[i]
        (x, y), (x_2, y_2) = places[stage.fast.name], places[stage.slow.name]
        miss = hypot(x + stage.pair.a * cos(stage.angle) - x_2, y + stage.pair.a * sin(stage.angle) - y_2)
        loop = f"the loop {_names(stages, found, i)} misses by {miss / mm:.6g} mm to close"
        if not miss < CLOSED * stage.pair.a:
            raise ValueError(f"{loop}; {fitting_remedy(stages, fitting_angles(stages, loop_of(stages, found, i)))}")
    return places


def loop_of(stages: Sequence[Stage], found: Walk, i: int) -> Loop:
    """The loop of shafts that stage i closes: (stage, +1 from fast to slow | -1)."""
    return found.loop(i, (stages[i].fast.name, stages[i].slow.name))


def fitting_angles(stages: Sequence[Stage], loop: Loop, further=None) -> dict[int, float] | None:
    """Angles [rad] by stage that close a loop, near the given ones; the stages reached first keep theirs.

    further   further condition angles (n,) -> (value, slopes (n,)) that shall vanish too, by one more angle

    None where there are none nearby.
    """
    numbers, senses = (np.array(column) for column in zip(*loop, strict=True))
    way = senses * [stages[i].pair.a for i in numbers] / stages[numbers[0]].pair.a
    angle = np.array([stages[i].angle for i in numbers], float)
    free = slice(-2 if further is None else -3, None)
    for _ in range(ITERATIONS):
        value = np.array([way @ np.cos(angle), way @ np.sin(angle)])
        slope = np.array([-way * np.sin(angle), way * np.cos(angle)])
        if further is not None:
            more, slopes = further(angle)
            value, slope = np.append(value, more), np.vstack([slope, slopes])
        if np.abs(value).max() < 1e-12:
            turned = (angle + np.pi) % (2 * np.pi) - np.pi
            return dict(zip(numbers.tolist()[free], turned.tolist()[free], strict=True))
        angle[free] -= np.linalg.lstsq(slope[:, free], value)[0]
    return None


def fitting_remedy(stages: Sequence[Stage], angles: dict[int, float] | None) -> str:
    """What to write for `fitting_angles`."""
    if angles is None:
        return "no angles nearby do it; change centre distances or numbers of teeth"
    written = ", ".join(f"angle={angle:.11g} in stage {i} ({stages[i].name})" for i, angle in angles.items())
    return f"these angles [rad] do it: {written}"


def _ratio(stage: Stage) -> Fraction:
    return Fraction(-stage.pair.pinion.z, stage.pair.wheel.z)


def _names(stages: Sequence[Stage], found: Walk, i: int) -> str:
    return ", ".join(stages[j].name for j, _ in loop_of(stages, found, i))
