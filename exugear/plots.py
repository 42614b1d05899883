"""Pictures for a report: each takes data and an axes (or makes one) and returns the axes."""

from itertools import cycle

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from exugear.spectrum import Envelope, Resonances, envelope, order_spectrum
from fem.ste import PHASE, TORQUE, over_torque_and_phase, pair_of
from fem.units import mm, rpm, um

STEEL = "#c9d3dc"
TRACE, EDGE, MARK = "#9ecae1", "#08519c", "#cb181d"


def _axes(ax: Axes | None, **projection) -> Axes:
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.figure(figsize=(8, 4.5), layout="constrained").add_subplot(**projection)


def figure(rows: int = 1, columns: int = 1, spatial: tuple[int, ...] = ()) -> Figure:
    """Empty figure for a report; the axes numbered in spatial are three-dimensional."""
    made = Figure(figsize=(7.5 * columns, 4.8 * rows), layout="constrained")
    for i in range(rows * columns):
        made.add_subplot(rows, columns, i + 1, projection="3d" if i in spatial else None)
    return made


def plot_ste(ste: xr.Dataset, ax: Axes | None = None, pitches: float = 2.0) -> Axes:
    """Transmission error over some pitches, a curve per torque."""
    ax = _axes(ax)
    phase, torque = ste[PHASE].values, ste[TORQUE].values
    repeats = np.arange(np.ceil(pitches))
    at = (phase + repeats[:, None]).ravel()
    for row, load, colour in zip(over_torque_and_phase(ste).values, torque, _colours(torque), strict=True):
        ax.plot(at, np.tile(row, repeats.size) / um, color=colour, label=f"{load:g} N m", marker=".", markersize=3)
    ax.set(xlabel="phase of the mesh cycle [pitches]", ylabel="static transmission error [µm]", xlim=(0, pitches))
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    ax.grid(alpha=0.3)
    return ax


