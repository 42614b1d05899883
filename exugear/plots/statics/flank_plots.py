"""Plots of the load over the flanks: contact pattern over the mesh cycle, contact lines in the plane of action."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from exugear.plots.figures import GUIDE, axes_or_new, colour_bar, merged, styled
from fem.ste.ste_map import PHASE, TORQUE, pair_of
from fem.support.arguments import Finite, checked
from fem.support.validation import require
from fem.units import MPa, mm

__all__ = ["plot_contact_pattern", "plot_load_distribution"]

#: Variables of a load distribution: unit of the plot, its value in SI units, words of the colour bar.
SHOWN = {"pressure": (MPa, "contact pressure [MPa]"), "line_load": (1e3, "line load [N/mm]")}


@checked
@styled
def plot_contact_pattern(
    data: xr.Dataset, ax: Axes | None = None, name: str = "pressure", torque: Finite | None = None, **style
) -> Axes:
    """Largest pressure at each point of the flank over the mesh cycle, over face width and path of contact.

    data    as `fem.load_distribution` returns it; its phases must cover the mesh cycle
    name    "pressure" or "line_load"
    torque  of data that is shown [N m]; by default the largest
    style   of matplotlib's pcolormesh: cmap, vmin, vmax, …

    Dashed lines bound the path of contact: below, the pinion's flank begins to mesh, above it ends at its tip.
    """
    ax, values = axes_or_new(ax), _at_torque(data, name, torque)
    unit, words = SHOWN[name]
    passed = values.stack(position=("pair", PHASE)).transpose("position", "axial")
    path = data["path"].stack(position=("pair", PHASE)).transpose("position", "axial").values / mm
    axial = np.broadcast_to(data["axial"].values / mm, path.shape)
    picture = {"cmap": "YlOrRd", "shading": "gouraud", "vmin": 0, "rasterized": True} | style
    shown = ax.pcolormesh(axial, path, passed.values / unit, **picture)
    colour_bar(ax, shown, words)
    _frame(ax, data)
    return ax


@checked
@styled
def plot_load_distribution(
    data: xr.Dataset,
    ax: Axes | None = None,
    name: str = "line_load",
    phase: Finite = 0.0,
    torque: Finite | None = None,
    **style,
) -> Axes:
    """Load on the contact lines in the plane of action at a phase, over face width and path of contact.

    data    as `fem.load_distribution` returns it
    name    "pressure" or "line_load"
    phase   of data that is shown, the nearest; torque: by default the largest
    style   of the lines: matplotlib's cmap, linewidth, …
    """
    ax, values = axes_or_new(ax), _at_torque(data, name, torque)
    unit, words = SHOWN[name]
    top, lines = float(values.max()) / unit, data["path"].sel({PHASE: phase}, method="nearest")
    options = merged(style, LineCollection, cmap="YlOrRd", linewidth=7.0, clim=(0, top), capstyle="butt")
    for number in data["pair"].values:
        load = values.sel(pair=number).sel({PHASE: phase}, method="nearest").values / unit
        points = np.stack([data["axial"].values, lines.sel(pair=number).values], axis=-1) / mm
        loaded = (load[1:] > 0) & (load[:-1] > 0)
        line = LineCollection(list(np.stack([points[:-1], points[1:]], axis=1)[loaded]), **options)
        line.set_array(((load[1:] + load[:-1]) / 2)[loaded])
        ax.add_collection(line)
    colour_bar(ax, line, words)
    _frame(ax, data)
    ax.set_title(f"phase {float(lines[PHASE]):.3g}")
    return ax


def _at_torque(data: xr.Dataset, name: str, torque: float | None) -> xr.DataArray:
    """A variable of a load distribution at a torque, by default the largest."""
    require(name in SHOWN, f"name must be one of {list(SHOWN)}, got {name!r}")
    missing = [part for part in (*SHOWN, "path", TORQUE, PHASE, "pair", "axial") if part not in data.variables]
    require(not missing, f"data must have {missing}; make it with fem.load_distribution")
    torques = data[TORQUE].values
    value = float(torques[-1]) if torque is None else torque
    require(bool(np.isclose(torques, value).any()), f"torque must be one of {torques.tolist()} N m, got {value:g}")
    return data[name].sel({TORQUE: value}, method="nearest")


def _frame(ax: Axes, data: xr.Dataset) -> None:
    """Axes of the plane of action: the whole face width, and the path of contact with its ends."""
    path, axial = pair_of(data).path_of_contact, data["axial"].values
    half = (axial[1] - axial[0]) / 2
    start, end = (path.start - path.pitch) / mm, (path.end - path.pitch) / mm
    for position, line in ((start, "--"), (0.0, ":"), (end, "--")):
        ax.axhline(position, color=GUIDE, linewidth=0.9, linestyle=line)
    room = 0.12 * (end - start)
    ax.set(xlim=((axial[0] - half) / mm, (axial[-1] + half) / mm), ylim=(start - room, end + room))
    ax.set(xlabel="face width [mm]", ylabel="path of contact from the pitch point [mm]")
    ax.grid(False)
