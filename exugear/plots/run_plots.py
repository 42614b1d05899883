"""Plots of runs: DTE with its envelope, envelopes of several runs, mesh forces, forces and orbits of bearings."""

from collections.abc import Mapping
from itertools import cycle, pairwise
from typing import Any, TypeVar

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from exugear.plots.figures import DISTINCT, GUIDE, axes_or_new, finished, legend, merged, styled, title_of
from exugear.running.run_data import stage_data
from exugear.signals.envelope import Envelope, Peaks, bearing_force_rms, dte_envelope, envelope, mesh_cycles
from exugear.signals.member_orbit import stands_still
from exugear.signals.signal import require_signal, signal
from fem.support.arguments import Numbers, checked, renamed
from fem.support.validation import require
from fem.units import rpm, um

__all__ = ["plot_bearing_forces", "plot_envelopes", "plot_mesh_force", "plot_orbit", "plot_run_up"]

EDGE, MARK = DISTINCT[0], DISTINCT[3]
#: Line styles that show curves one over the other.
DASHES = "-", "--", ":"
#: Least distance of labels of resonances in a row, as share of the axis, and height of a row [points].
CLOSE, ROW = 0.03, 42
#: Mesh cycles up to which a force is a curve over time, beyond which it is a band; number of windows of the band.
SHOWN_CYCLES, WINDOWS = 60, 280
#: Half the least range of the axes of an orbit that is rounding alone [µm].
STILL = 1.0
#: Largest deviation of the mesh force, over its mean, that is shown without 0; least range of the axis over the mean.
NEAR_PARTING, LEAST_RANGE = 0.5, 0.01
#: Quantity of an orbit, and the unit in which it is shown with its symbol, by its unit in the data.
ORBITS = {"m": ("displacement", um, "µm"), "N": ("force", 1.0, "N")}

Samples = TypeVar("Samples", xr.Dataset, xr.DataArray)


@renamed(found="resonances")
@checked
@styled
def plot_run_up(
    run, ax: Axes | None = None, stage: int | str = 0, resonances: xr.Dataset | Peaks | Numbers | None = None, **style
) -> Axes:
    """Dynamic transmission error of one stage over its mesh frequency, with its envelope.

    run         an `exugear.Run` or its data, as in all plots of runs
    stage       its number or label
    resonances  marked: as `exugear.resonances` returns them, peaks of `exugear.dte_envelope`, or frequencies [Hz]
    style       of the lines of the envelope, as in all plots: matplotlib's color, linewidth, linestyle, label, …
    """
    ax, data = axes_or_new(ax), stage_data(run, stage)
    outline = dte_envelope(run, stage)
    _band(ax, outline.abscissa, outline.low / um, outline.high / um, style)
    if resonances is not None:
        _mark(ax, outline, _frequencies(resonances))
    ends = outline.abscissa.min(), outline.abscissa.max()
    ax.set(xlabel="mesh frequency [Hz]", ylabel="dynamic transmission error [µm]", title=title_of(data))
    ax.set_xlim(*ends if ends[0] < ends[1] else (None, None))
    legend(ax)
    return ax


@checked
@styled
def plot_envelopes(runs: Mapping[str, Any], ax: Axes | None = None, stage: int | str = 0, **style) -> Axes:
    """Half peak to peak of the DTE of a stage, by its number or label, in several runs over the mesh frequency.

    runs    name -> `exugear.Run` or its data
    """
    ax = axes_or_new(ax)
    for (name, run), colour, dash in zip(runs.items(), cycle(DISTINCT), cycle(DASHES), strict=False):
        outline = dte_envelope(run, stage)
        options = merged(style, color=colour, linestyle=dash, label=name)
        ax.plot(outline.abscissa, outline.amplitude / um, **options)
    return finished(ax, xlabel="mesh frequency [Hz]", ylabel="half peak to peak of the DTE [µm]")


