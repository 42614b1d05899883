"""Resonances of a run with the mesh harmonic that excites each of them."""

from collections.abc import Callable
from functools import cache, partial
from typing import NamedTuple

import numpy as np
import xarray as xr

from exugear.integration.run_data import stage_data
from exugear.recordings.angle_sampling import REVOLUTION
from exugear.recordings.mesh_orders import mesh_orders
from exugear.recordings.signal import mesh_order, signal
from exugear.signals.order_cut import SEPARATION, cut_of
from exugear.signals.resonances import Resonances, resonances
from exugear.signals.run_envelopes import dte_envelope
from fem.support.arguments import checked
from fem.support.validation import require

#: Largest distance of a peak of an order cut from that of the envelope, as share of the frequency: half that of the
#: eighth and ninth superharmonic is 6 %.
NEAR = 0.04
#: Least prominence of a peak of an order cut, as share of its largest amplitude.
PROMINENCE = 0.05
#: Least amplitude of the harmonic as share of that of the envelope: on the paper's pair the least is a quarter, while
#: noise and tones beside the mesh orders leave a hundredth in an order cut.
SHARE = 0.1
#: Largest change of the speed in a window that tells close orders apart, as share of the speed.
SLEW = 0.15
#: Windows of an order cut in a run, at least; a window takes at most 4 revolutions.
WINDOWS = 200
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
    separation   distance from which on the windows of the cut tell orders apart
    """

    stage: int
    harmonic: int
    order: float
    separation: float
    peaks: Resonances

    def height(self, mesh_frequency: float) -> float:
        """Largest amplitude of a peak near a mesh frequency; 0 where none is near."""
        return self.peak(mesh_frequency)[1]

    def peak(self, mesh_frequency: float) -> tuple[float, float]:
        """Mesh frequency and amplitude of the largest peak near a mesh frequency; NaN and 0 where none is near."""
        near = np.abs(self.peaks.place / mesh_frequency - 1) < NEAR
        peaks = zip(self.peaks.place[near].tolist(), self.peaks.height[near].tolist(), strict=True)
        return max(peaks, key=lambda peak: peak[1], default=(np.nan, 0.0))


class Resonance(NamedTuple):
    """A row of the table: `VARIABLES`, and the number of the exciting stage."""

    mesh_frequency: float
    amplitude: float
    harmonic: int
    harmonic_amplitude: float
    response_frequency: float
    stage: int


@checked
def resonance_table(run, stage: int = 0, *, harmonics: int = 8, prominence: float = 0.004) -> xr.Dataset:
    """Resonances of the DTE of a stage along a run, with the mesh harmonic that excites each of them.

    run           an `exugear.Run` or its data, over a range of speeds
    harmonics     number of mesh harmonics of each stage that are examined
    prominence    least prominence of a peak of the envelope, as share of its largest amplitude

    A peak of the envelope is a resonance where the order cut of a mesh harmonic peaks within 4 % of its mesh frequency;
    of several harmonics, of this stage and of the others, the one with the largest amplitude counts, which must be a
    tenth of the envelope's or more. Other peaks are left out, and all but the highest of those at the same peak of a
    harmonic. Where the windows are too short to tell the orders of two stages apart, the amplitudes of a joint cut in
    longer windows at the peak decide, unless the speed changes by more than 15 % in such a window. The harmonics 2, 3,
    ... of the main resonance are its superharmonics: their response frequencies nearly agree.

    Returns a Dataset over peak with mesh_frequency [Hz], amplitude (half peak to peak) [m], exciting_stage, harmonic,
    harmonic_amplitude [m] and response_frequency [Hz].

    Raises ValueError for a run of less than 3 mesh cycles, and for numbers out of range.
    """
    require(1 <= harmonics <= HARMONICS, f"harmonics must lie in [1, {HARMONICS}], got {harmonics}")
    require(0 < prominence < 1, f"prominence must lie in (0, 1) as share of the largest amplitude, got {prominence}")
    outline = dte_envelope(run, stage)
    short = f"run must hold 3 mesh cycles or more for its resonances, got {outline.place.size}; run it longer"
    require(outline.place.size >= 3, short)
    peaks = resonances(outline.place, outline.amplitude, prominence)
    data = run if isinstance(run, xr.Dataset) else run.data
    stages = [stage, *(k for k in range(data["stage"].size) if k != stage % data["stage"].size)]
    cuts = [cut for exciting in stages for cut in _cuts(data, stage, exciting, harmonics)]
    of_orders = cache(partial(joint_cut, signal(data, "dte", stage=stage)))
    rows: dict[tuple, Resonance] = {}
    for frequency, height in sorted(zip(*peaks, strict=True), key=lambda peak: peak[1]):
        cut = max(cuts, key=lambda each: each.height(frequency))
        if cut.height(frequency) > SHARE * height:
            cut, amplitude = _separated_cut(cuts, cut, frequency, of_orders)
            ratio = mesh_order(stage_data(data, cut.stage)) / mesh_order(stage_data(data, stage))
            row = Resonance(frequency, height, cut.harmonic, amplitude, cut.harmonic * frequency * ratio, cut.stage)
            rows[cut.stage, cut.harmonic, cut.peak(frequency)[0]] = row
    return _labelled(sorted(rows.values()), data["stage"].values)


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
    frequency, orders = _mesh_frequency(cut), cut["order"].values
    separation = SEPARATION / _window(signal(data, "dte", stage=stage), orders[0])
    return [
        OrderPeaks(exciting, harmonic, float(order), separation, _peaks(frequency, amplitude))
        for harmonic, (order, amplitude) in enumerate(zip(orders, cut["amplitude"].values, strict=True), start=1)
    ]


def _separated_cut(
    cuts: list[OrderPeaks], largest: OrderPeaks, frequency: float, joint_cut: Callable[..., xr.Dataset | None]
) -> tuple[OrderPeaks, float]:
    """The cut whose order excites a peak at a mesh frequency [Hz], and the amplitude of the order [m].

    largest     the cut with the largest amplitude near the peak, to which close orders may contribute
    joint_cut   function (orders) -> their joint cut, or None
    """
    of_other_stages = [cut for cut in cuts if cut.stage != largest.stage and cut.height(frequency) > 0]
    near = [cut for cut in of_other_stages if abs(cut.order - largest.order) < max(cut.separation, largest.separation)]
    close = {cut.order: cut for cut in (*near, largest)}
    joint = joint_cut(tuple(sorted(close))) if len(close) > 1 else None
    if joint is not None:
        amplitude = joint["amplitude"].values[:, np.abs(_mesh_frequency(joint) / frequency - 1).argmin()]
        if np.isfinite(amplitude).all():
            return close[float(joint["order"][amplitude.argmax()])], float(amplitude.max())
    return largest, largest.height(frequency)


def joint_cut(dte: xr.DataArray, orders: tuple[float, ...]) -> xr.Dataset | None:
    """Order cut that tells close orders apart, NaN where the speed changes too much in a window; None in short runs."""
    window = SEPARATION / float(np.diff(orders).min())
    if 2 * window * REVOLUTION > float(dte["angle"][-1]):
        return None
    cut = cut_of(dte, orders, revolutions=window)
    speed = np.abs(cut["speed"].values)
    change = np.abs(np.gradient(speed, cut["angle"].values)) * window * REVOLUTION
    return cut.where(xr.DataArray(change <= SLEW * speed, dims="time"))


def _mesh_frequency(cut: xr.Dataset) -> np.ndarray:
    """(n_time,) mesh frequency [Hz] of the examined stage in an order cut."""
    return np.abs(cut["speed"].values) * float(cut["mesh_order"]) / (2 * np.pi)


def mesh_order_cut(data: xr.Dataset, stage: int, exciting: int | None = None, *, harmonics: int) -> xr.Dataset:
    """Order cut of the DTE of a stage at the mesh harmonics of an exciting stage, by default its own.

    At least `WINDOWS` windows divide the run, so that they are short beside the passage of a resonance.
    """
    dte = signal(data, "dte", stage=stage)
    orders = mesh_orders(data, stage if exciting is None else exciting, harmonics=harmonics)
    return cut_of(dte, orders, revolutions=_window(dte, orders[0]))


def separated_order_cut(data: xr.Dataset, stage: int, *, harmonics: int) -> xr.Dataset:
    """`mesh_order_cut` of a stage by itself, where windows can tell its orders from those of the other stages."""
    dte, orders = signal(data, "dte", stage=stage), mesh_orders(data, stage, harmonics=harmonics)
    of_stages = [mesh_orders(data, number, harmonics=harmonics) for number in range(data["stage"].size)]
    joint = joint_cut(dte, tuple(np.unique(of_stages))) if len(of_stages) > 1 else None
    return mesh_order_cut(data, stage, harmonics=harmonics) if joint is None else joint.sel(order=orders)


def _window(dte: xr.DataArray, order: float) -> float:
    """Length of the windows [revolutions] of a cut whose lowest order is this."""
    turned = float(dte["angle"][-1]) / REVOLUTION
    return float(np.clip(turned / WINDOWS, SEPARATION / order, max(SEPARATION, SEPARATION / order)))


def _peaks(frequency: np.ndarray, amplitude: np.ndarray) -> Resonances:
    """Peaks of an order cut, as far as it has amplitudes."""
    valid = np.isfinite(amplitude)
    if valid.sum() < 3 or amplitude[valid].max() == 0:
        return Resonances(np.zeros(0), np.zeros(0))
    return resonances(frequency[valid], amplitude[valid], PROMINENCE)
