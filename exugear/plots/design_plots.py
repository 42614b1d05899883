"""Plots of designs of flanks: profile and lead for the drawing office, landscape of the objective, Pareto front."""

from math import hypot
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from exugear.plots.figures import DISTINCT, GUIDE, axes_or_new, colour_bar, figure, merged, styled
from fem.gear.gear import Gear
from fem.microgeometry.flank import removed
from fem.microgeometry.modification import EndRelief, RootRelief, TipRelief
from fem.pair.pair import GearPair
from fem.support.arguments import checked
from fem.support.representation import SHOWN
from fem.support.validation import require
from fem.units import mm, um

__all__ = ["flank_drawing", "plot_flank", "plot_landscape", "plot_pareto_front"]

GEARS, DIRECTIONS = ("pinion", "wheel"), ("profile", "lead")
#: Points along a diagram; room above and below it, over its range; least range [um].
POINTS, ROOM, LEAST = 400, 0.25, 4.0


@checked
@styled
def plot_flank(
    pair: GearPair, ax: Axes | None = None, *, gear: str = "pinion", direction: str = "profile", **style
) -> Axes:
    """Designed flank of a gear along its profile or across its face, as a measuring machine draws it.

    pair        whose driving flank, left, is drawn; material is below the line
    gear        "pinion" or "wheel"
    direction   "profile" in mid-face over the roll length, with the diameters where reliefs begin, or "lead" at half
                the roll of the flank
    style       of matplotlib's plot
    """
    require(gear in GEARS, f"gear must be one of {GEARS}, got {gear!r}")
    require(direction in DIRECTIONS, f"direction must be one of {DIRECTIONS}, got {direction!r}")
    ax, of = axes_or_new(ax), pair.pinion if gear == "pinion" else pair.wheel
    middle = (of.roll_form + of.roll_tip) / 2
    roll = np.linspace(of.roll_form, of.roll_tip, POINTS) if direction == "profile" else middle
    axial = 0.0 if direction == "profile" else np.linspace(-of.b / 2, of.b / 2, POINTS)
    at = np.abs(roll) if direction == "profile" else axial
    deviation = -removed(of.drive_flank, of.face, roll, axial) / um
    ax.plot(np.divide(at, mm), deviation, **merged(style, color=DISTINCT[GEARS.index(gear)], linewidth=2.0))
    ax.axhline(0.0, color=GUIDE, linewidth=0.8, linestyle="--")
    low, high = min(deviation.min(), -LEAST / 2), max(deviation.max(), LEAST / 2)
    ax.set_ylim(low - ROOM * (high - low), high + ROOM * (high - low))
    for position, words in _edges(of, direction):
        ax.axvline(position / mm, color=GUIDE, linewidth=0.8, linestyle=":")
        where: dict[str, Any] = {
            "xycoords": ("data", "axes fraction"),
            "xytext": (-4, 0),
            "textcoords": "offset points",
        }
        ax.annotate(words, (position / mm, 0.4), **where, rotation=90, va="top", ha="right", fontsize=9)
    ends = "root form circle to tip circle" if direction == "profile" else "from the middle of the face"
    ax.set(xlabel=f"{'roll length' if direction == 'profile' else 'axial position'} [mm], {ends}")
    ax.set(ylabel="deviation of the flank [µm]", title=f"{gear}, z = {of.z}: {direction}")
    return ax


def _edges(gear: Gear, direction: str) -> list[tuple[float, str]]:
    """Positions where reliefs begin [m], with words."""
    edges = []
    for part in gear.drive_flank:
        if direction == "profile" and isinstance(part, TipRelief | RootRelief):
            reach = part.reach(gear.face)
            roll = gear.roll_tip - reach if isinstance(part, TipRelief) else gear.roll_form + reach
            edges.append((abs(roll), f"d {2 * hypot(roll, gear.r_b) / mm:.3f} mm"))
        if direction == "lead" and isinstance(part, EndRelief):
            edges += [(sign * (gear.b / 2 - part.length), f"{part.length / mm:.3g} mm") for sign in (-1, 1)]
    return edges


@checked
def flank_drawing(pair: GearPair, *, title: str = "") -> Figure:
    """Figure for the drawing office: profile and lead of both gears, with their modifications in words."""
    drawing = figure(2, 2)
    for row, (name, gear) in enumerate(zip(GEARS, (pair.pinion, pair.wheel), strict=True)):
        for column, direction in enumerate(DIRECTIONS):
            plot_flank(pair, drawing.axes[2 * row + column], gear=name, direction=direction)
        words = ", ".join(repr(part) for part in gear.drive_flank) or "no modification"
        drawing.axes[2 * row].annotate(words, (0.02, 0.03), xycoords="axes fraction", fontsize=8)
    drawing.suptitle(title)
    return drawing


@checked
@styled
def plot_landscape(data: xr.DataArray, ax: Axes | None = None, **style) -> Axes:
    """Objective over one or two variables, as `OptimalFlanks.landscape` returns it, with its optimum.

    style   of matplotlib's plot over one variable, of its pcolormesh over two
    """
    names = [str(name) for name in data.dims]
    fits = 1 <= len(names) <= 2 and all(f"optimum_{name}" in data.attrs for name in names)
    require(fits, f"data must be a landscape over one or two variables, got {names}; pass result.landscape(...)")
    ax = axes_or_new(ax)
    units = {name: str(data[name].attrs.get("unit", "")) for name in names}
    scaled = {name: data[name].values / SHOWN.get(units[name], 1.0) for name in names}
    best = {name: float(data.attrs[f"optimum_{name}"]) / SHOWN.get(units[name], 1.0) for name in names}
    label = {name: f"{name} [{units[name].replace('um', 'µm')}]" if units[name] else name for name in names}
    if len(names) == 1:
        ax.plot(scaled[names[0]], data.values, **merged(style))
        ax.axvline(best[names[0]], color=GUIDE, linestyle="--")
        ax.set(xlabel=label[names[0]], ylabel="objective")
        return ax
    across, up = names
    picture = ax.pcolormesh(
        scaled[across], scaled[up], data.transpose(up, across).values, **merged(style, QuadMesh, cmap="viridis")
    )
    ax.plot(best[across], best[up], "o", color="white", markeredgecolor="k", markersize=8)
    ax.set(xlabel=label[across], ylabel=label[up])
    ax.grid(False)
    colour_bar(ax, picture, str(data.attrs.get("long_name", "objective")))
    return ax


@checked
@styled
def plot_pareto_front(data: xr.Dataset, ax: Axes | None = None, **style) -> Axes:
    """Designs of which none is better in both goals, as `OptimalFlanks.pareto_front` returns them.

    style   of matplotlib's plot
    """
    goals = [data.attrs.get(name) for name in ("first", "second")]
    require(all(goal in data for goal in goals), "data must be a Pareto front; pass result.pareto_front(...)")
    ax = axes_or_new(ax)
    scales = [um if data[goal].attrs.get("units") == "m" else 1.0 for goal in goals]
    values = [data[goal].values / scale for goal, scale in zip(goals, scales, strict=True)]
    ax.plot(*values, **merged(style, marker="o"))
    words = [
        f"{goal} [{'µm' if s != 1 else data[goal].attrs.get('units', '1')}]"
        for goal, s in zip(goals, scales, strict=True)
    ]
    ax.set(xlabel=words[0].replace("_", " "), ylabel=words[1].replace("_", " "))
    return ax
