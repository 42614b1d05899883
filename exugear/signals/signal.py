"""A signal: values over time with the speed and the angle of a shaft, from a run, a sensor or a measurement.

Orders of a stage, and what makes a signal valid.
"""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy
import xarray as xr

from exugear.running.run_data import START_ANGLE, stage_data
from fem.support.arguments import Numbers, checked
from fem.support.validation import require, require_finite

#: Units and long names of the coordinates.
TIME = {"units": "s", "long_name": "time"}
MOTION_UNITS = {"speed": "rad/s", "angle": "rad"}
DRIVING = "driving shaft"
#: End of the names of attributes of a run that hold the speed of a shaft over that of the driving shaft; least such.
RATIO, STILL = "_speed_ratio", 1e-12
#: Title of runs that keep the nominal ratios of speeds that the teeth leave free.
NOMINAL = "run-up"
MESH_ORDER = {"units": "1", "long_name": "mesh cycles per revolution of the shaft"}
#: Deviation of a harmonic from a whole number as share of it: orders are rounded to 9 digits.
WHOLE = 1e-7
#: Largest share by which the steps of time may differ where a function needs equal steps.
STEP_TOLERANCE = 1e-3
#: Largest number of values that are computed at once: 4 GB.
LARGEST = 500_000_000
#: Largest number of mesh harmonics, and of side bands of each.
MOST = 1000


@checked
def signal(
    run,
    name: str,
    *,
    stage: int | str = 0,
    turns_of: str | None = None,
    relative_to: str | None = None,
    **labels: str | Sequence[str],
) -> xr.DataArray:
    """A variable of a run as a signal, with the speed and the angle of the shaft whose turns its orders count.

    run          an `exugear.Run` or its data
    name         variable over time: "dte", "mesh_force", "bearing_force", ...
    stage        number or label of the stage: of the variable where it has a value per stage, and of the mesh order
    turns_of     name of the shaft whose turns orders count; by default the driving shaft
    relative_to  name of the shaft against which it turns, by default the housing: of a planetary set
                 turns_of="carrier", relative_to="ring" are the orders that the ring sees, mesh orders at multiples of
                 its number of teeth, whichever member is held
    labels       coordinates to select, such as bearing="slow at 0 mm", direction="y"; without them all values remain

    Returns a DataArray (..., time) with the coordinates time [s], speed [rad/s] and angle [rad] of that shaft over
    time, and mesh_order, the mesh cycles of the stage per revolution of it. Raises ValueError for variables, labels and
    shafts that the run does not have, and for shafts that do not turn against each other.
    """
    data = stage_data(run, stage)
    over_time = [str(key) for key, values in data.data_vars.items() if "time" in values.dims]
    require(name in over_time, f"name must be a variable over time of the run, {over_time}, got {name!r}")
    values = _selected(data[name], labels).transpose(..., "time")
    speed, words = reference_speed(data, turns_of, relative_to)
    shaft = speed_and_angle(data["time"].values, speed, words)
    of_others = [str(key) for key in values.coords if key not in data[name].dims]
    return values.drop_vars(of_others).assign_coords(shaft | _mesh_order_coordinate(run, data, speed))


def reference_speed(data: xr.Dataset, turns_of: str | None, relative_to: str | None) -> tuple[np.ndarray, str]:
    """(n,) speed about z of a shaft against another one [rad/s], and words for it; by default of the driving shaft.

    By the ratios of the teeth, so that vibrations do not turn the angle of reference; where the teeth leave several
    speeds free, and a run has not kept their nominal ratios, by the recorded speeds.
    """
    if turns_of is None:
        alone = f"relative_to={relative_to!r} needs turns_of, the shaft whose turns against it are counted"
        require(relative_to is None, alone)
        return data["speed"].values, DRIVING
    speed, words = speed_of_shaft(data, "turns_of", turns_of), turns_of
    if relative_to is not None:
        speed, words = speed - speed_of_shaft(data, "relative_to", relative_to), f"{turns_of} relative to {relative_to}"
    still = np.abs(speed).max() <= STILL * np.abs(data["speed"].values).max()
    require(not still, f"turns_of={turns_of!r}, relative_to={relative_to!r}: the {words} does not turn; name another")
    return speed, words


