"""Direct solution of symmetric positive definite sparse systems: PARDISO where installed, SuperLU everywhere."""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

Solve = Callable[[np.ndarray], np.ndarray]


def factorize(matrix: sp.csr_matrix) -> Solve:
    """Function that solves matrix x = b for b (n, k)."""
    try:
        from pypardiso import PyPardisoSolver
    except (ImportError, OSError):
        return superlu(matrix)
    return pardiso(matrix, PyPardisoSolver)


def superlu(matrix: sp.csr_matrix) -> Solve:
    """SuperLU in its symmetric mode; with the default ordering it takes ten times as long."""
    return splu(
        sp.csc_matrix(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    ).solve


def pardiso(matrix: sp.csr_matrix, solver_type) -> Solve:
    """Cholesky factors by MKL PARDISO, which reads the upper triangle."""
    positive_definite, release_all = 2, -1
    solver = solver_type(mtype=positive_definite)
    upper = sp.triu(matrix, format="csr")
    solver.factorize(upper)

    def solve(b: np.ndarray) -> np.ndarray:
        x = solver.solve(upper, b)
        solver.free_memory(everything=release_all)
        return x

    return solve
