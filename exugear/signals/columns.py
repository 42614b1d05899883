"""Checks of the columns of a signal, and of the size of what is computed from it."""

import numpy as np

from fem.support.validation import require, require_finite

#: Largest number of values that are computed at once: 4 GB.
LARGEST = 500_000_000


def check_columns(**columns: np.ndarray) -> None:
    """ValueError unless all are finite and equally long, (n,) with n >= 3."""
    names, shapes = " and ".join(columns), [column.shape for column in columns.values()]
    fits = len(set(shapes)) == 1 and len(shapes[0]) == 1 and shapes[0][0] >= 3
    require(fits, f"{names} must be equally long, (n,) with n >= 3, got {' and '.join(map(str, shapes))}")
    for name, column in columns.items():
        require_finite(name, column, "leave out or interpolate what is not")


def check_size(argument: str, number: float, remedy: str) -> None:
    """ValueError with a remedy where an argument, named with its value, asks for too many values."""
    require(number <= LARGEST, f"{argument} asks for {number:.3g} values, more than {LARGEST:.0e}; {remedy}")
