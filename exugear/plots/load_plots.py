"""Plots of load factors and dynamic stresses."""

from itertools import cycle

import xarray as xr
from matplotlib.axes import Axes

from exugear.plots.figures import DISTINCT, axes_or_new, check_result, finished, graded, legend, merged, styled
from fem.support.arguments import checked
from fem.support.validation import require
from fem.units import MPa, mm, rpm

__all__ = ["plot_dynamic_factor", "plot_dynamic_stress", "plot_load_factors"]

SPEED, TIME, GEAR = "speed", "time", "gear"
#: Words on the axis of each stress.
LABELS = {
    "root_stress": "tooth root stress",
    "tangent_stress": "root stress at the 30° tangent",
    "hertz_pressure": "contact pressure by Hertz",
    "peak_pressure": "peak contact pressure",
}


@checked
@styled
def plot_dynamic_factor(data: xr.Dataset, ax: Axes | None = None, *, iso: xr.DataArray | None = None, **style) -> Axes:
    """Dynamic factor of every stage over the speed of the driving shaft.

    data    as `exugear.dynamic_factor` returns it
    iso     factor of ISO 6336-1 over the speed of the driving shaft, drawn dashed, as `fem.iso6336.dynamic_factor`
            returns it for the pinion on that shaft; for a later stage assign it the speeds of the driving shaft
    style   of matplotlib's plot
    """
    is_factor = "K_v" in data and set(data["K_v"].dims) == {"stage", SPEED}
    require(is_factor, "data must have K_v over stage and speed; pass what exugear.dynamic_factor returns")
    ax = axes_or_new(ax)
    for name, colour in zip(data["stage"].values, cycle(DISTINCT), strict=False):
        factor = data["K_v"].sel(stage=name)
        ax.plot(factor[SPEED] / rpm, factor, **merged(style, color=colour, label=str(name)))
    if iso is not None:
        over_speed = iso.dims == (SPEED,)
        require(over_speed, f"iso must be over speed, got {iso.dims}; give fem.iso6336.dynamic_factor several speeds")
        ax.plot(iso[SPEED] / rpm, iso, "--", color="k", linewidth=1.2, label="ISO 6336-1, method B")
    ax.set(xlabel="speed of the driving shaft [rpm]", ylabel="dynamic factor $K_v$")
    ax.set_ylim(bottom=min(1.0, ax.dataLim.y0), auto=True)
    legend(ax)
    return ax


@checked
@styled
def plot_dynamic_stress(data: xr.Dataset, ax: Axes | None = None, *, name: str = "root_stress", **style) -> Axes:
    """Stress of pinion and wheel, or a contact pressure, over speed or time.

    data    as `exugear.stress_envelope` returns it (over speed), or `exugear.dynamic_stress` (over time)
    name    "root_stress", "tangent_stress", "hertz_pressure" or "peak_pressure"
    style   of matplotlib's plot
    """
    known = sorted(set(LABELS) & set(data))
    require(name in known, f"name must be a stress of the data, which has {known}, got {name!r}")
    stress = data[name]
    axis = next((axis for axis in (SPEED, TIME) if axis in stress.dims), None)
    require(axis is not None, f"data must be over speed or time, got {stress.dims}; pass exugear.stress_envelope(...)")
    ax = axes_or_new(ax)
    abscissa = data[axis].values / (rpm if axis == SPEED else 1.0)
    curves = {str(g): stress.sel({GEAR: g}) for g in stress[GEAR].values} if GEAR in stress.dims else {"": stress}
    for (label, curve), colour in zip(curves.items(), DISTINCT, strict=False):
        ax.plot(abscissa, curve.values / MPa, **merged(style, color=colour, label=label or None))
    words = "speed of the driving shaft [rpm]" if axis == SPEED else "time [s]"
    return finished(ax, xlabel=words, ylabel=f"{LABELS[name]} [MPa]")


@checked
@styled
def plot_load_factors(data: xr.Dataset, ax: Axes | None = None, **style) -> Axes:
    """Line load across the face width, a colour per torque, with the load factors in the legend; dashed: its mean.

    data    as `fem.load_factors` returns it
    style   of matplotlib's plot
    """
    check_result("data", data, ("line_load", "K_H_beta", "K_H_alpha"), "fem.load_factors(...)")
    ax, axial = axes_or_new(ax), data["axial_position"].values / mm
    for k, colour in enumerate(graded(data["torque"].values)):
        row = data.isel(torque=k)
        load, factors = row["line_load"].values * mm, (float(row["K_H_beta"]), float(row["K_H_alpha"]))
        label = f"{float(row['torque']):.4g} N m: $K_{{H\\beta}}$ {factors[0]:.3g}, $K_{{H\\alpha}}$ {factors[1]:.3g}"
        ax.plot(axial, load, **merged(style, color=colour, label=label))
        ax.axhline(load.mean(), color=colour, linewidth=0.8, linestyle="--")
    return finished(
        ax, xlabel="axial position [mm]", ylabel="line load of all tooth pairs [N/mm]", xlim=(axial[0], axial[-1])
    )
