"""Amplitude spectra of overlapping windows of equally spaced samples."""

from typing import Annotated, Any

import numpy as np
import scipy

from exugear.signals.columns import check_size
from fem.support.validation import require, text_of

#: Samples of a chunk of windows.
CHUNK = 1_000_000


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


def window_values(window: Window, length: int) -> np.ndarray:
    """(length,) values of a window."""
    return scipy.signal.get_window(window, length)


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
    weights = window_values(window, length)
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
