"""Plots of signals over speed: order maps, order cuts, spectrograms, waterfalls, levels."""

from collections.abc import Callable
from functools import wraps
from itertools import cycle, product
from math import inf
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from exugear.plots.figures import DISTINCT, axes_or_new, colour_bar, legend, merged, styled, title_of
from exugear.running.run_data import stage_data
from exugear.signals.short_time_spectra import order_tracking
from exugear.signals.signal import recorded_signal
from fem.support.arguments import Finite, checked, renamed
from fem.support.user_warning import warn_renamed
from fem.support.validation import require
from fem.units import rpm, um

__all__ = [
    "plot_levels",
    "plot_mesh_order_map",
    "plot_order_cuts",
    "plot_order_map",
    "plot_spectrogram",
    "plot_waterfall",
]

#: Length of a line of an order map of the DTE [mesh cycles], and its largest share of the run.
CYCLES, SHARE = 400, 1 / 20
#: Share of the energy of spectra that lies in the frequencies shown by default.
ENERGY = 0.999
#: Units in which plots show values: factor and name.
SHOWN = {"m": (1 / um, "µm"), "m/s^2": (1.0, "m/s²"), "1": (1.0, "")}
#: Change of the speed in a line of an order map, as share of it, from which on it flattens resonances.
SMEARED = 0.1
#: Colours of an amplitude, from white.
COLOURS = "magma_r"
#: Widths of the curves of order cuts: more than 15 orders differ in width, too.
WIDTHS = 1.6, 0.7


@renamed(orders="order_map")
@checked
@styled
def plot_order_map(order_map: xr.Dataset, ax: Axes | None = None, *, decibels: Finite = 60.0, **style) -> Axes:
    """Order map: amplitude over speed, or time where the speed is not monotonic, and order.

    order_map   of one channel, as `exugear.order_tracking` returns it
    decibels    range of amplitudes shown, down from the highest one
    style       of matplotlib's pcolormesh
    """
    amplitude = _channel("order_map", order_map, "order")
    return _draw_map(amplitude, _speed_name(amplitude).replace("speed", "order"), ax, decibels, style)


@checked
@styled
def plot_spectrogram(
    spectra: xr.Dataset, ax: Axes | None = None, *, decibels: Finite = 60.0, top: float | None = None, **style
) -> Axes:
    """Spectrogram or waterfall in colours: amplitude over time or speed, and frequency.

    spectra     of one channel, as `exugear.spectrogram` or `exugear.waterfall` returns it
    decibels    range of amplitudes shown, down from the highest one
    top         highest frequency shown [Hz]; by default that below which 99.9 % of the energy lies
    style       of matplotlib's pcolormesh
    """
    amplitude = _below(_channel("spectra", spectra, "frequency"), top)
    return _draw_map(amplitude, "frequency [Hz]", ax, decibels, style)


def _below(amplitude: xr.DataArray, top: float | None) -> xr.DataArray:
    """The amplitudes up to a highest frequency [Hz], by default that of `ENERGY`."""
    frequency = amplitude["frequency"].values
    if top is None:
        energy = np.cumsum((amplitude.values**2).sum(axis=0))
        last = int(np.searchsorted(energy, ENERGY * energy[-1])) if energy[-1] > 0 else frequency.size - 1
        top = frequency[np.clip(last, 1, frequency.size - 1)]
    require(top >= frequency[1], f"top must be >= {frequency[1]:g} Hz, the distance of the lines, got {top}")
    return amplitude.isel(frequency=frequency <= top)


