"""Root stress and contact pressure along a run: the map of `fem.root_stress` at the force and phase of every sample."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from exugear.planning.mirrored_flanks import warn_of_mirrored
from exugear.running.run_data import stage_data
from exugear.signals.envelope import means_between, mesh_cycles, window_edges
from fem.pair.pair import GearPair
from fem.ste.map_sides import SIDES_DIFFER, why_unlike
from fem.ste.ste_map import check_whole_cycle, number_of_pitches, pair_of
from fem.support.arguments import checked
from fem.support.intervals import interval_of
from fem.support.validation import increasing, require, require_finite

GEAR, TORQUE, PHASE, TIME, SPEED = "gear", "torque", "phase", "time", "speed"
BOTH = ["pinion", "wheel"]
#: Stresses of a map [Pa] and the power of the force with which each grows between the torques of the map: root stress
#: is linear, the pressure of a line contact grows with the root of the force (Hertz).
POWERS = {"root_stress": 1.0, "tangent_stress": 1.0, "hertz_pressure": 0.5, "peak_pressure": 0.5}
MAP_OF_RIGHT = "those of the right flanks are fem.root_stress(fem.mirror_image(pair), ...)"
LONG_NAMES = {
    "root_stress": "largest tensile stress in the tooth root",
    "tangent_stress": "tensile stress in the tooth root, 30 degree tangent",
    "hertz_pressure": "largest contact pressure by Hertz of the line load",
    "peak_pressure": "largest contact pressure, including tip edges",
}


@dataclass(frozen=True, eq=False)
class StressMap:
    """Stresses over mesh force and phase.

    force    (n_force,) increasing mesh forces > 0 [N]
    phase    (n_phase,) increasing phases in [0, pitches)
    values   (..., n_force, n_phase) stresses by name [Pa]
    pitches  after which the stresses repeat: 1 where all teeth are alike

    Between the forces stress / force^power is linear; below the lowest it is constant, so that the stress vanishes
    without force.
    """

    force: np.ndarray
    phase: np.ndarray
    values: dict[str, np.ndarray]
    pitches: int = 1

    def at(self, force: np.ndarray, phase: np.ndarray) -> dict[str, np.ndarray]:
        """(..., n) stresses [Pa] under forces (n,) >= 0 up to the largest of the map [N], at phases (n,)."""
        row, over_row = _interval(self.force, force)
        closed = np.append(self.phase, self.phase[0] + self.pitches)
        column, over_column = _interval(closed, self.phase[0] + (phase - self.phase[0]) % self.pitches)
        corners = (row, column), (over_row, over_column)
        return {
            name: force ** POWERS[name] * _bilinear(values, *corners) for name, values in self._coefficients.items()
        }

    @cached_property
    def _coefficients(self) -> dict[str, np.ndarray]:
        """(..., n_force, n_phase + 1) stress / force^power, periodic in the phase."""
        closed = {name: np.concatenate([x, x[..., :1]], axis=-1) for name, x in self.values.items()}
        return {name: x / self.force[:, None] ** POWERS[name] for name, x in closed.items()}


@checked
def dynamic_stress(run, stresses: xr.Dataset, stage: int | str = 0) -> xr.Dataset:
    """Root stress and contact pressure of a stage along a run.

    run         an `exugear.Run` or its data
    stresses    map of `fem.root_stress` of the pair of the stage, over torques up to the largest mesh force of the run
                times the base radius of the pinion; where teeth differ, over as many pitches as the force law
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
    _check_pitches(table, int(data.attrs.get(f"{label}_pitches", 1)), label)
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
    """Largest stresses in windows that each hold a whole mesh cycle, over the speed of the driving shaft.

    stress      as `dynamic_stress` returns it
    windows     largest number of windows of equal length, joined as in `exugear.dte_envelope`

    Returns a dataset over speed [rad/s], the mean of each window, with the mesh frequency [Hz] and the largest
    root_stress and tangent_stress (gear, speed), hertz_pressure and peak_pressure (speed,) [Pa].

    Raises ValueError for other data, and for fewer than one window.
    """
    is_stress = {"root_stress", "mesh_frequency", SPEED} <= set(stress) and TIME in stress.dims
    require(is_stress, "stress must be stresses over time; pass what exugear.dynamic_stress returns")
    require(windows >= 1, f"windows must be at least 1, got {windows}")
    samples = stress.sizes[TIME]
    edges = window_edges(samples, min(windows, samples), mesh_cycles(stress))
    first, end = edges[:-1], edges[-1]
    largest = {
        name: np.maximum.reduceat(stress[name].transpose(..., TIME).values[..., :end], first, axis=-1)
        for name in POWERS
        if name in stress
    }
    means = {name: means_between(stress[name].values, edges) for name in (SPEED, "mesh_frequency")}
    coordinates = {GEAR: stress[GEAR], SPEED: (SPEED, means[SPEED], stress[SPEED].attrs)}
    frequency = {"mesh_frequency": (SPEED, means["mesh_frequency"], stress["mesh_frequency"].attrs)}
    return xr.Dataset(_labelled(largest, SPEED) | frequency, coordinates)


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


