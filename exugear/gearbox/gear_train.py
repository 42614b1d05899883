"""The gear train as a graph: positions and speeds of its shafts; loops of stages must close and give equal speeds.

Stages are visited in the order in which they are listed, as soon as they are coupled to visited ones. The traversal has
14 lines; scipy.sparse.csgraph needs node numbers and holds only one edge between two nodes, whereas a gearbox may have
two stages between the same shafts.
"""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import cos, hypot, sin

import numpy as np
import scipy

from exugear.gearbox.planetary_kinematics import MeshOfMembers
from exugear.gearbox.stage import Stage
from fem.support.validation import require
from fem.units import mm

#: Edges with their senses: (number, +1 from the first to the second end | -1 back).
Path = tuple[tuple[int, int], ...]
Edge = tuple[Hashable, Hashable]
#: Gap at which a loop of shafts counts as closed, as share of the centre distance.
CLOSED = 1e-6
#: Largest such gap that remains after angles are solved for, and the solver's tolerance.
SOLVED, FINEST = 1e-12, 1e-15


@dataclass(frozen=True)
class Traversal:
    """Edges of a graph in the order in which they are reached from a node.

    tree      edges that reach a new node
    closing   numbers of the edges that close a loop
    paths     node -> edges of the tree that lead to it from the start
    """

    tree: Path
    closing: tuple[int, ...]
    paths: dict[Hashable, Path]

    def loop(self, number: int, edge: Edge) -> Path:
        """The loop that an edge closes, in the sense of that edge; edges in the order in which they are reached."""
        out, back = (self.paths[node] for node in edge)
        senses = {i: sense for i, sense in out if (i, sense) not in back}
        senses |= {i: -sense for i, sense in back if (i, sense) not in out} | {number: 1}
        return tuple((i, senses[i]) for i in (*(i for i, _ in self.tree), number) if i in senses)


def traverse(edges: Sequence[Edge], start: Hashable) -> Traversal:
    """All edges that can be reached from a node, those with the lowest number first."""
    tree: list[tuple[int, int]] = []
    closing: list[int] = []
    paths: dict[Hashable, Path] = {start: ()}
    waiting = dict(enumerate(edges))
    while reachable := [i for i, edge in waiting.items() if paths.keys() & set(edge)]:
        number = reachable[0]
        edge = waiting.pop(number)
        if paths.keys() >= set(edge):
            closing.append(number)
            continue
        sense = 1 if edge[0] in paths else -1
        reached, new = edge[::sense]
        tree.append((number, sense))
        paths[new] = (*paths[reached], (number, sense))
    return Traversal(tuple(tree), tuple(closing), paths)


def traverse_shafts(stages: Sequence[Stage]) -> Traversal:
    """From the first stage's fast shaft on; ValueError for stages that are not coupled to it.

    Behind the stages follow the edges from the suns to their carriers, which are coaxial (`_coaxial`).
    """
    edges = [*(_shaft_names(stage) for stage in stages), *_coaxial(stages)]
    traversal = traverse(edges, edges[0][0])
    loose = [edge for edge in edges if edge[0] not in traversal.paths]
    require(not loose, f"stages {loose} are not coupled to shaft {edges[0][0]!r}; connect them")
    return traversal


def _coaxial(stages: Sequence[Stage]) -> list[tuple[str, str]]:
    """(Sun, carrier) of each carrier: the fast shaft of its first stage, on whose axis it turns."""
    suns: dict[str, str] = {}
    for stage in stages:
        if stage.carrier:
            suns.setdefault(stage.carrier.name, stage.fast.name)
    return [(sun, carrier) for carrier, sun in suns.items()]


def meshes_of(stages: Sequence[Stage]) -> list[MeshOfMembers]:
    """The meshes of stages by the names of their shafts."""
    return [
        MeshOfMembers(*_shaft_names(x), x.pair.pinion.z, x.pair.wheel.z, x.carrier.name if x.carrier else None)
        for x in stages
    ]


def speed_ratios(stages: Sequence[Stage], traversal: Traversal) -> dict[str, Fraction]:
    """Speed of every shaft over that of the driving shaft, < 0 if opposite; ValueError where loops disagree."""
    ratios = {stages[0].fast.name: Fraction(1)}
    for i, sense in traversal.tree:
        reached, new = _shaft_names(stages[i])[::sense]
        ratios[new] = ratios[reached] * _ratio(stages[i]) ** sense
    for i in traversal.closing:
        slow = stages[i].slow.name
        ratio, by_loop = ratios[slow], ratios[stages[i].fast.name] * _ratio(stages[i])
        loop = f"the loop {_names(stages, traversal, i)}"
        senses = f"{loop} cannot turn, it jams: an odd number of meshes turns shaft {slow!r} in both senses"
        require(ratio * by_loop > 0, f"{senses}; drop a stage or add an idler")
        speeds = f"at {ratio} and at {by_loop} of the driving shaft"
        teeth = f"{loop} cannot turn, it jams: shaft {slow!r} would turn {speeds}"
        require(ratio == by_loop, f"{teeth}; change numbers of teeth")
    return ratios


