"""Plots of periodic steady states: branches over the mesh frequency, with their stability and their bifurcations."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from exugear.plots.figures import DISTINCT, axes_or_new, check_result, legend, load_of, merged, styled
from exugear.signals.envelope import dte_envelope
from fem.support.arguments import checked
from fem.support.validation import require
from fem.units import um

__all__ = ["plot_branches"]

SWEPT = "#bbbbbb"
#: Axis label of each quantity.
QUANTITIES = {"rms": "rms of the DTE [µm]", "peak_to_peak": "peak to peak of the DTE [µm]"}
#: Marks of bifurcations and colours of branches by their period.
MARKS, COLOURS = {"fold": "o", "period doubling": "D"}, {1: DISTINCT[0], 2: DISTINCT[3]}
PERIODS = {1: "one {} period", 2: "two {} periods"}


@checked
@styled
def plot_branches(
    data: xr.Dataset,
    ax: Axes | None = None,
    quantity: str = "rms",
    *,
    harmonic: float | None = None,
    run=None,
    stage: int | str = 0,
    **style,
) -> Axes:
    """Branches of periodic steady states over the mesh frequency: stable ones solid, unstable ones dashed.

    data       of `exugear.steady_states`
    quantity   "rms" or "peak_to_peak" of the DTE
    harmonic   multiple of the mesh frequency whose amplitude is drawn instead of the quantity
    run        `exugear.Run`, or its data, of a slow sweep under the same load whose envelope lies behind the branches
    stage      number or label of the stage of the run
    style      of matplotlib's plot, for all branches
    """
    check_result("data", data, ("bifurcation",), "exugear.steady_states(...)")
    require("stage" not in data.dims, f"data must be of a single stage, got {data.sizes}; take data.isel(stage=0)")
    require(quantity in QUANTITIES, f"quantity must be one of {list(QUANTITIES)}, got {quantity!r}")
    orders = data["harmonic"].values.tolist()
    require(harmonic is None or harmonic in orders, f"harmonic must be one of {orders}, got {harmonic}")
    ax = axes_or_new(ax)
    values = data[quantity] if harmonic is None else data["harmonics"].sel(harmonic=harmonic)
    if run is not None:
        require(harmonic is None, f"harmonic must be None beside a run, whose harmonics are not known, got {harmonic}")
        _draw_sweep(ax, run, stage, quantity)
    for number in np.unique(data["branch"]):
        points = np.flatnonzero(data["branch"].values == number)
        _draw_branch(ax, data.isel(point=points), values.values[points] / um, style)
    _mark_bifurcations(ax, data, values.values / um)
    label = QUANTITIES[quantity] if harmonic is None else f"amplitude of the DTE at {harmonic:g} x mesh frequency [µm]"
    ax.set(xlabel="mesh frequency [Hz]", ylabel=label, title=f"{_stage_of(data)}, {load_of(data)}")
    ax.set_ylim(bottom=0, auto=True)
    handles, labels = ax.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    legend(ax, handles=list(once.values()), labels=list(once))
    return ax


def _stage_of(data: xr.Dataset) -> str:
    """Label of the stage of the data."""
    return str(data["stage"].item()) if "stage" in data.coords else str(data.attrs["stage"])


def _mark_bifurcations(ax: Axes, data: xr.Dataset, values: np.ndarray) -> None:
    """Mark folds and period doublings at the values of their points."""
    for kind, mark in MARKS.items():
        met = np.flatnonzero(data["bifurcation"].values == kind)
        if met.size:
            frequency = data["mesh_frequency"].values[met]
            ax.plot(frequency, values[met], mark, color="k", markerfacecolor="w", markersize=5, label=kind)


def _draw_sweep(ax: Axes, run, stage: int | str, quantity: str) -> None:
    """Draw the envelope of a run."""
    outline = dte_envelope(run, stage)
    height = outline.rms if quantity == "rms" else outline.high - outline.low
    ax.plot(outline.abscissa, height / um, color=SWEPT, linewidth=4, label="swept")


def _draw_branch(ax: Axes, points: xr.Dataset, values: np.ndarray, style: dict[str, Any]) -> None:
    """Draw the pieces of a branch between changes of its stability."""
    frequency, stable = points["mesh_frequency"].values, points["stable"].values
    number = f"branch {int(points['branch'][0])} has a single one"
    require(frequency.size > 1, f"states must have two points or more in every branch, {number}; select whole branches")
    period = int(points["period"][0])
    about = PERIODS[period].format("mesh" if points.attrs["common_period"] == 1 else "common")
    between = stable[:-1] | stable[1:]
    between &= ~((points["bifurcation"].values[:-1] != "") & ~stable[1:])
    between &= ~((points["bifurcation"].values[1:] != "") & ~stable[:-1])
    starts = np.flatnonzero(np.diff(between, prepend=~between[:1]))
    for start, end in zip(starts, [*starts[1:], between.size], strict=True):
        linestyle, state = ("-", "stable") if between[start] else ("--", "unstable")
        piece, label = slice(start, end + 1), f"{state}, {about}"
        options = merged(style, color=COLOURS[period], linestyle=linestyle, linewidth=1.3, label=label)
        ax.plot(frequency[piece], values[piece], **options)
