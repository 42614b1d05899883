"""What a signal over a run-up holds: envelope, resonances, orders; arrays in, arrays out."""

from typing import NamedTuple

import numpy as np
import scipy

from fem.gear import require

#: Samples per revolution over what the highest order needs, so that still higher ones are not folded onto it.
OVERSAMPLING = 4


class Envelope(NamedTuple):
    """Per window: place of its middle, smallest and largest value, rms about the mean; each (n_window,)."""

    place: np.ndarray
    low: np.ndarray
    high: np.ndarray
    rms: np.ndarray

    @property
    def amplitude(self) -> np.ndarray:
        """Half the peak to peak value."""
        return (self.high - self.low) / 2


class Resonances(NamedTuple):
    """Peaks of an envelope in rising order: place and height; each (n_peak,)."""

    place: np.ndarray
    height: np.ndarray


class OrderSpectrum(NamedTuple):
    """Amplitudes (n_line, n_order) of the orders (n_order,) of shaft rotation at the speeds (n_line,) [rad/s]."""

    speed: np.ndarray
    order: np.ndarray
    amplitude: np.ndarray


def envelope(place, signal, windows: int = 280) -> Envelope:
    """Envelope of signal (n,) over place (n,) (time, speed or mesh frequency) in equally long windows.

    A remainder shorter than a window is left out at the end. Raises ValueError for NaN and too few samples.
    """
    place, signal = np.asarray(place, float), np.asarray(signal, float)
    _check_signal(place, signal)
    require(windows >= 1 and signal.size >= 2 * windows, f"windows must be 1 to {signal.size // 2}, got {windows}")
    length = signal.size // windows
    cut = signal[: length * windows].reshape(windows, length)
    middle = place[: length * windows].reshape(windows, length).mean(axis=1)
    return Envelope(middle, cut.min(axis=1), cut.max(axis=1), cut.std(axis=1))


def resonances(place, amplitude, prominence: float = 0.05) -> Resonances:
    """Peaks of amplitude (n,) over place (n,) that stand out by prominence times the largest amplitude.

    The places are refined by parabolas through three points. Raises ValueError for NaN and a prominence outside (0, 1).
    """
    place, amplitude = np.asarray(place, float), np.asarray(amplitude, float)
    _check_signal(place, amplitude)
    require(0 < prominence < 1, f"prominence must lie in (0, 1) as share of the largest amplitude, got {prominence}")
    peaks, _ = scipy.signal.find_peaks(amplitude, prominence=prominence * amplitude.max())
    before, at, behind = amplitude[peaks - 1], amplitude[peaks], amplitude[peaks + 1]
    shift = (before - behind) / (2 * (before - 2 * at + behind))
    places = np.interp(peaks + shift, np.arange(place.size), place)
    return Resonances(places, at - (before - behind) * shift / 4)


def order_spectrum(time, speed, signal, *, orders: float, revolutions: int = 8) -> OrderSpectrum:
    """Amplitudes of a signal (n,) over the orders of a shaft that turns with speed (n,) [rad/s].

    time            (n,) [s]
    orders          highest order wanted, for instance five times the number of teeth
    revolutions     per line: the resolution is 1 / revolutions orders (Hann window)

    The signal is resampled over the angle; revolutions too slow or too fast to be sampled are left out: fewer than
    2.2 samples per period of the highest order. Raises ValueError for signals shorter than a line,
    and where no line remains.
    """
    time, speed, signal = (np.asarray(x, float) for x in (time, speed, signal))
    _check_signal(time, signal)
    _check_signal(time, speed)
    require(orders > 0 and revolutions >= 1, f"orders must be > 0, revolutions >= 1, got {orders}, {revolutions}")
    turns = scipy.integrate.cumulative_trapezoid(np.abs(speed), time, initial=0) / (2 * np.pi)
    short = f"the signal holds {turns[-1]:.3g} revolutions, a line takes {revolutions}"
    require(turns[-1] >= revolutions, f"{short}; record longer, or pass fewer revolutions")
    per_line = OVERSAMPLING * int(np.ceil(2.56 * orders)) * revolutions
    lines = _sampled_lines(time, turns, orders, revolutions)
    require(lines.size > 0, f"no {revolutions} revolutions are sampled well enough for order {orders:g}; sample finer")
    at = (lines[:, None] + np.arange(per_line) / per_line) * revolutions
    moment = np.interp(at, turns, time)
    window = scipy.signal.windows.hann(per_line, sym=False)
    values = np.interp(moment, time, signal)
    values -= values.mean(axis=1, keepdims=True)
    amplitude = np.abs(np.fft.rfft(values * window, axis=1)) * 2 / window.sum()
    order = np.arange(amplitude.shape[1]) / revolutions
    kept = order <= orders
    return OrderSpectrum(np.interp(moment.mean(axis=1), time, speed), order[kept], amplitude[:, kept])


def _sampled_lines(time, turns, orders: float, revolutions: int) -> np.ndarray:
    """Numbers of the stretches of whole revolutions in which the signal is sampled finely enough."""
    lines = np.arange(int(turns[-1] / revolutions))
    start, end = (np.interp((lines + k) * revolutions, turns, time) for k in (0, 1))
    samples = (end - start) / np.diff(time).max()
    return lines[samples >= 2.2 * orders * revolutions]


def _check_signal(place: np.ndarray, signal: np.ndarray) -> None:
    fits = signal.ndim == 1 and place.shape == signal.shape and signal.size >= 3
    require(fits, f"place and signal must be of one length (n,), at least 3, got {place.shape} and {signal.shape}")
    require(bool(np.isfinite(signal).all() and np.isfinite(place).all()), "signal and place must be finite, got NaN")