def speed_of_shaft(data: xr.Dataset, argument: str, shaft: str) -> np.ndarray:
    """(n,) speed of a shaft of a run about z [rad/s]; ValueError for a name that is none."""
    ratios = {name.removesuffix(RATIO): x for name, x in data.attrs.items() if name.endswith(RATIO)}
    older = "the run is of an older version, which kept no speed ratios; run it again, or leave turns_of out"
    require(bool(ratios), older)
    require(shaft in ratios, f"{argument} must be one of the shafts {[*ratios]}, got {shaft!r}")
    ratio = float(ratios[shaft])
    if "independent_speeds" not in data.attrs or data.attrs.get("title") == NOMINAL or ratio == 0.0:
        return ratio * data["speed"].values
    recorded = "shaft_speed" in data and shaft in data["shaft"].values
    free = f"{argument}={shaft!r}: speeds are free in this run, {data.attrs['independent_speeds']}"
    require(recorded, f"{free}; run it with power=True, which records the speeds of all shafts")
    return (1.0 if ratio >= 0 else -1.0) * data["shaft_speed"].sel(shaft=shaft).values


def angle_of_shaft(data: xr.Dataset, argument: str, shaft: str) -> np.ndarray:
    """(n,) angle of a shaft of a run about z [rad], from the reference configuration on; raises as `speed_of_shaft`."""
    speed, start = speed_of_shaft(data, argument, shaft), float(data.attrs.get(f"{shaft}{START_ANGLE}", 0.0))
    return start + scipy.integrate.cumulative_trapezoid(speed, data["time"].values, initial=0)


def _selected(values: xr.DataArray, labels: dict) -> xr.DataArray:
    """The values at some labels; ValueError with the labels that there are."""
    for dim, label in labels.items():
        known = values[dim].values.tolist() if dim in values.dims and dim != "time" else []
        wanted = [label] if isinstance(label, str) else list(label)
        coordinates = {str(key): values[key].values.tolist() for key in values.dims if key != "time"}
        require(
            bool(wanted) and set(wanted) <= set(known),
            f"{dim}={label!r} is no label of {values.name}, which has {coordinates}",
        )
    return values.sel(labels)


def _mesh_order_coordinate(run, data: xr.Dataset, speed: np.ndarray) -> dict[str, tuple]:
    """The mesh order of the data of a stage, with those of all stages of the run by their labels in its attributes.

    speed   (n,) of the shaft whose revolutions orders count [rad/s]
    """
    whole = run if isinstance(run, xr.Dataset) else run.data
    labels = [str(label) for label in whole["stage"].values]
    of_stages = {label: mesh_order(whole.isel(stage=number), speed) for number, label in enumerate(labels)}
    return {"mesh_order": ((), mesh_order(data, speed), MESH_ORDER | {"of_stages": json.dumps(of_stages)})}


def order_names(signal: xr.DataArray, orders: np.ndarray) -> list[str]:
    """Names of orders: harmonic and stage of mesh orders, as in a Campbell diagram, else the number."""
    about = signal["mesh_order"].attrs if "mesh_order" in signal.coords else {}
    of_stages = json.loads(about.get("of_stages", "{}"))
    return [_order_name(order, of_stages) for order in orders.tolist()]


def _order_name(order: float, of_stages: dict[str, float]) -> str:
    harmonics = {label: order / mesh for label, mesh in of_stages.items() if mesh > 0}
    whole = {label: round(ratio) for label, ratio in harmonics.items() if abs(ratio - round(ratio)) < WHOLE * ratio}
    names = ", ".join(f"{harmonic} x mesh {label}" for label, harmonic in whole.items() if harmonic)
    return names or f"order {order:.6g}"


