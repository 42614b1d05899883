"""Cholesky factors by the multifrontal method, for matrices whose unknowns come in blocks.

Every supernode of the elimination tree has a front: a dense matrix over its pivots and the later rows of their columns.
The original entries and the update matrices of the children are added into it (extend-add), the pivots are eliminated,
and the Schur complement that is left is the update matrix for the parent (Duff and Reid, ACM TOMS 9, 1983). The blocks
are large, so most of the work is in products of dense matrices.

Why not a library: the solid of a spur gear (52 800 unknowns over half of the width, 952 of them loaded or read) takes
0.4 s and 0.11 GB on one core, against 2.2 s and 0.34 GB of CHOLMOD and 4.5 s and 0.67 GB of SuperLU; that of a helical
gear 2.1 s and 0.42 GB, against 6.9 s and 0.76 GB of CHOLMOD and 13 s and 1.6 GB of SuperLU. The blocks of a prism are
known beforehand, its matrix is never assembled, and columns that no load or reading needs are not stored. Measured by
``pytest tests/benchmarks/test_direct_solver.py -m measured -n 0 -s``.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fem.linalg.block_matrix import BlockMatrix, KroneckerMatrix, PivotColumns
from fem.linalg.dense_kernels import eliminate, solve_lower
from fem.linalg.elimination_tree import supernodes
from fem.support.blas_threads import one_thread
from fem.support.progress import bar

#: Unknowns of a front in the order of elimination: pivots (n,), and later rows (m,).
Front = tuple[np.ndarray, np.ndarray]
Solve = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class FactorColumns:
    """Columns of the factor that belong to a supernode.

    pivots      their unknowns, in the order of elimination
    rows        (m,) later unknowns where they are not zero
    diagonal    (n, n) lower triangle over the pivots
    below       (m, n) the rest
    """

    pivots: slice
    rows: np.ndarray
    diagonal: np.ndarray
    below: np.ndarray


def factorize(matrix: BlockMatrix | KroneckerMatrix, accessed: np.ndarray | None = None) -> Solve:
    """Function that solves matrix x = b for b (n, k).

    matrix      symmetric, positive definite; LinAlgError where it is not
    accessed    numbers of the unknowns that are loaded or read; columns of the factor that these do not need are not
                stored, and x is nan elsewhere
    """
    order, fronts = ordered_fronts(matrix)
    stored = np.ones(order.size, bool) if accessed is None else np.isin(order, accessed)
    with one_thread():
        factor = _factor(matrix.pivot_columns(order), fronts, stored)

    def solve(b: np.ndarray) -> np.ndarray:
        ordered = b.astype(float, copy=False)[order]
        if ordered[~stored].any():
            raise ValueError("b must be zero except at the accessed unknowns; factorize with its entries among them")
        with one_thread():
            solution = _substituted(factor, ordered)[stored]
        x = np.full(b.shape, np.nan)
        x[order[stored]] = solution
        return x

    return solve


def schur_complement(matrix: BlockMatrix | KroneckerMatrix, kept: np.ndarray) -> np.ndarray:
    """(n, n) matrix that is left over the kept unknowns (n,), in this order, after elimination of all others.

    Raises LinAlgError unless the symmetric matrix is positive definite over the others, ValueError for kept unknowns
    that are part of a block.
    """
    blocks = list(dict.fromkeys(matrix.block[kept].tolist()))
    if kept.size != np.isin(matrix.block, blocks).sum():
        raise ValueError("all unknowns of a block must be kept, or none; keep whole blocks")
    order, fronts = ordered_fronts(matrix, blocks)
    with one_thread():
        *_, front = _eliminated(matrix.pivot_columns(order), fronts, assembled=1)
    for column in range(len(front)):
        front[column, column:] = front[column:, column]
    left, last = front.T, order[fronts[-1][0]]
    if (last == kept).all():
        return left
    increasing = np.argsort(last)
    position = increasing[np.searchsorted(last, kept, sorter=increasing)]
    return left[position[:, None], position]


def ordered_fronts(matrix: BlockMatrix | KroneckerMatrix, last=()) -> tuple[np.ndarray, list[Front]]:
    """Order of elimination (n,) of the unknowns, and the fronts in that order; blocks `last` make the last front."""
    sizes = np.bincount(matrix.block)
    tree = supernodes(matrix.graph, sizes, np.asarray(last, int))
    blocks = np.concatenate([supernode.pivots for supernode in tree])
    rank = np.argsort(blocks)
    order = np.argsort(rank[matrix.block], kind="stable")
    ends = np.append(0, np.cumsum(sizes[blocks]))

    def unknowns(numbers) -> np.ndarray:
        ranks = np.sort(rank[list(numbers)])
        return np.concatenate([np.zeros(0, int), *(np.arange(ends[k], ends[k + 1]) for k in ranks)])

    return order, [(unknowns(supernode.pivots), unknowns(supernode.rows)) for supernode in tree]


def _eliminated(write: PivotColumns, fronts: list[Front], assembled: int = 0) -> Iterator[np.ndarray]:
    """Each front (n + m, n + m) after the elimination of its pivots, in Fortran order; the last ones only `assembled`.

    Its first columns are those of the factor, the rest is the update matrix for the parent. The next front overwrites
    it: memory that is used again is much faster than new memory.
    """
    updates, local = UpdateStack(fronts), np.empty(sum(pivots.size for pivots, _ in fronts), int)
    workspace = np.empty(max((pivots.size + rows.size) ** 2 for pivots, rows in fronts))
    for number, (pivots, rows) in enumerate(fronts):
        n, unknowns = pivots.size, np.concatenate([pivots, rows])
        local[unknowns] = np.arange(unknowns.size)
        front = _square(workspace, unknowns.size)
        front.fill(0.0)
        write(pivots, rows, front[:, :n])
        updates.add_children(number, front, local)
        if number < len(fronts) - assembled:
            eliminate(front, n)
        if rows.size:
            updates.push(rows, front[n:, n:])
        yield front


class UpdateStack:
    """Update matrices that wait for their parents, in one piece of memory; those of a front's children are the last."""

    def __init__(self, fronts: list[Front]):
        parents = _parents(fronts)
        self.children = np.bincount(parents[parents >= 0], minlength=len(fronts)).tolist()
        self.waiting: list[tuple[np.ndarray, np.ndarray]] = []
        self.used = 0
        self.memory = np.empty(self._largest([rows.size**2 for _, rows in fronts]))

    def _largest(self, sizes: list[int]) -> int:
        """Largest number of entries that wait at a time; sizes (n_front,) of the update matrices."""
        waiting: list[int] = []
        used = largest = 0
        for size, number in zip(sizes, self.children, strict=True):
            first = len(waiting) - number
            used += size - sum(waiting[first:])
            waiting[first:] = [size] if size else []
            largest = max(largest, used)
        return largest

    def add_children(self, number: int, front: np.ndarray, local: np.ndarray) -> None:
        """Move the update matrices of a front's children into the front, in which unknowns have `local` numbers."""
        first = len(self.waiting) - self.children[number]
        for rows, update in self.waiting[first:]:
            _extend_add(update, local[rows], front)
            self.used -= update.size
        del self.waiting[first:]

    def push(self, rows: np.ndarray, update: np.ndarray) -> None:
        """Keep a copy of an update matrix (m, m) over rows (m,)."""
        copy = _square(self.memory[self.used :], rows.size)
        copy[:] = update
        self.used += copy.size
        self.waiting.append((rows, copy))