def _draw_map(amplitude: xr.DataArray, label: str, ax: Axes | None, decibels: float, style: dict[str, Any]) -> Axes:
    """Amplitude (line, axis) in decibels over time or speed, and over the axis with its label."""
    require(0 < decibels < inf, f"decibels must be > 0 dB and finite, got {decibels}")
    require(amplitude.shape[0] > 1, "a map needs two spectra or more, got one; draw it with matplotlib's plot")
    ax, axis = axes_or_new(ax), amplitude.dims[-1]
    name, abscissa = _abscissa(amplitude, by_time=axis == "frequency")
    factor, unit, words = _shown(amplitude)
    ordinate, values = _visible(amplitude[axis].values, amplitude.values * factor)
    level = 20 * np.log10(np.maximum(values, 1e-30))
    top = np.nanmax(level, initial=-600.0)
    options = {"vmin": top - decibels, "vmax": top, "cmap": COLOURS, "rasterized": True}
    picture = ax.pcolormesh(abscissa, ordinate, level.T, **options | style)
    colour_bar(ax, picture, f"{words} [dB re {f'1 {unit}'.strip()}]")
    ax.set(xlabel=name + _smeared(amplitude, abscissa), ylabel=label)
    return ax


def _smeared(amplitude: xr.DataArray, abscissa: np.ndarray) -> str:
    """Words for the label of the abscissa of an order map: where its lines smear resonances."""
    if "speed_change" not in amplitude.coords:
        return ""
    smeared = abscissa[amplitude["speed_change"].values > SMEARED]
    between = f"resonances are smeared from {smeared.min():.4g} to {smeared.max():.4g}" if smeared.size else ""
    return f"\n{between}:\nthe speed changes by more than {SMEARED:.0%} in a line" if between else ""


def _channel(name: str, data: xr.Dataset, axis: str) -> xr.DataArray:
    """The amplitude of one channel over (line, axis); ValueError for several channels or other data."""
    amplitude = data.get("amplitude", xr.DataArray(0.0))
    over = [dim for dim in ("time", "speed") if dim in amplitude.dims]
    fits = axis in amplitude.dims and len(over) == 1 and "speed" in amplitude.coords
    functions = "exugear's order_tracking, order_cut, spectrogram or waterfall"
    require(fits, f"{name} must hold an amplitude over time or speed and {axis}; pass what {functions} returned")
    further = [str(dim) for dim in amplitude.dims if dim not in (*over, axis)]
    require(not further, f"{name} must hold one channel; select one by .sel, or sum over {further} by exugear.rms_sum")
    return amplitude.transpose(*over, axis)


def _shown(amplitude: xr.DataArray) -> tuple[float, str, str]:
    """Factor to the unit in which an amplitude is shown, the unit, and words for the amplitude."""
    units = amplitude.attrs.get("units", "1")
    return *SHOWN.get(units, (1.0, units)), amplitude.attrs.get("long_name", "amplitude")


def _abscissa(amplitude: xr.DataArray, *, by_time: bool = False) -> tuple[str, np.ndarray]:
    """Label and values of the speed [rpm], or of the time where it is asked for or the speed is not monotonic."""
    steps = np.diff(amplitude["speed"].values)
    if "time" in amplitude.dims and (by_time or not ((steps > 0).all() or (steps < 0).all())):
        return "time [s]", amplitude["time"].values
    return f"{_speed_name(amplitude)} [rpm]", amplitude["speed"].values / rpm


def _speed_name(amplitude: xr.DataArray) -> str:
    return amplitude["speed"].attrs.get("long_name", "speed of the shaft")


@checked
@styled
def plot_order_cuts(cuts: xr.Dataset, ax: Axes | None = None, *, decibels: Finite | None = None, **style) -> Axes:
    """Amplitudes of orders over speed, a curve per order with its harmonic and stage; NaN leave gaps.

    cuts        of one channel, as `exugear.order_cut` returns it
    decibels    range of a logarithmic axis, down from the highest amplitude; by default the axis is linear
    style       of matplotlib's plot
    """
    amplitude, ax = _channel("cuts", cuts, "order"), axes_or_new(ax)
    label, abscissa = _abscissa(amplitude)
    factor, unit, words = _shown(amplitude)
    looks = cycle(product(WIDTHS, ("-", "--", ":"), DISTINCT))
    for name, row, (width, line, colour) in zip(_labels(amplitude, "order"), amplitude.values.T, looks, strict=False):
        look = merged(style, linewidth=width, linestyle=line, color=colour, label=name)
        ax.plot(abscissa, row * factor, **look)
    ax.set(xlabel=label, ylabel=f"{words} [{unit or '-'}]", title=_channel_name(amplitude))
    require(decibels is None or 0 < decibels < inf, f"decibels must be > 0 dB and finite, got {decibels}")
    if decibels is None:
        ax.set_ylim(bottom=0, auto=True)
    else:
        top = float(amplitude.max()) * factor
        require(top > 0, "cuts must hold an amplitude > 0 that can be told for decibels; all are 0 or NaN")
        ax.set(yscale="log", ylim=(top * 10 ** (-decibels / 20), 1.5 * top))
    legend(ax)
    return ax


