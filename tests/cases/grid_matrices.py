"""Positive definite matrices of a grid."""

import scipy.sparse as sp


def grid(n: int, m: int) -> sp.csr_matrix:
    """Positive definite matrix that couples the neighbours of a grid."""
    line = [sp.diags_array([-1.0, 2.1, -1.0], offsets=[-1, 0, 1], shape=(k, k)) for k in (n, m)]
    return sp.csr_matrix(sp.kron(line[0], sp.eye_array(m)) + sp.kron(sp.eye_array(n), line[1]))