def shaft_positions(stages: Sequence[Stage], traversal: Traversal) -> dict[str, tuple[float, float]]:
    """x, y of every shaft [m], the driving shaft at 0; ValueError where a loop does not close."""
    positions, coaxial = {stages[0].fast.name: (0.0, 0.0)}, _coaxial(stages)
    for i, sense in traversal.tree:
        if i >= len(stages):
            reached, new = coaxial[i - len(stages)][::sense]
            positions[new] = positions[reached]
            continue
        stage = stages[i]
        reached, new = _shaft_names(stage)[::sense]
        (x, y), a = positions[reached], sense * stage.pair.a
        positions[new] = (x + a * cos(stage.angle), y + a * sin(stage.angle))
    for i in traversal.closing:
        if i >= len(stages):
            sun, carrier = coaxial[i - len(stages)]
            beside = hypot(*np.subtract(positions[sun], positions[carrier])) / mm
            apart = f"carrier {carrier!r} must lie on the axis of {sun!r}, got {beside:.6g} mm beside it"
            require(beside * mm < CLOSED * abs(stages[0].pair.a), f"{apart}; change angles or centre distances")
            continue
        stage = stages[i]
        (x_1, y_1), (x_2, y_2) = (positions[name] for name in _shaft_names(stage))
        gap = hypot(x_1 + stage.pair.a * cos(stage.angle) - x_2, y_1 + stage.pair.a * sin(stage.angle) - y_2)
        loop = f"the loop {_names(stages, traversal, i)} does not close, the gap is {gap / mm:.6g} mm"
        if not gap < CLOSED * abs(stage.pair.a):
            loop_of_stages = tuple((j, s) for j, s in traversal.loop(i, _shaft_names(stage)) if j < len(stages))
            angles = fitting_angles(stages, loop_of_stages)
            raise ValueError(f"{loop}; {fitting_remedy(stages, angles)}")
    return positions


def fitting_angles(
    stages: Sequence[Stage], loop: Path, assembly: Callable[[np.ndarray], float] | None = None
) -> dict[int, float] | None:
    """Angles [rad] by stage that close a loop, near the given angles; None where no such angles are nearby.

    assembly   further condition on the angles (n,) of the loop: a function that is 0 where they assemble

    The last two stages of the loop turn, with a further condition the last three; the others keep their angles.
    """
    numbers, senses = (np.array(column) for column in zip(*loop, strict=True))
    sides = senses * [stages[i].pair.a for i in numbers] / stages[numbers[0]].pair.a
    given = np.array([stages[i].angle for i in numbers], float)
    free = slice(-2 if assembly is None else -3, None)

    def residuals(free_angles: np.ndarray) -> list[float]:
        angles = given.copy()
        angles[free] = free_angles
        gap = [sides @ np.cos(angles), sides @ np.sin(angles)]
        return gap if assembly is None else [*gap, assembly(angles)]

    solution = scipy.optimize.least_squares(residuals, given[free], xtol=FINEST, ftol=FINEST, gtol=FINEST)
    if np.abs(solution.fun).max() > SOLVED:
        return None
    angles = (solution.x + np.pi) % (2 * np.pi) - np.pi
    return dict(zip(numbers[free].tolist(), angles.tolist(), strict=True))


def fitting_remedy(stages: Sequence[Stage], angles: dict[int, float] | None) -> str:
    """Remedy for a loop: its `fitting_angles`, as the arguments to write."""
    if angles is None:
        return "no angles nearby fit; change centre distances or numbers of teeth"
    written = ", ".join(f"angle={angle:.11g} in stage {i} ({stages[i].name})" for i, angle in angles.items())
    return f"these angles [rad] fit: {written}"


def _shaft_names(stage: Stage) -> tuple[str, str]:
    return stage.fast.name, stage.slow.name


def _ratio(stage: Stage) -> Fraction:
    return Fraction(-stage.pair.pinion.z, stage.pair.wheel.z)


def _names(stages: Sequence[Stage], traversal: Traversal, i: int) -> str:
    """Names of the stages of the loop that stage i closes."""
    return ", ".join(stages[j].name for j, _ in traversal.loop(i, _shaft_names(stages[i])) if j < len(stages))
