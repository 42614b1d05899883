"""Plots of runs: DTE with its envelope, envelopes of several runs, bearing forces."""

from collections.abc import Mapping
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from exugear.integration.run_data import stage_data
from exugear.plots.figures import axes_or_new, title_of
from exugear.signals.spectrum import Envelope, Resonances, bearing_force_rms, dte_envelope
from fem.support.arguments import checked
from fem.units import rpm, um

__all__ = ["plot_bearing_forces", "plot_envelopes", "plot_run_up"]

TRACE, EDGE, MARK = "#9ecae1", "#08519c", "#cb181d"


@checked
def plot_run_up(run, ax: Axes | None = None, stage: int = 0, found: Resonances | None = None) -> Axes:
    """Dynamic transmission error of one stage over its mesh frequency, with its envelope.

    run     an `exugear.Run` or its data, as in all plots of runs
    found   `Resonances` to be marked, as `exugear.resonances` finds them in the envelope
    """
    ax, data = axes_or_new(ax), stage_data(run, stage)
    outline = dte_envelope(run, stage)
    ax.fill_between(outline.place, outline.low / um, outline.high / um, color=TRACE, linewidth=0)
    for side in (outline.high, outline.low):
        ax.plot(outline.place, side / um, color=EDGE, linewidth=1.2)
    if found is not None:
        _mark(ax, outline, found)
    ends = outline.place.min(), outline.place.max()
    ax.set(xlabel="mesh frequency [Hz]", ylabel="dynamic transmission error [µm]", title=title_of(data))
    ax.set_xlim(*ends if ends[0] < ends[1] else (None, None))
    ax.grid(alpha=0.3)
    return ax


@checked
def plot_envelopes(runs: Mapping[str, Any], ax: Axes | None = None, stage: int = 0) -> Axes:
    """Half peak to peak of the DTE of several runs over mesh frequency; runs: name -> `exugear.Run` or its data."""
    ax = axes_or_new(ax)
    for (name, run), style in zip(runs.items(), cycle(("-", "--", ":")), strict=False):
        outline = dte_envelope(run, stage)
        ax.plot(outline.place, outline.amplitude / um, style, linewidth=1.4, label=name)
    ax.set(xlabel="mesh frequency [Hz]", ylabel="half peak to peak of the DTE [µm]")
    ax.set_ylim(bottom=0, auto=True)
    ax.legend()
    ax.grid(alpha=0.3)
    return ax


@checked
def plot_bearing_forces(run, ax: Axes | None = None) -> Axes:
    """Root mean square of the varying part of each bearing's radial force over the speed of the driving shaft."""
    ax, forces = axes_or_new(ax), bearing_force_rms(run)
    for name, row in zip(forces["bearing"].values, forces.values, strict=True):
        ax.plot(forces["speed"] / rpm, row, linewidth=1.2, label=str(name))
    ax.set(xlabel="speed of the driving shaft [rpm]", ylabel="rms of the varying radial force [N]")
    ax.set_ylim(bottom=0, auto=True)
    ax.legend(frameon=False, fontsize="small")
    ax.grid(alpha=0.3)
    return ax


def _mark(ax: Axes, outline: Envelope, resonances: Resonances) -> None:
    """Mark resonances on the envelope, with room for their frequencies inside the frame."""
    order = np.argsort(outline.place)
    heights = np.interp(resonances.place, outline.place[order], outline.high[order]) / um
    ax.plot(resonances.place, heights, "v", color=MARK, markersize=5)
    low, high = outline.low.min() / um, outline.high.max() / um
    ax.set_ylim(low - 0.05 * (high - low), high + 0.45 * (high - low))
    for frequency, height in zip(resonances.place, heights, strict=True):
        text = ax.annotate(f"{frequency:.0f} Hz", (frequency, height), (0, 7), textcoords="offset points", color=MARK)
        text.set(rotation=90, ha="center", fontsize="small")