@checked
@styled
def plot_mesh_force(
    run, ax: Axes | None = None, stage: int | str = 0, window: tuple[float, float] | None = None, **style
) -> Axes:
    """Mesh force of one stage over time, beside its mean static force.

    A force that falls below half of its mean is shown with 0, at which the teeth part; a ripple fills the axes.

    stage   its number or label
    window  start and end [s]; by default the whole run. Over more than 60 mesh cycles a band shows the limits of the
            force in each of 280 parts of the window
    """
    ax, data = axes_or_new(ax), in_window(stage_data(run, stage), window)
    time, force = data["time"].values, data["mesh_force"].values
    cycles = mesh_cycles(data)
    if cycles[-1] <= SHOWN_CYCLES:
        ax.plot(time, force, **merged(style, color=EDGE))
    else:
        limits = envelope(time, force, min(WINDOWS, time.size // 2), cycles=cycles)
        _band(ax, limits.abscissa, limits.low, limits.high, style)
    ax.axhline(force.mean(), color=GUIDE, linewidth=0.9, linestyle="--", label="mean")
    deviation, mean = np.abs(force - force.mean()).max(), abs(force.mean())
    if deviation > NEAR_PARTING * mean:
        ax.axhline(0.0, color=GUIDE, linewidth=0.9)
    elif deviation < LEAST_RANGE / 2 * mean:
        ax.set_ylim(force.mean() - LEAST_RANGE / 2 * mean, force.mean() + LEAST_RANGE / 2 * mean)
    ax.set(xlabel="time [s]", ylabel="mesh force [N]", title=title_of(data), xlim=(time[0], time[-1]))
    legend(ax)
    return ax


@checked
@styled
def plot_bearing_forces(run, ax: Axes | None = None, **style) -> Axes:
    """Root mean square of the varying part of each bearing's radial force over the speed of the driving shaft."""
    ax, forces = axes_or_new(ax), bearing_force_rms(run)
    lines = zip(forces["bearing"].values, forces.values, cycle(DISTINCT), cycle(DASHES), strict=False)
    for name, row, colour, dash in lines:
        ax.plot(forces["speed"] / rpm, row, **merged(style, color=colour, linestyle=dash, label=str(name)))
    return finished(ax, xlabel="speed of the driving shaft [rpm]", ylabel="rms of the varying radial force [N]")


@checked
@styled
def plot_orbit(
    run, ax: Axes | None = None, bearing: str | None = None, window: tuple[float, float] | None = None, **style
) -> Axes:
    """Orbit of the shaft at a bearing, y over x, or that of the radial force of the bearing; a cross marks its mean.

    run         an `exugear.Run` or its data: of the shaft where it ran with displacement=True, else of the force. Or a
                signal over bearing and direction, such as `exugear.signal(run, "bearing_force")`; or the orbit of a
                member of a set, as `exugear.member_orbit` returns it
    bearing     name in run.data["bearing"]; by default the first; left out with a member's orbit
    window      start and end [s]; by default the last turn of the driving shaft, of a member's orbit of the carrier
                against the ring

    Raises ValueError for runs without bearings, unknown bearings and windows outside the run.
    """
    is_of_member = isinstance(run, xr.Dataset) and "member" in run.attrs
    motion = _motion_of_member(run) if is_of_member else run if isinstance(run, xr.DataArray) else None
    motion = _motion_at_bearings(run) if motion is None else motion
    over = {"bearing", "direction"} <= set(motion.dims) and motion.attrs.get("units") in ORBITS
    remedy = "pass exugear.signal(run, 'bearing_force') and select the bearing by bearing="
    require(over, f"run must be a run or its forces or displacements over bearing and direction; {remedy}")
    require_signal(motion)
    names = motion["bearing"].values.tolist()
    name = names[0] if bearing is None else bearing
    require(name in names, f"bearing must be one of {names}, got {bearing!r}")
    ax, motion = axes_or_new(ax), in_window(motion, _last_turn(motion) if window is None else window)
    quantity, unit, symbol = ORBITS[motion.attrs["units"]]
    x, y = motion.sel(bearing=name, direction=["x", "y"]).transpose("direction", "time").values / unit
    still = stands_still(motion.sel(bearing=name))
    label = f"{name}, which does not move" if still else name
    ax.plot(x, y, **merged(style, color=EDGE, linewidth=1.0, label=label))
    ax.plot(x.mean(), y.mean(), "+", color=MARK, markersize=11, markeredgewidth=1.6, label="mean")
    along = {"pin": ("along the pin's radius", "across it")}.get(str(run.attrs.get("frame")) if is_of_member else "")
    along_x, along_y = along or ("along x", "along y")
    ax.set(xlabel=f"{quantity} {along_x} [{symbol}]", ylabel=f"{quantity} {along_y} [{symbol}]")
    if is_of_member and run.attrs["frame"] not in ("pin", "housing"):
        ax.set_title(f"in the frame of {run.attrs['frame']}")
    if still:
        ax.update_datalim([(-STILL, -STILL), (STILL, STILL)])
        ax.autoscale_view()
    ax.set_aspect("equal", adjustable="datalim")
    legend(ax)
    return ax


def _motion_of_member(orbit: xr.Dataset) -> xr.DataArray:
    """The displacement or force of an orbit of `exugear.member_orbit`, as of a bearing named after the member."""
    motion = next(orbit[name] for name in ("displacement", "force") if name in orbit)
    return motion.expand_dims(bearing=[orbit.attrs["member"]])


def _motion_at_bearings(run) -> xr.DataArray:
    """Displacements of the shafts at the bearings of a run, where its data hold them, else the forces."""
    names = [name for name in ("bearing_displacement", "bearing_force") if name in stage_data(run)]
    require(bool(names), "run must have bearings, whose forces it records; the shafts of this run only spin")
    return signal(run, names[0])


def in_window(data: Samples, window: tuple[float, float] | None) -> Samples:
    """The samples of a window of time [s]; ValueError for windows with fewer than two."""
    time = data["time"].values
    if window is None:
        return data
    inside = (time >= window[0]) & (time <= window[1])
    span = f"window must be start and end within {time[0]:.6g} to {time[-1]:.6g} s, with two samples at least"
    require(int(inside.sum()) >= 2, f"{span}, got {window}")
    return data.isel(time=inside)


def _last_turn(data: xr.DataArray) -> tuple[float, float]:
    """Start and end [s] of the last turn of the driving shaft, or of the whole run where it is shorter."""
    time = data["time"].values
    first = np.searchsorted(data["angle"].values, data["angle"].values[-1] - 2 * np.pi)
    return float(time[min(first, time.size - 2)]), float(time[-1])


def _band(ax: Axes, abscissa: np.ndarray, low: np.ndarray, high: np.ndarray, style: dict[str, Any]) -> None:
    """Band between the limits of a signal, the upper line labelled.

    It is filled piece by piece between the turns of the abscissa, as areas of opposite directions would cancel.
    """
    line = merged(style, color=EDGE, linewidth=1.2)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(abscissa)))) + 1
    for first, last in pairwise([0, *turns, abscissa.size - 1]):
        way = slice(first, last + 1)
        ax.fill_between(abscissa[way], low[way], high[way], color=line["color"], alpha=0.3, linewidth=0)
    ax.plot(abscissa, high, **line)
    ax.plot(abscissa, low, **line | {"label": None})


