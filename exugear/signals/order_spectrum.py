"""Amplitudes of a signal over the orders of a shaft."""

from typing import NamedTuple

import numpy as np
import scipy

from exugear.signals.columns import check_columns
from exugear.signals.fourier_sum import fourier_sum
from fem.support.arguments import Numbers, checked
from fem.support.validation import require

#: Least number of samples per period of the highest order in a line: Nyquist's two and a margin for the window.
SAMPLES_PER_PERIOD = 2.05


@checked
class OrderSpectrum(NamedTuple):
    """Amplitudes (n_line, n_order) of the orders (n_order,) of shaft rotation at the speeds (n_line,) [rad/s]."""

    speed: np.ndarray
    order: np.ndarray
    amplitude: np.ndarray


@checked
def order_spectrum(
    time: Numbers, speed: Numbers, signal: Numbers, *, orders: float, revolutions: int = 8, overlap: float = 0.75
) -> OrderSpectrum:
    """Amplitudes of a signal over the orders of a shaft.

    time            (n,) [s]
    speed           (n,) of the shaft [rad/s]
    signal          (n,)
    orders          highest order wanted, for instance five times the number of teeth
    revolutions     length of a line; the resolution is 1 / revolutions orders (Hann window)
    overlap         of neighbouring lines, as share of their length

    Each line is a Fourier integral over the shaft angle, summed over the samples at their angles. Thus nothing is
    interpolated, and nothing above the highest order is aliased below it. Lines with fewer than 2.05 samples per period
    of the highest order are left out. With speed = 2 pi mesh_frequency the orders are mesh orders and the revolutions
    mesh cycles. Raises ValueError for signals shorter than a line, and where no line remains.
    """
    time, speed, signal = (np.asarray(x, float) for x in (time, speed, signal))
    check_columns(time=time, speed=speed, signal=signal)
    require(orders > 0 and revolutions >= 1, f"orders must be > 0, revolutions >= 1, got {orders}, {revolutions}")
    require(0 <= overlap < 1, f"overlap must lie in [0, 1) as share of a line, got {overlap}")
    turns = scipy.integrate.cumulative_trapezoid(np.abs(speed), time, initial=0) / (2 * np.pi)
    short = f"the signal holds {turns[-1]:.3g} revolutions, a line takes {revolutions}"
    require(turns[-1] * (1 + 1e-9) > revolutions, f"{short}; record longer, or pass fewer revolutions")
    passed = np.abs(speed) * np.gradient(time) / (2 * np.pi)
    lines = _sampled_lines(turns, passed, orders, revolutions, overlap)
    require(bool(lines), f"no {revolutions} revolutions are sampled well enough for order {orders:g}; sample finer")
    order = np.arange(int(orders * revolutions * (1 + 1e-9)) + 1) / revolutions
    shares = [(turns[part] - start) / revolutions for start, part in lines]
    spectra = [_line(x, passed[part], signal[part], order.size) for x, (_, part) in zip(shares, lines, strict=True)]
    speeds = [weight @ speed[part] for (weight, _), (_, part) in zip(spectra, lines, strict=True)]
    return OrderSpectrum(np.array(speeds), order, np.array([amplitude for _, amplitude in spectra]))


def _sampled_lines(turns, passed, orders: float, revolutions: int, overlap: float) -> list[tuple[float, slice]]:
    """Start [revolutions] and samples of each line in which the signal is sampled finely enough."""
    starts = np.arange(0, turns[-1] * (1 + 1e-9) - revolutions, (1 - overlap) * revolutions)
    bounds = (np.searchsorted(turns, starts + k * revolutions).tolist() for k in (0, 1))
    lines = [(start, slice(first, end)) for start, first, end in zip(starts.tolist(), *bounds, strict=True)]
    lines = [(start, part) for start, part in lines if part.stop > part.start]
    return [(start, part) for start, part in lines if passed[part].max() * orders * SAMPLES_PER_PERIOD <= 1]


def _line(share: np.ndarray, passed: np.ndarray, signal: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the samples of a line, Hann window times angle passed, and the amplitudes of n orders."""
    weight = np.sin(np.pi * share) ** 2 * passed
    weight /= weight.sum()
    return weight, 2 * np.abs(fourier_sum(share, weight * (signal - weight @ signal), n))