def _parents(fronts: list[Front]) -> np.ndarray:
    """(n_front,) number of the front to which each front's update matrix is added, -1 for none."""
    front_of = np.repeat(np.arange(len(fronts)), [pivots.size for pivots, _ in fronts])
    return np.array([front_of[rows[0]] if rows.size else -1 for _, rows in fronts])


def _square(memory: np.ndarray, n: int) -> np.ndarray:
    """Matrix (n, n) in Fortran order at the beginning of the memory."""
    return memory[: n * n].reshape((n, n), order="F")


def _factor(write: PivotColumns, fronts: list[Front], accessed: np.ndarray) -> list[FactorColumns]:
    """Columns of the factor that solutions at the accessed unknowns (n,) need, front by front."""
    parents = _parents(fronts)
    costs = [pivots.size * (pivots.size + rows.size) ** 2 for pivots, rows in fronts]
    needed, factor = set(), []
    eliminated = zip(fronts, _eliminated(write, fronts), strict=True)
    for number, ((pivots, rows), front) in enumerate(bar(eliminated, "finite elements", costs)):
        if number in needed or accessed[pivots].any():
            n = pivots.size
            needed.add(parents[number])
            columns = slice(pivots[0], pivots[0] + n)
            factor.append(FactorColumns(columns, rows, front[:n, :n].copy("F"), front[n:, :n].copy("F")))
    return factor


def _extend_add(update: np.ndarray, local: np.ndarray, front: np.ndarray) -> None:
    """Add the lower triangle of an update matrix (n, n) to a front, in which its rows are local (n,), increasing.

    Rows that follow one another in the front are added as one slice.
    """
    cuts = np.flatnonzero(np.diff(local) != 1) + 1
    runs = [slice(start, end) for start, end in pairwise([0, *cuts.tolist(), local.size])]
    to = [slice(local[run.start], local[run.stop - 1] + 1) for run in runs]
    for i, column in enumerate(runs):
        for along, row in zip(to[i:], runs[i:], strict=True):
            front[along, to[i]] += update[row, column]


def _substituted(factor: list[FactorColumns], x: np.ndarray) -> np.ndarray:
    """Forward and back substitution of right-hand sides x (n, k) in the order of elimination, which it overwrites."""
    for columns in factor:
        if x[columns.pivots].any():
            known = np.asfortranarray(x[columns.pivots])
            solve_lower(columns.diagonal, known)
            x[columns.pivots] = known
            x[columns.rows] -= columns.below @ known
    for columns in reversed(factor):
        known = np.asfortranarray(x[columns.pivots] - columns.below.T @ x[columns.rows])
        solve_lower(columns.diagonal, known, transposed=True)
        x[columns.pivots] = known
    return x
