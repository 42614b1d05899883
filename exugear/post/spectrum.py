"""Envelope, resonances and order spectrum of a signal over a run-up, and of the data of a run."""

from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr

from exugear.integration.run_data import stage_data
from fem.support.arguments import Numbers, checked
from fem.support.validation import require

__all__ = [
    "Envelope",
    "OrderSpectrum",
    "Resonances",
    "bearing_force_rms",
    "envelope",
    "order_spectrum",
    "resonances",
    "superharmonics",
]

#: Half the width of the Gaussian that spreads samples over a grid [grid points]: amplitudes are exact to 1e-6.
SPREAD = 6
#: Least number of samples per period of the highest order, in all of a line: Nyquist's two and a margin for the window.
SAMPLES_PER_PERIOD = 2.05
#: Least prominence of a peak as multiple of the scatter of the envelope.
SCATTERS = 6.0


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
class Resonances(NamedTuple):
    """Peaks of an envelope, each (n_peak,): place on the abscissa, rising, and height."""

    place: np.ndarray
    height: np.ndarray


@checked
class OrderSpectrum(NamedTuple):
    """Amplitudes (n_line, n_order) of the orders (n_order,) of shaft rotation at the speeds (n_line,) [rad/s]."""

    speed: np.ndarray
    order: np.ndarray
    amplitude: np.ndarray


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
    _check_signal(place=place, signal=signal)
    require(windows >= 1 and signal.size >= 2 * windows, f"windows must be 1 to {signal.size // 2}, got {windows}")
    edges = np.arange(windows + 1) * (signal.size // windows)
    if cycles is not None:
        _check_signal(place=place, cycles=(cycles := np.asarray(cycles, float)))
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


@checked
def resonances(place: Numbers, amplitude: Numbers, prominence: float = 0.05) -> Resonances:
    """Peaks of an amplitude over an abscissa.

    place        (n,) abscissa, such as the mesh frequency
    amplitude    (n,)
    prominence   least prominence of a peak, as share of the largest amplitude

    A peak must also exceed the scatter of the amplitudes and lie inside the range: an amplitude that rises up to its
    end has no peak there. Place and height are refined by parabolas through three points. Raises ValueError for NaN
    and for a prominence outside (0, 1).
    """
    place, amplitude = np.asarray(place, float), np.asarray(amplitude, float)
    _check_signal(place=place, amplitude=amplitude)
    require(0 < prominence < 1, f"prominence must lie in (0, 1) as share of the largest amplitude, got {prominence}")
    peaks, _ = scipy.signal.find_peaks(amplitude, prominence=max(prominence * amplitude.max(), _scatter(amplitude)))
    before, at, after = amplitude[peaks - 1], amplitude[peaks], amplitude[peaks + 1]
    shift = (before - after) / (2 * (before - 2 * at + after))
    refined = np.interp(peaks + shift, np.arange(place.size), place)
    return Resonances(refined, at - (before - after) * shift / 4)


@checked
def superharmonics(peaks: Resonances, divisors: Numbers = (4, 3, 2, 1), within: float = 0.12) -> np.ndarray:
    """Frequencies (n,) of the peaks nearest to the main resonance over divisors (n,); NaN where no peak is near.

    peaks       `Resonances`; the highest peak is the main resonance
    within      largest distance of a peak from the expected frequency, as share of the latter

    Raises ValueError without peaks, and for divisors and shares out of range.
    """
    require(peaks.place.size > 0, "peaks must hold at least one peak, got none; lower the prominence")
    require(0 < within < 1, f"within must lie in (0, 1) as share of the frequency, got {within}")
    ratios = np.atleast_1d(np.asarray(divisors, float))
    require(bool((ratios > 0).all()), f"divisors must be > 0, got {divisors}")
    expected = peaks.place[np.argmax(peaks.height)] / ratios
    nearest = peaks.place[np.abs(peaks.place - expected[:, None]).argmin(axis=1)]
    return np.where(np.abs(nearest / expected - 1) < within, nearest, np.nan)


def _scatter(amplitude: np.ndarray) -> float:
    """Least prominence of a peak, by the scatter of neighbouring values about a smooth curve."""
    return SCATTERS * float(np.median(np.abs(np.diff(amplitude, 2)))) / (0.6745 * np.sqrt(6))


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
    _check_signal(time=time, speed=speed, signal=signal)
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


def fourier_sum(share: np.ndarray, values: np.ndarray, n: int) -> np.ndarray:
    """(n,) sums of values exp(-2 pi i k share), k = 0 to n - 1, over samples at any share of a period in [0, 1].

    The samples are spread by a Gaussian over a regular grid whose FFT is taken; exact to 1e-6 of the sum of the values'
    magnitudes. Source: Greengard and Lee, SIAM Review 46 (2004).
    """
    size = 4 * n
    tau, cell = SPREAD * np.pi / (12 * n**2), 2 * np.pi / size
    nearest = np.floor(share * size)
    off = 2 * np.pi * share - nearest * cell
    nearest = nearest.astype(int) % size
    growth = np.exp(off * cell / (2 * tau))
    spread = values * np.exp(-(off**2) / (4 * tau)) * growth ** (1 - SPREAD)
    grid = np.zeros(size)
    for k in range(1 - SPREAD, 1 + SPREAD):
        grid += np.exp(-((k * cell) ** 2) / (4 * tau)) * np.roll(np.bincount(nearest, spread, size), k)
        spread *= growth
    return np.sqrt(np.pi / tau) / size * np.exp(tau * np.arange(n) ** 2) * np.fft.rfft(grid)[:n]


def _check_signal(**columns: np.ndarray) -> None:
    """ValueError unless all are finite and equally long, (n,) with n >= 3."""
    names, shapes = " and ".join(columns), [column.shape for column in columns.values()]
    fits = len(set(shapes)) == 1 and len(shapes[0]) == 1 and shapes[0][0] >= 3
    require(fits, f"{names} must be equally long, (n,) with n >= 3, got {' and '.join(map(str, shapes))}")
    for name, column in columns.items():
        require(bool(np.isfinite(column).all()), f"{name} must be finite, got NaN")


@checked
def dte_envelope(run, stage: int = 0, windows: int = 280) -> Envelope:
    """Envelope of the DTE of a stage [m] over its mesh frequency [Hz]; each window holds a whole mesh cycle.

    run         an `exugear.Run` or its data
    windows     number of windows of equal length, joined where the gears turn too slowly for a mesh cycle
    """
    data = stage_data(run, stage)
    time, frequency = data["time"].values, data["mesh_frequency"].values
    cycles = scipy.integrate.cumulative_trapezoid(frequency, time, initial=0)
    return envelope(frequency, data["dte"].values, min(windows, time.size // 2), cycles=cycles)


@checked
def bearing_force_rms(run, windows: int = 150) -> xr.DataArray:
    """Root mean square of the varying part of the radial force of each bearing [N], (bearing, speed [rad/s]).

    run         an `exugear.Run` on bearings, or its data
    windows     of equal length, over which speed and force are averaged
    """
    data = stage_data(run)
    bearings = "run must have bearings, whose forces it records; the shafts of this run only spin"
    require("bearing_force" in data, bearings)
    speed, force = data["speed"].values, data["bearing_force"].transpose("bearing", "direction", "time")
    windows = min(windows, speed.size // 2)
    axes = force.sel(direction=["x", "y"]).values
    values = [np.hypot(*(envelope(speed, part, windows).rms for part in radial)) for radial in axes]
    grid = {"bearing": data["bearing"].values, "speed": envelope(speed, speed, windows).place}
    return xr.DataArray(np.array(values), grid, ("bearing", "speed"), attrs={"units": "N"})
