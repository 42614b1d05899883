"""Spectra of short windows along a signal: spectrogram over time, waterfall over speed, order map of the shaft."""

from math import inf
from typing import Annotated, Any, NamedTuple

import numpy as np
import scipy
import xarray as xr

from exugear.signals.angle_sampling import REVOLUTION, SAMPLES_PER_PERIOD, check_angular_samples, over_angle
from exugear.signals.signal import channel_coordinates, check_size, recorded_signal, require_signal, sample_rate
from fem.support.arguments import checked, renamed
from fem.support.user_warning import warn_renamed
from fem.support.validation import require, text_of

#: Samples of a chunk of windows.
CHUNK = 1_000_000
#: Attributes of the axes.
FREQUENCY = {"units": "Hz", "long_name": "frequency"}
ORDER = {"units": "1", "long_name": "order of the shaft"}
SPEED_CHANGE = {"units": "1", "long_name": "change of the speed within a line, as share of it"}


def check_window(name: str, value) -> None:
    """ValueError for a window that scipy.signal.get_window does not know."""
    kinds = f"{name} must be one of scipy.signal.get_window, a name or (name, parameters), got {text_of(value)}"
    require(isinstance(value, str | tuple), kinds)
    try:
        values = scipy.signal.get_window(value, 8)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{kinds}: {error}") from None
    require(bool(np.isfinite(values).all()), kinds)


#: Window: a name, or a name and its parameters, of scipy.signal.get_window.
Window = Annotated[Any, check_window]


