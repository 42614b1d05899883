"""Polynomials between knots as kernels read them: imposed angles over time, torques over time, speed or angle."""

import numpy as np

from exugear.mesh_force.kernel_records import doubles_at, record_type
from exugear.multibody.addresses import reader
from fem.support.numba_cache import compiled

#: Polynomials between knots: their number, addresses of knots (number + 1) and coefficients
#: (number, degree + 1) of 1, s, s^2 ..., s counted from the lower knot; the piece of the last call, near which the next
#: one lies.
PIECES = record_type(*((name, "i8") for name in ("number", "knots", "coefficients", "last")))
pieces_at = reader(PIECES)


def pieces_record(knots: np.ndarray, coefficients: np.ndarray) -> tuple[np.record, tuple]:
    """The `PIECES` of knots (n + 1,) and coefficients (n, degree + 1), and the arrays to which they point.

    The arrays must live as long as the record.
    """
    record, arrays = np.zeros(1, PIECES)[0], (np.array(knots, float), np.array(coefficients, float, order="C"))
    record.number, record.knots, record.coefficients = len(coefficients), *(array.ctypes.data for array in arrays)
    return record, arrays


@compiled
def piece_at(pieces, x):
    """Number of the piece of `PIECES` at x, and x counted from its lower knot."""
    knots, i = doubles_at(pieces.knots), pieces.last
    while i > 0 and x < knots[i]:
        i -= 1
    while i < pieces.number - 1 and x >= knots[i + 1]:
        i += 1
    pieces.last = i
    return i, x - knots[i]
