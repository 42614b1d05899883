"""Root stress and contact pressure along a run: the map of `fem.root_stress` at the force and phase of every sample."""

import numpy as np
import xarray as xr

from exugear.load_factors.mesh_windows import mesh_cycles, window_bounds
from exugear.load_factors.stress_interpolation import BOTH, GEAR, POWERS, StressMap, stress_map
from exugear.planning.mirrored_flanks import warn_of_mirrored
from exugear.running.run_data import stage_data
from fem.pair.pair import GearPair
from fem.ste.map_sides import SIDES_DIFFER, why_unlike
from fem.ste.ste_map import pair_of
from fem.support.arguments import checked
from fem.support.validation import require

TIME, SPEED = "time", "speed"
MAP_OF_RIGHT = "those of the right flanks are fem.root_stress(fem.mirror_image(pair), ...)"
LONG_NAMES = {
    "root_stress": "largest tensile stress in the tooth root",
    "tangent_stress": "tensile stress in the tooth root, 30 degree tangent",
    "hertz_pressure": "largest contact pressure by Hertz of the line load",
    "peak_pressure": "largest contact pressure, including tip edges",
}


@checked
def dynamic_stress(run, stresses: xr.Dataset, stage: int | str = 0) -> xr.Dataset:
    """Root stress and contact pressure of a stage along a run.

    run         an `exugear.Run` or its data
    stresses    map of `fem.root_stress` of the pair of the stage, over torques up to the largest mesh force of the run
                times the base radius of the pinion
    stage       number or label of the stage

    Returns a dataset over time [s] with speed [rad/s], mesh_frequency [Hz] and mesh_force [N] of the run:

    root_stress, tangent_stress   (gear, time) of pinion and wheel [Pa], as `fem.root_stress` defines them
    hertz_pressure, peak_pressure (time,) contact pressures [Pa]

    Each sample has the stress of the static contact at its phase and mesh force: quasi-static in the tooth, whose own
    eigenfrequencies lie far above those of the mesh. Between the torques of the map root stresses are interpolated as
    multiples of the force, pressures as multiples of its root; over the phase they are linear. Where the back flank
    carries the load, the stresses are those of that flank, the mirror image: a warning says where left and right flanks
    differ. Offsets of the gears are those of the map.

    Raises ValueError for other data, for the map of another pair, and where the run leaves the map.
    """
    data = stage_data(run, stage)
    require(data.sizes["time"] > 0, "run must have samples, got none; let it last longer")
    require("phase" in data, "run must have phases, which older versions did not record; run it again")
    label = str(data["stage"].item())
    pair = _pair_of_stage(data, label)
    _check_same_pair(stresses, pair, label)
    table = stress_map(stresses, pair.pinion.r_b)
    _check_reach(table, data["mesh_force"].values, pair.pinion.r_b)
    force = data["mesh_force"].values
    unlike = why_unlike(stresses) if "pinion_z" in stresses.attrs else ""
    if unlike == SIDES_DIFFER or (pair.beta_b and unlike):
        mirrored = "stresses of the coast flank are those of the left flanks"
        warn_of_mirrored({label: unlike}, (label,), force, mirrored, MAP_OF_RIGHT)
    phase = np.where(force < 0, pair.back_phase - data["phase"].values, data["phase"].values)
    kept = {name: data[name].variable for name in (SPEED, "mesh_frequency", "mesh_force")}
    coordinates = {GEAR: BOTH, TIME: data[TIME].variable, "stage": label}
    return xr.Dataset(kept | _labelled(table.at(np.abs(force), phase), TIME), coordinates)


@checked
def stress_envelope(stress: xr.Dataset, windows: int = 280) -> xr.Dataset:
    """Largest stresses in windows of whole mesh cycles, over the speed of the driving shaft.

    stress      as `dynamic_stress` returns it
    windows     largest number of windows, of about equal length

    Returns a dataset over speed [rad/s], the mean of each window, with the mesh frequency [Hz] and the largest
    root_stress and tangent_stress (gear, speed), hertz_pressure and peak_pressure (speed,) [Pa].

    Raises ValueError for other data, and for fewer than one window.
    """
    is_stress = {"root_stress", "mesh_frequency", SPEED} <= set(stress) and TIME in stress.dims
    require(is_stress, "stress must be stresses over time; pass what exugear.dynamic_stress returns")
    require(windows >= 1, f"windows must be at least 1, got {windows}")
    cycles = mesh_cycles(stress)
    bounds = window_bounds(stress[TIME].values, cycles, min(windows, cycles.size))
    first = np.unique(np.searchsorted(cycles, bounds[:-1]))
    end = int(np.searchsorted(cycles, bounds[-1], side="right"))
    largest = {
        name: np.maximum.reduceat(stress[name].transpose(..., TIME).values[..., :end], first, axis=-1)
        for name in POWERS
        if name in stress
    }
    means = {name: _means(stress[name].values[:end], first) for name in (SPEED, "mesh_frequency")}
    coordinates = {GEAR: stress[GEAR], SPEED: (SPEED, means[SPEED], stress[SPEED].attrs)}
    frequency = {"mesh_frequency": (SPEED, means["mesh_frequency"], stress["mesh_frequency"].attrs)}
    return xr.Dataset(_labelled(largest, SPEED) | frequency, coordinates)


def _means(values: np.ndarray, first: np.ndarray) -> np.ndarray:
    """(m,) means of values (n,) between the samples first (m,) and the next."""
    return np.add.reduceat(values, first) / np.diff(first, append=values.size)


def _labelled(stresses: dict[str, np.ndarray], axis: str) -> dict[str, tuple]:
    """Variables of stresses ([gear,] n) over an axis."""
    return {
        name: ((GEAR, axis)[-values.ndim :], values, {"units": "Pa", "long_name": LONG_NAMES[name]})
        for name, values in stresses.items()
    }


def _pair_of_stage(data: xr.Dataset, label: str) -> GearPair:
    """The gear pair of a stage, from the inputs in the attributes of a run."""
    prefix = f"{label}_"
    inputs = {name.removeprefix(prefix): value for name, value in data.attrs.items() if name.startswith(prefix)}
    return pair_of(xr.Dataset(attrs=inputs))


def _check_same_pair(stresses: xr.Dataset, pair: GearPair, label: str) -> None:
    """ValueError where the map has the inputs of another pair."""
    if "pinion_z" in stresses.attrs:
        mapped = pair_of(stresses)
        differs = f"stresses must be those of the pair of stage {label!r}, {pair!r}, got a map of {mapped!r}"
        require((mapped.pinion, mapped.wheel) == (pair.pinion, pair.wheel), f"{differs}; map that pair")


def _check_reach(table: StressMap, force: np.ndarray, r_b: float) -> None:
    """ValueError where mesh forces exceed the map."""
    largest, end = float(np.abs(force).max()), float(table.force[-1])
    reach = f"stresses end at {end * r_b:.4g} N m, the run reaches {largest * r_b:.4g} N m"
    require(largest <= end * (1 + 1e-9), f"{reach} = its largest mesh force times r_b; map up to that torque")