@checked
def spectrogram(
    signal: xr.DataArray, *, resolution: float = 10.0, overlap: float = 0.5, window: Window = "hann"
) -> xr.Dataset:
    """Amplitude spectra of a signal over time.

    signal        (..., time) as `exugear.signal` returns it, at equal steps of time
    resolution    frequency resolution [Hz]; a spectrum takes 1 / resolution seconds
    overlap       of neighbouring spectra, as share of their length
    window        of scipy.signal.get_window: "hann", "flattop" for amplitudes, ("kaiser", 9.0), ...

    Returns a Dataset with amplitude (..., time, frequency), frequency [Hz], and the speed [rad/s] in the middle of each
    spectrum. A sine has its amplitude in the spectrum. Raises ValueError for signals shorter than a spectrum and for
    more than 5e8 values.
    """
    require_signal(signal)
    rate, samples = sample_rate(signal), signal.sizes["time"]
    require(0 < resolution < inf, f"resolution must be > 0 Hz and finite, got {resolution}")
    length = round(min(float(rate) / resolution, samples + 1.0))
    span = f"resolution must lie in [{rate / samples:.3g}, {rate / 4:.3g}] Hz, got {resolution:.3g} Hz"
    require(4 <= length <= samples, f"{span}: a spectrum takes its inverse of the signal's {samples / rate:.3g} s")
    rows, hop = signal.values.reshape(-1, samples), hop_of(length, overlap, signal.size)
    spectra = [amplitude_spectra(row, length, hop, window) for row in rows]
    middles, frequency = spectra[0][0], np.arange(length // 2 + 1) * rate / length
    lines = np.array([amplitude for _, amplitude in spectra]).reshape(*signal.shape[:-1], middles.size, -1)
    coordinates = signal.isel(time=middles).coords.assign(frequency=("frequency", frequency, FREQUENCY))
    return xr.Dataset({"amplitude": ((*signal.dims, "frequency"), lines, signal.attrs)}, coordinates)


@checked
def waterfall(
    signal: xr.DataArray, *, lines: int = 60, resolution: float = 10.0, window: Window = "hann"
) -> xr.Dataset:
    """Amplitude spectra of a signal at about equal steps of the speed.

    signal        (..., time) as `exugear.signal` returns it, at equal steps of time
    lines         number of spectra between the lowest and the highest speed, at most as many as overlap by 75 %
    resolution    frequency resolution [Hz]
    window        of scipy.signal.get_window

    Returns a Dataset with amplitude (..., speed, frequency). Raises ValueError for signals shorter than a spectrum.
    """
    require(lines >= 2, f"lines must be >= 2, got {lines}")
    spectra = spectrogram(signal, resolution=resolution, overlap=0.75, window=window)
    speed = spectra["speed"].values
    wanted = np.linspace(speed.min(), speed.max(), lines) if lines < speed.size else speed
    nearest = np.unique([np.abs(speed - value).argmin() for value in wanted])
    return spectra.isel(time=nearest).swap_dims(time="speed").sortby("speed")


@renamed(orders="highest_order")
@checked
def order_tracking(
    signal: xr.DataArray,
    *,
    highest_order: float,
    revolutions: float = 8.0,
    overlap: float = 0.75,
    window: Window = "hann",
) -> xr.Dataset:
    """Order map of a signal: amplitudes over time and order, with the speed of each block.

    signal         (..., time) as `exugear.signal` returns it
    highest_order  highest order wanted
    revolutions    length of a window, of which each spectrum is taken; its orders lie 1 / revolutions apart
    overlap        of neighbouring windows, as share of their length
    window         of scipy.signal.get_window: "hann", "flattop" for amplitudes between the orders, ("kaiser", 9.0), ...

    The signal is sampled over the shaft angle by `exugear.over_angle`, whose filter attenuates the orders that would
    alias by 100 dB. Windows in which a period of the highest order has fewer than 2.25 samples are left out.

    Returns a Dataset with amplitude (..., time, order) and the coordinates time [s] and speed [rad/s] of the middle of
    each window, and speed_change, the change of the speed within it as share of it. Orders of steady amplitude
    are right at any change; a resonance is smeared over the speeds of the window, and flattened from 0.1 on:
    `exugear.order_cut` gives amplitudes there. Raises ValueError for signals shorter than a window, where no
    window remains, and for more than 5e8 values.
    """
    require_signal(signal)
    require(0 < highest_order < np.inf, f"highest_order must be > 0 and finite, got {highest_order:g}")
    least = f"revolutions must hold a period of the highest order, {1 / highest_order:.3g} or more, got {revolutions:g}"
    require(revolutions * highest_order >= 1, least)
    check_overlap(overlap)
    turned = float(np.ptp(signal["angle"].values)) / REVOLUTION
    short = f"the signal holds {turned:.3g} revolutions, a window takes {revolutions:g}"
    require(turned * (1 + 1e-9) > revolutions, f"{short}; record longer, or pass fewer revolutions")
    passed = np.gradient(signal["angle"].values) / REVOLUTION
    resolved = f"sample finer, or pass {1 / (SAMPLES_PER_PERIOD * passed.max()):.4g}, which all samples resolve"
    coarse = f"no {revolutions:g} revolutions are sampled well enough for order {highest_order:g}; {resolved}"
    require(bool(passed[_fine(passed, highest_order)].sum() * (1 + 1e-9) >= revolutions), coarse)
    check_angular_samples(signal, highest_order)
    length = scipy.fft.next_fast_len(int(np.ceil(SAMPLES_PER_PERIOD * highest_order * revolutions)), real=True)
    hop = hop_of(length, overlap, turned / revolutions * length * signal.size / signal.sizes["time"])
    sampled = over_angle(signal, highest_order=length / revolutions / SAMPLES_PER_PERIOD)
    rows = sampled.values.reshape(-1, sampled.sizes["angle"])
    spectra = [amplitude_spectra(row, length, hop, window) for row in rows]
    middles, lines = spectra[0][0], np.array([amplitude for _, amplitude in spectra])
    passed = np.interp(sampled["angle"].values, signal["angle"].values, passed)
    fine = _fine_lines(_fine(passed, highest_order), middles, length)
    require(bool(fine.any()), coarse)
    order = np.arange(int(highest_order * revolutions * (1 + 1e-9)) + 1) / revolutions
    lines = lines[:, fine, : order.size].reshape(*signal.shape[:-1], -1, order.size)
    change = _speed_change(sampled["speed"].values, middles[fine], length)
    return _labelled(sampled.isel(angle=middles[fine]), order, lines, change)


def _fine(passed: np.ndarray, highest_order: float) -> np.ndarray:
    """(n,) whether periods of the highest order have enough samples, each of which passes some revolutions (n,)."""
    return passed * highest_order * SAMPLES_PER_PERIOD <= 1 + 1e-9


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


def check_overlap(overlap: float) -> None:
    """ValueError unless windows overlap by a share of their length."""
    require(0 <= overlap < 1, f"overlap must lie in [0, 1) as share of a window, got {overlap}")


def hop_of(length: int, overlap: float, samples: float) -> int:
    """Samples from a window to the next; ValueError where the spectra of all samples take too many values."""
    check_overlap(overlap)
    hop = max(1, round((1 - overlap) * length))
    remedy = "let the windows overlap less, or pass fewer channels"
    check_size(f"overlap = {overlap}", samples / hop * (length / 2), remedy)
    return hop


def amplitude_spectra(values: np.ndarray, length: int, hop: int, window: Window) -> tuple[np.ndarray, np.ndarray]:
    """Middles of the windows inside the values [samples], and amplitudes (n_window, 1 + length // 2).

    values   (n,) of which each window's weighted mean is subtracted
    """
    weights = scipy.signal.get_window(window, length)
    weights = weights / weights.sum()
    parts = np.lib.stride_tricks.sliding_window_view(values, length)[::hop]
    size = max(1, CHUNK // length)
    chunks = [_amplitudes(parts[k : k + size], weights) for k in range(0, len(parts), size)]
    return length // 2 + hop * np.arange(len(parts)), np.concatenate(chunks)


def _amplitudes(parts: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Amplitudes of the frequencies of parts (n_window, length) with weights (length,) whose sum is 1."""
    amplitude = 2 * np.abs(scipy.fft.rfft((parts - (parts @ weights)[:, None]) * weights))
    if weights.size % 2 == 0:
        amplitude[:, -1] /= 2
    return amplitude


class OrderSpectrum(NamedTuple):
    """Amplitudes (n_line, n_order) of the orders (n_order,) of shaft rotation at the speeds (n_line,) [rad/s]."""

    speed: np.ndarray
    order: np.ndarray
    amplitude: np.ndarray


def order_spectrum(time, speed, signal, *, orders: float, revolutions: float = 8, overlap: float = 0.75):
    """Deprecated: `order_tracking` of a `recorded_signal`."""
    recorded = recorded_signal(time, speed, signal)
    lines = order_tracking(recorded, highest_order=orders, revolutions=revolutions, overlap=overlap)
    instead = "exugear.order_tracking(exugear.recorded_signal(time, speed, values), highest_order=...)"
    warn_renamed("order_spectrum", instead)
    return OrderSpectrum(*(lines[name].values for name in OrderSpectrum._fields))
