"""Sound files of signals."""

from fractions import Fraction
from math import inf
from pathlib import Path

import numpy as np
import scipy
import xarray as xr

from exugear.signals.signal import require_signal, sample_rate
from fem.support.arguments import FilePath, checked
from fem.support.cache import complete_file
from fem.support.validation import require

#: Largest denominator of the ratio of sample rates: the pitch is right within 1e-6.
DENOMINATOR = 1000
#: Anti-alias filter: Kaiser window of 100 dB, half its length in samples of the lower rate, and its cut-off as share of
#: half that rate; it passes up to 0.9 and attenuates by 100 dB from 1 on.
WINDOW, HALF_LENGTH, CUT_OFF = ("kaiser", 10.06), 64, 0.95
#: Share of the largest number of a file that the signal takes: the filter may overshoot the samples.
HEADROOM = 0.95
LARGEST = 32767
#: Highest rate of sound files [Hz].
HIGHEST_RATE = 768_000
#: Deviation from the mean as share of the largest value that counts as rounding: a constant signal is silent.
ROUNDING = 1e-12


@checked
def write_sound(path: FilePath, signal: xr.DataArray, *, rate: int = 48_000, full_scale: float | None = None) -> float:
    """Write a signal as a sound file (WAV, 16 bit, mono), completely or not at all.

    path          of the file
    signal        (time,) as `exugear.signal` returns it, at equal steps of time; its mean is inaudible and left out
    rate          samples per second of the file [Hz]: 48000 or 44100
    full_scale    value of the signal that becomes the largest number of the file; by default its largest one over 0.95.
                  Files of the same full scale are comparable in loudness

    The signal is resampled behind an anti-alias filter of 100 dB. Returns the full scale in the units of the signal.
    Raises ValueError for several channels, for unequal steps of time and for a signal beyond the full scale.
    """
    require_signal(signal)
    require(signal.ndim == 1, f"signal must be one channel over time, select it: got the dimensions {signal.dims}")
    require(0 < rate <= HIGHEST_RATE, f"rate must lie in (0, {HIGHEST_RATE}] Hz, got {rate}")
    ratio = Fraction(rate / sample_rate(signal)).limit_denominator(DENOMINATOR)
    require(ratio > 0, f"rate must be at least {sample_rate(signal) / DENOMINATOR:.3g} Hz, got {rate}")
    centred = signal.values - signal.values.mean()
    centred[np.abs(centred) <= ROUNDING * np.abs(signal.values).max()] = 0.0
    highest = max(ratio.numerator, ratio.denominator)
    taps = scipy.signal.firwin(2 * HALF_LENGTH * highest + 1, CUT_OFF / highest, window=WINDOW)
    samples = scipy.signal.resample_poly(centred, ratio.numerator, ratio.denominator, window=taps)
    peak = float(np.abs(samples).max())
    scale = (peak / HEADROOM or 1.0) if full_scale is None else full_scale
    require(inf > scale >= peak > -1, f"full_scale must be at least the largest value, {peak:.6g}, got {scale:.6g}")
    with complete_file(Path(path)) as file:
        scipy.io.wavfile.write(file, rate, np.rint(samples / scale * LARGEST).astype(np.int16))
    return scale
