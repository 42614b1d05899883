"""Plots of STE maps: transmission error, its harmonics, mesh stiffness and load sharing."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from exugear.plots.figures import DISTINCT, GUIDE, axes_or_new, graded, legend, merged, styled
from fem.gear.rim_support import Bolts, period
from fem.pair.pair import GearPair
from fem.ste.ste_map import (
    LOAD_SHARE,
    PHASE,
    RING_ANGLE,
    TE,
    TORQUE,
    check_whole_cycle,
    over_torque_and_phase,
    over_torque_and_pitches,
    pair_of,
    periodic_spline,
)
from fem.ste.te_measures import te_harmonics
from fem.support.arguments import checked
from fem.support.validation import require
from fem.units import deg, mm, um

__all__ = ["plot_load_sharing", "plot_ring_stiffness", "plot_ste", "plot_stiffness", "plot_te_harmonics"]

#: Points of a curve over the ring angles.
DRAWN = 241


@checked
@styled
def plot_ste(
    ste: xr.Dataset, ax: Axes | None = None, pitches: float | None = None, alternating: bool = False, **style
) -> Axes:
    """Transmission error over some pitches, a curve per torque.

    pitches         number of pitches shown: by default two, or all pitches of a map over several
    alternating     subtract the mean over the mesh cycle, which leaves what excites vibrations
    style           of the lines, as in all plots: matplotlib's color, linewidth, linestyle, label, …
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
    for row, load, colour in zip(curves, torque, graded(torque), strict=True):
        line = merged(style, color=colour, label=f"{load:.4g} N m", marker=".", markersize=3)
        ax.plot(at, np.tile(row, repeats.size) / um, **line)
    name = "alternating part of the STE [µm]" if alternating else "static transmission error [µm]"
    ax.set(xlabel="phase of the mesh cycle [pitches]", ylabel=name, xlim=(0, shown))
    legend(ax)
    return ax


def _cycle_mean(phase: np.ndarray, te: np.ndarray, pitches: int) -> np.ndarray:
    """(n_torque, 1) means of te (n_torque, n_phase) over a number of pitches."""
    closed = np.append(te, te[:, :1], axis=1)
    return np.trapezoid(closed, np.append(phase, phase[0] + pitches), axis=1)[:, None] / pitches


@checked
@styled
def plot_te_harmonics(ste: xr.Dataset, ax: Axes | None = None, harmonics: int = 5, **style) -> Axes:
    """Amplitudes of the mesh harmonics of the transmission error over torque; bars where the map has a single torque.

    harmonics   number of harmonics shown
    """
    ax, te = axes_or_new(ax), over_torque_and_pitches(ste)
    amplitudes = te_harmonics(ste, harmonics)["amplitude"].transpose("harmonic", TORQUE) / um
    torque, orders = te[TORQUE].values, amplitudes["harmonic"].values
    if torque.size == 1:
        bars: dict[str, Any] = {"color": DISTINCT[0], "width": 0.6, "label": f"{torque[0]:.4g} N m"} | style
        ax.bar(orders, amplitudes.values[:, 0], **bars)
        ax.set(xlabel="mesh order", xticks=orders)
    else:
        for order, row, colour in zip(orders, amplitudes.values, graded(orders), strict=True):
            ax.plot(torque, row, **merged(style, color=colour, label=f"mesh order {order}", marker="o", markersize=3))
        ax.set(xlabel="pinion torque [N m]", xlim=(torque[0], torque[-1]))
    ax.set(ylabel="amplitude of the STE [µm]", ylim=(0, None))
    legend(ax)
    return ax


@checked
@styled
def plot_stiffness(ste: xr.Dataset, ax: Axes | None = None, **style) -> Axes:
    """Secant mesh stiffness F / STE over the phase, a curve per torque beside 0."""
    ax = axes_or_new(ax)
    r_b = pair_of(ste).pinion.r_b
    loaded = ste.sel({TORQUE: ste[TORQUE] != 0})
    torque = loaded[TORQUE].values
    for row, load, colour in zip(over_torque_and_phase(loaded).values, torque, graded(torque), strict=True):
        at, te = np.append(loaded[PHASE], 1 + loaded[PHASE][0]), np.append(row, row[0])
        ax.plot(at, load / r_b / te * um, **merged(style, color=colour, label=f"{load:.4g} N m"))
    ax.set(xlabel="phase of the mesh cycle [pitches]", ylabel="mesh stiffness F / STE [N/µm]", xlim=(0, 1))
    legend(ax)
    return ax


