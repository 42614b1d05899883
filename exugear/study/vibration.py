"""Measures of the vibration of a pair in its gearbox over a range of speed, by steady states."""

from collections.abc import Callable, Sequence
from typing import Annotated, Any

import numpy as np
import xarray as xr

from exugear.multibody.assembly import build
from exugear.steady_state.steady_states import check_range, steady_states
from fem.contact.resolution import Resolution, Slices
from fem.pair.offsets import Offsets, check_offsets
from fem.pair.pair import GearPair
from fem.ste.transmission import static_transmission_error
from fem.support.arguments import Numbers, checked
from fem.support.validation import increasing, numbers, require, text_of

#: Torques of the map over the largest load: from light loads to dynamic ones.
MAP_TORQUES = 0.0, 0.01, 0.03, 0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0
LOAD = "load"


@checked
def vibration_measures(
    pair: GearPair,
    *,
    speed: Annotated[Sequence[float], check_range],
    load: Numbers,
    gearbox: Callable,
    offsets: Annotated[Offsets, check_offsets] | None = None,
    phases: Numbers = 30,
    resolution: Resolution | Slices | None = None,
) -> xr.Dataset:
    """Largest vibration of a pair in its gearbox over a range of speed, over the load.

    speed       lowest and highest speed of the driving shaft [rad/s]
    load        on the driven shaft > 0, increasing [N m]; the map of the pair reaches to 3 times the largest
    gearbox     function of an STE map that returns an `exugear.Gearbox`
    offsets, phases, resolution   as for `fem.static_transmission_error`; one value of each offset

    Returns "dte", the largest rms of the DTE [m] of stable steady states, "dte_speed", where it is [rad/s], and where
    shafts stand on bearings "bearing_force", the largest rms of the vibration of their forces over (load, bearing,
    direction) [N]. Raises ValueError as `exugear.steady_states`.
    """
    loads = increasing("load", np.atleast_1d(numbers("load", load)))
    require(bool(loads[0] > 0), f"load must be > 0 N m, got {text_of(load)}")
    several = [] if offsets is None else [*offsets.axes()]
    require(not several, f"offsets must have one value each, {several} have several; call it for each of them")
    options: dict[str, Any] = {"offsets": offsets, "resolution": resolution, "progress": False}
    ste = static_transmission_error(pair, np.multiply(MAP_TORQUES, loads[-1]), phases, **options)
    model = build(gearbox(ste))
    on_bearings = any(kind.on_bearings for kind in model.plan.shafts.values())
    columns = []
    for torque in loads.tolist():
        states = steady_states(model, speed=speed, load=torque, bearing_forces=on_bearings, progress=False)
        stable = np.flatnonzero(states["stable"].values)
        require(stable.size > 0, f"speed {text_of(speed)} holds no stable steady state at {torque:g} N m; widen it")
        largest = states.isel(point=int(stable[states["rms"].values[stable].argmax()]))
        column = {"dte": largest["rms"].drop_vars("point"), "dte_speed": largest["speed"].drop_vars("point")}
        if on_bearings:
            column["bearing_force"] = states["bearing_force_rms"].isel(point=stable).max("point")
        columns.append(xr.Dataset(column, attrs={}))
    data = xr.concat(columns, LOAD).assign_coords({LOAD: (LOAD, loads, {"units": "N m"})})
    about = {"dte": "largest rms of the DTE", "dte_speed": "speed of the largest rms"}
    about |= {"bearing_force": "largest rms of the vibration of the bearing force"}
    units = {"dte": "m", "dte_speed": "rad/s", "bearing_force": "N"}
    for name in data.data_vars:
        data[name].attrs = {"units": units[str(name)], "long_name": about[str(name)]}
    return data
