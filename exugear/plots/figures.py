"""Figures, axes and legends of plots in one style, with colours that the colour-blind tell apart."""

from collections.abc import Callable, Sequence
from functools import wraps
from textwrap import fill
from typing import Any, TypeVar, cast

import numpy as np
import xarray as xr
from cycler import cycler
from matplotlib import colormaps, rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cbook import normalize_kwargs
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fem.support.arguments import checked
from fem.support.validation import require

Plot = TypeVar("Plot", bound=Callable)
#: Blue, orange, green, vermilion, purple: distinct for the colour-blind. Source: Okabe and Ito, Color universal design.
DISTINCT = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7"
#: Grey of lines that mark a value.
GUIDE = "0.35"
#: Letters [pt]: those of a figure 8 in wide are 8.7 pt high where it is printed 160 mm wide.
LETTERS = 11
#: Letters in a line of the label of a colour bar: those of the height of axes of half the width of a page.
LABEL_LENGTH = 30
GRID = {"color": "0.88", "linewidth": 0.7}
#: matplotlib's settings while a plot is drawn.
STYLE: dict[Any, Any] = {
    "font.size": LETTERS,
    "axes.titlesize": LETTERS,
    "axes.prop_cycle": cycler(color=DISTINCT),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "legend.fontsize": LETTERS - 1,
    "legend.title_fontsize": LETTERS - 1,
    "lines.linewidth": 1.6,
    "lines.markersize": 4.0,
}


def styled(plot: Plot) -> Plot:
    """Decorator of a plot: it draws with `STYLE`, which leaves the user's settings of matplotlib as they are."""

    @wraps(plot)
    def drawn(*args, **kwargs):
        with rc_context(STYLE):
            return plot(*args, **kwargs)

    return cast(Plot, drawn)


def add_axes(figure: Figure, *position: int, **projection) -> Axes:
    """Axes of a figure in the style of all plots."""
    with rc_context(STYLE):
        ax = figure.add_subplot(*position, **projection)
    ax.tick_params(labelsize=LETTERS - 1)
    if ax.name == "rectilinear":
        ax.grid(**GRID)
    return ax


def axes_or_new(ax: Axes | None, **projection) -> Axes:
    """The given axes, or those of a new figure."""
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return add_axes(pyplot.figure(figsize=(8, 4.5), layout="constrained"), **projection)


@checked
def figure(rows: int = 1, columns: int = 1, spatial: tuple[int, ...] = ()) -> Figure:
    """Empty figure for a report; the axes numbered in spatial are three-dimensional."""
    empty = Figure(figsize=(5.2 * columns, 3.5 * rows), layout="constrained")
    for i in range(rows * columns):
        add_axes(empty, rows, columns, i + 1, projection="3d" if i in spatial else None)
    return empty


def merged(style: dict[str, Any], artist: type[Artist] = Line2D, **defaults) -> dict[str, Any]:
    """Properties of an artist: the defaults, replaced by the user's style, in which matplotlib's short names count."""
    return defaults | normalize_kwargs(style, artist)


def check_result(argument: str, data: xr.Dataset, names: Sequence[str], source: str) -> None:
    """ValueError unless a data set has variables of these names, as the function that returns it gives them."""
    known = set(names) <= set(data.variables)
    require(known, f"{argument} must have {' and '.join(names)}; pass what {source} returned")


def legend(ax: Axes, **options) -> None:
    """Legend beside the axes, where it covers no data; none if nothing is labelled.

    In a figure without a layout engine, which would cut it off, it stands where it covers least.
    """
    if ax.get_legend_handles_labels()[1]:
        beside = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)} if ax.figure.get_layout_engine() else {}
        ax.legend(**beside | options)


def finished(ax: Axes, **axis) -> Axes:
    """The axes of curves that begin at 0, with a legend; axis: their labels and limits, as of matplotlib's set."""
    ax.set(**axis)
    ax.set_ylim(bottom=0, auto=True)
    legend(ax)
    return ax


def colour_bar(ax: Axes, picture, label: str, **options) -> None:
    """Colour bar of a picture beside its axes."""
    bar = ax.figure.colorbar(picture, ax=ax, label=fill(label, LABEL_LENGTH), **options)
    bar.ax.tick_params(labelsize=LETTERS - 1)
    bar.outline.set_visible(False)


def graded(values: np.ndarray) -> np.ndarray:
    """(n, 4) colours of curves over increasing values (n,), from dark to light."""
    return colormaps["viridis"](np.linspace(0, 0.85, len(values)))


def title_of(data: xr.Dataset) -> str:
    """Name of the stage, and the load, or the loads of several shafts, where they are constant."""
    return ", ".join(filter(None, (str(data["stage"].item()), load_of(data))))


def load_of(data: xr.Dataset) -> str:
    """Constant load, or loads of several shafts, in words; empty where they change."""
    if "loaded_shafts" in data.attrs:
        loads = zip(*(np.atleast_1d(data.attrs[name]) for name in ("loads", "loaded_shafts")), strict=True)
        return ", ".join(f"{torque:.4g} N m on {shaft}" for torque, shaft in loads)
    try:
        return f"{float(data.attrs['load']):.4g} N m"
    except (KeyError, ValueError, TypeError):
        return ""
