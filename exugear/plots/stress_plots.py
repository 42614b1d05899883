"""Plots of stress: fields of meshing gears on their meshes, root stress and pressure over the mesh cycle.

A body is a tuple (points (2, n) [m], cells (3, n_cell)) or (points, cells, values (n,)); all bodies of a plot
share its colour scale.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection, TriMesh
from matplotlib.colors import ListedColormap
from matplotlib.tri import Triangulation

from exugear.plots.figures import DISTINCT, axes_or_new, colour_bar, graded, legend, merged, styled
from fem.ste.ste_map import PHASE, TORQUE, check_whole_cycle
from fem.support.arguments import Finite, Numbers, checked
from fem.support.validation import require
from fem.units import MPa, mm

__all__ = ["plot_field", "plot_gears", "plot_outlines", "plot_peak_pressure", "plot_pressure", "plot_root_stress"]

Body = Sequence[Numbers]
STEEL, OUTLINE, MARK = "#dde3e9", "#30363c", DISTINCT[3]


@checked
@styled
def plot_gears(bodies: Sequence[Body], touching: Sequence[Numbers] = (), ax: Axes | None = None, **style) -> Axes:
    """Gears with their meshes, without values.

    bodies     (points (2, n) [m], cells (3, n_cell), ...) of each gear
    touching   points (2, n) [m] of each contact, to be marked
    style   of the lines of the meshes: matplotlib's color, linewidth, alpha, …
    """
    ax = axes_or_new(ax)
    for points, cells, *_ in bodies:
        mesh = _triangulation(points, cells)
        ax.tripcolor(mesh, np.zeros(mesh.x.size), cmap=ListedColormap([STEEL]), rasterized=True)
        ax.triplot(mesh, **merged(style, color=OUTLINE, linewidth=0.12, alpha=0.6))
    for points in touching:
        x, y = np.asarray(points).mean(axis=1) / mm
        ax.plot(x, y, "o", markersize=17, markerfacecolor="none", markeredgecolor=MARK, markeredgewidth=1.8)
    return plot_outlines(bodies, ax)


@checked
@styled
def plot_field(
    bodies: Sequence[Body],
    label: str,
    ax: Axes | None = None,
    *,
    top: Finite | None = None,
    colours: str = "viridis",
    **style,
) -> Axes:
    """Values of all bodies on a common scale.

    bodies    (points (2, n) [m], cells (3, n_cell), values (n,)) of each gear
    label     of the colour bar
    top       end of the scale, which begins at 0; by default the largest value
    colours   name of matplotlib's colour map
    style     of matplotlib's tripcolor: cmap, alpha, …
    """
    ax = axes_or_new(ax)
    top = max(np.max(values) for *_, values in bodies) if top is None else top
    shown = draw_field(bodies, ax, {"cmap": colours, "vmin": 0, "vmax": top} | style)
    colour_bar(ax, shown, label, shrink=0.9)
    return plot_outlines(bodies, ax)


def draw_field(bodies: Sequence[Body], ax: Axes, style: dict[str, Any]) -> PolyCollection | TriMesh:
    """Values of all bodies as colours; returns the picture of the last one."""
    options: dict[str, Any] = {"shading": "gouraud", "rasterized": True} | style
    for points, cells, values in bodies:
        picture = ax.tripcolor(_triangulation(points, cells), values, **options)
    return picture


@checked
@styled
def plot_outlines(
    bodies: Sequence[Body], ax: Axes | None = None, colour: str = OUTLINE, width: Finite = 0.8, **style
) -> Axes:
    """Boundaries of the bodies; equal axes in millimetres.

    style   of the lines: matplotlib's linestyle, alpha, …
    """
    ax = axes_or_new(ax)
    for points, cells, *_ in bodies:
        ends = (np.asarray(points) / mm)[:, _boundary(np.asarray(cells))]
        ax.add_collection(LineCollection(list(ends.T), **merged(style, LineCollection, color=colour, linewidth=width)))
    ax.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    ax.grid(False)
    return ax


@checked
@styled
def plot_root_stress(data: xr.Dataset, ax: Axes | None = None, name: str = "root_stress", **style) -> Axes:
    """Root stress of pinion (solid line) and wheel (dashed) over the mesh cycle, a colour per torque beside 0."""
    _check_map(data, name)
    ax = axes_or_new(ax)
    for gear, line in (("pinion", "-"), ("wheel", "--")):
        _curves(ax, data[name].sel(gear=gear), f"{gear}, ", {"linestyle": line} | style)
    ax.set(ylabel="tooth root stress [MPa]")
    return ax


@checked
@styled
def plot_pressure(data: xr.Dataset, ax: Axes | None = None, **style) -> Axes:
    """Hertz's pressure on the flanks over the mesh cycle, a colour per torque beside 0; drawn thin where a tip edge
    touches.

    `plot_peak_pressure` shows the pressure at the edge itself.
    """
    _check_map(data, "hertz_pressure", "tip_contact")
    ax = axes_or_new(ax)
    flanks = data["hertz_pressure"]
    _curves(ax, flanks, "", {"linewidth": 0.8} | style)
    _curves(ax, flanks.where(data["tip_contact"] == 0), None, {"linewidth": 2.4} | style)
    ax.set(ylabel="contact pressure by Hertz [MPa]", title="thin lines: a tip edge touches")
    return ax


@checked
@styled
def plot_peak_pressure(data: xr.Dataset, ax: Axes | None = None, **style) -> Axes:
    """Largest contact pressure over the mesh cycle, on tip edges too, a colour per torque beside 0."""
    _check_map(data, "peak_pressure")
    ax = axes_or_new(ax)
    _curves(ax, data["peak_pressure"], "", style)
    ax.set(ylabel="peak contact pressure [MPa]")
    return ax


def _check_map(data: xr.Dataset, *names: str) -> None:
    missing = [name for name in (*names, TORQUE, PHASE) if name not in data.variables]
    require(not missing, f"data must have {missing}; make them with fem.root_stress or fem.static_transmission_error")
    check_whole_cycle(data)


def _curves(ax: Axes, data: xr.DataArray, name: str | None, style: dict) -> None:
    data = data.sel({TORQUE: data[TORQUE] != 0}).transpose(TORQUE, PHASE)
    phase = np.append(data[PHASE], np.floor(data[PHASE][-1]) + 1 + data[PHASE][0])
    for row, torque, colour in zip(data.values, data[TORQUE].values, graded(data[TORQUE].values), strict=True):
        label = None if name is None else f"{name}{torque:.4g} N m"
        ax.plot(phase, np.append(row, row[0]) / MPa, **merged(style, color=colour) | {"label": label})
    ax.set(xlabel="phase of the mesh cycle [pitches]", xlim=(phase[0], phase[-1]), ylim=(0, None))
    legend(ax)


def _triangulation(points, cells) -> Triangulation:
    x, y = np.asarray(points) / mm
    return Triangulation(x, y, np.asarray(cells).T)


def _boundary(cells: np.ndarray) -> np.ndarray:
    """(2, n) edges that belong to a single triangle."""
    edges = np.sort(np.hstack([cells[[0, 1]], cells[[1, 2]], cells[[2, 0]]]), axis=0)
    unique, count = np.unique(edges, axis=1, return_counts=True)
    return unique[:, count == 1]
