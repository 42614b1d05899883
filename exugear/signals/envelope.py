"""Envelope of a signal in windows, of the DTE of a run and of its bearing forces, and the peaks of an envelope."""

from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr

from exugear.running.run_data import stage_data
from exugear.signals.signal import check_columns
from fem.support.arguments import Numbers, checked, renamed
from fem.support.user_warning import warn_renamed
from fem.support.validation import require

#: Least prominence of a peak as multiple of the scatter of the envelope.
SCATTERS = 6.0


@renamed(place="abscissa")
@checked
class Peaks(NamedTuple):
    """Peaks of an envelope, each (n_peak,): abscissa, rising, and height."""

    abscissa: np.ndarray
    height: np.ndarray

    @property
    def place(self) -> np.ndarray:
        """Deprecated name of the abscissa."""
        warn_renamed("Peaks.place", "Peaks.abscissa")
        return self.abscissa


@renamed(place="abscissa")
@checked
class Envelope(NamedTuple):
    """Envelope of a signal, each (n_window,).

    abscissa   mean of the abscissa in the window: time, speed or mesh frequency
    low        smallest value of the signal
    high       largest value
    rms        root mean square about the mean
    """

    abscissa: np.ndarray
    low: np.ndarray
    high: np.ndarray
    rms: np.ndarray

    @property
    def amplitude(self) -> np.ndarray:
        """Half the peak to peak value."""
        return (self.high - self.low) / 2

    @property
    def place(self) -> np.ndarray:
        """Deprecated name of the abscissa."""
        warn_renamed("Envelope.place", "Envelope.abscissa")
        return self.abscissa

    def peaks(self, prominence: float = 0.05) -> Peaks:
        """Peaks of the amplitude, as `exugear.peaks` finds them."""
        return peaks(self.abscissa, self.amplitude, prominence)


@renamed(place="abscissa")
@checked
def envelope(abscissa: Numbers, signal: Numbers, windows: int = 280, *, cycles: Numbers | None = None) -> Envelope:
    """Envelope of a signal in windows of equal length.

    abscissa    (n,) time, speed or mesh frequency
    signal      (n,)
    windows     number of windows
    cycles      (n,) mesh cycles up to each sample; if given, windows are joined until each holds a whole cycle

    Extremes between samples are those of parabolas through three samples. A remainder at the end that is shorter than a
    window is left out. Raises ValueError for NaN and for too few samples.
    """
    abscissa, signal = np.asarray(abscissa, float), np.asarray(signal, float)
    check_columns(abscissa=abscissa, signal=signal)
    require(windows >= 1, f"windows must be at least 1, got {windows}")
    few = f"signal has {signal.size} samples, too few for {windows} windows of 2 or more"
    require(signal.size >= 2 * windows, f"{few}; pass windows={signal.size // 2} or fewer, or a longer signal")
    if cycles is not None:
        check_columns(abscissa=abscissa, cycles=(cycles := np.asarray(cycles, float)))
    edges = window_edges(signal.size, windows, cycles)
    first, end = edges[:-1], edges[-1]
    deviation = signal[:end] - np.repeat(means_between(signal, edges), np.diff(edges))
    extremes = _between_samples(signal)[:end]
    low, high = np.minimum.reduceat(extremes, first), np.maximum.reduceat(extremes, first)
    return Envelope(means_between(abscissa, edges), low, high, np.sqrt(means_between(deviation**2, edges)))


