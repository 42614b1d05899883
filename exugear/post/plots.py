"""Plots of maps, runs and meshes: each function takes data and optionally axes, and returns the axes."""

from collections.abc import Mapping
from itertools import cycle
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from exugear.integration.run_data import stage_data
from exugear.post.figures import axes_or_new, figure
from exugear.post.power_plots import plot_efficiency, plot_power
from exugear.signals.spectrum import Envelope, Resonances, bearing_force_rms, dte_envelope, order_spectrum
from fem.ste.ste_map import PHASE, TORQUE, over_torque_and_phase, over_torque_and_pitches, pair_of
from fem.support.arguments import Finite, Numbers, checked
from fem.support.validation import require
from fem.units import mm, rpm, um

__all__ = [
    "figure",
    "plot_bearing_forces",
    "plot_efficiency",
    "plot_envelopes",
    "plot_power",
    "plot_run_up",
    "plot_section",
    "plot_solid",
    "plot_ste",
    "plot_stiffness",
    "plot_waterfall",
]

STEEL = "#c9d3dc"
TRACE, EDGE, MARK = "#9ecae1", "#08519c", "#cb181d"
#: Length of a line of an order map [mesh cycles], and its largest share of the run.
CYCLES, SHARE = 400, 1 / 20


@checked
def plot_ste(ste: xr.Dataset, ax: Axes | None = None, pitches: float | None = None, alternating: bool = False) -> Axes:
    """Transmission error over some pitches, a curve per torque.

    pitches         number of pitches shown: by default two, or all pitches of a map over several
    alternating     subtract the mean over the mesh cycle; the rest excites vibrations
    """
    ax = axes_or_new(ax)
    mapped = int(ste.attrs.get("pitches", 1))
    te = over_torque_and_phase(ste) if mapped == 1 else over_torque_and_pitches(ste)
    default, most = (2, 1000) if mapped == 1 else (mapped, mapped)
    shown = default if pitches is None else pitches
    require(0 < shown <= most, f"pitches must lie in (0, {most}], got {pitches}")
    repeats = np.arange(np.ceil(shown) + 1 if mapped == 1 else 1)
    phase, torque = te[PHASE].values, te[TORQUE].values
    at = (phase + repeats[:, None]).ravel()
    curves = te.values - _cycle_mean(phase, te.values, mapped) if alternating else te.values
    for row, load, colour in zip(curves, torque, _colours(torque), strict=True):
        ax.plot(at, np.tile(row, repeats.size) / um, color=colour, label=f"{load:.4g} N m", marker=".", markersize=3)
    name = "alternating part of the STE [µm]" if alternating else "static transmission error [µm]"
    ax.set(xlabel="phase of the mesh cycle [pitches]", ylabel=name, xlim=(0, shown))
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    ax.grid(alpha=0.3)
    return ax


def _cycle_mean(phase: np.ndarray, te: np.ndarray, pitches: int) -> np.ndarray:
    """(n_torque, 1) means of te (n_torque, n_phase) over a number of pitches."""
    closed = np.append(te, te[:, :1], axis=1)
    return np.trapezoid(closed, np.append(phase, phase[0] + pitches), axis=1)[:, None] / pitches


