"""Sampling of a signal at equal steps of the shaft angle, behind a low-pass filter that follows the speed."""

from math import ceil

import numpy as np
import scipy
import xarray as xr

from exugear.signals.signal import (
    LARGEST,
    STEP_TOLERANCE,
    at_angles,
    channel_coordinates,
    check_size,
    require_signal,
)
from fem.support.arguments import checked, renamed
from fem.support.intervals import interval_of
from fem.support.numba_cache import compiled, fast
from fem.support.validation import require

#: Samples per period of the highest order, over angle and over time; half the length of the filter [samples], and the
#: parameter of its Kaiser window: flat to 1e-5 up to the highest order, 100 dB where samples would alias below it.
SAMPLES_PER_PERIOD, HALF_LENGTH, BETA = 2.25, 30, 10.06
#: Points of the table of the filter per sample; linear interpolation between them errs by 1e-6.
TABLE = 1000
REVOLUTION = 2 * np.pi
#: Step of time over the median step from which samples are missing; mean step over the least step of an interpolation.
MISSING, FINEST_SHARE = 3.0, 8


@renamed(orders="highest_order")
@checked
def over_angle(signal: xr.DataArray, *, highest_order: float) -> xr.DataArray:
    """A signal at equal steps of the shaft angle, 2.25 samples per period of the highest order.

    signal           (..., time) as `exugear.signal` returns it
    highest_order    highest order wanted

    The signal is convolved over the angle with a windowed sinc (Kaiser, 60 angular samples long), so that the cut-off
    frequency follows the speed. Orders up to the highest one pass within 1e-5; orders that would alias below it are
    attenuated by 100 dB. At the ends the signal is continued by its point reflection. Between samples at unequal steps
    of time it is first interpolated by cubic splines.

    Returns a DataArray (..., angle) with the coordinates angle [rad], time and speed. Raises ValueError for an order
    that is not positive, for more than 5e8 samples in total, where samples are missing, and for a shaft at rest.
    """
    require_signal(signal)
    require(0 < highest_order < np.inf, f"highest_order must be > 0 and finite, got {highest_order}")
    angle = signal["angle"].values
    turned = (angle[-1] - angle[0]) / REVOLUTION
    require(turned > 0, f"signal must be of a turning shaft, its angle stays {angle[0]:g} rad; pass a run at speed")
    check_angular_samples(signal, highest_order)
    samples = int(turned * SAMPLES_PER_PERIOD * highest_order * (1 + 1e-12)) + 1
    short = f"the signal holds {turned:.3g} revolutions, too few for order {highest_order:g}; record longer"
    require(samples > 2 * HALF_LENGTH, short)
    step = REVOLUTION / (SAMPLES_PER_PERIOD * highest_order)
    least = resolved_order(signal, 0.0)
    lower = f"got samples for order {least:.4g} at the lowest speed; sample finer, or pass a lower order"
    require(highest_order <= least, f"signal must have {SAMPLES_PER_PERIOD} samples per period of the order, {lower}")
    grid = angle[0] + step * np.arange(samples)
    angle, rows, spacing = _evenly_sampled(signal, step)
    values = np.array([_filtered(angle, np.ascontiguousarray(row), spacing, grid, step) for row in rows])
    coordinates = {
        **channel_coordinates(signal),
        "angle": ("angle", grid, signal["angle"].attrs),
        **at_angles(signal, grid, "angle"),
    }
    dims = (*signal.dims[:-1], "angle")
    return xr.DataArray(values.reshape(*signal.shape[:-1], samples), coordinates, dims, signal.name, signal.attrs)


def resolved_order(signal: xr.DataArray, share: float) -> float:
    """Highest order of which a share of the steps, the slowest first, has samples enough; 0: the slowest step alone."""
    spacing = np.diff(signal["angle"].values)
    step = float(np.quantile(spacing[spacing > 0], share))
    return REVOLUTION / (SAMPLES_PER_PERIOD * step) * (1 + STEP_TOLERANCE)


