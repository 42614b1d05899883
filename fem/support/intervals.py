"""Intervals between the points of a grid, for interpolation."""

import numpy as np


def interval_of(grid: np.ndarray, x: np.ndarray | float) -> np.ndarray:
    """Numbers of the lower grid points (n,), rising, of the intervals that contain x; the outer ones are unbounded."""
    return np.clip(np.searchsorted(grid, x, side="right") - 1, 0, grid.size - 2)
