"""Resonances of a run with the mesh harmonic that excites each of them."""

from collections.abc import Callable
from functools import cache, partial, wraps
from typing import NamedTuple

import numpy as np
import xarray as xr

from exugear.gearbox.stage import stage_number
from exugear.running.run_data import stage_data
from exugear.signals.angle_sampling import REVOLUTION
from exugear.signals.envelope import Peaks, dte_envelope, peaks
from exugear.signals.order_cut import LONGER, SEPARATION, TOLD, cut_of, told
from exugear.signals.signal import mesh_order, mesh_orders, signal
from fem.support.arguments import checked
from fem.support.user_warning import warn_renamed
from fem.support.validation import require

#: Largest distance of a peak of an order cut from that of the envelope, as share of the frequency: half that of the
#: eighth and ninth superharmonic is 6 %.
NEAR = 0.04
#: Least prominence of a peak of an order cut, as share of its largest amplitude.
PROMINENCE = 0.05
#: Least amplitude of the harmonic as share of that of the envelope: on the paper's pair the least is a quarter, while
#: noise and tones beside the mesh orders leave a hundredth in an order cut.
SHARE = 0.1
#: Largest number of harmonics that are examined.
HARMONICS = 100
VARIABLES = {
    "mesh_frequency": ("Hz", "mesh frequency of the resonance"),
    "amplitude": ("m", "half peak to peak of the DTE"),
    "harmonic": ("1", "mesh harmonic that excites the resonance"),
    "harmonic_amplitude": ("m", "amplitude of the mesh harmonic in the DTE"),
    "response_frequency": ("Hz", "frequency of the vibration: harmonic times mesh frequency of the exciting stage"),
}


class OrderPeaks(NamedTuple):
    """Peaks of the order cut of a mesh harmonic over the mesh frequency [Hz] of the examined stage.

    order        of the driving shaft
    frequency    (n_point,) mesh frequencies of the cut
    resolution   (n_point,) distance from which on its windows tell orders apart
    told         (n_point,) whether its amplitude can be told
    """

    stage: int
    harmonic: int
    order: float
    frequency: np.ndarray
    resolution: np.ndarray
    told: np.ndarray
    peaks: Peaks

    def height(self, mesh_frequency: float) -> float:
        """Largest amplitude of a peak near a mesh frequency; 0 where none is near."""
        return self.peak(mesh_frequency)[1]

    def peak(self, mesh_frequency: float) -> tuple[float, float]:
        """Mesh frequency and amplitude of the largest peak near a mesh frequency; NaN and 0 where none is near."""
        near = np.abs(self.peaks.abscissa / mesh_frequency - 1) < NEAR
        peaks = zip(self.peaks.abscissa[near].tolist(), self.peaks.height[near].tolist(), strict=True)
        return max(peaks, key=lambda peak: peak[1], default=(np.nan, 0.0))

    def resolution_at(self, mesh_frequency: float) -> float:
        """Distance of orders that the window at a mesh frequency tells apart."""
        return float(self.resolution[np.abs(self.frequency - mesh_frequency).argmin()])

    def told_height(self, mesh_frequency: float) -> float:
        """`height`, NaN where it cannot be told."""
        at, height = self.peak(mesh_frequency)
        return height if height > 0 and self.told[np.abs(self.frequency - at).argmin()] else np.nan


class Resonance(NamedTuple):
    """A row of the table: `VARIABLES`, and the number of the exciting stage."""

    mesh_frequency: float
    amplitude: float
    harmonic: int
    harmonic_amplitude: float
    response_frequency: float
    stage: int


def _also_of_arrays(function: Callable) -> Callable:
    """Decorator: an earlier version took an abscissa and an amplitude, which now are `exugear.peaks`."""

    @wraps(function)
    def calling(*args, **options):
        if (len(args) > 1 and np.ndim(args[1]) > 0) or "amplitude" in options:
            tops = peaks(*args, **options)
            warn_renamed("resonances(abscissa, amplitude)", "exugear.peaks(abscissa, amplitude)")
            return tops
        return function(*args, **options)

    return calling


