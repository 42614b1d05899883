"""Plots of the load over the faces of a gearbox with elastic shafts: line loads, deflections, bearing forces."""

from itertools import cycle

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from exugear.plots.figures import DISTINCT, GUIDE, axes_or_new, finished, legend, merged, styled
from fem.support.arguments import checked
from fem.support.validation import require
from fem.units import mm, um

__all__ = ["plot_bearing_loads", "plot_line_load", "plot_shaft_deflection"]

MISSING = "data must be what exugear.load_distribution returns"


@checked
@styled
def plot_line_load(data: xr.Dataset, ax: Axes | None = None, *, mesh: str | None = None, **style) -> Axes:
    """Line load over the face of each mesh, over its mean, with the face load factors in the legend.

    data    as `exugear.load_distribution` returns it
    mesh    label of a stage; by default all
    style   of matplotlib's plot
    """
    require("line_load" in data and "K_H_beta_B" in data, MISSING)
    labels = data["mesh"].values.tolist() if mesh is None else [mesh]
    require(set(labels) <= {*data["mesh"].values}, f"mesh must be one of {data['mesh'].values.tolist()}, got {mesh!r}")
    ax = axes_or_new(ax)
    for label, colour in zip(labels, cycle(DISTINCT), strict=False):
        of_mesh = data.sel(mesh=label)
        load, width = of_mesh["line_load"].values, float(of_mesh["width"])
        if not load.any():
            continue
        factors = f"$K_{{H\\beta}}$ {float(of_mesh['K_H_beta']):.3g}, method B {float(of_mesh['K_H_beta_B']):.3g}"
        shown = merged(style, color=colour, label=f"{label}\n{factors}")
        ax.plot(data["face"].values * width / mm, load / load.mean(), **shown)
    ax.axhline(1.0, color=GUIDE, linewidth=0.8, linestyle="--")
    return finished(ax, xlabel="axial position from the middle of the face [mm]", ylabel="line load over its mean")


@checked
@styled
def plot_shaft_deflection(
    data: xr.Dataset, ax: Axes | None = None, *, direction: str = "x", shaft: str | None = None, **style
) -> Axes:
    """Deflection lines of the shafts, with their bearings as triangles.

    data        as `exugear.load_distribution` returns it
    direction   "x", "y" or "z"
    shaft       name of a shaft; by default all
    style       of matplotlib's plot
    """
    require("deflection" in data and "bearing_force" in data, MISSING)
    require(direction in ("x", "y", "z"), f"direction must be 'x', 'y' or 'z', got {direction!r}")
    names = data["shaft"].values.tolist() if shaft is None else [shaft]
    require(
        set(names) <= {*data["shaft"].values}, f"shaft must be one of {data['shaft'].values.tolist()}, got {shaft!r}"
    )
    ax = axes_or_new(ax)
    for name, colour in zip(names, cycle(DISTINCT), strict=False):
        of_shaft = data.sel(shaft=name)
        axial, moved = of_shaft["axial"].values, of_shaft["deflection"].sel(direction=direction).values
        ax.plot(axial / mm, moved / um, **merged(style, color=colour, label=str(name)))
        at = data["bearing_axial"].values[data["bearing_shaft"].values == name]
        on_axis = np.interp(at, axial, moved) / um
        ax.plot(at / mm, on_axis, "^", color=colour, markersize=8, linestyle="none")
    ax.axhline(0.0, color=GUIDE, linewidth=0.8, linestyle="--")
    ax.set(xlabel="axial position on the shaft [mm]", ylabel=f"deflection in {direction} [µm]")
    legend(ax)
    return ax


@checked
@styled
def plot_bearing_loads(data: xr.Dataset, ax: Axes | None = None, **style) -> Axes:
    """Radial and axial force of every bearing on its shaft, as bars.

    data    as `exugear.load_distribution` returns it
    style   of matplotlib's bar
    """
    require("bearing_force" in data and "bearing_axial" in data, MISSING)
    ax, force = axes_or_new(ax), data["bearing_force"]
    radial = np.hypot(*(force.sel(direction=name).values for name in ("x", "y"))) / 1e3
    axial = np.abs(force.sel(direction="z").values) / 1e3
    at = np.arange(radial.size)
    for shift, values, colour, label in ((-0.2, radial, DISTINCT[0], "radial"), (0.2, axial, DISTINCT[1], "axial")):
        ax.bar(at + shift, values, **merged(style, Rectangle, width=0.38, color=colour, label=label))
    ax.set_xticks(at, [str(name).replace(" at ", "\nat ") for name in data["bearing"].values])
    ax.set(ylabel="bearing force [kN]")
    legend(ax)
    return ax
