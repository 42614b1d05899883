"""Plots of orders: amplitude of a signal over speed and mesh order."""

import numpy as np
from matplotlib.axes import Axes

from exugear.integration.run_data import stage_data
from exugear.plots.figures import axes_or_new, title_of
from exugear.signals.spectrum import order_spectrum
from fem.support.arguments import Finite, checked
from fem.units import rpm, um

__all__ = ["plot_waterfall"]

#: Length of a line of an order map [mesh cycles], and its largest share of the run.
CYCLES, SHARE = 400, 1 / 20


@checked
def plot_waterfall(
    run, ax: Axes | None = None, stage: int = 0, harmonics: Finite = 3.2, decibels: Finite = 60.0
) -> Axes:
    """Order map of the DTE of one stage: amplitude over speed and mesh order.

    harmonics   highest mesh order shown
    decibels    range of amplitudes shown, down from the highest one

    Lines that cross the orders obliquely are harmonics that the steps of the run alias; a smaller `tolerance` of
    `exugear.run_up` removes them.
    """
    ax, data = axes_or_new(ax), stage_data(run, stage)
    time, speed, frequency = (data[name].values for name in ("time", "speed", "mesh_frequency"))
    cycles = max(1, min(CYCLES, int(SHARE * np.trapezoid(frequency, time))))
    spectrum = order_spectrum(time, 2 * np.pi * frequency, data["dte"].values, orders=harmonics, revolutions=cycles)
    shaft = spectrum.speed * np.abs(speed).max() / (2 * np.pi * frequency.max())
    orders, amplitude = _visible(spectrum.order, spectrum.amplitude)
    level = 20 * np.log10(np.maximum(amplitude / um, 1e-9))
    top = level.max()
    limits = {"vmin": top - decibels, "vmax": top}
    picture = ax.pcolormesh(shaft / rpm, orders, level.T, cmap="magma_r", rasterized=True, **limits)
    ax.figure.colorbar(picture, ax=ax, label="DTE amplitude [dB re 1 µm]")
    ax.set(xlabel="speed of the driving shaft [rpm]", ylabel="mesh order")
    ax.set_title(f"order map, {title_of(data)}")
    return ax


def _visible(order: np.ndarray, amplitude: np.ndarray, lines: int = 120) -> tuple[np.ndarray, np.ndarray]:
    """Orders and amplitudes in groups of neighbouring orders, about as many as lines: mean order, largest amplitude."""
    share = max(1, order.size // lines)
    n = order.size // share * share
    middle = order[:n].reshape(-1, share).mean(axis=1)
    return middle, amplitude[:, :n].reshape(len(amplitude), -1, share).max(axis=2)
