"""Direct solution of symmetric positive definite sparse systems: fronts where unknowns come in groups, else SuperLU."""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from fem.linalg import multifrontal
from fem.linalg.block_matrix import KroneckerMatrix, Sparse

Solve = Callable[[np.ndarray], np.ndarray]


def factorize(
    matrix: sp.csr_matrix | KroneckerMatrix, group: np.ndarray | None = None, wanted: np.ndarray | None = None
) -> Solve:
    """Function that solves matrix x = b for b (n, k).

    group       (n,) number of a group of coupled unknowns that each belongs to, unless the matrix knows its groups
    wanted      numbers of the unknowns that are loaded or read, which saves memory with groups; x may be nan elsewhere
    """
    if isinstance(matrix, KroneckerMatrix):
        return multifrontal.factorize(matrix, wanted)
    if group is None:
        return superlu(matrix)
    return multifrontal.factorize(Sparse(matrix, np.unique(group, return_inverse=True)[1]), wanted)


def superlu(matrix: sp.csr_matrix) -> Solve:
    """SuperLU in its symmetric mode; with the default ordering it takes ten times as long."""
    options = {"SymmetricMode": True}
    return splu(sp.csc_matrix(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).solve
