"""Plots for the diagnosis of gears: averages over a turn, envelope spectra, condition indicators over time."""

from itertools import cycle

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from exugear.plots.figures import DISTINCT, GUIDE, axes_or_new, legend, merged, styled
from exugear.plots.order_plots import SHOWN
from fem.support.arguments import checked
from fem.support.validation import require
from fem.units import deg

__all__ = ["plot_condition_indicators", "plot_envelope_spectrum", "plot_synchronous_average"]


@checked
@styled
def plot_synchronous_average(average: xr.DataArray, ax: Axes | None = None, **style) -> Axes:
    """An average, or what remains of it, over the angle of its shaft.

    average   (angle,) as `exugear.synchronous_average` or `residual_signal` returns it
    style     of matplotlib's plot
    """
    over = "average must be over angle alone; pass one channel and one average of exugear.synchronous_average"
    require(average.dims == ("angle",) and "turns" in average.attrs, over)
    ax, units = axes_or_new(ax), average.attrs.get("units", "1")
    factor, unit = SHOWN.get(units, (1.0, units))
    ax.plot(average["angle"] / deg, average * factor, **merged(style, color=DISTINCT[0], linewidth=1.0))
    words = average.attrs.get("long_name", "signal")
    ax.set(xlabel="angle of the shaft [°]", ylabel=f"{words} [{unit}]" if unit else words, xlim=(0, 360))
    ax.set_xticks(np.arange(0, 361, 45))
    ax.set_title(f"average of {average.attrs['turns']} turns")
    return ax


@checked
@styled
def plot_envelope_spectrum(
    lines: xr.Dataset, ax: Axes | None = None, *, orders: xr.DataArray | None = None, **style
) -> Axes:
    """Mean amplitudes of the orders of an envelope; dashed: those at which faults would show.

    lines    of one channel, as `exugear.envelope_spectrum` returns them
    orders   as `exugear.fault_orders` returns them; those beyond the spectrum are left out
    style    of matplotlib's plot
    """
    known = "mean_amplitude" in lines and lines["mean_amplitude"].dims == ("order",)
    require(known, "lines must have mean_amplitude of one channel; pass what exugear.envelope_spectrum(...) returned")
    require(orders is None or "cause" in orders.dims, "orders must be what exugear.fault_orders(...) returned")
    ax, mean = axes_or_new(ax), lines["mean_amplitude"]
    factor, unit = SHOWN.get(mean.attrs.get("units", "1"), (1.0, mean.attrs.get("units", "1")))
    highest = float(lines["order"][-1])
    ax.plot(lines["order"], mean * factor, **merged(style, color=DISTINCT[0], linewidth=1.0))
    causes: dict[float, list[str]] = {}
    for cause, order in zip(orders["cause"].values, orders.values, strict=True) if orders is not None else ():
        causes.setdefault(round(float(order), 9), []).append(str(cause))
    for (order, names), colour in zip(causes.items(), cycle(DISTINCT[1:]), strict=False):
        if 0 < order <= highest:
            ax.axvline(order, color=colour, linewidth=1.0, linestyle="--", label=", ".join(names), zorder=0)
    ax.set(xlabel="order of the shaft", ylabel=f"amplitude of the envelope [{unit}]", xlim=(0, highest))
    ax.set_ylim(bottom=0)
    legend(ax)
    return ax


@checked
@styled
def plot_condition_indicators(
    indicators: xr.Dataset, ax: Axes | None = None, *, names: tuple[str, ...] = ("FM4", "NA4", "kurtosis"), **style
) -> Axes:
    """Indicators over the time of their averages; dashed: 3, noise of a normal distribution.

    indicators   of one channel and several averages, as `exugear.condition_indicators` returns them
    names        of those that are drawn
    style        of matplotlib's plot
    """
    over = "indicators must be of one channel and several averages: exugear.synchronous_average(..., turns=...)"
    known = [str(name) for name, values in indicators.data_vars.items() if values.dims == ("average",)]
    require(bool(known) and "time" in indicators.coords, over)
    missing = [name for name in names if name not in known]
    require(bool(names) and not missing, f"names must be of {known}, got {[*names]}")
    ax = axes_or_new(ax)
    for name, colour in zip(names, cycle(DISTINCT), strict=False):
        look = merged(style, color=colour, marker="o", label=name)
        ax.plot(indicators["time"], indicators[name], **look)
    ax.axhline(3.0, color=GUIDE, linewidth=0.9, linestyle="--", label="normal distribution")
    ax.set(xlabel="time [s]", ylabel="indicator")
    legend(ax)
    return ax
