"""Small symmetric linear systems in compiled code."""

from math import sqrt

import numpy as np

from fem.support.numba_cache import unchecked, unchecked_apart


@unchecked(fastmath=True)
def product(a, i, b, j, n):
    """Scalar product of the first n values in row i of a and row j of b, summed in any order."""
    total = 0.0
    for k in range(n):
        total += a[i, k] * b[j, k]
    return total


@unchecked_apart
def factorize(matrix):
    """Replace a symmetric matrix (n, n) by its factors L D L^T, with the inverse of D on the diagonal of L."""
    n = len(matrix)
    row = np.empty((1, n))
    for i in range(n):
        for j in range(i):
            row[0, j] = matrix[i, j] - product(row, 0, matrix, j, j)
        pivot = matrix[i, i]
        for j in range(i):
            matrix[i, j] = row[0, j] * matrix[j, j]
            pivot -= row[0, j] * matrix[i, j]
        matrix[i, i] = 1 / pivot


@unchecked_apart
def solve(factors, right):
    """Replace right sides (m, n), one in each row, by the solutions; factors of `factorize`."""
    n = len(factors)
    for r in range(len(right)):
        for i in range(n):
            right[r, i] -= product(factors, i, right, r, i)
        for i in range(n):
            right[r, i] *= factors[i, i]
        for i in range(n - 1, 0, -1):
            for k in range(i):
                right[r, k] -= factors[i, k] * right[r, i]


@unchecked_apart
def square_root(matrix, first, root):
    """Write a lower triangular L (n, n) with L L^T = matrix[first:, first:], which may be singular up to rounding."""
    least = 0.0
    for j in range(len(root)):
        least += 1e-14 * matrix[first + j, first + j]
    for j in range(len(root)):
        pivot = matrix[first + j, first + j] - product(root, j, root, j, j)
        for i in range(len(root)):
            root[i, j] = 0.0
            if pivot > least and i >= j:
                root[i, j] = (matrix[first + i, first + j] - product(root, i, root, j, j)) / sqrt(pivot)


@unchecked
def submatrix(matrix, chosen):
    """(k, k) chosen rows and columns of a matrix."""
    part = np.empty((chosen.size, chosen.size))
    for i in range(chosen.size):
        for j in range(chosen.size):
            part[i, j] = matrix[chosen[i], chosen[j]]
    return part


@unchecked_apart
def times(matrix, rows):
    """Symmetric matrix (n, n) times vectors (m, n), one in each row."""
    products = np.empty(rows.shape)
    for r in range(len(rows)):
        for i in range(len(matrix)):
            products[r, i] = product(matrix, i, rows, r, len(matrix))
    return products


@unchecked
def column_times(root, a, rows, r, first):
    """Column a of a lower triangular matrix (n, n) times values in row r from the first on."""
    total = 0.0
    for b in range(a, len(root)):
        total += root[b, a] * rows[r, first + b]
    return total


@unchecked
def active_rows(active):
    """Numbers of the rows of a matrix (n, m) of truth values that have a true one."""
    any_active = np.zeros(len(active), np.bool_)
    for i in range(len(active)):
        for k in range(active.shape[1]):
            any_active[i] |= active[i, k]
    return indices_of_true(any_active)


@unchecked
def indices_of_true(values):
    """Positions of the true ones of truth values (n,)."""
    positions, number = np.empty(values.size, np.int64), 0
    for i in range(values.size):
        if values[i]:
            positions[number], number = i, number + 1
    return positions[:number]


@unchecked_apart
def congruent(matrix, roots):
    """L^T S L of a symmetric matrix S (n, n) and of a block diagonal L of lower triangular roots (k, m, m)."""
    return _left_times(roots, np.ascontiguousarray(_left_times(roots, matrix).T))


@unchecked
def _left_times(roots, matrix):
    """L^T times a matrix (n, n), of the L of `congruent`."""
    m, products = roots.shape[1], np.zeros(matrix.shape)
    for k in range(len(roots)):
        for a in range(m):
            for b in range(a, m):
                for j in range(len(matrix)):
                    products[k * m + a, j] += roots[k, b, a] * matrix[k * m + b, j]
    return products