@_also_of_arrays
@checked
def resonances(run, stage: int | str = 0, *, harmonics: int = 8, prominence: float = 0.004) -> xr.Dataset:
    """Resonances of the DTE of a stage along a run, with the mesh harmonic that excites each of them.

    run           an `exugear.Run` or its data, over a range of speeds
    harmonics     number of mesh harmonics of each stage that are examined
    prominence    least prominence of a peak of the envelope, as share of its largest amplitude

    A peak of `exugear.dte_envelope` is a resonance where the order cut of a mesh harmonic peaks within 4 % of its mesh
    frequency; of several harmonics, of this stage and of the others, the one with the largest amplitude counts, which
    must be a tenth of the envelope's or more. Other peaks are left out, and all but the highest of those at the same
    peak of a harmonic. Where the windows are too short to tell the orders of two stages apart, the amplitudes of a
    joint cut in longer windows at the peak decide. The harmonics 2, 3, ... of the main resonance are its
    superharmonics: their response frequencies nearly agree.

    Returns a Dataset over peak with mesh_frequency [Hz], amplitude (half peak to peak) [m], exciting_stage, harmonic,
    harmonic_amplitude [m] and response_frequency [Hz]; its attribute `resonances` tells how many peaks of the envelope
    these are, and over which mesh frequencies, also where there is none. The harmonic_amplitude is NaN where
    `exugear.order_cut` cannot tell it: the speed changes too fast for it, or for telling it from close orders of
    another stage.

    Raises ValueError for a run of less than 3 mesh cycles, and for numbers out of range.
    """
    require(1 <= harmonics <= HARMONICS, f"harmonics must lie in [1, {HARMONICS}], got {harmonics}")
    require(0 < prominence < 1, f"prominence must lie in (0, 1) as share of the largest amplitude, got {prominence}")
    outline = dte_envelope(run, stage)
    short = f"run must hold 3 mesh cycles or more for its resonances, got {outline.abscissa.size}; run it longer"
    require(outline.abscissa.size >= 3, short)
    tops = outline.peaks(prominence)
    data = run if isinstance(run, xr.Dataset) else run.data
    number = stage_number(data["stage"].values.tolist(), stage)
    stages = [number, *(k for k in range(data["stage"].size) if k != number)]
    cuts = [cut for exciting in stages for cut in _cuts(data, number, exciting, harmonics)]
    of_orders = cache(partial(joint_cut, signal(data, "dte", stage=stage)))
    rows: dict[tuple, Resonance] = {}
    for frequency, height in sorted(zip(*tops, strict=True), key=lambda peak: peak[1]):
        cut = max(cuts, key=lambda each: each.height(frequency))
        if cut.height(frequency) > SHARE * height:
            cut, amplitude, peaks_at = _separated_cut(cuts, cut, frequency, of_orders)
            if amplitude == 0:
                continue
            ratio = mesh_order(stage_data(data, cut.stage)) / mesh_order(stage_data(data, stage))
            row = Resonance(frequency, height, cut.harmonic, amplitude, cut.harmonic * frequency * ratio, cut.stage)
            rows[cut.stage, cut.harmonic, peaks_at] = row
    low, high = outline.abscissa[[0, -1]]
    among = f"{len(rows)} of {len(tops[0])} peaks of the envelope, at {low:.4g} to {high:.4g} Hz of mesh frequency"
    return _labelled(sorted(rows.values()), data["stage"].values).assign_attrs(resonances=among)


def _labelled(rows: list[Resonance], stages: np.ndarray) -> xr.Dataset:
    columns = np.array([row[:-1] for row in rows]).reshape(-1, len(VARIABLES)).T
    exciting = np.array([stages[row.stage] for row in rows], str)
    table = xr.Dataset(
        {
            name: ("peak", values, {"units": units, "long_name": long_name})
            for (name, (units, long_name)), values in zip(VARIABLES.items(), columns, strict=True)
        }
    )
    return table.assign(harmonic=table["harmonic"].astype(int), exciting_stage=("peak", exciting))


def _cuts(data: xr.Dataset, stage: int, exciting: int, harmonics: int) -> list[OrderPeaks]:
    """Peaks of the DTE of a stage at each mesh harmonic of an exciting stage."""
    cut = mesh_order_cut(data, stage, exciting, harmonics=harmonics)
    frequency, of_harmonics = _mesh_frequency(cut), []
    for harmonic, order in enumerate(cut["order"].values, start=1):
        of_order = cut.sel(order=order)
        amplitude, resolution, reason = (of_order[name].values for name in ("amplitude", "resolution", "reason"))
        known = frequency, resolution, reason == TOLD
        of_harmonics.append(OrderPeaks(exciting, harmonic, float(order), *known, _peaks(frequency, amplitude)))
    return of_harmonics


