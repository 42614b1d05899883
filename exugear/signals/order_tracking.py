"""Order map: amplitudes of a signal over speed and order."""

import numpy as np
import scipy
import xarray as xr

from exugear.signals.angle_sampling import REVOLUTION, SAMPLES_PER_PERIOD, check_angular_samples, over_angle
from exugear.signals.short_time_spectra import Window, amplitude_spectra, check_overlap, hop_of
from exugear.signals.signal import channel_coordinates, require_signal
from fem.support.arguments import checked
from fem.support.validation import require

#: Attributes of the axis of orders.
ORDER = {"units": "1", "long_name": "order of the shaft"}
SPEED_CHANGE = {"units": "1", "long_name": "change of the speed within a line, as share of it"}


@checked
def order_tracking(
    signal: xr.DataArray, *, orders: float, revolutions: float = 8.0, overlap: float = 0.75, window: Window = "hann"
) -> xr.Dataset:
    """Order map of a signal: amplitudes over time and order, with the speed of each block.

    signal         (..., time) as `exugear.signal` returns it
    orders         highest order wanted
    revolutions    length of a block, of which each spectrum is taken; its orders lie 1 / revolutions apart
    overlap        of neighbouring blocks, as share of their length
    window         of scipy.signal.get_window: "hann", "flattop" for amplitudes between the orders, ("kaiser", 9.0), ...

    The signal is sampled over the shaft angle by `exugear.over_angle`, whose filter attenuates the orders that would
    alias by 100 dB. Blocks in which a period of the highest order has fewer than 2.25 samples are left out.

    Returns a Dataset with amplitude (..., time, order) and the coordinates time [s] and speed [rad/s] of the middle of
    each block, and speed_change, the change of the speed within the block as share of it. Orders of steady amplitude
    are right at any change; a resonance is smeared over the speeds of the block, and flattened from 0.1 on:
    `exugear.order_cut` gives amplitudes there. Raises ValueError for signals shorter than a block, where no block
    remains, and for more than 5e8 values.
    """
    require_signal(signal)
    require(0 < orders < np.inf, f"orders must be > 0 and finite, got {orders:g}")
    least = f"revolutions must hold a period of the highest order, {1 / orders:.3g} or more, got {revolutions:g}"
    require(revolutions * orders >= 1, least)
    check_overlap(overlap)
    turned = float(np.ptp(signal["angle"].values)) / REVOLUTION
    short = f"the signal holds {turned:.3g} revolutions, a block takes {revolutions:g}"
    require(turned * (1 + 1e-9) > revolutions, f"{short}; record longer, or pass fewer revolutions")
    passed = np.gradient(signal["angle"].values) / REVOLUTION
    resolved = f"sample finer, or pass {1 / (SAMPLES_PER_PERIOD * passed.max()):.4g}, which all samples resolve"
    coarse = f"no {revolutions:g} revolutions are sampled well enough for order {orders:g}; {resolved}"
    require(bool(passed[_fine(passed, orders)].sum() * (1 + 1e-9) >= revolutions), coarse)
    check_angular_samples(signal, orders)
    length = scipy.fft.next_fast_len(int(np.ceil(SAMPLES_PER_PERIOD * orders * revolutions)), real=True)
    hop = hop_of(length, overlap, turned / revolutions * length * signal.size / signal.sizes["time"])
    sampled = over_angle(signal, orders=length / revolutions / SAMPLES_PER_PERIOD)
    rows = sampled.values.reshape(-1, sampled.sizes["angle"])
    spectra = [amplitude_spectra(row, length, hop, window) for row in rows]
    middles, lines = spectra[0][0], np.array([amplitude for _, amplitude in spectra])
    passed = np.interp(sampled["angle"].values, signal["angle"].values, passed)
    fine = _fine_lines(_fine(passed, orders), middles, length)
    require(bool(fine.any()), coarse)
    order = np.arange(int(orders * revolutions * (1 + 1e-9)) + 1) / revolutions
    lines = lines[:, fine, : order.size].reshape(*signal.shape[:-1], -1, order.size)
    change = _speed_change(sampled["speed"].values, middles[fine], length)
    return _labelled(sampled.isel(angle=middles[fine]), order, lines, change)


def _fine(passed: np.ndarray, orders: float) -> np.ndarray:
    """(n,) whether periods of the highest order have enough samples, each of which passes some revolutions (n,)."""
    return passed * orders * SAMPLES_PER_PERIOD <= 1 + 1e-9


def _fine_lines(fine: np.ndarray, middles: np.ndarray, length: int) -> np.ndarray:
    """(n_line,) whether all samples of a line about its middle are fine (n,)."""
    coarse, first = np.append(0, np.cumsum(~fine)), middles - length // 2
    return coarse[np.minimum(first + length, fine.size)] == coarse[first]


def _speed_change(speed: np.ndarray, middles: np.ndarray, length: int) -> np.ndarray:
    """(n_line,) change of the speed (n,) in a line about its middle, over the speed there."""
    first = middles - length // 2
    ends = np.abs(speed[first]), np.abs(speed[np.minimum(first + length, speed.size) - 1])
    return np.abs(ends[1] - ends[0]) / np.maximum(np.abs(speed[middles]), np.finfo(float).tiny)


def _labelled(middles: xr.DataArray, order: np.ndarray, lines: np.ndarray, change: np.ndarray) -> xr.Dataset:
    """The Dataset of lines (..., n_line, n_order)."""
    along = {name: ("time", middles[name].values, middles[name].attrs) for name in ("time", "speed")}
    along["speed_change"] = ("time", change, SPEED_CHANGE)
    coordinates = channel_coordinates(middles) | along | {"order": ("order", order, ORDER)}
    return xr.Dataset({"amplitude": ((*middles.dims[:-1], "time", "order"), lines, middles.attrs)}, coordinates)
