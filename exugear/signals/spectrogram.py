"""Spectra over frequency along a run: spectrogram over time, waterfall over speed."""

from math import inf

import numpy as np
import xarray as xr

from exugear.signals.short_time_spectra import Window, amplitude_spectra, hop_of
from exugear.signals.signal import require_signal, sample_rate
from fem.support.arguments import checked
from fem.support.validation import require

#: Attributes of the axis of frequencies.
FREQUENCY = {"units": "Hz", "long_name": "frequency"}


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