def plot_stiffness(ste: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Secant mesh stiffness F / STE over the phase, a curve per torque above 0."""
    ax = _axes(ax)
    r_b = pair_of(ste).pinion.r_b
    loaded = ste.sel({TORQUE: ste[TORQUE] > 0})
    torque = loaded[TORQUE].values
    for row, load, colour in zip(over_torque_and_phase(loaded).values, torque, _colours(torque), strict=True):
        at, te = np.append(loaded[PHASE], 1 + loaded[PHASE][0]), np.append(row, row[0])
        ax.plot(at, load / r_b / te * um, color=colour, label=f"{load:g} N m")
    ax.set(xlabel="phase of the mesh cycle [pitches]", ylabel="mesh stiffness F / STE [N/µm]")
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    ax.grid(alpha=0.3)
    return ax


def _colours(torque: np.ndarray) -> np.ndarray:
    return colormaps["viridis"](np.linspace(0, 0.85, torque.size))


def plot_run_up(run, ax: Axes | None = None, stage: int = 0, found: Resonances | None = None) -> Axes:
    """Dynamic transmission error of one stage over mesh frequency with its envelope and the resonances found in it."""
    ax = _axes(ax)
    frequency, dte = run.data["mesh_frequency"].values, run.data["dte"].values[stage]
    outline = envelope(frequency, dte)
    ax.plot(frequency, dte / um, color=TRACE, linewidth=0.2, rasterized=True)
    _draw_outline(ax, outline)
    if found is not None:
        _mark(ax, outline, found)
    ax.set(xlabel="mesh frequency [Hz]", ylabel="dynamic transmission error [µm]", xlim=(0, frequency.max()))
    ax.grid(alpha=0.3)
    return ax


def plot_envelopes(runs, ax: Axes | None = None, stage: int = 0) -> Axes:
    """Half peak to peak of the DTE of several runs over mesh frequency; runs: name -> `Run.data`."""
    ax = _axes(ax)
    for (name, data), style in zip(runs.items(), cycle(("-", "--", ":")), strict=False):
        outline = envelope(data["mesh_frequency"].values, data["dte"].values[stage])
        ax.plot(outline.place, (outline.high - outline.low) / 2 / um, style, linewidth=1.4, label=name)
    ax.set(xlabel="mesh frequency [Hz]", ylabel="half peak to peak of the DTE [µm]", ylim=(0, None))
    ax.legend()
    ax.grid(alpha=0.3)
    return ax


def _draw_outline(ax: Axes, outline: Envelope) -> None:
    ax.plot(outline.place, outline.high / um, color=EDGE, linewidth=1.2, label="envelope")
    ax.plot(outline.place, outline.low / um, color=EDGE, linewidth=1.2)


def _mark(ax: Axes, outline: Envelope, found: Resonances) -> None:
    for place in found.place:
        height = np.interp(place, outline.place, outline.high) / um
        ax.plot(place, height, "v", color=MARK, markersize=5)
        text = ax.annotate(f"{place:.0f} Hz", (place, height), (0, 7), textcoords="offset points", color=MARK)
        text.set(rotation=90, ha="center", fontsize="small")
    ax.margins(y=0.2)


def plot_waterfall(run, ax: Axes | None = None, stage: int = 0, harmonics: float = 3.2) -> Axes:
    """Amplitude of the DTE over speed and order of the mesh (Campbell diagram)."""
    ax = _axes(ax)
    data = run.data
    speed, frequency = data["speed"].values, data["mesh_frequency"].values
    teeth = float(2 * np.pi * frequency[-1] / abs(speed[-1]))
    spectrum = order_spectrum(data["time"].values, speed, data["dte"].values[stage], orders=harmonics * teeth)
    orders, amplitude = _visible(spectrum.order / teeth, spectrum.amplitude)
    level = 20 * np.log10(np.maximum(amplitude / um, 1e-4))
    picture = ax.pcolormesh(spectrum.speed / rpm, orders, level.T, cmap="magma", vmin=-50, rasterized=True)
    ax.figure.colorbar(picture, ax=ax, label="DTE amplitude [dB re 1 µm]")
    ax.set(xlabel="speed [rpm]", ylabel="order of the mesh frequency")
    return ax


def _visible(order: np.ndarray, amplitude: np.ndarray, lines: int = 240) -> tuple[np.ndarray, np.ndarray]:
    """Largest amplitudes of neighbouring orders, so that no line is thinner than a picture shows."""
    share = max(1, order.size // lines)
    n = order.size // share * share
    middle = order[:n].reshape(-1, share).mean(axis=1)
    return middle, amplitude[:, :n].reshape(len(amplitude), -1, share).max(axis=2)


def plot_section(points, quads, ax: Axes | None = None, height: float | None = None) -> Axes:
    """Transverse section of a mesh, points (2, n) [m] and quads (4, n); height: only that much below the tip [m]."""
    ax = _axes(ax)
    points, quads = np.asarray(points) / mm, np.asarray(quads)
    ax.add_collection(PolyCollection(points[:, quads].T, facecolor=STEEL, edgecolor="k", linewidth=0.3))
    top = points[1].max()
    if height is None:
        ax.autoscale_view()
    else:
        ax.set(xlim=(-0.75 * height / mm, 0.75 * height / mm), ylim=(top - height / mm, top + 0.03 * height / mm))
    ax.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    return ax


def plot_solid(points, facets, ax: Axes | None = None) -> Axes:
    """Surface of a solid mesh in space, points (3, n) [m] and the rings of its outer facets (4, n)."""
    ax = _axes(ax, projection="3d")
    corners = np.asarray(points)[:, np.asarray(facets)].transpose(2, 1, 0) / mm
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    shade = 0.55 + 0.45 * np.abs(normal @ np.array([0.3, 0.4, 0.86]))
    faces = Poly3DCollection(corners, facecolors=colormaps["bone"](shade), edgecolors="k", linewidths=0.1)
    ax.add_collection3d(faces)  # type: ignore[attr-defined]
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    for name, a, b in zip("xyz", low, high, strict=True):
        getattr(ax, f"set_{name}lim")(a, b)
    ax.set_box_aspect(high - low, zoom=1.25)  # type: ignore[call-arg]
    ax.view_init(elev=32, azim=68)  # type: ignore[attr-defined]
    ax.set_axis_off()
    return ax
