"""What a signal over a run-up holds: envelope, resonances, orders; arrays in, arrays out."""

from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr

from exugear.simulation.run_data import stage_data
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

#: Half the width of the Gaussian that spreads samples over a grid [cells]: amplitudes to 1e-6.
SPREAD = 6
#: Fewest samples per period of the highest order, anywhere in a line: the two of Nyquist, and room for the window.
SAMPLES_PER_PERIOD = 2.05
#: Peaks must stand out by so many times the scatter of an envelope.
SCATTERS = 6.0


@checked
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


@checked
class Resonances(NamedTuple):
    """Peaks of an envelope in rising order: place and height; each (n_peak,)."""

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
    """Envelope of signal (n,) over place (n,) (time, speed or mesh frequency) in equally long windows.

    cycles      (n,) mesh cycles passed up to each sample, if given: windows are joined until each holds a whole one

    Extremes between samples lie on parabolas through three. A remainder shorter than a window is left out at the end.
    Raises ValueError for NaN and too few samples.
    """
    place, signal = np.asarray(place, float), np.asarray(signal, float)
    _check_signal(place=place, signal=signal)
    require(windows >= 1 and signal.size >= 2 * windows, f"windows must be 1 to {signal.size // 2}, got {windows}")
    edges = np.arange(windows + 1) * (signal.size // windows)
    if cycles is not None:
        _check_signal(place=place, cycles=(cycles := np.asarray(cycles, float)))
        edges = _joined(edges, cycles)
    first, length, end = edges[:-1], np.diff(edges), edges[-1]
    mean = lambda values: np.add.reduceat(values[:end], first) / length  # noqa: E731
    about = signal[:end] - np.repeat(mean(signal), length)
    extremes = _between_samples(signal)[:end]
    low, high = np.minimum.reduceat(extremes, first), np.maximum.reduceat(extremes, first)
    return Envelope(mean(place), low, high, np.sqrt(np.add.reduceat(about**2, first) / length))


def _joined(edges: np.ndarray, cycles: np.ndarray) -> np.ndarray:
    """Those edges of windows between which a whole cycle passes; the last window takes what is left."""
    passed = cycles[np.minimum(edges, cycles.size - 1)]
    kept = [0]
    for i in range(1, edges.size):
        if passed[i] - passed[kept[-1]] >= 1:
            kept.append(i)
    return edges[np.append(kept[: max(len(kept) - 1, 1)], edges.size - 1)]


def _between_samples(signal: np.ndarray) -> np.ndarray:
    """The signal with its extremes where parabolas through three samples have them."""
    before, at, behind = signal[:-2], signal[1:-1], signal[2:]
    bend = before - 2 * at + behind
    extreme = ((at - before) * (behind - at) <= 0) & (bend != 0)
    found = signal.copy()
    found[1:-1] -= np.where(extreme, (before - behind) ** 2 / (8 * np.where(extreme, bend, 1.0)), 0.0)
    return found


@checked
def resonances(place: Numbers, amplitude: Numbers, prominence: float = 0.05) -> Resonances:
    """Peaks of amplitude (n,) over place (n,) that stand out by prominence times the largest amplitude.

    They must also stand out of the scatter of the amplitudes, and lie within the range: what rises to its end is none.
    The places are refined by parabolas through three points. Raises ValueError for NaN and a prominence outside (0, 1).
    """
    place, amplitude = np.asarray(place, float), np.asarray(amplitude, float)
    _check_signal(place=place, amplitude=amplitude)
    require(0 < prominence < 1, f"prominence must lie in (0, 1) as share of the largest amplitude, got {prominence}")
    peaks, _ = scipy.signal.find_peaks(amplitude, prominence=max(prominence * amplitude.max(), _scatter(amplitude)))
    before, at, behind = amplitude[peaks - 1], amplitude[peaks], amplitude[peaks + 1]
    shift = (before - behind) / (2 * (before - 2 * at + behind))
    places = np.interp(peaks + shift, np.arange(place.size), place)
    return Resonances(places, at - (before - behind) * shift / 4)


@checked
def superharmonics(peaks: Resonances, divisors: Numbers = (4, 3, 2, 1), within: float = 0.12) -> np.ndarray:
    """Places (n,) of the peaks nearest to the highest peak's place over divisors (n,); NaN where none lies within.

    within      distance that still counts, as share of the place looked for
    """
    require(peaks.place.size > 0, "peaks must hold at least one peak, got none; lower the prominence")
    require(0 < within < 1, f"within must lie in (0, 1) as share of the place, got {within}")
    divisors = np.asarray(divisors, float)
    positive = divisors.ndim == 1 and bool((divisors > 0).all())
    require(positive, f"divisors must be numbers > 0 (n,), got {divisors}; 2 looks at half of the main resonance")
    expected = peaks.place[np.argmax(peaks.height)] / divisors
    nearest = peaks.place[np.abs(peaks.place - expected[:, None]).argmin(axis=1)]
    return np.where(np.abs(nearest / expected - 1) < within, nearest, np.nan)


def _scatter(amplitude: np.ndarray) -> float:
    """By how much a peak must stand out of what neighbouring values scatter about a smooth curve."""
    return SCATTERS * float(np.median(np.abs(np.diff(amplitude, 2)))) / (0.6745 * np.sqrt(6))


@checked
def order_spectrum(
    time: Numbers, speed: Numbers, signal: Numbers, *, orders: float, revolutions: int = 8, overlap: float = 0.75
) -> OrderSpectrum:
    """Amplitudes of a signal (n,) over the orders of a shaft that turns with speed (n,) [rad/s].

    time            (n,) [s]
    orders          highest order wanted, for instance five times the number of teeth
    revolutions     per line: the resolution is 1 / revolutions orders (Hann window)
    overlap         of neighbouring lines, as share of their length

    Each line is a Fourier integral over the angle, from the samples at the angles where they lie: nothing is
    interpolated, and what lies above the highest order is not folded below it. Lines with fewer than 2.05 samples per
    period of the highest order are left out. With speed = 2 pi mesh_frequency orders are those of the mesh, revolutions
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
    found = [_line(x, passed[part], signal[part], order.size) for x, (_, part) in zip(shares, lines, strict=True)]
    speeds = [weight @ speed[part] for (weight, _), (_, part) in zip(found, lines, strict=True)]
    return OrderSpectrum(np.array(speeds), order, np.array([amplitude for _, amplitude in found]))


def _sampled_lines(turns, passed, orders: float, revolutions: int, overlap: float) -> list[tuple[float, slice]]:
    """Start [revolutions] and samples of every line in which the signal is sampled finely enough."""
    starts = np.arange(0, turns[-1] * (1 + 1e-9) - revolutions, (1 - overlap) * revolutions)
    bounds = (np.searchsorted(turns, starts + k * revolutions).tolist() for k in (0, 1))
    lines = [(start, slice(first, end)) for start, first, end in zip(starts.tolist(), *bounds, strict=True)]
    lines = [(start, part) for start, part in lines if part.stop > part.start]
    return [(start, part) for start, part in lines if passed[part].max() * orders * SAMPLES_PER_PERIOD <= 1]


def _line(share: np.ndarray, passed: np.ndarray, signal: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Weights of samples at shares of a line, each for the angle passed, and the amplitudes of n orders."""
    weight = np.sin(np.pi * share) ** 2 * passed
    weight /= weight.sum()
    return weight, 2 * np.abs(fourier_sum(share, weight * (signal - weight @ signal), n))


def fourier_sum(share: np.ndarray, values: np.ndarray, n: int) -> np.ndarray:
    """(n,) sums of values exp(-2 pi i k share), k = 0 to n - 1, over samples at any share of a period in [0, 1].

    Spread by a Gaussian over a grid, to 1e-6 of the sum of the values' magnitudes. Source: Greengard and Lee, SIAM
    Review 46 (2004).
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
    """ValueError unless all are finite and of one length (n,), at least 3."""
    names, shapes = " and ".join(columns), [column.shape for column in columns.values()]
    fits = len(set(shapes)) == 1 and len(shapes[0]) == 1 and shapes[0][0] >= 3
    require(fits, f"{names} must be of one length (n,), at least 3, got {' and '.join(map(str, shapes))}")
    for name, column in columns.items():
        require(bool(np.isfinite(column).all()), f"{name} must be finite, got NaN")


@checked
def dte_envelope(run, stage: int = 0, windows: int = 280) -> Envelope:
    """Envelope of the DTE of a stage [m] over its mesh frequency [Hz]; every window holds a whole mesh cycle.

    run         an `exugear.Run` or its data
    windows     equally long ones, joined where the gears turn too slowly
    """
    data = stage_data(run, stage)
    time, frequency = data["time"].values, data["mesh_frequency"].values
    cycles = scipy.integrate.cumulative_trapezoid(frequency, time, initial=0)
    return envelope(frequency, data["dte"].values, min(windows, time.size // 2), cycles=cycles)


@checked
def bearing_force_rms(run, windows: int = 150) -> xr.DataArray:
    """Root mean square of what varies of the radial force of each bearing [N], (bearing, speed [rad/s]).

    run         an `exugear.Run` on bearings, or its data
    windows     of equal length, over which speed and force are averaged
    """
    data = stage_data(run)
    bearings = "run must have bearings, whose forces it records; this one's shafts only spin"
    require("bearing_force" in data, bearings)
    speed, force = data["speed"].values, data["bearing_force"].transpose("bearing", "direction", "time")
    windows = min(windows, speed.size // 2)
    axes = force.sel(direction=["x", "y"]).values
    values = [np.hypot(*(envelope(speed, part, windows).rms for part in radial)) for radial in axes]
    grid = {"bearing": data["bearing"].values, "speed": envelope(speed, speed, windows).place}
    return xr.DataArray(np.array(values), grid, ("bearing", "speed"), attrs={"units": "N"})