def _also_of_runs(plot: Callable) -> Callable:
    """Decorator: an earlier version of the plot took a run, for its order map."""

    @wraps(plot)
    def drawn(*args, **options):
        data = args[0] if args else options.get("run")
        if (isinstance(data, xr.Dataset) and "dte" in data) or isinstance(getattr(data, "data", None), xr.Dataset):
            old = dict(zip(("run", "ax", "stage", "harmonics", "decibels"), args, strict=False)) | options
            if "harmonics" in old:
                old["top"] = old.pop("harmonics")
            ax = plot_mesh_order_map(**old)
            warn_renamed("plot_waterfall of a run", "plot_mesh_order_map(run)")
            return ax
        return plot(*args, **options)

    return drawn


@_also_of_runs
@checked
@styled
def plot_waterfall(
    spectra: xr.Dataset, ax: Axes | None = None, *, height: Finite = 8.0, top: float | None = None, **style
) -> Axes:
    """Waterfall, or cascade: spectra over frequency, one above the other at their speeds.

    spectra    of one channel, as `exugear.waterfall` returns it
    height     of the largest amplitude, as multiple of the distance of two spectra
    top        highest frequency shown [Hz]; by default that below which 99.9 % of the energy lies
    style      of matplotlib's plot
    """
    amplitude, ax = _below(_channel("spectra", spectra, "frequency"), top), axes_or_new(ax)
    speed = amplitude["speed"].values / rpm
    require(0 < height < inf, f"height must be > 0 distances of two spectra and finite, got {height}")
    rise = height * np.ptp(speed) / max(speed.size - 1, 1) / (float(amplitude.max()) or 1.0)
    for k in np.argsort(speed)[::-1]:
        line = speed[k] + rise * amplitude.values[k]
        depth = 2 + 1e-3 * (speed.max() - speed[k]) / (np.ptp(speed) or 1.0)
        ax.fill_between(amplitude["frequency"], speed[k], line, color="white", zorder=4 - depth)
        ax.plot(amplitude["frequency"], line, **merged(style, color=DISTINCT[0], linewidth=0.6, zorder=4 - depth))
    factor, unit, words = _shown(amplitude)
    ax.set_title(f"{words},\nhighest amplitude {float(amplitude.max()) * factor:.3g} {unit}")
    label, last = f"{_speed_name(amplitude)} [rpm]", float(amplitude["frequency"][-1])
    ax.set(xlabel="frequency [Hz]", ylabel=label, xlim=(0, last))
    return ax


def plot_cascade(spectra: xr.Dataset, ax: Axes | None = None, **options) -> Axes:
    """Deprecated name of `plot_waterfall`."""
    ax = plot_waterfall(spectra, ax, **options)
    warn_renamed("plot_cascade", "plot_waterfall")
    return ax


