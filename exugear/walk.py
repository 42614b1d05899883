"""Walks through a graph: which edges reach a new node, and which close a loop."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

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
