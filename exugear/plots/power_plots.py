"""Plots of power: efficiency over speed and load, and the losses of a run."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.ticker import MaxNLocator

from exugear.plots.figures import DISTINCT, axes_or_new, colour_bar, legend, styled
from exugear.running.energy_balance import LOSSES
from exugear.running.run_data import stage_data
from fem.support.arguments import checked
from fem.support.validation import require
from fem.units import rpm

__all__ = ["plot_efficiency", "plot_power"]

#: Largest number of windows in which the losses of a run are averaged; mesh cycles up to which they are shown within
#: the cycle.
WINDOWS, SHOWN_CYCLES = 300, 16
#: Losses [%] between whose decades the contours lie, as efficiency falls quickly towards light loads; least number of
#: such contours, else they are equidistant.
DECADE, FEWEST = np.array([1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0]), 4
#: Colours of the contours from low to high efficiency, light enough for black lines and labels.
COLOURS = ListedColormap(colormaps["YlGnBu_r"](np.linspace(0.4, 1.0, 256)))
#: Words for the kinds of loss.
KINDS = {
    "mesh": "mesh damping",
    "bearing": "bearing damping",
    "coupling": "coupling damping",
    "friction": "tooth friction",
    "drag": "shaft drag",
}


@checked
@styled
def plot_efficiency(data: xr.Dataset, ax: Axes | None = None, **style) -> Axes:
    """Contours of the efficiency over speed and load; dots mark the solved points, crosses those that stopped.

    data    as `exugear.efficiency` returns it, over at least two speeds and two loads
    style   of matplotlib's contourf: levels [%] or their number, cmap, …

    Raises ValueError for other data, and where no point was solved.
    """
    values = _efficiency(data)
    ax, speeds, loads = axes_or_new(ax), data["speed"].values / rpm, data["load"].values
    solved = np.isfinite(values)
    require(bool(solved.any()), f"data must hold a solved point, all stopped: {data['stopped'].values.flat[0]}")
    options: dict[str, Any] = {"cmap": COLOURS} | style
    if "levels" not in style:
        levels = _levels(values[solved])
        options |= {"levels": levels, "norm": BoundaryNorm(levels, 256)}
    filled = ax.contourf(speeds, loads, values.T, **options)
    lines = ax.contour(speeds, loads, values.T, levels=filled.levels, colors="k", linewidths=0.6)
    ax.clabel(lines, fmt="%g %%", fontsize="x-small", inline_spacing=2)
    x, y = (grid.T for grid in np.meshgrid(speeds, loads))
    ax.plot(x[solved], y[solved], "k.", markersize=3, clip_on=False)
    ax.plot(x[~solved], y[~solved], "kx", markersize=5, clip_on=False)
    colour_bar(ax, filled, "efficiency [%]", format="%g", ticks=filled.levels)
    ax.set(xlabel="speed of the driving shaft [rpm]", ylabel="load on the driven shaft [N m]")
    return ax


def _efficiency(data: xr.Dataset) -> np.ndarray:
    """(n_speed, n_load) efficiency [%]; ValueError for data without it or of a single row."""
    is_map = {"efficiency", "stopped"} <= set(data) and set(data["efficiency"].dims) == {"speed", "load"}
    require(is_map, "data must be an efficiency over speed and load; pass what exugear.efficiency returns")
    values = data["efficiency"].transpose("speed", "load").values * 100
    require(min(values.shape) > 1, f"data must hold two speeds and two loads at least, got {values.shape}")
    return values


def _levels(values: np.ndarray) -> np.ndarray:
    """Rising levels [%] for efficiencies (n,) [%]."""
    low, high = 100 - values.max(), 100 - values.min()
    losses = np.outer(10.0 ** np.arange(-2, 2), DECADE).ravel()
    first, last = np.searchsorted(losses, low, side="right") - 1, np.searchsorted(losses, high)
    if first < 0 or last == losses.size or last - first < FEWEST:
        return np.array(MaxNLocator(2 * FEWEST, steps=[1, 2, 2.5, 5, 10]).tick_values(values.min(), values.max()))
    return np.round(100 - losses[first : last + 1][::-1], 10)


@checked
@styled
def plot_power(run, ax: Axes | None = None, **style) -> Axes:
    """Losses of a run by kind, stacked: over the speed where it only rises or only falls, else over time.

    run     an `exugear.Run` with power=True, or its data
    style   of matplotlib's stackplot: colors, alpha, …

    The losses are means over equal parts of the run, 300 at most, each of about a mesh cycle or more unless the run is
    shorter than 16 cycles. Raises ValueError for a run without powers.
    """
    data = stage_data(run)
    require("mesh_loss" in data, "run must have powers; run it with power=True")
    data = run if isinstance(run, xr.Dataset) else run.data
    ax, part = axes_or_new(ax), -(-data["time"].size // _windows(data))
    means = data[["speed", *[name for name in LOSSES if name in data]]].coarsen(time=part, boundary="trim").mean()
    change = np.diff(means["speed"].values)
    over_speed = bool((change > 0).all() or (change < 0).all())
    abscissa = means["speed"].values / rpm if over_speed else means["time"].values
    kinds = {name.removesuffix("_loss"): _total(means[name]) for name in LOSSES if name in means}
    colours = dict(zip(KINDS, DISTINCT, strict=True))
    stack: dict[str, Any] = {
        "labels": [KINDS[kind] for kind in kinds],
        "colors": [colours[kind] for kind in kinds],
        "linewidth": 0,
    }
    ax.stackplot(abscissa, *kinds.values(), **stack | style)
    words = "speed of the driving shaft [rpm]" if over_speed else "time [s]"
    ax.set(xlabel=words, ylabel="dissipated power [W]", xlim=(abscissa.min(), abscissa.max()))
    ax.set_ylim(bottom=0, auto=True)
    handles, labels = ax.get_legend_handles_labels()
    legend(ax, handles=handles[::-1], labels=labels[::-1])
    return ax


def _windows(data: xr.Dataset) -> int:
    """Number of windows in which losses are averaged."""
    cycles = int(data["mesh_frequency"].min("stage").integrate("time"))
    return min(WINDOWS, cycles) if cycles > SHOWN_CYCLES else WINDOWS


def _total(loss: xr.DataArray) -> np.ndarray:
    """(n_time,) sum over all meshes, bearings, couplings or shafts."""
    return loss.sum([name for name in loss.dims if name != "time"]).values
