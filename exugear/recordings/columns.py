"""Checks of the columns of a signal."""

import numpy as np

from fem.support.validation import require


def check_columns(**columns: np.ndarray) -> None:
    """ValueError unless all are finite and equally long, (n,) with n >= 3."""
    names, shapes = " and ".join(columns), [column.shape for column in columns.values()]
    fits = len(set(shapes)) == 1 and len(shapes[0]) == 1 and shapes[0][0] >= 3
    require(fits, f"{names} must be equally long, (n,) with n >= 3, got {' and '.join(map(str, shapes))}")
    for name, column in columns.items():
        require(bool(np.isfinite(column).all()), f"{name} must be finite, got NaN")