def _check_pitches(table: StressMap, pitches: int, label: str) -> None:
    """ValueError unless the stresses run over as many pitches as the force law of the stage, or neither has several."""
    of_map = f"{table.pitches} pitch{'es' * (table.pitches > 1)}"
    over = f"stresses run over {of_map}, the law of stage {label!r} over {pitches}"
    phases = f"phases=np.arange({pitches} * 12) / 12"
    teeth = f"its teeth differ, and so do their stresses; pass fem.root_stress(pair, torques, {phases})"
    bolts = "of a ring that bends between bolts they differ along it, which fem.root_stress tells for a ring_angle each"
    require(table.pitches == pitches, f"{over}: {teeth}; {bolts}")


def _check_reach(table: StressMap, force: np.ndarray, r_b: float) -> None:
    """ValueError where mesh forces exceed the map."""
    largest, end = float(np.abs(force).max()), float(table.force[-1])
    reach = f"stresses end at {end * r_b:.4g} N m, the run reaches {largest * r_b:.4g} N m"
    require(largest <= end * (1 + 1e-9), f"{reach} = its largest mesh force times r_b; map up to that torque")


def _interval(grid: np.ndarray, queries: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower grid point of the interval of each query, and the share of the interval below it, clipped to [0, 1]."""
    if grid.size == 1:
        return np.zeros(queries.shape, int), np.zeros(queries.shape)
    lower = interval_of(grid, queries)
    return lower, np.clip((queries - grid[lower]) / (grid[lower + 1] - grid[lower]), 0.0, 1.0)


def _bilinear(values: np.ndarray, lower: tuple[np.ndarray, ...], share: tuple[np.ndarray, ...]) -> np.ndarray:
    """(..., n) values between the grid points of values (..., n_row, n_column)."""
    (i, j), (s, t) = lower, share
    following = np.minimum(i + 1, values.shape[-2] - 1)
    at_row, at_following = (values[..., k, j] + t * (values[..., k, j + 1] - values[..., k, j]) for k in (i, following))
    return at_row + s * (at_following - at_row)


def stress_map(stresses: xr.Dataset, r_b: float) -> StressMap:
    """The map of `fem.root_stress` over the mesh force; r_b: base radius of the pinion [m].

    Raises ValueError for other data, and for a map without a torque > 0.
    """
    axes = {"root_stress": (GEAR, TORQUE, PHASE), "hertz_pressure": (TORQUE, PHASE), "peak_pressure": (TORQUE, PHASE)}
    is_map = all(name in stresses and set(stresses[name].dims) == set(dims) for name, dims in axes.items())
    require(is_map, "stresses must be a map over gear, torque and phase; pass what fem.root_stress returns")
    gears = stresses.get(GEAR, xr.DataArray(BOTH)).values.tolist()
    whole = f"stresses must have the gears {BOTH}, got {gears}; pass all that fem.root_stress returns"
    require(sorted(gears) == BOTH, whole)
    stresses = stresses.isel({GEAR: np.argsort(gears)})
    torque, phase = (increasing(name, stresses[name].values) for name in (TORQUE, PHASE))
    require(bool(torque[-1] > 0), f"stresses must have a torque > 0 N m, got {torque}")
    require(bool(phase[0] >= 0), f"stresses must have phases >= 0, got {phase[0]:g}; pass what fem.root_stress returns")
    check_whole_cycle(stresses)
    loaded = stresses.isel({TORQUE: torque > 0}).transpose(GEAR, TORQUE, PHASE)
    values = {name: loaded[name].values for name in POWERS if name in loaded}
    for name, x in values.items():
        require_finite(f"{name} of the stresses", x, "solve the missing states or drop their torque")
    return StressMap(torque[torque > 0] / r_b, phase, values, number_of_pitches(phase))
