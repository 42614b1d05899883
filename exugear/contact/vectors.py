"""Vectors (3) and rows (6) as tuples, for compiled kernels."""

from fem.support.numba_cache import compiled


@compiled
def cross(a, b):
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def dot(a, b):
    """a . b of vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def scaled(f, a):
    """f a of a vector."""
    return f * a[0], f * a[1], f * a[2]


@compiled
def total(a, b):
    """a + b of vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled
def row_dot(row, v):
    """Row (6) times velocity (6)."""
    return row[0] * v[0] + row[1] * v[1] + row[2] * v[2] + row[3] * v[3] + row[4] * v[4] + row[5] * v[5]


@compiled
def row_scaled(f, row):
    """f row (6)."""
    return f * row[0], f * row[1], f * row[2], f * row[3], f * row[4], f * row[5]


@compiled
def row_total(a, b):
    """Sum of two rows (6)."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]
