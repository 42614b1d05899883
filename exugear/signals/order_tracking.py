"""Order map: amplitudes of a signal over speed and order."""

import numpy as np
import scipy
import xarray as xr

from exugear.recordings.angle_sampling import REVOLUTION, SAMPLES_PER_PERIOD, over_angle
from exugear.recordings.short_time_spectra import Window, amplitude_spectra, hop_of
from exugear.recordings.signal import channel_coordinates, require_signal
from fem.support.arguments import checked
from fem.support.validation import require

#: Attributes of the axis of orders.
ORDER = {"units": "1", "long_name": "order of the shaft"}


@checked
def order_tracking(
    signal: xr.DataArray, *, orders: float, revolutions: float = 8.0, overlap: float = 0.75, window: Window = "hann"
) -> xr.Dataset:
    """Order map of a signal: amplitudes over time and order, with the speed of each line.

    signal         (..., time) as `exugear.signal` returns it
    orders         highest order wanted
    revolutions    length of a line; the lines of order lie 1 / revolutions apart
    overlap        of neighbouring lines, as share of their length
    window         of scipy.signal.get_window: "hann", "flattop" for amplitudes between the orders, ("kaiser", 9.0), ...

    The signal is sampled over the shaft angle by `exugear.over_angle`, whose filter attenuates the orders that would
    alias by 100 dB. Lines in which a period of the highest order has fewer than 2.25 samples are left out.

    Returns a Dataset with amplitude (..., time, order) and the coordinates time [s] and speed [rad/s] of the middle of
    each line. Raises ValueError for signals shorter than a line, and where no line remains.
    """
    require_signal(signal)
    require(0 < orders < np.inf, f"orders must be > 0 and finite, got {orders:g}")
    least = f"revolutions must hold a period of the highest order, {1 / orders:.3g} or more, got {revolutions:g}"
    require(revolutions * orders >= 1, least)
    length = scipy.fft.next_fast_len(int(np.ceil(SAMPLES_PER_PERIOD * orders * revolutions)), real=True)
    hop = hop_of(length, overlap)
    turned = float(np.ptp(signal["angle"].values)) / REVOLUTION
    short = f"the signal holds {turned:.3g} revolutions, a line takes {revolutions:g}"
    require(turned * (1 + 1e-9) > revolutions, f"{short}; record longer, or pass fewer revolutions")
    sampled = over_angle(signal, orders=length / revolutions / SAMPLES_PER_PERIOD)
    rows = sampled.values.reshape(-1, sampled.sizes["angle"])
    spectra = [amplitude_spectra(row, length, hop, window) for row in rows]
    middles, lines = spectra[0][0], np.array([amplitude for _, amplitude in spectra])
    fine = _sampled_finely(signal, sampled, middles, length, orders)
    coarse = f"no {revolutions:g} revolutions are sampled well enough for order {orders:g}; sample finer"
    require(bool(fine.any()), coarse)
    order = np.arange(int(orders * revolutions * (1 + 1e-9)) + 1) / revolutions
    lines = lines[:, fine, : order.size].reshape(*signal.shape[:-1], -1, order.size)
    return _labelled(sampled.isel(angle=middles[fine]), order, lines)


def _sampled_finely(signal, sampled, middles: np.ndarray, length: int, orders: float) -> np.ndarray:
    """(n_line,) whether all periods of the highest order in a line have enough samples."""
    angle = signal["angle"].values
    passed = np.interp(sampled["angle"].values, angle, np.gradient(angle)) / REVOLUTION
    coarse = np.append(0, np.cumsum(passed * orders * SAMPLES_PER_PERIOD > 1 + 1e-9))
    first = middles - length // 2
    return coarse[np.minimum(first + length, passed.size)] == coarse[first]


def _labelled(middles: xr.DataArray, order: np.ndarray, lines: np.ndarray) -> xr.Dataset:
    """The Dataset of lines (..., n_line, n_order)."""
    along = {name: ("time", middles[name].values, middles[name].attrs) for name in ("time", "speed")}
    coordinates = channel_coordinates(middles) | along | {"order": ("order", order, ORDER)}
    return xr.Dataset({"amplitude": ((*middles.dims[:-1], "time", "order"), lines, middles.attrs)}, coordinates)