@checked
@styled
def plot_ring_stiffness(ste: xr.Dataset, ax: Axes | None = None, **style) -> Axes:
    """Secant mesh stiffness F / STE over the position of the mesh on a ring between its bolts, a curve per torque.

    ste     map over `ring_angle`, over a period of the support, of `fem.static_transmission_error`

    The curve is that of the mean STE of the mesh cycle, the band about it holds all phases. Triangles mark where the
    line of centres passes a bolt.
    """
    pair = pair_of(ste)
    te = check_whole_cycle(ste)[TE].sel({TORQUE: ste[TORQUE] != 0})
    further = set(te.dims) - {TORQUE, RING_ANGLE, PHASE}
    require(RING_ANGLE in te.dims, f"ste must have the axis {RING_ANGLE}, of a ring on fem.Bolts, got {te.dims}")
    require(not further, f"ste also has the axes {sorted(map(str, further))}; select one value of each: ste.sel(...)")
    ax, turn, torque = axes_or_new(ax), period(pair.wheel.support) or 2 * np.pi, te[TORQUE].values
    angle = te[RING_ANGLE].values
    at = np.linspace(0, turn, DRAWN)
    curves = te.transpose(RING_ANGLE, TORQUE, PHASE).values
    over = periodic_spline((angle - angle[0]) / turn, curves)((at - angle[0]) / turn % 1.0)
    for row, (load, colour) in enumerate(zip(torque, graded(torque), strict=True)):
        stiffness = load / pair.pinion.r_b / over[:, row] * um
        mean = load / pair.pinion.r_b / over[:, row].mean(axis=1) * um
        line = merged(style, color=colour, label=f"{load:.4g} N m")
        ax.plot(at / deg, mean, **line)
        ax.fill_between(at / deg, stiffness.min(axis=1), stiffness.max(axis=1), color=colour, alpha=0.15, linewidth=0)
    half_tooth = np.pi * (1 - pair.back_phase) / abs(pair.wheel.z)
    bolts = [angle for part in pair.wheel.support if isinstance(part, Bolts) for angle in part.angles]
    passed = np.unique(np.round(np.mod(np.array(bolts) - half_tooth, 2 * np.pi), 9))
    passed = passed[passed <= turn] / deg
    ax.plot(passed, 0 * passed, "^", color=GUIDE, clip_on=False, label="bolt")
    ax.set(xlabel="ring angle of the mesh [deg]", ylabel="mesh stiffness F / STE [N/µm]", xlim=(0, turn / deg))
    ax.set_ylim(0, None)
    legend(ax)
    return ax


@checked
@styled
def plot_load_sharing(ste: xr.Dataset, ax: Axes | None = None, **style) -> Axes:
    """Share of the load on one tooth pair while it passes the path of contact, a curve per torque beside 0.

    Of a map over several pitches each pair has a curve of its own.

    ste     map with load shares, as `fem.static_transmission_error` returns it

    Letters mark the path of contact of spur pairs: A begin, E end, B to D single contact, C pitch point.
    """
    require(LOAD_SHARE in ste, "ste must have load shares; make the map with fem.static_transmission_error")
    ax, pair, further = axes_or_new(ax), pair_of(ste), set(ste[LOAD_SHARE].dims) - {TORQUE, PHASE, "pair"}
    require(not further, f"ste also has the axes {sorted(map(str, further))}; select one value of each: ste.sel(...)")
    check_whole_cycle(ste)
    share = ste[LOAD_SHARE].sel({TORQUE: ste[TORQUE] != 0}).transpose(TORQUE, "pair", PHASE)
    position = (ste["pair"].values[:, None] + ste[PHASE].values) * pair.p_bt / mm
    ends = position[0, 0], position[-1, -1]
    if ste.attrs.get("pitches", 1) > 1:
        loaded = position[(share.values > 0).any(axis=0)]
        ends = loaded.min(), loaded.max()
        position, share = np.pad(position, ((0, 0), (0, 1)), constant_values=np.nan), share.pad({PHASE: (0, 1)})
    torque = share[TORQUE].values
    if torque.min(initial=0.0) < 0:
        ends = -pair.eps_alpha * pair.p_bt / mm, pair.eps_alpha * pair.p_bt / mm
    for row, load, colour in zip(share.values, torque, graded(torque), strict=True):
        # Right flanks touch at the tip of the pinion first: their tooth pairs pass the path from its end.
        at = position if load > 0 else pair.back_phase * pair.p_bt / mm - position
        ax.plot(at.ravel(), row.ravel(), **merged(style, color=colour, label=f"{load:.4g} N m"))
    ax.set(xlabel="path of contact from the pitch point [mm]", ylabel="share of the load", xlim=ends, ylim=(0, 1.02))
    if pair.beta_b == 0:
        _mark_path(ax, pair)
    legend(ax)
    return ax


def _mark_path(ax: Axes, pair: GearPair) -> None:
    """Mark the points A to E of the path of contact by lines and by letters above the axes."""
    path = pair.path_of_contact
    start, end = path.start - path.pitch, path.end - path.pitch
    points = {"A": start, "B": end - pair.p_bt, "C": 0.0, "D": start + pair.p_bt, "E": end}
    for letter, position in points.items():
        ax.axvline(position / mm, color=GUIDE, linewidth=0.8, linestyle=":")
        ax.annotate(letter, (position / mm, 1.0), (0, 3), ("data", "axes fraction"), "offset points", ha="center")
