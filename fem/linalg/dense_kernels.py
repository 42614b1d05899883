"""Cholesky factors of dense matrices, in place: scipy's BLAS and LAPACK without Python's lock, so that threads run.

scipy's Python functions for these routines hold the lock. Matrices are in Fortran order, or parts of such matrices;
only the lower triangle of a symmetric one is used.
"""

from ctypes import CFUNCTYPE, addressof, c_char, c_double, c_int, c_void_p
from functools import cache

import numpy as np
from numba.extending import get_cython_function_address


def cholesky(matrix: np.ndarray) -> None:
    """Replace a matrix (n, n) by L of L L^T; LinAlgError where there is none."""
    failed = c_int(0)
    _call("lapack", "dpotrf", b"L", len(matrix), matrix, failed)
    if failed.value or not (matrix.diagonal() > 0).all():
        remedy = "clamp what moves as a rigid body, and check the mesh for elements turned inside out"
        raise np.linalg.LinAlgError(f"matrix must be positive definite, got a pivot that is not > 0; {remedy}")


def solve_from_the_right(lower: np.ndarray, b: np.ndarray) -> None:
    """Replace b (m, n) by b L^-T with L (n, n)."""
    _call("blas", "dtrsm", b"R", b"L", b"T", b"N", *b.shape, 1.0, lower, b)


def solve_lower(lower: np.ndarray, b: np.ndarray, *, transposed: bool = False) -> None:
    """Replace b (n, k) by L^-1 b with L (n, n), or by L^-T b."""
    _call("blas", "dtrsm", b"L", b"L", b"T" if transposed else b"N", b"N", *b.shape, 1.0, lower, b)


def subtract_square(b: np.ndarray, matrix: np.ndarray) -> None:
    """Subtract b b^T of b (m, n) from a matrix (m, m)."""
    _call("blas", "dsyrk", b"L", b"N", *b.shape, -1.0, b, 1.0, matrix)


@cache
def _routine(library: str, name: str, n: int):
    """A Fortran routine with n arguments, all of them pointers."""
    return CFUNCTYPE(None, *[c_void_p] * n)(get_cython_function_address(f"scipy.linalg.cython_{library}", name))


def _call(library: str, name: str, *values) -> None:
    """Call a routine with letters, whole numbers, floats, and matrices, each followed by its leading dimension."""
    arguments: list = []
    for value in values:
        if isinstance(value, np.ndarray):
            arguments += [value, c_int(max(1, value.shape[0], value.strides[1] // value.itemsize))]
        else:
            kinds = {bytes: c_char, int: c_int, float: c_double}
            arguments.append(kinds[type(value)](value) if type(value) in kinds else value)
    pointers = [a.ctypes.data if isinstance(a, np.ndarray) else addressof(a) for a in arguments]
    _routine(library, name, len(pointers))(*pointers)