def window_edges(samples: int, windows: int, cycles: np.ndarray | None = None) -> np.ndarray:
    """(m + 1,) samples at which windows of equal length begin, and the end of the last one.

    With cycles (n,) up to each sample, windows are joined until each holds a whole cycle; the last takes the remainder.
    """
    edges = np.arange(windows + 1) * (samples // windows)
    if cycles is None:
        return edges
    passed = cycles[np.minimum(edges, cycles.size - 1)]
    kept = [0]
    for i in range(1, edges.size):
        if passed[i] - passed[kept[-1]] >= 1:
            kept.append(i)
    return edges[np.append(kept[: max(len(kept) - 1, 1)], edges.size - 1)]


def means_between(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """(m,) means of values (n,) in the windows between edges (m + 1,), as `window_edges` gives them."""
    return np.add.reduceat(values[: edges[-1]], edges[:-1]) / np.diff(edges)


def mesh_cycles(data: xr.Dataset) -> np.ndarray:
    """(n_time,) mesh cycles since the start of a run, of the data of a stage, or of the slowest of all stages."""
    frequency = data["mesh_frequency"]
    slowest = frequency.min("stage") if "stage" in frequency.dims else frequency
    return scipy.integrate.cumulative_trapezoid(slowest.values, data["time"].values, initial=0)


def _between_samples(signal: np.ndarray) -> np.ndarray:
    """The signal with its local extremes replaced by those of parabolas through three samples."""
    before, at, after = signal[:-2], signal[1:-1], signal[2:]
    bend = before - 2 * at + after
    extreme = ((at - before) * (after - at) <= 0) & (bend != 0)
    refined = signal.copy()
    refined[1:-1] -= np.where(extreme, (before - after) ** 2 / (8 * np.where(extreme, bend, 1.0)), 0.0)
    return refined


@checked
def dte_envelope(run, stage: int | str = 0, windows: int = 280) -> Envelope:
    """Envelope of the DTE of a stage [m] over its mesh frequency [Hz]; each window holds a whole cycle of every mesh.

    run         an `exugear.Run` or its data
    windows     number of windows of equal length, joined where the gears turn too slowly for a mesh cycle

    Raises ValueError for a stage that the run lacks, and for fewer than one window.
    """
    data = stage_data(run, stage)
    cycles = mesh_cycles(run if isinstance(run, xr.Dataset) else run.data)
    windows = _at_most(windows, data.sizes["time"])
    return envelope(data["mesh_frequency"].values, data["dte"].values, windows, cycles=cycles)


@checked
def bearing_force_rms(run, windows: int = 150) -> xr.DataArray:
    """Root mean square of the varying part of the radial force of each bearing [N], (bearing, speed [rad/s]).

    run         an `exugear.Run` on bearings, or its data
    windows     of equal length, over which speed and force are averaged

    Raises ValueError for a run without bearings, and for fewer than one window.
    """
    data = stage_data(run)
    bearings = "run must have bearings, whose forces it records; the shafts of this run only spin"
    require("bearing_force" in data, bearings)
    speed, force = data["speed"].values, data["bearing_force"].transpose("bearing", "direction", "time")
    windows = _at_most(windows, speed.size)
    axes = force.sel(direction=["x", "y"]).values
    values = [np.hypot(*(envelope(speed, part, windows).rms for part in radial)) for radial in axes]
    grid = {"bearing": data["bearing"].values, "speed": envelope(speed, speed, windows).abscissa}
    return xr.DataArray(np.array(values), grid, ("bearing", "speed"), attrs={"units": "N"})


def _at_most(windows: int, samples: int) -> int:
    """The number of windows, or as many as hold two of the samples each."""
    require(windows >= 1, f"windows must be at least 1, got {windows}")
    require(samples >= 2, f"run must hold at least 2 samples, got {samples}; let it last longer")
    return min(windows, samples // 2)


@renamed(place="abscissa")
@checked
def peaks(abscissa: Numbers, amplitude: Numbers, prominence: float = 0.05) -> Peaks:
    """Peaks of an amplitude over an abscissa; `exugear.resonances` says which mesh harmonic excites those of a run.

    abscissa     (n,) such as the mesh frequency
    amplitude    (n,)
    prominence   least prominence of a peak, as share of the largest amplitude

    A peak must also exceed the scatter of the amplitudes and lie inside the range: an amplitude that rises up to its
    end has no peak there. Abscissa and height are refined by parabolas through three points. Raises ValueError for NaN
    and for a prominence outside (0, 1).
    """
    abscissa, amplitude = np.asarray(abscissa, float), np.asarray(amplitude, float)
    check_columns(abscissa=abscissa, amplitude=amplitude)
    require(0 < prominence < 1, f"prominence must lie in (0, 1) as share of the largest amplitude, got {prominence}")
    tops, _ = scipy.signal.find_peaks(amplitude, prominence=max(prominence * amplitude.max(), _scatter(amplitude)))
    before, at, after = amplitude[tops - 1], amplitude[tops], amplitude[tops + 1]
    curvature = 2 * (before - 2 * at + after)
    shift = np.divide(before - after, curvature, out=np.zeros_like(at), where=curvature != 0)
    refined = np.interp(tops + shift, np.arange(abscissa.size), abscissa)
    rising = np.argsort(refined)
    return Peaks(refined[rising], (at - (before - after) * shift / 4)[rising])


def _scatter(amplitude: np.ndarray) -> float:
    """Least prominence of a peak, by the scatter of neighbouring values about a smooth curve."""
    return SCATTERS * float(np.median(np.abs(np.diff(amplitude, 2)))) / (0.6745 * np.sqrt(6))


@checked
def superharmonics(peaks: Peaks, divisors: Numbers = (4, 3, 2, 1), within: float = 0.12) -> np.ndarray:
    """Frequencies (n,) of the peaks nearest to the main resonance over divisors (n,); NaN where no peak is near.

    peaks       `Peaks`; the highest peak is the main resonance
    within      largest distance of a peak from the expected frequency, as share of the expected frequency

    Raises ValueError without peaks, and for divisors and shares out of range.
    """
    require(peaks.abscissa.size > 0, "peaks must hold at least one peak, got none; lower the prominence")
    require(0 < within < 1, f"within must lie in (0, 1) as share of the frequency, got {within}")
    ratios = np.atleast_1d(np.asarray(divisors, float))
    require(bool((ratios > 0).all()), f"divisors must be > 0, got {divisors}")
    expected = peaks.abscissa[np.argmax(peaks.height)] / ratios
    nearest = peaks.abscissa[np.abs(peaks.abscissa - expected[:, None]).argmin(axis=1)]
    return np.where(np.abs(nearest / expected - 1) < within, nearest, np.nan)
