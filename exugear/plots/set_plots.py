"""Plots of planetary sets: phases of the meshes, their sums over the planets, load shares, side bands."""

from itertools import cycle
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from exugear.plots.figures import DISTINCT, GUIDE, axes_or_new, check_result, legend, merged, styled
from fem.support.arguments import Finite, checked
from fem.support.validation import require
from fem.units import deg

__all__ = ["plot_mesh_phases", "plot_phase_sums", "plot_planet_shares", "plot_side_bands"]

#: Marks of the meshes with sun and ring: shape, size, filling, colour; those of equal phases stay apart.
MEMBERS = ("sun", "o", 7, "full", DISTINCT[0]), ("ring", "s", 12, "none", DISTINCT[3])
#: Place of a legend above narrow axes.
ABOVE: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (-0.1, 1.0), "ncols": 2, "columnspacing": 1.0}
#: Share of equal planets from which on a line is one of theirs, by its colour.
OF_EQUAL_PLANETS = 1e-6
#: Lowest level that is drawn below the range of the axis, so that lines below it leave no stump.
BELOW = 1.0
#: Least range of shares that is drawn [%], so that rounding does not fill the picture.
LEAST_RANGE = 0.5
#: Distance of the lines of two harmonics in the picture [orders]; lines on one side of all harmonics for a mark each.
GAP, TICKS = 3.0, 3


@checked
@styled
def plot_mesh_phases(phases: xr.Dataset, ax: Axes | None = None, **style) -> Axes:
    """Phases of the meshes of every planet with sun and ring, as shares of a pitch.

    phases   as `Planetary.mesh_phases` returns them
    style    of the marks: matplotlib's color, markersize, ...
    """
    check_result("phases", phases, ("sun_phase", "ring_phase"), "planetary.mesh_phases()")
    ax, rows = axes_or_new(ax), np.arange(phases.sizes["planet"])
    for name, mark, size, fill, colour in MEMBERS:
        look = merged(
            style,
            color=colour,
            marker=mark,
            linestyle="none",
            markersize=size,
            fillstyle=fill,
            label=f"mesh with {name}",
        )
        ax.plot(phases[f"{name}_phase"].values % 1.0, rows, **look)
    names = zip(phases["planet"].values, phases["angle"].values / deg, strict=True)
    ax.set(xlabel="phase in the reference configuration [pitch]", xlim=(-0.04, 1.04), ylim=(rows[-1] + 0.5, -0.5))
    ax.set_yticks(rows, [f"{planet}, {angle % 360:.4g}°" for planet, angle in names])
    legend(ax, **ABOVE)
    return ax


@checked
@styled
def plot_phase_sums(phases: xr.Dataset, ax: Axes | None = None, **style) -> Axes:
    """What mesh harmonics add up to over the planets, in the torque and in the lateral force on the sun.

    phases   as `Planetary.mesh_phases` returns them
    style    of the bars: matplotlib's alpha, edgecolor, ...
    """
    check_result("phases", phases, ("torque_sum", "lateral_sum"), "planetary.mesh_phases()")
    ax, harmonic = axes_or_new(ax), phases["harmonic"].values
    for shift, name, words, colour in ((-0.2, "torque", "torque", 0), (0.2, "lateral", "lateral force on sun", 1)):
        look: dict[str, Any] = {"width": 0.4, "color": DISTINCT[colour], "label": words} | style
        ax.bar(harmonic + shift, phases[f"{name}_sum"].values, **look)
    ax.set(xlabel="mesh harmonic", ylabel="sum over the planets\n/ sum in phase", ylim=(0, 1.05))
    ax.set_xticks(harmonic)
    legend(ax, **ABOVE)
    return ax


@checked
@styled
def plot_planet_shares(shares: xr.Dataset, ax: Axes | None = None, **style) -> Axes:
    """Shares of the planets in the mesh forces over time; dashed: equal shares. The title has K_gamma.

    shares   as `exugear.planet_shares` returns them
    style    of matplotlib's plot
    """
    check_result("shares", shares, ("share", "K_gamma"), "exugear.planet_shares(run)")
    ax = axes_or_new(ax)
    for planet, share, colour in zip(shares["planet"].values, shares["share"].values, cycle(DISTINCT), strict=False):
        ax.plot(shares["time"], 100 * share, **merged(style, color=colour, linewidth=1.0, label=str(planet)))
    ax.axhline(100 / shares.sizes["planet"], color=GUIDE, linewidth=0.9, linestyle="--", label="equal")
    low, high = ax.get_ylim()
    if high - low < LEAST_RANGE:
        ax.set_ylim((low + high - LEAST_RANGE) / 2, (low + high + LEAST_RANGE) / 2)
    member, factor = shares.attrs.get("member", "sun"), float(shares["K_gamma"])
    ax.set(xlabel="time [s]", ylabel=f"share in the mesh forces\nat the {member} [%]")
    ax.set_title(f"$K_\\gamma$ = {factor:.4g}")
    legend(ax)
    return ax


@checked
@styled
def plot_side_bands(lines: xr.Dataset, ax: Axes | None = None, *, decibels: Finite = 60.0, **style) -> Axes:
    """Levels of the lines about the mesh harmonics of a set, side by side, coloured by what excites them.

    lines      of one channel, as `exugear.side_bands` returns them
    decibels   range of levels shown, down from the largest line
    style      of the lines: matplotlib's linewidth, alpha, ...
    """
    check_result("lines", lines, ("level", "share", "cause"), "exugear.side_bands(...)")
    single = lines["level"].dims == ("order",)
    require(single, f"lines must be of a single channel, got {dict(lines.sizes)}; select one of them")
    require(0 < decibels < np.inf, f"decibels must be > 0 dB and finite, got {decibels}")
    ax, level = axes_or_new(ax), lines["level"].values
    offset, share, harmonic = (lines[name].values for name in ("offset", "share", "harmonic"))
    reach = float(np.abs(offset).max())
    middles = (2 * reach + GAP) * (harmonic - 1)
    kinds = {
        "mesh harmonic": offset == 0,
        "planet pass of equal planets": (offset != 0) & (share > OF_EQUAL_PLANETS),
        "unequal planets, carrier or ring": (offset != 0) & (share <= OF_EQUAL_PLANETS),
        "sun or planet once per turn": np.char.startswith(lines["cause"].values.astype(str), "error of"),
    }
    kinds["planet pass of equal planets"] &= ~kinds["sun or planet once per turn"]
    kinds["unequal planets, carrier or ring"] &= ~kinds["sun or planet once per turn"]
    for (name, chosen), colour in zip(kinds.items(), ("k", *DISTINCT), strict=False):
        shown = chosen & (level > -decibels)
        if chosen.any():
            look = merged(style, color=colour, linewidth=2.5)
            ax.vlines((middles + offset)[shown], -decibels - BELOW, level[shown], label=name, **look)
    step = max(1, round(reach * np.unique(harmonic).size / TICKS))
    marked = np.flatnonzero(offset % step == 0)
    ax.set_xticks((middles + offset)[marked], [f"{x:.0f}" for x in lines["order"].values[marked]])
    words = lines["level"].attrs.get("long_name", "level")
    ax.set(xlabel="order of the carrier against the ring", ylabel=f"{words} [dB]", ylim=(-decibels, 3))
    legend(ax, **ABOVE)
    return ax