@checked
def plot_stiffness(ste: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Secant mesh stiffness F / STE over the phase, a curve per torque above 0."""
    ax = axes_or_new(ax)
    r_b = pair_of(ste).pinion.r_b
    loaded = ste.sel({TORQUE: ste[TORQUE] > 0})
    torque = loaded[TORQUE].values
    for row, load, colour in zip(over_torque_and_phase(loaded).values, torque, _colours(torque), strict=True):
        at, te = np.append(loaded[PHASE], 1 + loaded[PHASE][0]), np.append(row, row[0])
        ax.plot(at, load / r_b / te * um, color=colour, label=f"{load:.4g} N m")
    ax.set(xlabel="phase of the mesh cycle [pitches]", ylabel="mesh stiffness F / STE [N/µm]")
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    ax.grid(alpha=0.3)
    return ax


def _colours(torque: np.ndarray) -> np.ndarray:
    return colormaps["viridis"](np.linspace(0, 0.85, torque.size))


@checked
def plot_run_up(run, ax: Axes | None = None, stage: int = 0, found: Resonances | None = None) -> Axes:
    """Dynamic transmission error of one stage over its mesh frequency, with its envelope.

    run     an `exugear.Run` or its data, as in all plots of runs
    found   `Resonances` to be marked, as `exugear.resonances` finds them in the envelope
    """
    ax, data = axes_or_new(ax), stage_data(run, stage)
    outline = dte_envelope(run, stage)
    ax.fill_between(outline.place, outline.low / um, outline.high / um, color=TRACE, linewidth=0)
    for side in (outline.high, outline.low):
        ax.plot(outline.place, side / um, color=EDGE, linewidth=1.2)
    if found is not None:
        _mark(ax, outline, found)
    ends = outline.place.min(), outline.place.max()
    ax.set(xlabel="mesh frequency [Hz]", ylabel="dynamic transmission error [µm]", title=_title(data))
    ax.set_xlim(*ends if ends[0] < ends[1] else (None, None))
    ax.grid(alpha=0.3)
    return ax


def _title(data: xr.Dataset) -> str:
    """Name of the stage, and the load where it is constant."""
    stage = str(data["stage"].item())
    try:
        return f"{stage}, {float(data.attrs['load']):.4g} N m"
    except (KeyError, ValueError):
        return stage


@checked
def plot_envelopes(runs: Mapping[str, Any], ax: Axes | None = None, stage: int = 0) -> Axes:
    """Half peak to peak of the DTE of several runs over mesh frequency; runs: name -> `exugear.Run` or its data."""
    ax = axes_or_new(ax)
    for (name, run), style in zip(runs.items(), cycle(("-", "--", ":")), strict=False):
        outline = dte_envelope(run, stage)
        ax.plot(outline.place, outline.amplitude / um, style, linewidth=1.4, label=name)
    ax.set(xlabel="mesh frequency [Hz]", ylabel="half peak to peak of the DTE [µm]")
    ax.set_ylim(bottom=0, auto=True)
    ax.legend()
    ax.grid(alpha=0.3)
    return ax


@checked
def plot_bearing_forces(run, ax: Axes | None = None) -> Axes:
    """Root mean square of the varying part of each bearing's radial force over the speed of the driving shaft."""
    ax, forces = axes_or_new(ax), bearing_force_rms(run)
    for name, row in zip(forces["bearing"].values, forces.values, strict=True):
        ax.plot(forces["speed"] / rpm, row, linewidth=1.2, label=str(name))
    ax.set(xlabel="speed of the driving shaft [rpm]", ylabel="rms of the varying radial force [N]")
    ax.set_ylim(bottom=0, auto=True)
    ax.legend(frameon=False, fontsize="small")
    ax.grid(alpha=0.3)
    return ax


def _mark(ax: Axes, outline: Envelope, resonances: Resonances) -> None:
    """Mark resonances on the envelope, with room for their frequencies inside the frame."""
    order = np.argsort(outline.place)
    heights = np.interp(resonances.place, outline.place[order], outline.high[order]) / um
    ax.plot(resonances.place, heights, "v", color=MARK, markersize=5)
    low, high = outline.low.min() / um, outline.high.max() / um
    ax.set_ylim(low - 0.05 * (high - low), high + 0.45 * (high - low))
    for frequency, height in zip(resonances.place, heights, strict=True):
        text = ax.annotate(f"{frequency:.0f} Hz", (frequency, height), (0, 7), textcoords="offset points", color=MARK)
        text.set(rotation=90, ha="center", fontsize="small")


@checked
def plot_waterfall(
    run, ax: Axes | None = None, stage: int = 0, harmonics: Finite = 3.2, decibels: Finite = 60.0
) -> Axes:
    """Order map of the DTE of one stage: amplitude over speed and mesh order.

    harmonics   highest mesh order shown
    decibels    range of amplitudes shown, down from the highest one

    Lines that cross the orders obliquely are harmonics that the steps of the run alias; a smaller `tolerance` of
    `exugear.run_up` removes them.
    """
    ax, data = axes_or_new(ax), stage_data(run, stage)
    time, speed, frequency = (data[name].values for name in ("time", "speed", "mesh_frequency"))
    cycles = max(1, min(CYCLES, int(SHARE * np.trapezoid(frequency, time))))
    spectrum = order_spectrum(time, 2 * np.pi * frequency, data["dte"].values, orders=harmonics, revolutions=cycles)
    shaft = spectrum.speed * np.abs(speed).max() / (2 * np.pi * frequency.max())
    orders, amplitude = _visible(spectrum.order, spectrum.amplitude)
    level = 20 * np.log10(np.maximum(amplitude / um, 1e-9))
    top = level.max()
    limits = {"vmin": top - decibels, "vmax": top}
    picture = ax.pcolormesh(shaft / rpm, orders, level.T, cmap="magma_r", rasterized=True, **limits)
    ax.figure.colorbar(picture, ax=ax, label="DTE amplitude [dB re 1 µm]")
    ax.set(xlabel="speed of the driving shaft [rpm]", ylabel="mesh order")
    ax.set_title(f"order map, {_title(data)}")
    return ax


def _visible(order: np.ndarray, amplitude: np.ndarray, lines: int = 120) -> tuple[np.ndarray, np.ndarray]:
    """Orders and amplitudes in groups of neighbouring orders, about as many as lines: mean order, largest amplitude."""
    share = max(1, order.size // lines)
    n = order.size // share * share
    middle = order[:n].reshape(-1, share).mean(axis=1)
    return middle, amplitude[:, :n].reshape(len(amplitude), -1, share).max(axis=2)


@checked
def plot_section(points: Numbers, quads: Numbers, ax: Axes | None = None, height: Finite | None = None) -> Axes:
    """Transverse section of a mesh, points (2, n) [m] and quads (4, n); height: shows this much below the tip [m]."""
    points, quads = _coordinates(points, 2) / mm, _corners("quads", quads)
    ax = axes_or_new(ax)
    ax.add_collection(PolyCollection(points[:, quads].T, facecolor=STEEL, edgecolor="k", linewidth=0.3))
    top = points[1].max()
    if height is None:
        ax.autoscale_view()
    else:
        ax.set(xlim=(-0.75 * height / mm, 0.75 * height / mm), ylim=(top - height / mm, top + 0.03 * height / mm))
    ax.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    return ax


@checked
def plot_solid(points: Numbers, facets: Numbers, ax: Axes | None = None) -> Axes:
    """Surface of a solid mesh in space, points (3, n) [m] and the rings of its outer facets (4, n)."""
    corners = _coordinates(points, 3)[:, _corners("facets", facets)].transpose(2, 1, 0) / mm
    space: Any = axes_or_new(ax, projection="3d")
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    shade = 0.55 + 0.45 * np.abs(normal @ np.array([0.3, 0.4, 0.86]))
    faces = Poly3DCollection(corners, facecolors=colormaps["bone"](shade), edgecolors="k", linewidths=0.1)
    space.add_collection3d(faces)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    for name, a, b in zip("xyz", low, high, strict=True):
        getattr(space, f"set_{name}lim")(a, b)
    space.set_box_aspect(high - low, zoom=1.25)
    space.view_init(elev=32, azim=68)
    space.set_axis_off()
    return space


def _coordinates(points, dim: int) -> np.ndarray:
    points = np.asarray(points, float)
    fits = points.ndim == 2 and len(points) == dim and bool(np.isfinite(points).all())
    require(fits, f"points must be ({dim}, n) finite coordinates [m], got an array of shape {points.shape}")
    return points


def _corners(name: str, cells) -> np.ndarray:
    cells = np.asarray(cells)
    fits = cells.ndim == 2 and len(cells) == 4 and cells.dtype.kind in "iu"
    require(fits, f"{name} must be (4, n) numbers of points, got {cells.dtype} of shape {cells.shape}")
    return cells
