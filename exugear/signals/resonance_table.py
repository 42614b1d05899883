"""Resonances of a run with the mesh harmonic that excites each of them."""

import numpy as np
import xarray as xr

from exugear.recordings.mesh_orders import mesh_orders
from exugear.recordings.signal import signal
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
VARIABLES = {
    "mesh_frequency": ("Hz", "mesh frequency of the resonance"),
    "amplitude": ("m", "half peak to peak of the DTE"),
    "harmonic": ("1", "mesh harmonic that excites the resonance"),
    "harmonic_amplitude": ("m", "amplitude of the mesh harmonic in the DTE"),
    "response_frequency": ("Hz", "frequency of the vibration: harmonic times mesh frequency"),
}


@checked
def resonance_table(run, stage: int = 0, *, harmonics: int = 8, prominence: float = 0.004) -> xr.Dataset:
    """Resonances of the DTE of a stage along a run, with the mesh harmonic that excites each of them.

    run           an `exugear.Run` or its data, over a range of speeds
    harmonics     number of mesh harmonics that are examined
    prominence    least prominence of a peak of the envelope, as share of its largest amplitude

    A peak of the envelope is a resonance where the order cut of a mesh harmonic peaks within 4 % of its mesh frequency;
    of several harmonics the one with the largest amplitude counts, which must be a tenth of the envelope's or more.
    Other peaks are left out. The harmonics 2, 3, ... of
    the main resonance are its superharmonics: their response frequencies nearly agree.

    Returns a Dataset over peak with mesh_frequency [Hz], amplitude (half peak to peak) [m], harmonic,
    harmonic_amplitude [m] and response_frequency [Hz].
    """
    require(0 < prominence < 1, f"prominence must lie in (0, 1) as share of the largest amplitude, got {prominence}")
    outline = dte_envelope(run, stage)
    peaks = resonances(outline.place, outline.amplitude, prominence)
    cuts = _peaks_of_harmonics(run, stage, harmonics)
    rows = [(f, height, *_strongest(cuts, f)) for f, height in zip(peaks.place, peaks.height, strict=True)]
    columns = (
        np.array([(*row, row[0] * row[2]) for row in rows if row[3] > SHARE * row[1]]).reshape(-1, len(VARIABLES)).T
    )
    table = xr.Dataset(
        {
            name: ("peak", values, {"units": units, "long_name": long_name})
            for (name, (units, long_name)), values in zip(VARIABLES.items(), columns, strict=True)
        }
    )
    return table.assign(harmonic=table["harmonic"].astype(int))


def _peaks_of_harmonics(run, stage: int, harmonics: int) -> list[Resonances]:
    """Peaks of the order cut of each mesh harmonic over the mesh frequency [Hz]."""
    dte, orders = signal(run, "dte", stage=stage), mesh_orders(run, stage, harmonics=harmonics)
    turned = float(dte["angle"][-1]) / (2 * np.pi)
    length = float(np.clip(turned / WINDOWS, SEPARATION / orders[0], SEPARATION))
    cut = order_cut(dte, orders, revolutions=length)
    frequency = np.abs(cut["speed"].values) * float(dte["mesh_order"]) / (2 * np.pi)
    peaks = []
    for amplitude in cut["amplitude"].values:
        valid = np.isfinite(amplitude)
        enough = valid.sum() >= 3 and amplitude[valid].max() > 0
        none = Resonances(np.zeros(0), np.zeros(0))
        peaks.append(resonances(frequency[valid], amplitude[valid], PROMINENCE) if enough else none)
    return peaks


def _strongest(cuts: list[Resonances], mesh_frequency: float) -> tuple[int, float]:
    """Number and amplitude of the harmonic with the largest peak near a mesh frequency; (0, 0) where none is near."""
    amplitudes = [cut.height[np.abs(cut.place / mesh_frequency - 1) < NEAR].max(initial=0.0) for cut in cuts]
    return (1 + int(np.argmax(amplitudes)), float(max(amplitudes))) if max(amplitudes) > 0 else (0, 0.0)
