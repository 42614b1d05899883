"""Plots of STE maps: transmission error and mesh stiffness over the mesh cycle."""

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes

from exugear.plots.figures import axes_or_new
from fem.ste.ste_map import PHASE, TORQUE, over_torque_and_phase, over_torque_and_pitches, pair_of
from fem.support.arguments import checked
from fem.support.validation import require
from fem.units import um

__all__ = ["plot_ste", "plot_stiffness"]


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
