"""Plots of the load over the flanks: contact pattern over the mesh cycle, contact lines in the plane of action."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.tri import Triangulation
from scipy.spatial import Delaunay

from exugear.plots.figures import GUIDE, axes_or_new, colour_bar, merged, styled
from fem.ste.ste_map import PHASE, TORQUE, check_whole_cycle, pair_of
from fem.support.arguments import Finite, checked
from fem.support.validation import require
from fem.units import MPa, mm

__all__ = ["plot_contact_pattern", "plot_load_distribution"]

#: Colours from no load, white, to beyond the scale, grey; share of the path that the scale leaves out at its ends.
COLOURS, EDGES = colormaps["Reds"].with_extremes(over="0.25"), 0.05
#: Parts of a contact line overlap by a little, so that no gaps show between them.
OVERLAP = 1.05
#: So much more than those across the face count distances along the path at its ends, where values are interpolated.
STRETCH = 20.0
#: Digits of positions on the path of contact [pitches].
POSITION_DIGITS = 9
#: Variables of a load distribution: unit of the plot in SI units, words of the colour bar.
SHOWN = {"pressure": (MPa, "contact pressure [MPa]"), "line_load": (1e3, "line load [N/mm]")}


@checked
@styled
def plot_contact_pattern(
    data: xr.Dataset, ax: Axes | None = None, name: str = "pressure", torque: Finite | None = None, **style
) -> Axes:
    """Largest pressure at each point of the flank over the mesh cycle, over face width and path of contact.

    data    as `fem.load_distribution` returns it; its phases must cover the mesh cycle
    name    "pressure" or "line_load"
    torque  whose values are shown [N m]; by default the largest of the data
    style   of matplotlib's pcolormesh: cmap, vmin, vmax, …

    Dashed lines bound the path of contact: below, the pinion's flank begins to mesh, above it ends at its tip.
    """
    ax, values = axes_or_new(ax), _at_torque(data, name, torque)
    check_whole_cycle(data)
    unit, words = SHOWN[name]
    passed, path = _passed(values) / unit, _passed(data["path"]) / mm
    axial, padding = (
        np.clip(np.pad(data["axial_position"], 1, "reflect", reflect_type="odd"), *_face(data)) / mm,
        ((0, 0), (1, 1)),
    )
    path = np.pad(path, padding, "reflect", reflect_type="odd")
    picture: dict[str, Any] = {
        "cmap": COLOURS,
        "shading": "gouraud",
        "clim": (0, _top(data, values) / unit),
        "rasterized": True,
    }
    axial, colours = np.broadcast_to(axial, path.shape), np.pad(passed, padding, "edge")
    if pair_of(data).beta_b:
        triangles = _triangles(axial.ravel(), path.ravel(), np.array(_path_ends(data)) / mm)
        shown: Any = ax.tripcolor(triangles, colours.ravel(), **picture | style)
    else:
        shown = ax.pcolormesh(axial, path, colours, **picture | style)
    colour_bar(ax, shown, words, extend="max" if passed.max() > shown.norm.vmax else "neither")
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
    phase   whose load is shown, the nearest of the data
    torque  whose load is shown [N m]; by default the largest of the data
    style   of the lines: matplotlib's cmap, linewidth, …
    """
    ax, values = axes_or_new(ax), _at_torque(data, name, torque)
    unit, words = SHOWN[name]
    path = data["path"].sel({PHASE: phase}, method="nearest").transpose("pair", "axial_position")
    load = values.sel({PHASE: phase}, method="nearest").transpose("pair", "axial_position").values / unit
    half = (data["axial_position"].values[1] - data["axial_position"].values[0]) / 2
    along = OVERLAP * half * np.array([1.0, np.tan(pair_of(data).beta_b)])
    middles = np.stack(np.broadcast_arrays(data["axial_position"].values, path.values), axis=-1)
    ends = [middles - along, middles + along]
    segments, loaded = np.stack(ends, axis=2) / mm, load > 0
    options = {"cmap": COLOURS, "linewidth": 7.0, "clim": (0, _top(data, values) / unit), "capstyle": "butt"}
    lines = LineCollection(list(segments[loaded]), **merged(style, LineCollection, **options))
    lines.set_array(load[loaded])
    ax.add_collection(lines)
    colour_bar(ax, lines, words, extend="max" if load.max() > lines.norm.vmax else "neither")
    _frame(ax, data)
    ax.set_title(f"phase {float(path[PHASE]):.3g}, {float(values[TORQUE]):.4g} N m")
    return ax


