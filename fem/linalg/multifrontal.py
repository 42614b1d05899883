"""Cholesky factors of a matrix whose unknowns come in groups, such as those over each dof of a prism's section.

Multifrontal (Duff and Reid, ACM TOMS 9, 1983): a front is a dense matrix of groups that are eliminated together and of
the later ones that they touch. The groups are large, so most of the work is in products of dense matrices.
"""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf
from scipy.sparse.linalg import splu

from fem.linalg.block_matrix import KroneckerMatrix, Panel, Sparse
from fem.support.blas_threads import one_thread
from fem.support.progress import bar


@dataclass
class Front:
    """Groups that are eliminated together, later ones that they touch, and fronts that leave something to this one."""

    groups: list[int]
    later: set[int]
    before: list["Front"] = field(default_factory=list)


@dataclass(frozen=True)
class Columns:
    """Columns of the factor.

    pivots      their unknowns, in the order of elimination
    rows        (m,) later unknowns where they are not zero
    square      (n, n) lower triangle over the pivots
    below       (m, n) the rest
    """

    pivots: slice
    rows: np.ndarray
    square: np.ndarray
    below: np.ndarray


def factorize(matrix: Sparse | KroneckerMatrix, wanted: np.ndarray | None = None) -> Callable[[np.ndarray], np.ndarray]:
    """Function that solves matrix x = b for b (n, k).

    matrix      symmetric, positive definite; LinAlgError where it is not
    wanted      numbers of the unknowns that are loaded or read: x is nan elsewhere, what gives it is not kept
    """
    size = np.bincount(matrix.group)
    fronts = eliminated(matrix.coupled)
    sequence = np.concatenate([front.groups for front in fronts])
    rank = np.argsort(sequence)
    order = np.argsort(rank[matrix.group], kind="stable")
    ends = np.append(0, np.cumsum(size[sequence]))
    unknowns = [(_of(front.groups, rank, ends), _of(front.later, rank, ends)) for front in fronts]
    keep = np.ones(order.size, bool) if wanted is None else np.isin(order, wanted)
    with one_thread():
        columns = _factor(matrix.panels(order), unknowns, keep)

    def solve(b: np.ndarray) -> np.ndarray:
        ordered = b.astype(float, copy=False)[order]
        if ordered[~keep].any():
            raise ValueError("b must be zero where nothing is wanted; factorize with these unknowns among the wanted")
        with one_thread():
            solution = _solved(columns, ordered)[keep]
        x = np.full(b.shape, np.nan)
        x[order[keep]] = solution
        return x

    return solve