def mesh_order(data: xr.Dataset, reference: np.ndarray | None = None) -> float:
    """Mesh cycles of a stage per revolution of the driving shaft; NaN for a shaft at rest.

    reference   (n,) speed of another shaft [rad/s] whose revolutions count instead
    """
    if reference is not None:  # the mean, as a recorded speed vibrates
        turned = float(np.abs(reference).mean())
        return round(2 * np.pi * float(data["mesh_frequency"].mean()) / turned, 9) if turned > 0 else np.nan
    speed = float(np.abs(data["speed"]).max())
    cycles = 2 * np.pi * float(data["mesh_frequency"].max()) / speed if speed > 0 else np.nan
    return round(cycles, 9)


@checked
def mesh_orders(
    run,
    stage: int | str = 0,
    *,
    harmonics: int = 3,
    side_bands: int = 0,
    turns_of: str | None = None,
    relative_to: str | None = None,
) -> np.ndarray:
    """Orders of the driving shaft at which a stage excites vibrations: mesh harmonics and their side bands.

    run           an `exugear.Run` or its data
    harmonics     number of mesh harmonics
    side_bands    number of side bands on either side of each, at multiples of the orders of the stage's two shafts
                  against their carrier
    turns_of, relative_to
                  shafts whose turns orders count instead of those of the driving shaft, as in `exugear.signal`

    Returns the distinct orders, rising. Raises ValueError for a shaft at rest and for numbers out of range.
    """
    require(1 <= harmonics <= MOST, f"harmonics must lie in [1, {MOST}], got {harmonics}")
    require(0 <= side_bands <= MOST, f"side_bands must lie in [0, {MOST}], got {side_bands}")
    data = stage_data(run, stage)
    mesh = mesh_order(data, reference_speed(data, turns_of, relative_to)[0])
    require(mesh > 0, "run must turn its shafts, its speed is 0 throughout; pass a run at speed")
    mean = mesh * np.arange(1, harmonics + 1)
    label = data["stage"].item()
    teeth = [abs(data.attrs[f"{label}_{gear}_z"]) for gear in ("pinion", "wheel")] if side_bands else []
    bands = [np.arange(-side_bands, side_bands + 1) * mesh / z for z in teeth] or [np.zeros(1)]
    orders = np.concatenate([np.add.outer(mean, band).ravel() for band in bands])
    return np.unique(orders[orders > 0].round(9))


@checked
def recorded_signal(
    time: Numbers, speed: Numbers, values: Numbers, *, units: str = "1", long_name: str = "signal"
) -> xr.DataArray:
    """A signal from arrays, such as a measurement.

    time         (n,) [s], increasing
    speed        (n,) of the shaft whose revolutions the orders count [rad/s]
    values       (n,)
    units        of the values
    long_name    of the values, for the axes of plots

    Returns a DataArray (time,) with the coordinates time, speed and angle. Raises ValueError for NaN and for times that
    do not increase.
    """
    time, speed, values = (np.asarray(x, float) for x in (time, speed, values))
    check_columns(time=time, speed=speed, values=values)
    require(bool((np.diff(time) > 0).all()), "time must increase; sort the samples and drop repeated times")
    coordinates = {"time": ("time", time, TIME)} | speed_and_angle(time, speed)
    return xr.DataArray(values, coordinates, ("time",), attrs={"units": units, "long_name": long_name})


@checked
def sensor_signal(
    run,
    stored: Numbers,
    component: int = 0,
    *,
    units: str = "1",
    long_name: str = "sensor",
    stage: int | str = 0,
    turns_of: str | None = None,
    relative_to: str | None = None,
) -> xr.DataArray:
    """A signal from a sensor of Exudyn that has recorded during a run, such as the acceleration of a point of a body.

    run          the `exugear.Run`, or its data
    stored       (n, 1 + components) times and values: mbs.GetSensorStoredData(sensor)
    component    number of the component of the sensor
    units        of the values
    long_name    of the values, for the axes of plots
    stage        number or label of the stage whose mesh order the signal has
    turns_of, relative_to
                 shafts whose turns orders count, as in `signal`

    Returns a DataArray (time,) with the coordinates of `signal`. Raises ValueError for components that are not stored.
    """
    data, stored = stage_data(run, stage), np.asarray(stored, float)
    table = f"stored must be (n, 1 + components), as mbs.GetSensorStoredData returns, got {stored.shape}"
    require(stored.ndim == 2 and stored.shape[1] > 1, table)
    components = stored.shape[1] - 1
    require(0 <= component < components, f"component must be 0 to {components - 1}, got {component}")
    time, first = np.unique(stored[:, 0], return_index=True)
    sample, end = np.diff(data["time"].values).max(initial=0.0), float(data["time"][-1])
    longer = f"stored must be of the run, which ends at {end:g} s, got times up to {time[-1]:g} s"
    require(time[-1] <= end + sample, f"{longer}; pass what the sensor recorded in this run")
    of_reference, words = reference_speed(data, turns_of, relative_to)
    speed = np.interp(time, data["time"].values, of_reference)
    values = recorded_signal(time, speed, stored[first, 1 + component], units=units, long_name=long_name)
    coordinates = speed_and_angle(time, speed, words)
    return values.assign_coords(coordinates | _mesh_order_coordinate(run, data, of_reference))