def _frequencies(resonances: xr.Dataset | Peaks | np.ndarray) -> np.ndarray:
    """(n,) rising mesh frequencies of resonances [Hz]."""
    if isinstance(resonances, xr.Dataset):
        require("mesh_frequency" in resonances, "resonances must have mesh_frequency; pass exugear.resonances(run)")
        resonances = resonances["mesh_frequency"].values
    frequencies = np.asarray(resonances.abscissa if isinstance(resonances, Peaks) else resonances, float).ravel()
    return np.sort(frequencies[np.isfinite(frequencies)])


def _mark(ax: Axes, outline: Envelope, frequencies: np.ndarray) -> None:
    """Mark resonances on the envelope, their frequencies inside the frame, those of close ones in two rows."""
    abscissa, low, high, _ = outline
    rising = np.argsort(abscissa)
    heights = np.interp(frequencies, abscissa[rising], high[rising]) / um
    ax.plot(frequencies, heights, "v", color=MARK, markersize=5)
    least, largest = low.min() / um, high.max() / um
    label_rows = _label_rows(frequencies, CLOSE * np.ptp(abscissa))
    ax.set_ylim(least - 0.05 * (largest - least), largest + (0.8 if any(label_rows) else 0.45) * (largest - least))
    for frequency, height, row in zip(frequencies, heights, label_rows, strict=True):
        offset = 0, 7 + ROW * row
        text = ax.annotate(f"{frequency:.0f} Hz", (frequency, height), offset, textcoords="offset points", color=MARK)
        text.set(rotation=90, ha="center", fontsize="small")


def _label_rows(positions: np.ndarray, least: float) -> list[int]:
    """Row of each label at rising positions, 0 or 1: the other row than the previous label where that is close."""
    rows: list[int] = []
    for k, close in enumerate(np.diff(positions, prepend=-np.inf) < least):
        rows.append(1 - rows[k - 1] if close else 0)
    return rows
