"""Dynamic factor K_v of every stage over the speed: largest mesh force over static mesh force."""

from math import inf

import numpy as np
import scipy
import xarray as xr

from exugear.running.run_data import stage_data
from exugear.signals.envelope import envelope, mesh_cycles
from fem.support.arguments import checked
from fem.support.validation import require

#: Share of the largest static force below which a mesh counts as unloaded; largest force of a run without load [N].
UNLOADED, NO_LOAD = 0.05, 1e-3
#: Share of the largest static force of all stages below which a stage is idle, as the mesh of a member that runs free.
IDLE = 1e-3
#: Why K_v is NaN.
MISSING = f"static mesh force below {UNLOADED:.0%} of its largest in the run, as where the load crosses zero"
#: Variables over (stage, speed): unit, long name.
VARIABLES = {
    "K_v": ("1", "dynamic factor: largest over static mesh force"),
    "static_force": ("N", "local mean of the mesh force over whole mesh cycles"),
    "mesh_frequency": ("Hz", "mesh frequency"),
}


@checked
def dynamic_factor(run, windows: int = 280, *, static_force: float | None = None) -> xr.Dataset:
    """Dynamic factor of every stage of a run, or of steady states, over the speed of the driving shaft.

    run             an `exugear.Run` or its data, or steady states: a dataset with largest_force [N] over point
    windows         number of windows of equal length, joined where the gears turn too slowly for a mesh cycle
    static_force    of steady states [N]: the torque on the pinion over its base radius, > 0; a run records its load

    Returns a dataset over (stage, speed), the mean speed of each window [rad/s]:

    K_v             largest mesh force over the static one; NaN in windows in which the static force falls below 5 % of
                    its largest in the run, as where the load crosses zero, and of stages without load, below 0.1 % of
                    the largest of all stages: the ratio to a force that vanishes says nothing (attribute "missing")
    static_force    local mean of the mesh force over whole mesh cycles [N]: the torque that the mesh transmits, over
                    the base radius; < 0 where the back flank transmits it
    mesh_frequency  [Hz]

    The mesh force is that of all tooth pairs together, as the total tangential load to which K_v of ISO 6336-1 applies;
    its division among tooth pairs belongs to K_Halpha (`fem.load_factors`). The static force follows the load over
    time linearly between windows; a load that varies faster than these counts as dynamic. Steady states are returned
    as they are, with K_v over point added.

    Raises ValueError for other data, for a run without load in any stage, for windows out of range, and for steady
    states without a static force.
    """
    if isinstance(run, xr.Dataset) and "largest_force" in run:
        dims = run["largest_force"].dims
        require(dims == ("point",), f"run must be steady states of a single stage, got {dims}; take run.isel(stage=0)")
        return _of_steady_states(run, static_force)
    require(static_force is None, "static_force is for steady states; leave it out, a run has a mean mesh force")
    stages = _stages(run)
    require(stages[0].sizes["time"] > 1, "run must have two samples or more, got one; let it last longer")
    slowest = min((mesh_cycles(stage) for stage in stages), key=lambda cycles: cycles[-1])
    require(windows >= 1, f"windows must be at least 1, got {windows}")
    windows = min(windows, slowest.size // 2)
    idle = IDLE * _largest_static(stages, windows)
    columns = np.array([_over_speed(stage, windows, slowest, idle) for stage in stages])
    labels, loaded = [stage["stage"].item() for stage in stages], np.abs(columns[:, 1]).max() > NO_LOAD
    require(bool(loaded), f"run must load the mesh of a stage of {labels}; give it a load that is not 0 N m")
    about = {"units": "rad/s", "long_name": "speed of the driving shaft"}
    speed = envelope(stages[0]["speed"].values, slowest, windows, cycles=slowest).abscissa
    factors = xr.Dataset(
        {
            name: (("stage", "speed"), columns[:, i], {"units": unit, "long_name": long_name})
            for i, (name, (unit, long_name)) in enumerate(VARIABLES.items())
        },
        {"stage": [str(label) for label in labels], "speed": ("speed", speed, about)},
    )
    factors["K_v"].attrs["missing"] = MISSING
    return factors


def _of_steady_states(states: xr.Dataset, static_force: float | None) -> xr.Dataset:
    """Steady states with their dynamic factor over point; on the coast flank the mesh forces are < 0."""
    given = "static_force must be > 0 N for steady states, the torque on the pinion over its base radius"
    require(static_force is not None and 0 < static_force < inf, f"{given}, got {static_force}")
    unit, long_name = VARIABLES["K_v"]
    driven = float((states["largest_force"] + states.get("smallest_force", 0.0)).mean()) > 0
    largest = states["largest_force"].values if driven else -states["smallest_force"].values
    factor = largest / static_force
    return states.assign(K_v=("point", factor, {"units": unit, "long_name": long_name}))


def _stages(run) -> list[xr.Dataset]:
    """The data of every stage of a run."""
    first = stage_data(run)
    data = run if isinstance(run, xr.Dataset) else run.data
    return [first, *(stage_data(data, i) for i in range(1, data["stage"].size))]


def is_loaded(run, windows: int = 280) -> bool:
    """Whether a mesh of a run transmits a mean force in a window, to which dynamic factors refer."""
    return _largest_static(_stages(run), windows) > NO_LOAD


def _largest_static(stages: list[xr.Dataset], windows: int) -> float:
    """Largest static force [N] of all stages."""
    return max(float(np.abs(_static(stage, windows)).max()) for stage in stages)


def _static(stage: xr.Dataset, windows: int) -> np.ndarray:
    """(n,) static force of a stage."""
    return local_mean(stage["time"].values, mesh_cycles(stage), stage["mesh_force"].values, windows)


def _over_speed(stage: xr.Dataset, windows: int, slowest: np.ndarray, idle: float) -> tuple[np.ndarray, ...]:
    """`VARIABLES` of a stage, each (n_window,).

    slowest   mesh cycles of the slowest stage, by which windows join
    idle      static force up to which the stage carries no load [N]
    """
    force, static = stage["mesh_force"].values, _static(stage, windows)
    loaded = np.abs(static) > max(UNLOADED * np.abs(static).max(), NO_LOAD, idle)
    dynamic = envelope(static, force / np.where(loaded, static, inf), windows, cycles=slowest)
    told = envelope(static, loaded.astype(float), windows, cycles=slowest).low > 0.5
    frequency = envelope(stage["mesh_frequency"].values, force, windows, cycles=slowest).abscissa
    return np.where(told, dynamic.high, np.nan), dynamic.abscissa, frequency


def local_mean(time: np.ndarray, cycles: np.ndarray, signal: np.ndarray, windows: int) -> np.ndarray:
    """(n,) mean of a signal over whole mesh cycles, linear over time between the middles of windows.

    time, cycles   (n,) times [s] and mesh cycles of the samples, increasing
    windows        largest number of windows of whole mesh cycles, about equally long; without a whole mesh cycle there
                   is one window, from the first sample to the last

    In the remainder of a mesh cycle after the last window it is constant: a run-down may end in a long one.
    """
    bounds = np.unique(np.floor(np.interp(np.linspace(time[0], time[-1], windows + 1), time, cycles)))
    bounds = bounds if bounds.size > 1 else cycles[[0, -1]]
    integral = scipy.integrate.cumulative_trapezoid(signal, time, initial=0)
    if bounds[-1] == bounds[0]:
        return np.full(time.size, integral[-1] / (time[-1] - time[0]))
    ends = np.interp(bounds, cycles, time)
    means = np.diff(np.interp(ends, time, integral)) / np.diff(ends)
    if means.size == 1:
        return np.full(time.size, means[0])
    middles = (ends[1:] + ends[:-1]) / 2
    line = scipy.interpolate.make_interp_spline(middles, means, k=1)
    return line(np.clip(time, ends[0], ends[-1]))