def speed_and_angle(time: np.ndarray, speed: np.ndarray, shaft: str = "shaft") -> dict[str, tuple]:
    """Coordinates of a signal: speed of a shaft, and the angle that it has turned by."""
    angle = scipy.integrate.cumulative_trapezoid(np.abs(speed), time, initial=0)
    about = {name: {"units": units, "long_name": f"{name} of the {shaft}"} for name, units in MOTION_UNITS.items()}
    return {"speed": ("time", speed, about["speed"]), "angle": ("time", angle, about["angle"])}


def channel_coordinates(signal: xr.DataArray) -> dict[Any, Any]:
    """The coordinates of a signal that do not vary along its last dimension: labels of channels, mesh order."""
    return {name: values for name, values in signal.coords.items() if signal.dims[-1] not in values.dims}


def at_angles(signal: xr.DataArray, angle: np.ndarray, dim: str) -> dict[Any, Any]:
    """Time and speed of a signal at angles of the shaft, as coordinates along a dimension."""
    known = signal["angle"].values
    return {name: (dim, np.interp(angle, known, signal[name].values), signal[name].attrs) for name in ("time", "speed")}


def require_signal(signal: xr.DataArray) -> None:
    """ValueError unless this is a finite signal (..., time) with its coordinates."""
    lacking = {"time", "speed", "angle"} - set(signal.coords)
    remedy = "pass what exugear.signal, sensor_signal or recorded_signal returned"
    require(not lacking and signal.dims[-1:] == ("time",), f"signal must be over time, speed and angle; {remedy}")
    require(signal.sizes["time"] >= 3, f"signal must have 3 samples or more, got {signal.sizes['time']}")
    require_finite("signal", signal.values, "leave out or interpolate what is not")
    require_finite("speed of the signal", signal["speed"].values, "leave out or interpolate what is not")
    require(bool((np.diff(signal["time"].values) > 0).all()), "the times of the signal must increase; sort it by time")


def sample_rate(signal: xr.DataArray) -> float:
    """Samples per second [Hz]; ValueError unless the steps of time are equal."""
    time = signal["time"].values
    steps = np.diff(time)
    mean = (time[-1] - time[0]) / steps.size
    equal = bool((np.abs(steps - mean) <= STEP_TOLERANCE * mean).all())
    require(
        equal, f"signal must have equal steps of time, got {steps.min():.4g} to {steps.max():.4g} s; interpolate it"
    )
    return 1 / mean


def check_columns(**columns: np.ndarray) -> None:
    """ValueError unless all are finite and equally long, (n,) with n >= 3."""
    names, shapes = " and ".join(columns), [column.shape for column in columns.values()]
    fits = len(set(shapes)) == 1 and len(shapes[0]) == 1 and shapes[0][0] >= 3
    require(fits, f"{names} must be equally long, (n,) with n >= 3, got {' and '.join(map(str, shapes))}")
    for name, column in columns.items():
        require_finite(name, column, "leave out or interpolate what is not")


def check_size(argument: str, number: float, remedy: str) -> None:
    """ValueError with a remedy where an argument, named with its value, asks for too many values."""
    require(number <= LARGEST, f"{argument} asks for {number:.3g} values, more than {LARGEST:.0e}; {remedy}")
