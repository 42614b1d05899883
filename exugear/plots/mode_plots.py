"""Plots of vibration modes: Campbell diagram, and shafts and gears in the shape of a mode."""

from math import pi

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from exugear.plots.figures import DISTINCT, axes_or_new
from fem.support.arguments import checked
from fem.support.validation import require
from fem.units import mm, rpm

__all__ = ["plot_campbell", "plot_modes"]

MODE, SHAFT_ORDER, AT_REST = "#333333", "#999999", "#bbbbbb"
#: Share of the strain energy in the mesh from which on a crossing is marked as a resonance.
MARKED = 0.1
#: Largest displacement in a picture of a mode over the largest radius, and points of a circle.
SCALE, POINTS = 0.4, 73


@checked
def plot_campbell(data: xr.Dataset, ax: Axes | None = None, marked: float = MARKED) -> Axes:
    """Natural frequencies over the speed of the driving shaft, with mesh orders (dashed) and shaft orders (dotted).

    data     of `exugear.campbell`
    marked   least share of a mode's strain energy in the mesh of an order at whose crossing a circle stands; its area
             grows with the share
    """
    require("crossing_speed" in data, "data must be that of exugear.campbell(...)")
    ax = axes_or_new(ax)
    speed, top = data["speed"].values, 1.05 * float(data["frequency"].max())
    ax.plot(speed / rpm, data["frequency"].values.T, color=MODE, linewidth=1.1)
    _draw_orders(ax, data, top)
    met = data.where(data["crossing_energy_share"] >= marked, drop=True) if data.sizes["crossing"] else data
    sizes = 160 * met["crossing_energy_share"]
    ax.scatter(
        met["crossing_speed"] / rpm, met["crossing_frequency"], sizes, facecolor="none", edgecolor=DISTINCT[3], zorder=3
    )
    ax.set(xlabel="speed of the driving shaft [rpm]", ylabel="natural frequency [Hz]")
    ax.set(xlim=(speed[0] / rpm, speed[-1] / rpm), ylim=(0, top))
    ax.grid(alpha=0.3)
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize="small")
    return ax


def _draw_orders(ax: Axes, data: xr.Dataset, top: float) -> None:
    """Lines of the orders with their harmonics where they leave the frame; a colour for each stage."""
    speed, stages = data["speed"].values, list(data["stage"].values)
    ax.plot([], [], color=MODE, linewidth=1.1, label="modes")
    labelled = set()
    for name, ratio, stage in zip(*(data[x].values for x in ("order", "order_ratio", "order_stage")), strict=True):
        colour = DISTINCT[stages.index(stage) % len(DISTINCT)] if stage else SHAFT_ORDER
        label = f"orders of mesh {stage}" if stage else "rotation of shafts"
        frequency, style = ratio * speed / (2 * pi), "--" if stage else ":"
        shown = {"label": label} if label not in labelled else {}
        ax.plot(speed / rpm, frequency, style, color=colour, linewidth=1.0, **shown)
        labelled.add(label)
        if stage:
            end = min(0.985 * speed[-1], 0.97 * top * 2 * pi / ratio)
            text = ax.annotate(f"{str(name).split(' ')[0]}x", (end / rpm, ratio * end / (2 * pi)), color=colour)
            text.set(fontsize="small", ha="right", va="bottom")


@checked
def plot_modes(data: xr.Dataset, ax: Axes | None = None, mode: int = 1) -> Axes:
    """A mode of a gearbox in space: shafts and gears at rest (grey) and displaced, arrows at the centres of the gears.

    data   of `exugear.modes`
    mode   its number, 1 for the lowest frequency

    Each gear has a spoke, which shows its rotation. The largest displacement is drawn as 0.4 of the largest radius.
    """
    require("part_shaft" in data, "data must be that of exugear.modes(model, load=...) of an exugear.Model")
    numbers = data["mode"].values
    require(mode in numbers, f"mode must lie in [1, {numbers[-1]}], got {mode}")
    ax = axes_or_new(ax, projection="3d")
    require(ax.name == "3d", "ax must be three-dimensional: figure.add_subplot(projection='3d')")
    chosen = data.sel(mode=mode)
    scale = _scale(chosen)
    for number, name in enumerate(np.unique(chosen["part_shaft"].values)):
        _draw_shaft(ax, chosen, str(name), scale, DISTINCT[number % len(DISTINCT)])
    ax.set(xlabel="z [mm]", ylabel="x [mm]", zlabel="y [mm]", title=_title(chosen))
    ax.set_aspect("equal")
    ax.legend(frameon=False, fontsize="small")
    return ax


