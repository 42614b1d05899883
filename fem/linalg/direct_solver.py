"""Direct solution of symmetric positive definite systems: multifrontal where unknowns come in blocks, else SuperLU."""

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from fem.linalg import multifrontal
from fem.linalg.block_matrix import BlockMatrix, KroneckerMatrix
from fem.linalg.multifrontal import Solve


def factorize(
    matrix: sp.csr_matrix | KroneckerMatrix, block: np.ndarray | None = None, accessed: np.ndarray | None = None
) -> Solve:
    """Function that solves matrix x = b for b (n, k).

    block       (n,) number of the block of coupled unknowns to which each unknown belongs; a KroneckerMatrix has blocks
    accessed    numbers of the unknowns that are loaded or read, which saves memory with blocks; x may be nan elsewhere
    """
    if isinstance(matrix, KroneckerMatrix):
        return multifrontal.factorize(matrix, accessed)
    if block is None:
        return superlu(matrix)
    return multifrontal.factorize(BlockMatrix(matrix, np.unique(block, return_inverse=True)[1]), accessed)


def superlu(matrix: sp.csr_matrix) -> Solve:
    """SuperLU in its symmetric mode; with its default ordering it takes ten times as long."""
    options = {"SymmetricMode": True}
    return splu(sp.csc_matrix(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).solve
