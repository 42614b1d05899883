"""Symmetric matrices whose unknowns come in groups, such as those over each dof of a prism's section."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

#: Columns of pivots (n,) at pivots and rows (m,), dense (n + m, n); numbers are places in the order of elimination.
Panel = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Sparse:
    """Any matrix (n, n) and the number (n,) of the group of each unknown, from 0 on without a gap."""

    matrix: sp.csr_matrix
    group: np.ndarray

    @property
    def coupled(self) -> sp.csr_matrix:
        """Matrix whose pattern says which groups are coupled."""
        ones = sp.csr_matrix((np.ones(self.matrix.nnz), self.matrix.indices, self.matrix.indptr), self.matrix.shape)
        member = sp.csr_matrix((np.ones(self.group.size), self.group, np.arange(self.group.size + 1)))
        return sp.csr_matrix(member.T @ (ones @ member))

    def panels(self, order: np.ndarray) -> Panel:
        """Function that gives columns of the lower triangle; order (n,) of the unknowns."""
        lower, place = sp.csc_matrix(sp.tril(self.matrix[order][:, order])), np.empty(order.size, int)

        def panel(pivots: np.ndarray, rows: np.ndarray) -> np.ndarray:
            every = np.concatenate([pivots, rows])
            place[every] = np.arange(every.size)
            found = np.zeros((every.size, pivots.size), order="F")
            start, end = lower.indptr[[pivots[0], pivots[-1] + 1]]
            across = np.repeat(np.arange(pivots.size), np.diff(lower.indptr[pivots[0] : pivots[-1] + 2]))
            found[place[lower.indices[start:end]], across] = lower.data[start:end]
            return found

        return panel


@dataclass(frozen=True)
class KroneckerMatrix:
    """Sum of Kronecker products of matrices between groups and of dense ones between what a group consists of.

    places      (2, m) row and column of the entries of the matrices between groups
    values      (m, k) these entries
    inside      (k, n, n) the dense matrices
    members     (n_group, n) numbers of the unknowns, increasing in each group
    """

    places: np.ndarray
    values: np.ndarray
    inside: np.ndarray
    members: np.ndarray

    def __post_init__(self):
        if (np.diff(self.members) <= 0).any():
            raise ValueError("members must increase in each group; sort them and what is inside along with them")

    @property
    def group(self) -> np.ndarray:
        """(n_unknown,) number of the group of each unknown."""
        found = np.empty(self.members.size, int)
        found[self.members] = np.arange(len(self.members))[:, None]
        return found

    @property
    def coupled(self) -> sp.csr_matrix:
        """Matrix whose pattern says which groups are coupled."""
        return sp.csr_matrix((np.ones(self.places.shape[1]), self.places), (len(self.members),) * 2)

    @property
    def matrix(self) -> sp.csr_matrix:
        """The assembled matrix."""
        one, other = np.nonzero(self.inside.any(axis=0))
        row, column = self.members[self.places]
        at = row[:, one].ravel(), column[:, other].ravel()
        return sp.csr_matrix(((self.values @ self.inside[:, one, other]).ravel(), at), (self.members.size,) * 2)

    def part(self, free: np.ndarray) -> "KroneckerMatrix":
        """Matrix of the unknowns that are free (n_unknown,), of some groups the same members in each."""
        kept = free[self.members]
        groups, members = kept.any(axis=1), kept.any(axis=0)
        if (kept != groups[:, None] & members).any():
            raise ValueError("of every group the same members must be free, or none; use groups.Sparse")
        number, both = np.cumsum(groups) - 1, groups[self.places].all(axis=0)
        numbers = (np.cumsum(free) - 1)[self.members[groups][:, members]]
        inside = self.inside[:, members][:, :, members]
        return KroneckerMatrix(number[self.places[:, both]], self.values[both], inside, numbers)

    def panels(self, order: np.ndarray) -> Panel:
        """Function that gives columns of the lower triangle; order (n,) of the unknowns, group by group."""
        n = self.members.shape[1]
        rank = np.argsort(self.group[order[::n]])
        row, column = rank[self.places]
        lower = np.flatnonzero(row >= column)
        lower = lower[np.argsort(column[lower], kind="stable")]
        row, column, values = row[lower], column[lower], self.values[lower]
        flat = self.inside.reshape(len(self.inside), -1)
        first, place = np.searchsorted(column, np.arange(rank.size + 1)), np.empty(rank.size, int)

        def panel(pivots: np.ndarray, rows: np.ndarray) -> np.ndarray:
            groups = np.concatenate([pivots, rows])[::n] // n
            place[groups] = np.arange(groups.size)
            found = np.zeros((groups.size * n, pivots.size), order="F")
            start, end = pivots[0] // n, pivots[-1] // n + 1
            some = slice(first[start], first[end])
            by_group = found.reshape((n, groups.size, n, end - start), order="F")
            by_group[:, place[row[some]], :, column[some] - start] = (values[some] @ flat).reshape(-1, n, n)
            return found

        return panel