def _triangles(axial: np.ndarray, path: np.ndarray, ends: np.ndarray) -> Triangulation:
    """Triangles between points (n,) of a helical flank, long across the face at the ends of the path of contact.

    At tip edges pressure rises within some tenths of a millimetre, but varies little along the edge: there, values
    between the inclined lines of contact of few phases are interpolated along the edge.
    """
    margin = EDGES * (ends[1] - ends[0])
    inside = np.clip(path, ends[0] + margin, ends[1] - margin)
    stretched = inside + STRETCH * (path - inside)
    return Triangulation(axial, path, Delaunay(np.stack([axial, stretched], axis=1)).simplices)


def _passed(values: xr.DataArray) -> np.ndarray:
    """(n_position, n_axial) largest values of all tooth pairs that pass the same position of the path."""
    rows = values.stack(position=("pair", PHASE)).transpose("position", "axial_position")
    positions, numbers = np.unique(np.round(rows["pair"] + rows[PHASE], POSITION_DIGITS), return_inverse=True)
    largest = np.full((positions.size, rows.shape[1]), -np.inf)
    np.maximum.at(largest, numbers, rows.values)
    return largest


def _face(data: xr.Dataset) -> tuple[float, float]:
    """Axial ends of the face width [m]."""
    axial = data["axial_position"].values
    half = (axial[1] - axial[0]) / 2
    return axial[0] - half, axial[-1] + half


def _path_ends(data: xr.Dataset) -> tuple[float, float]:
    """Begin and end of the path of contact, from the pitch point [m]."""
    path = pair_of(data).path_of_contact
    return path.start - path.pitch, path.end - path.pitch


def _top(data: xr.Dataset, values: xr.DataArray) -> float:
    """Largest value between the ends of the path of contact; beyond, on sharp tip edges, pressure has no limit."""
    start, end = _path_ends(data)
    margin = EDGES * (end - start)
    inside = values.where((data["path"] > start + margin) & (data["path"] < end - margin))
    return float(inside.max())


def _at_torque(data: xr.Dataset, name: str, torque: float | None) -> xr.DataArray:
    """A variable of a load distribution at a torque, by default the largest."""
    require(name in SHOWN, f"name must be one of {list(SHOWN)}, got {name!r}")
    missing = [part for part in (*SHOWN, "path", TORQUE, PHASE, "pair", "axial_position") if part not in data.variables]
    require(not missing, f"data must have {missing}; make it with fem.load_distribution")
    torques = data[TORQUE].values
    value = float(torques[-1]) if torque is None else torque
    require(bool(np.isclose(torques, value).any()), f"torque must be one of {torques.tolist()} N m, got {value:g}")
    return data[name].sel({TORQUE: value}, method="nearest")


def _frame(ax: Axes, data: xr.Dataset) -> None:
    """Axes of the plane of action: the whole face width, and the path of contact with its ends."""
    (start, end), face = np.array(_path_ends(data)) / mm, np.array(_face(data)) / mm
    for position, line in ((start, "--"), (0.0, ":"), (end, "--")):
        ax.axhline(position, color=GUIDE, linewidth=0.9, linestyle=line)
    room = 0.12 * (end - start)
    ax.set(xlim=tuple(face), ylim=(start - room, end + room))
    ax.set(xlabel="axial position [mm]", ylabel="path of contact from the pitch point [mm]")
    ax.grid(False)
