"""Cholesky factors of dense matrices, in place: scipy's BLAS and LAPACK without Python's lock, so that threads run.

scipy's Python functions for these routines hold the lock. Matrices are in Fortran order, or parts of such matrices;
only the lower triangle of a symmetric one is used.
"""

from ctypes import CFUNCTYPE, byref, c_char, c_double, c_int, c_void_p

import numpy as np
from numba.extending import get_cython_function_address


def _routine(library: str, name: str, n: int):
    """A Fortran routine with n arguments, all of them pointers."""
    return CFUNCTYPE(None, *[c_void_p] * n)(get_cython_function_address(f"scipy.linalg.cython_{library}", name))


POTRF, TRSM, SYRK = _routine("lapack", "dpotrf", 5), _routine("blas", "dtrsm", 11), _routine("blas", "dsyrk", 10)
#: Letters and factors that the routines take.
LEFT = LOWER = byref(c_char(b"L"))
RIGHT, TRANSPOSED, NOT = byref(c_char(b"R")), byref(c_char(b"T")), byref(c_char(b"N"))
ONE, MINUS_ONE = byref(c_double(1.0)), byref(c_double(-1.0))


def eliminate(matrix: np.ndarray, n: int) -> None:
    """Replace the first n columns of a matrix by those of its Cholesky factor, the rest by the Schur complement.

    Raises LinAlgError unless the matrix is positive definite over the first n unknowns.
    """
    first, size, failed = matrix.ctypes.data, matrix.itemsize, c_int(0)
    pivots, rows, step = byref(c_int(n)), byref(c_int(len(matrix) - n)), byref(c_int(_step(matrix)))
    POTRF(LOWER, pivots, first, step, byref(failed))
    if failed.value or not (matrix.diagonal()[:n] > 0).all():
        remedy = "clamp what moves as a rigid body, and check the mesh for elements turned inside out"
        raise np.linalg.LinAlgError(f"matrix must be positive definite, got a pivot that is not > 0; {remedy}")
    if n < len(matrix):
        below = first + n * size
        rest = below + n * _step(matrix) * size
        TRSM(RIGHT, LOWER, TRANSPOSED, NOT, rows, pivots, ONE, first, step, below, step)
        SYRK(LOWER, NOT, rows, pivots, MINUS_ONE, below, step, ONE, rest, step)


def solve_lower(lower: np.ndarray, b: np.ndarray, *, transposed: bool = False) -> None:
    """Replace b (n, k) by L^-1 b with L (n, n), or by L^-T b."""
    side, rows, columns = TRANSPOSED if transposed else NOT, byref(c_int(len(b))), byref(c_int(b.shape[1]))
    steps = byref(c_int(_step(lower))), byref(c_int(_step(b)))
    TRSM(LEFT, LOWER, side, NOT, rows, columns, ONE, lower.ctypes.data, steps[0], b.ctypes.data, steps[1])


def _step(matrix: np.ndarray) -> int:
    """Number of entries from one column to the next."""
    return max(1, len(matrix), matrix.strides[1] // matrix.itemsize)
