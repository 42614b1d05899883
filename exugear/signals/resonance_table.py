"""Resonances of a run with the mesh harmonic that excites each of them."""

from typing import NamedTuple

import numpy as np
import xarray as xr

from exugear.integration.run_data import stage_data
from exugear.recordings.mesh_orders import mesh_orders
from exugear.recordings.signal import mesh_order, signal
from exugear.signals.order_cut import SEPARATION, order_cut
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
    """Peaks of the order cut of a mesh harmonic over the mesh frequency [Hz] of the examined stage."""

    stage: int
    harmonic: int
    peaks: Resonances

    def height(self, mesh_frequency: float) -> float:
        """Largest amplitude of a peak near a mesh frequency; 0 where none is near."""
        near = np.abs(self.peaks.place / mesh_frequency - 1) < NEAR
        return float(self.peaks.height[near].max(initial=0.0))


@checked
def resonance_table(run, stage: int = 0, *, harmonics: int = 8, prominence: float = 0.004) -> xr.Dataset:
    """Resonances of the DTE of a stage along a run, with the mesh harmonic that excites each of them.

    run           an `exugear.Run` or its data, over a range of speeds
    harmonics     number of mesh harmonics of each stage that are examined
    prominence    least prominence of a peak of the envelope, as share of its largest amplitude

    A peak of the envelope is a resonance where the order cut of a mesh harmonic peaks within 4 % of its mesh frequency;
    of several harmonics, of this stage and of the others, the one with the largest amplitude counts, which must be a
    tenth of the envelope's or more. Other peaks are left out. The harmonics 2, 3, ... of the main resonance are its
    superharmonics: their response frequencies nearly agree.

    Returns a Dataset over peak with mesh_frequency [Hz], amplitude (half peak to peak) [m], exciting_stage, harmonic,
    harmonic_amplitude [m] and response_frequency [Hz].
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
    rows, labels = [], []
    for frequency, height in zip(*peaks, strict=True):
        cut = max(cuts, key=lambda each: each.height(frequency))
        if cut.height(frequency) > SHARE * height:
            ratio = mesh_order(stage_data(data, cut.stage)) / mesh_order(stage_data(data, stage))
            response = cut.harmonic * frequency * ratio
            rows.append((frequency, height, cut.harmonic, cut.height(frequency), response))
            labels.append(str(data["stage"].values[cut.stage]))
    return _labelled(rows, labels)


def _labelled(rows: list[tuple], exciting_stages: list[str]) -> xr.Dataset:
    columns = np.array(rows).reshape(-1, len(VARIABLES)).T
    table = xr.Dataset(
        {
            name: ("peak", values, {"units": units, "long_name": long_name})
            for (name, (units, long_name)), values in zip(VARIABLES.items(), columns, strict=True)
        }
    )
    return table.assign(harmonic=table["harmonic"].astype(int), exciting_stage=("peak", np.array(exciting_stages, str)))


def _cuts(data: xr.Dataset, stage: int, exciting: int, harmonics: int) -> list[OrderPeaks]:
    """Peaks of the DTE of a stage at each mesh harmonic of an exciting stage."""
    cut = mesh_order_cut(data, stage, exciting, harmonics=harmonics)
    frequency = np.abs(cut["speed"].values) * mesh_order(stage_data(data, stage)) / (2 * np.pi)
    amplitudes = enumerate(cut["amplitude"].values, start=1)
    return [OrderPeaks(exciting, harmonic, _peaks(frequency, amplitude)) for harmonic, amplitude in amplitudes]


def mesh_order_cut(data: xr.Dataset, stage: int, exciting: int | None = None, *, harmonics: int) -> xr.Dataset:
    """Order cut of the DTE of a stage at the mesh harmonics of an exciting stage, by default its own.

    At least `WINDOWS` windows divide the run, so that they are short beside the passage of a resonance.
    """
    dte = signal(data, "dte", stage=stage)
    orders = mesh_orders(data, stage if exciting is None else exciting, harmonics=harmonics)
    turned = float(dte["angle"][-1]) / (2 * np.pi)
    length = float(np.clip(turned / WINDOWS, SEPARATION / orders[0], max(SEPARATION, SEPARATION / orders[0])))
    return order_cut(dte, orders, revolutions=length)


def _peaks(frequency: np.ndarray, amplitude: np.ndarray) -> Resonances:
    """Peaks of an order cut, as far as it has amplitudes."""
    valid = np.isfinite(amplitude)
    if valid.sum() < 3 or amplitude[valid].max() == 0:
        return Resonances(np.zeros(0), np.zeros(0))
    return resonances(frequency[valid], amplitude[valid], PROMINENCE)