def check_angular_samples(signal: xr.DataArray, highest_order: float) -> None:
    """ValueError where all channels of a signal take too many samples over the angle for their highest order."""
    turned = float(np.ptp(signal["angle"].values)) / REVOLUTION
    per_order = signal.size / signal.sizes["time"] * turned * SAMPLES_PER_PERIOD
    check_size(
        f"highest_order = {highest_order:g}", per_order * highest_order, f"pass {LARGEST / per_order:.3g} at most"
    )


def _evenly_sampled(signal: xr.DataArray, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles (n,), values (n_row, n) and the angle between the samples (n,), at equal steps of time.

    step   angle [rad] that the samples must not leave out
    """
    time, angle, rows = signal["time"].values, signal["angle"].values, signal.values.reshape(-1, signal.sizes["time"])
    steps, turned = np.diff(time), np.diff(angle)
    if np.ptp(steps) <= STEP_TOLERANCE * steps.mean():
        return angle, rows, np.gradient(angle)
    missing = np.flatnonzero((steps > MISSING * np.median(steps)) & (turned > step))
    if missing.size:
        gap = f"samples are missing from {time[missing[0]]:.6g} to {time[missing[0] + 1]:.6g} s"
        raise ValueError(
            f"signal must have {SAMPLES_PER_PERIOD} samples per period of the highest order: {gap}; cut it there"
        )
    number = ceil((time[-1] - time[0]) / max(steps.min(), steps.mean() / FINEST_SHARE))
    even = np.linspace(time[0], time[-1], number + 1)
    spacing = turned[interval_of(time, even)]
    at_even = scipy.interpolate.CubicSpline(time, rows, axis=1)(even)
    return scipy.interpolate.PchipInterpolator(time, angle)(even), at_even, spacing


def _filtered(angle: np.ndarray, values: np.ndarray, spacing: np.ndarray, grid: np.ndarray, step: float) -> np.ndarray:
    """Values over the grid of angles with this step, of samples that are continued at both ends."""
    reach = 2 * HALF_LENGTH * step
    first, last = np.searchsorted(angle, [angle[0] + reach, angle[-1] - reach])
    ends = (min(max(first, 1), angle.size - 1), min(max(angle.size - last, 1), angle.size - 1))
    angle, values = (np.pad(x, ends, mode="reflect", reflect_type="odd") for x in (angle, values))
    return filtered(
        angle, values, np.gradient(angle), np.pad(spacing, ends, mode="reflect"), grid, step, _filter_table()
    )


def _filter_table() -> np.ndarray:
    """The low-pass filter over |distance| [samples], to its half length, with a zero behind it."""
    distance = np.arange(HALF_LENGTH * TABLE + 2) / TABLE
    inside = np.maximum(1 - (distance / HALF_LENGTH) ** 2, 0)
    return np.sinc(distance) * scipy.special.i0(BETA * np.sqrt(inside)) * (distance <= HALF_LENGTH)


@compiled
def tap(distance, table):
    """The filter at a distance [samples] within its half length."""
    position = abs(distance) * TABLE
    k = int(position)
    return table[k] + (position - k) * (table[k + 1] - table[k])


@fast
def filtered(angle, values, passed, spacing, grid, step, table):
    """Weighted means of values (n,) at angles (n,) about each angle of the grid.

    passed    (n,) angle that each sample stands for: its weight beside that of the filter
    spacing   (n,) angle between the samples
    step      distance of the zeros of the filter; the spacing where that is larger
    table     the filter, TABLE points a step
    """
    result = np.empty(grid.size)
    nearest, last = 0, angle.size - 1
    for k in range(grid.size):
        centre = grid[k]
        while nearest < last and angle[nearest] < centre:
            nearest += 1
        width = max(step, spacing[nearest])
        total, weights = 0.0, 0.0
        low, high = centre - HALF_LENGTH * width, centre + HALF_LENGTH * width
        i = nearest
        while i <= last and angle[i] < high:
            weight = passed[i] * tap((angle[i] - centre) / width, table)
            total, weights, i = total + weight * values[i], weights + weight, i + 1
        i = nearest - 1
        while i >= 0 and angle[i] > low:
            weight = passed[i] * tap((angle[i] - centre) / width, table)
            total, weights, i = total + weight * values[i], weights + weight, i - 1
        result[k] = total / weights
    return result