def _title(data: xr.Dataset) -> str:
    """Frequency and damping of a mode, and the element with the most strain energy."""
    text = f"mode {int(data['mode'])}: {float(data['frequency']):.0f} Hz, {float(data['damping_ratio']) * 100:.2g} % damped"
    element = data["energy_share"].argmax("element")
    share = float(data["energy_share"][element])
    return f"{text}\n{share * 100:.0f} % of the energy in {data['element'].values[int(element)]}" if share > 0 else text


def _gears(data: xr.Dataset, name: str) -> xr.Dataset:
    """Gears of a shaft."""
    return data.isel(part=np.flatnonzero((data["part_shaft"] == name) & (data["part_kind"] == "gear")))


def _displaced(data: xr.Dataset, name: str, axial, scale: float) -> np.ndarray:
    """(n, 3) positions x, y, z [m] of points on the axis of a shaft at axial positions (n,), displaced by a scale."""
    shaft = data.sel(shaft=name)
    x, y, z, a, b, _ = scale * shaft["shape"].values
    lever = np.asarray(axial) - float(shaft["shaft_centre"])
    at_rest = np.stack(np.broadcast_arrays(shaft["shaft_x"], shaft["shaft_y"], axial), axis=-1)
    return at_rest + np.stack(np.broadcast_arrays(x + lever * b, y - lever * a, z), axis=-1)


def _scale(data: xr.Dataset) -> float:
    """Factor from the shape to a picture of it."""
    moved = []
    for name in np.unique(data["part_shaft"].values):
        gears = _gears(data, str(name))
        axial, radius = gears["part_axial"].values, gears["part_radius"].values
        centres = _displaced(data, str(name), axial, 1.0) - _displaced(data, str(name), axial, 0.0)
        spin = float(data["shape"].sel(shaft=name, coordinate="spin"))
        moved += [*np.linalg.norm(centres, axis=1), *abs(radius * spin)]
    return SCALE * float(data["part_radius"].max()) / max(*moved, np.finfo(float).tiny)


def _draw_shaft(ax, data: xr.Dataset, name: str, scale: float, colour: str) -> None:
    """A shaft with its gears and bearings, at rest and displaced."""
    parts, spin = data.isel(part=np.flatnonzero(data["part_shaft"] == name)), data["shape"].sel(shaft=name)
    margin = 0.15 * float(data["part_radius"].max())
    ends = float(parts["part_axial"].min()) - margin, float(parts["part_axial"].max()) + margin
    gears, bearings = _gears(data, name), parts.isel(part=np.flatnonzero(parts["part_kind"] == "bearing"))
    for factor, style in ((0.0, {"color": AT_REST}), (scale, {"color": colour, "label": name})):
        _line(ax, _displaced(data, name, ends, factor), linewidth=1.6, **style)
        angle = factor * float(spin.sel(coordinate="spin"))
        for axial, radius in zip(gears["part_axial"].values, gears["part_radius"].values, strict=True):
            centre = _displaced(data, name, [axial], factor)[0]
            _line(ax, _rim(data, name, centre, radius, angle, factor), linewidth=1.2, color=style["color"])
    _line(ax, _displaced(data, name, bearings["part_axial"].values, 0.0), linestyle="", marker="^", color="k", markersize=4)
    for axial in gears["part_axial"].values:
        (start,), (end,) = (_displaced(data, name, [axial], factor) for factor in (0.0, scale))
        x, y, z = start / mm
        u, v, w = (end - start) / mm
        ax.quiver(z, x, y, w, u, v, color=colour, linewidth=1.4, arrow_length_ratio=0.25)


def _rim(data: xr.Dataset, name: str, centre: np.ndarray, radius: float, angle: float, factor: float) -> np.ndarray:
    """(n, 3) points of a spoke and of the circle of a gear [m], tilted with its shaft and turned by an angle."""
    tilt_x, tilt_y = factor * data["shape"].sel(shaft=name, coordinate=["tilt_x", "tilt_y"]).values
    angles = angle + np.linspace(0, 2 * pi, POINTS)
    x, y = radius * np.cos(angles), radius * np.sin(angles)
    return np.vstack([centre, centre + np.stack([x, y, y * tilt_x - x * tilt_y], axis=-1)])


def _line(ax, points: np.ndarray, **style) -> None:
    """A line through points (n, 3), the axis of the shafts across the picture."""
    x, y, z = points.T / mm
    ax.plot(z, x, y, **style)