def _separated_cut(
    cuts: list[OrderPeaks], largest: OrderPeaks, frequency: float, joint_cut: Callable[..., xr.Dataset | None]
) -> tuple[OrderPeaks, float, float]:
    """The cut whose order excites a peak at a mesh frequency [Hz], the amplitude of the order [m], where it peaks [Hz].

    The amplitude is 0 where the order, told apart from close ones, does not peak: these beat in the cut.

    largest     the cut with the largest amplitude near the peak, to which close orders may contribute
    joint_cut   function (orders) -> their joint cut, or None
    """
    of_other_stages = [cut for cut in cuts if cut.stage != largest.stage and cut.height(frequency) > 0]
    resolution = largest.resolution_at(frequency)
    beside = [cut for cut in of_other_stages if abs(cut.order - largest.order) < resolution]
    close = {cut.order: cut for cut in (*beside, largest)}
    if len(close) == 1:
        return largest, largest.told_height(frequency), largest.peak(frequency)[0]
    joint = joint_cut(tuple(sorted(close)))
    if joint is not None:
        amplitudes, distance = joint["amplitude"].values, np.abs(_mesh_frequency(joint) / frequency - 1)
        amplitude = amplitudes[:, distance.argmin()]
        if np.isfinite(amplitude).all():
            exciting = close[float(joint["order"][amplitude.argmax()])]
            separated = _peaks(_mesh_frequency(joint), amplitudes[amplitude.argmax()])
            peaks_at, height = exciting._replace(peaks=separated).peak(frequency)
            return exciting, float(amplitude.max()) if height > 0 else 0.0, peaks_at
    return largest, np.nan, largest.peak(frequency)[0]


def joint_cut(dte: xr.DataArray, orders: tuple[float, ...]) -> xr.Dataset | None:
    """Order cut that tells close orders apart, NaN where it cannot; None in runs shorter than its windows."""
    window = LONGER * SEPARATION / float(np.diff(orders).min())
    if window * REVOLUTION > float(np.ptp(dte["angle"].values)):
        return None
    return told(cut_of(dte, orders))


def _mesh_frequency(cut: xr.Dataset) -> np.ndarray:
    """(n_time,) mesh frequency [Hz] of the examined stage in an order cut."""
    return np.abs(cut["speed"].values) * float(cut["mesh_order"]) / (2 * np.pi)


def mesh_order_cut(data: xr.Dataset, stage: int, exciting: int | None = None, *, harmonics: int) -> xr.Dataset:
    """Order cut of the DTE of a stage at the mesh harmonics of an exciting stage, by default its own.

    Amplitudes that cannot be told are estimates of the shortest windows: their peaks tell which harmonic is near.
    """
    orders = mesh_orders(data, stage if exciting is None else exciting, harmonics=harmonics)
    return cut_of(signal(data, "dte", stage=stage), orders)


def separated_order_cut(data: xr.Dataset, stage: int, *, harmonics: int) -> xr.Dataset:
    """Order cut of a stage at its mesh harmonics, NaN where they cannot be told, or not from those of other stages."""
    dte, orders = signal(data, "dte", stage=stage), mesh_orders(data, stage, harmonics=harmonics)
    every = [mesh_orders(data, number, harmonics=harmonics) for number in range(data["stage"].size)]
    others = np.setdiff1d(np.concatenate(every), orders)
    joint = joint_cut(dte, tuple(np.union1d(orders, others))) if others.size else None
    if joint is not None:
        return joint.sel(order=orders)
    cut = told(cut_of(dte, orders))
    distance = np.abs(np.subtract.outer(orders, others)).min(axis=1, initial=np.inf)
    return cut.where(xr.DataArray(distance, dims="order") >= cut["resolution"])


def _peaks(frequency: np.ndarray, amplitude: np.ndarray) -> Peaks:
    """Peaks of an order cut, as far as it has amplitudes."""
    valid = np.isfinite(amplitude)
    if valid.sum() < 3 or amplitude[valid].max() == 0:
        return Peaks(np.zeros(0), np.zeros(0))
    return peaks(frequency[valid], amplitude[valid], PROMINENCE)


def resonance_table(run, stage: int | str = 0, **options) -> xr.Dataset:
    """Deprecated name of `resonances`."""
    table = resonances(run, stage, **options)
    warn_renamed("resonance_table", "exugear.resonances")
    return table
