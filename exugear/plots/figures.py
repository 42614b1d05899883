"""Axes and figures of plots, and colours that remain distinct in print and for the colour-blind."""

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fem.support.arguments import checked

#: Blue, orange, green, vermilion, purple: distinct for the colour-blind. Source: Okabe and Ito, Color universal design.
DISTINCT = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7"


def axes_or_new(ax: Axes | None, **projection) -> Axes:
    """The given axes, or those of a new figure."""
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.figure(figsize=(8, 4.5), layout="constrained").add_subplot(**projection)


@checked
def figure(rows: int = 1, columns: int = 1, spatial: tuple[int, ...] = ()) -> Figure:
    """Empty figure for a report; the axes numbered in spatial are three-dimensional."""
    empty = Figure(figsize=(5.2 * columns, 3.5 * rows), layout="constrained")
    for i in range(rows * columns):
        empty.add_subplot(rows, columns, i + 1, projection="3d" if i in spatial else None)
    return empty


def title_of(data: xr.Dataset) -> str:
    """Name of the stage, and the load where it is constant."""
    stage = str(data["stage"].item())
    try:
        return f"{stage}, {float(data.attrs['load']):.4g} N m"
    except (KeyError, ValueError):
        return stage