def _of(groups, rank: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Unknowns of groups, in the order of elimination."""
    places = np.sort(rank[list(groups)])
    return np.concatenate([np.zeros(0, int), *(np.arange(ends[k], ends[k + 1]) for k in places)])


def eliminated(graph: sp.csr_matrix) -> list[Front]:
    """Fronts in an order of little fill, each soon after those that leave something to it.

    graph       whose pattern says which groups are coupled; they are eliminated together where this adds no fill
    """
    graph = abs(graph) + sp.diags_array(abs(graph) @ np.ones(graph.shape[1]))
    order = splu(sp.csc_matrix(graph), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).perm_c.argsort()
    waiting: dict[int, list[Front]] = defaultdict(list)
    last: list[Front] = []
    for group, later in enumerate(_touched(sp.csr_matrix(graph[order][:, order]))):
        front = Front([group], later)
        for child in waiting.pop(group, []):
            _take(front, child)
        (waiting[min(later)] if later else last).append(front)
    fronts = _depth_first(last)
    return [Front(order[front.groups].tolist(), set(order[list(front.later)].tolist())) for front in fronts]


def _take(front: Front, child: Front) -> None:
    """Child becomes part of the front where both touch the same, else is one before it."""
    if len(child.later) == len(front.groups) + len(front.later):
        front.groups += child.groups
        front.before += child.before
    else:
        front.before.append(child)


def _depth_first(last: list[Front]) -> list[Front]:
    """These and all before them, each after those before it and before others."""
    backwards, left = [], list(last)
    while left:
        backwards.append(left.pop())
        left += backwards[-1].before
    return backwards[::-1]


def _touched(graph: sp.csr_matrix) -> list[set[int]]:
    """Of each group the later ones that its elimination touches."""
    later = [set(row[row > group].tolist()) for group, row in enumerate(np.split(graph.indices, graph.indptr[1:-1]))]
    for own in later:
        if own:
            later[min(own)] |= own - {min(own)}
    return later


def _factor(panels: Panel, unknowns: list[tuple[np.ndarray, np.ndarray]], keep: np.ndarray) -> list[Columns]:
    """Columns of the factor that solutions at `keep` (n,) need, front by front.

    What a front leaves to later ones waits for the next that it touches.
    """
    owner = np.repeat(np.arange(len(unknowns)), [pivots.size for pivots, _ in unknowns])
    waiting: dict[int, list[tuple[np.ndarray, np.ndarray]]] = defaultdict(list)
    place, needed, found = np.empty(keep.size, int), set(), []
    costs = [pivots.size * (pivots.size + rows.size) ** 2 for pivots, rows in unknowns]
    for number, (pivots, rows) in enumerate(bar(unknowns, "finite elements", costs)):
        n = pivots.size
        place[pivots], place[rows] = np.arange(n), n + np.arange(rows.size)
        panel, rest = panels(pivots, rows), np.zeros((rows.size, rows.size), order="F")
        for touched, left in waiting.pop(number, []):
            _add(left, place[touched], panel, rest)
        square = _cholesky(panel[:n])
        below = dtrsm(1.0, square, np.asfortranarray(panel[n:]), side=1, lower=1, trans_a=1, overwrite_b=1)
        if rows.size:
            waiting[owner[rows[0]]].append((rows, dsyrk(-1.0, below, beta=1.0, c=rest, lower=1, overwrite_c=1)))
        if number in needed or keep[pivots].any():
            needed.update(owner[rows[:1]])
            found.append(Columns(slice(pivots[0], pivots[0] + n), rows, square, below))
    return found


def _cholesky(matrix: np.ndarray) -> np.ndarray:
    """Lower triangle L of L L^T; LinAlgError where there is none."""
    lower, failed = dpotrf(matrix, lower=1)
    if failed or not (lower.diagonal() > 0).all():
        remedy = "hold what moves as a rigid body, and check the mesh for elements turned inside out"
        raise np.linalg.LinAlgError(f"matrix must be positive definite, got a pivot that is not > 0; {remedy}")
    return lower


def _add(left: np.ndarray, place: np.ndarray, panel: np.ndarray, rest: np.ndarray) -> None:
    """Adds the lower triangle left (n, n), whose rows stand at increasing places, to panel and rest of a front."""
    n = panel.shape[1]
    cuts = np.flatnonzero((np.diff(place) != 1) | (place[1:] == n)) + 1
    runs = [slice(start, end) for start, end in pairwise([0, *cuts.tolist(), place.size])]
    for i, column in enumerate(runs):
        across = slice(place[column.start], place[column.stop - 1] + 1)
        for row in runs[i:]:
            along = slice(place[row.start], place[row.stop - 1] + 1)
            if across.start < n:
                panel[along, across] += left[row, column]
            else:
                rest[along.start - n : along.stop - n, across.start - n : across.stop - n] += left[row, column]


def _solved(columns: list[Columns], x: np.ndarray) -> np.ndarray:
    """Solution for the right-hand sides x (n, k), which it overwrites, all in the order of elimination."""
    for part in columns:
        if x[part.pivots].any():
            x[part.pivots] = dtrsm(1.0, part.square, x[part.pivots].T, side=1, lower=1, trans_a=1).T
            x[part.rows] -= part.below @ x[part.pivots]
    for part in reversed(columns):
        known = x[part.pivots] - part.below.T @ x[part.rows]
        x[part.pivots] = dtrsm(1.0, part.square, known.T, side=1, lower=1).T
    return x
