"""Envelope of a signal over time, speed or mesh frequency."""

from typing import NamedTuple

import numpy as np

from exugear.signals.columns import check_columns
from fem.support.arguments import Numbers, checked
from fem.support.validation import require


@checked
class Envelope(NamedTuple):
    """Envelope of a signal, each (n_window,).

    place   mean of the abscissa in the window: time, speed or mesh frequency
    low     smallest value of the signal
    high    largest value
    rms     root mean square about the mean
    """

    place: np.ndarray
    low: np.ndarray
    high: np.ndarray
    rms: np.ndarray

    @property
    def amplitude(self) -> np.ndarray:
        """Half the peak to peak value."""
        return (self.high - self.low) / 2


@checked
def envelope(place: Numbers, signal: Numbers, windows: int = 280, *, cycles: Numbers | None = None) -> Envelope:
    """Envelope of a signal in windows of equal length.

    place       (n,) abscissa: time, speed or mesh frequency
    signal      (n,)
    windows     number of windows
    cycles      (n,) mesh cycles up to each sample; if given, windows are joined until each holds a whole cycle

    Extremes between samples are those of parabolas through three samples. A remainder at the end that is shorter than a
    window is left out. Raises ValueError for NaN and for too few samples.
    """
    place, signal = np.asarray(place, float), np.asarray(signal, float)
    check_columns(place=place, signal=signal)
    require(windows >= 1, f"windows must be at least 1, got {windows}")
    few = f"signal has {signal.size} samples, too few for {windows} windows of 2 or more"
    require(signal.size >= 2 * windows, f"{few}; pass windows={signal.size // 2} or fewer, or a longer signal")
    edges = np.arange(windows + 1) * (signal.size // windows)
    if cycles is not None:
        check_columns(place=place, cycles=(cycles := np.asarray(cycles, float)))
        edges = _joined(edges, cycles)
    first, length, end = edges[:-1], np.diff(edges), edges[-1]

    def mean(values: np.ndarray) -> np.ndarray:
        return np.add.reduceat(values[:end], first) / length

    deviation = signal[:end] - np.repeat(mean(signal), length)
    extremes = _between_samples(signal)[:end]
    low, high = np.minimum.reduceat(extremes, first), np.maximum.reduceat(extremes, first)
    return Envelope(mean(place), low, high, np.sqrt(mean(deviation**2)))


def _joined(edges: np.ndarray, cycles: np.ndarray) -> np.ndarray:
    """The edges of windows that each hold a whole cycle; the last window takes the remainder."""
    passed = cycles[np.minimum(edges, cycles.size - 1)]
    kept = [0]
    for i in range(1, edges.size):
        if passed[i] - passed[kept[-1]] >= 1:
            kept.append(i)
    return edges[np.append(kept[: max(len(kept) - 1, 1)], edges.size - 1)]


def _between_samples(signal: np.ndarray) -> np.ndarray:
    """The signal with its local extremes replaced by those of parabolas through three samples."""
    before, at, after = signal[:-2], signal[1:-1], signal[2:]
    bend = before - 2 * at + after
    extreme = ((at - before) * (after - at) <= 0) & (bend != 0)
    refined = signal.copy()
    refined[1:-1] -= np.where(extreme, (before - after) ** 2 / (8 * np.where(extreme, bend, 1.0)), 0.0)
    return refined
