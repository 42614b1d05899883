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

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf

from fem.linalg.block_matrix import BlockMatrix, KroneckerMatrix, PivotColumns
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


def ordered_fronts(matrix: BlockMatrix | KroneckerMatrix) -> tuple[np.ndarray, list[Front]]:
    """Order of elimination (n,) of the unknowns, and the fronts in that order."""
    tree = supernodes(matrix.graph)
    blocks = np.concatenate([supernode.pivots for supernode in tree])
    rank = np.argsort(blocks)
    order = np.argsort(rank[matrix.block], kind="stable")
    ends = np.append(0, np.cumsum(np.bincount(matrix.block)[blocks]))

    def unknowns(numbers) -> np.ndarray:
        ranks = np.sort(rank[list(numbers)])
        return np.concatenate([np.zeros(0, int), *(np.arange(ends[k], ends[k + 1]) for k in ranks)])

    return order, [(unknowns(supernode.pivots), unknowns(supernode.rows)) for supernode in tree]


def _factor(pivot_columns: PivotColumns, fronts: list[Front], accessed: np.ndarray) -> list[FactorColumns]:
    """Columns of the factor that solutions at the accessed unknowns (n,) need, supernode by supernode."""
    supernode_of = np.repeat(np.arange(len(fronts)), [pivots.size for pivots, _ in fronts])
    updates: dict[int, list[tuple[np.ndarray, np.ndarray]]] = defaultdict(list)
    local, needed, factor = np.empty(accessed.size, int), set(), []
    costs = [pivots.size * (pivots.size + rows.size) ** 2 for pivots, rows in fronts]
    for number, (pivots, rows) in enumerate(bar(fronts, "finite elements", costs)):
        n = pivots.size
        local[pivots], local[rows] = np.arange(n), n + np.arange(rows.size)
        columns, update = pivot_columns(pivots, rows), np.zeros((rows.size, rows.size), order="F")
        for child_rows, child_update in updates.pop(number, []):
            _extend_add(child_update, local[child_rows], columns, update)
        diagonal = _cholesky(columns[:n])
        below = dtrsm(1.0, diagonal, np.asfortranarray(columns[n:]), side=1, lower=1, trans_a=1, overwrite_b=1)
        if rows.size:
            schur_complement = dsyrk(-1.0, below, beta=1.0, c=update, lower=1, overwrite_c=1)
            updates[supernode_of[rows[0]]].append((rows, schur_complement))
        if number in needed or accessed[pivots].any():
            needed.update(supernode_of[rows[:1]])
            factor.append(FactorColumns(slice(pivots[0], pivots[0] + n), rows, diagonal, below))
    return factor


def _cholesky(matrix: np.ndarray) -> np.ndarray:
    """Lower triangle L of L L^T; LinAlgError where there is none."""
    lower, failed = dpotrf(matrix, lower=1)
    if failed or not (lower.diagonal() > 0).all():
        remedy = "clamp what moves as a rigid body, and check the mesh for elements turned inside out"
        raise np.linalg.LinAlgError(f"matrix must be positive definite, got a pivot that is not > 0; {remedy}")
    return lower


def _extend_add(child_update: np.ndarray, local: np.ndarray, columns: np.ndarray, update: np.ndarray) -> None:
    """Add a child's update matrix to a front, which is given by its pivots' columns and its own update matrix.

    child_update    (n, n) lower triangle
    local           (n,) increasing row numbers in the front

    Rows that follow one another in the front are added as one slice.
    """
    n = columns.shape[1]
    cuts = np.flatnonzero((np.diff(local) != 1) | (local[1:] == n)) + 1
    runs = [slice(start, end) for start, end in pairwise([0, *cuts.tolist(), local.size])]
    for i, column in enumerate(runs):
        across = slice(local[column.start], local[column.stop - 1] + 1)
        for row in runs[i:]:
            along = slice(local[row.start], local[row.stop - 1] + 1)
            if across.start < n:
                columns[along, across] += child_update[row, column]
            else:
                update[along.start - n : along.stop - n, across.start - n : across.stop - n] += child_update[
                    row, column
                ]


def _substituted(factor: list[FactorColumns], x: np.ndarray) -> np.ndarray:
    """Forward and back substitution of right-hand sides x (n, k) in the order of elimination, which it overwrites."""
    for columns in factor:
        if x[columns.pivots].any():
            x[columns.pivots] = dtrsm(1.0, columns.diagonal, x[columns.pivots].T, side=1, lower=1, trans_a=1).T
            x[columns.rows] -= columns.below @ x[columns.pivots]
    for columns in reversed(factor):
        known = x[columns.pivots] - columns.below.T @ x[columns.rows]
        x[columns.pivots] = dtrsm(1.0, columns.diagonal, known.T, side=1, lower=1).T
    return x
