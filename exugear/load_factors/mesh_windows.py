"""Windows of time that hold whole mesh cycles, and means of a signal over them."""

import numpy as np
import scipy
import xarray as xr


def mesh_cycles(data: xr.Dataset) -> np.ndarray:
    """(n_time,) mesh cycles since the start of the data of a stage: the integral of its mesh frequency."""
    return scipy.integrate.cumulative_trapezoid(data["mesh_frequency"].values, data["time"].values, initial=0)


def window_bounds(time: np.ndarray, cycles: np.ndarray, windows: int) -> np.ndarray:
    """(m + 1,) mesh cycles that bound windows of whole mesh cycles, at most as many as asked for, about equally long.

    time, cycles   (n,) times [s] and mesh cycles of the samples, increasing
    Without a whole mesh cycle there is one window, from the first sample to the last.
    """
    ends = np.linspace(time[0], time[-1], windows + 1)
    bounds = np.unique(np.floor(np.interp(ends, time, cycles)))
    return bounds if bounds.size > 1 else cycles[[0, -1]]


def local_mean(time: np.ndarray, cycles: np.ndarray, signal: np.ndarray, windows: int) -> np.ndarray:
    """(n,) mean of a signal over whole mesh cycles, linear over time between the middles of windows.

    In the remainder of a mesh cycle after the last window it is constant: a run-down may end in a long one.
    """
    bounds = window_bounds(time, cycles, windows)
    integral = scipy.integrate.cumulative_trapezoid(signal, time, initial=0)
    if bounds[-1] == bounds[0]:
        return np.full(time.size, integral[-1] / (time[-1] - time[0]))
    ends = np.interp(bounds, cycles, time)
    means = np.diff(np.interp(ends, time, integral)) / np.diff(ends)
    if means.size == 1:
        return np.full(time.size, means[0])
    middles = (ends[1:] + ends[:-1]) / 2
    line = scipy.interpolate.make_interp_spline(middles, means, k=1)
    return line(np.clip(time, ends[0], ends[-1]))
