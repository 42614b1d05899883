"""Symmetric matrices whose unknowns come in blocks, such as all unknowns over one dof of a prism's section."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

#: Function of pivots (n,), later rows (m,), numbers of unknowns in the order of elimination, and columns (n + m, n) of
#: zeros in Fortran order: it writes the pivots' columns of the lower triangle, the pivots' rows first.
PivotColumns = Callable[[np.ndarray, np.ndarray, np.ndarray], None]


@dataclass(frozen=True)
class BlockMatrix:
    """A sparse symmetric matrix (n, n), and the number (n,) of the block of each unknown, from 0 on without a gap."""

    matrix: sp.csr_matrix
    block: np.ndarray

    @property
    def graph(self) -> sp.csr_matrix:
        """Matrix whose pattern says which blocks are coupled."""
        ones = sp.csr_matrix((np.ones(self.matrix.nnz), self.matrix.indices, self.matrix.indptr), self.matrix.shape)
        in_block = sp.csr_matrix((np.ones(self.block.size), self.block, np.arange(self.block.size + 1)))
        return sp.csr_matrix(in_block.T @ (ones @ in_block))

    def pivot_columns(self, order: np.ndarray) -> PivotColumns:
        """Function that writes columns of the lower triangle; order (n,) of the unknowns."""
        lower, local = sp.csc_matrix(sp.tril(self.matrix[order][:, order])), np.empty(order.size, int)

        def write(pivots: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> None:
            unknowns = np.concatenate([pivots, rows])
            local[unknowns] = np.arange(unknowns.size)
            start, end = lower.indptr[[pivots[0], pivots[-1] + 1]]
            column = np.repeat(np.arange(pivots.size), np.diff(lower.indptr[pivots[0] : pivots[-1] + 2]))
            columns[local[lower.indices[start:end]], column] = lower.data[start:end]

        return write


@dataclass(frozen=True)
class KroneckerMatrix:
    """Sum over k of Kronecker products: a sparse matrix between the blocks times a dense one within a block.

    indices     (2, m) block row and block column of the entries of the sparse matrices
    entries     (m, k) these entries, of each of the sparse matrices
    dense       (k, n, n) the dense matrices
    unknowns    (n_block, n) numbers of the unknowns of each block, increasing
    """

    indices: np.ndarray
    entries: np.ndarray
    dense: np.ndarray
    unknowns: np.ndarray

    def __post_init__(self):
        if (np.diff(self.unknowns) <= 0).any():
            raise ValueError("unknowns must increase in each block; sort them, and the dense matrices with them")

    @property
    def block(self) -> np.ndarray:
        """(n_unknown,) number of the block of each unknown."""
        block = np.empty(self.unknowns.size, int)
        block[self.unknowns] = np.arange(len(self.unknowns))[:, None]
        return block

    @property
    def graph(self) -> sp.csr_matrix:
        """Matrix whose pattern says which blocks are coupled."""
        return sp.csr_matrix((np.ones(self.indices.shape[1]), self.indices), (len(self.unknowns),) * 2)

    @property
    def matrix(self) -> sp.csr_matrix:
        """The assembled matrix."""
        i, j = np.nonzero(self.dense.any(axis=0))
        row, column = self.unknowns[self.indices]
        values = (self.entries @ self.dense[:, i, j]).ravel()
        return sp.csr_matrix((values, (row[:, i].ravel(), column[:, j].ravel())), (self.unknowns.size,) * 2)

    def part(self, free: np.ndarray) -> "KroneckerMatrix":
        """Matrix of the free unknowns (n_unknown,); a block has the same free unknowns as all others, or none.

        Raises ValueError where the free unknowns differ between blocks.
        """
        kept = free[self.unknowns]
        blocks, inside = kept.any(axis=1), kept.any(axis=0)
        if (kept != blocks[:, None] & inside).any():
            raise ValueError("the same unknowns must be free in every block, or none; assemble it as a BlockMatrix")
        number, coupled = np.cumsum(blocks) - 1, blocks[self.indices].all(axis=0)
        unknowns = (np.cumsum(free) - 1)[self.unknowns[blocks][:, inside]]
        dense = self.dense[:, inside][:, :, inside]
        return KroneckerMatrix(number[self.indices[:, coupled]], self.entries[coupled], dense, unknowns)

    def pivot_columns(self, order: np.ndarray) -> PivotColumns:
        """Function that writes columns of the lower triangle; order (n,) of the unknowns, block by block."""
        n = self.unknowns.shape[1]
        rank = np.argsort(self.block[order[::n]])
        row, column = rank[self.indices]
        lower = np.flatnonzero(row >= column)
        lower = lower[np.argsort(column[lower], kind="stable")]
        row, column, entries = row[lower], column[lower], self.entries[lower]
        dense = self.dense.reshape(len(self.dense), -1)
        first, local = np.searchsorted(column, np.arange(rank.size + 1)), np.empty(rank.size, int)

        def write(pivots: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> None:
            blocks = np.concatenate([pivots, rows])[::n] // n
            local[blocks] = np.arange(blocks.size)
            start, end = pivots[0] // n, pivots[-1] // n + 1
            stored = slice(first[start], first[end])
            by_block = columns.reshape((n, blocks.size, n, end - start), order="F")
            by_block[:, local[row[stored]], :, column[stored] - start] = (entries[stored] @ dense).reshape(-1, n, n)

        return write