@checked
@styled
def plot_levels(levels: xr.DataArray, ax: Axes | None = None, **style) -> Axes:
    """Levels over speed, or over time where the speed is not monotonic, a curve per channel.

    levels    (..., time) or (..., speed) with the coordinate speed, as `exugear.level` returns them
    style     of matplotlib's plot
    """
    ax = axes_or_new(ax)
    over = [dim for dim in ("time", "speed") if dim in levels.dims]
    fits = len(over) == 1 and "speed" in levels.coords
    require(fits, f"levels must be over time or speed, with the coordinate speed; got the dimensions {levels.dims}")
    require(levels.size > 0, "levels must hold values, got none")
    label, abscissa = _abscissa(levels)
    channels = [str(dim) for dim in levels.dims if dim != over[0]]
    rows = levels.transpose(*channels, ...).values.reshape(-1, levels.sizes[over[0]])
    names = product(*(_labels(levels, dim) for dim in channels))
    styles = cycle(product(("-", "--", ":"), DISTINCT))
    for name, row, (line, colour) in zip(names, rows, styles, strict=False):
        ax.plot(abscissa, row, **merged(style, linestyle=line, color=colour, label=", ".join(name)))
    ax.set(xlabel=label, ylabel=f"{levels.attrs.get('long_name', 'level')} [dB]", title=_channel_name(levels))
    legend(ax)
    return ax


def _channel_name(values: xr.DataArray) -> str:
    """Bearing and direction of values of a single one, for a title."""
    chosen = {dim: str(values[dim].item()) for dim in ("bearing", "direction") if _is_chosen(values, dim)}
    words = [f"bearing {chosen['bearing']}"] if "bearing" in chosen else []
    return ", ".join(words + ([f"along {chosen['direction']}"] if "direction" in chosen else []))


def _is_chosen(values: xr.DataArray, dim: str) -> bool:
    return dim in values.coords and values[dim].ndim == 0


def _labels(levels: xr.DataArray, dim: str) -> list[str]:
    """Words for the channels along a dimension: names as they are, numbers behind the name of the dimension."""
    name = f"{dim}_name" if f"{dim}_name" in levels.coords else dim
    labels = levels[name].values.tolist()
    return [label if isinstance(label, str) else f"{dim} {label:.6g}" for label in labels]


@checked
@styled
def plot_mesh_order_map(
    run, ax: Axes | None = None, stage: int | str = 0, *, top: Finite = 3.2, decibels: Finite = 60.0, **style
) -> Axes:
    """Order map of the DTE of one stage: amplitude over speed and mesh order.

    run         an `exugear.Run` or its data
    stage       its number or label
    top         highest mesh order shown
    decibels    range of amplitudes shown, down from the highest one
    style       of matplotlib's pcolormesh

    Lines that cross the orders obliquely are harmonics that the steps of the run alias; a smaller `tolerance` of
    `exugear.run_up` removes them.
    """
    data = stage_data(run, stage)
    ax = _draw_map(_mesh_order_map(data, top), "mesh order", ax, decibels, style)
    ax.set_title(f"order map, {title_of(data)}")
    return ax


def _mesh_order_map(data: xr.Dataset, highest_order: float) -> xr.DataArray:
    """Amplitude of the DTE of one stage over time, with the speed of the driving shaft, and mesh order."""
    time, frequency = data["time"].values, data["mesh_frequency"].values
    turned = np.trapezoid(np.abs(frequency), time)
    require(turned > 1, f"run must hold more than one mesh cycle for its order map, got {turned:.3g}; run it longer")
    dte = recorded_signal(time, 2 * np.pi * frequency, data["dte"].values, units="m", long_name="DTE amplitude")
    cycles = max(1, min(CYCLES, int(SHARE * turned)))
    amplitude = order_tracking(dte, highest_order=highest_order, revolutions=cycles)["amplitude"]
    speed = np.interp(amplitude["time"], time, data["speed"])
    return amplitude.assign_coords(speed=("time", speed, {"long_name": "speed of the driving shaft"}))


def _visible(order: np.ndarray, amplitude: np.ndarray, lines: int = 120) -> tuple[np.ndarray, np.ndarray]:
    """Orders and amplitudes in groups of neighbouring orders, about as many as lines: mean order, largest amplitude."""
    share = max(1, order.size // lines)
    n = order.size // share * share
    middle = order[:n].reshape(-1, share).mean(axis=1)
    return middle, amplitude[:, :n].reshape(len(amplitude), -1, share).max(axis=2)
