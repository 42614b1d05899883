"""Efficiency and losses of a gearbox over speed and load, from short steady runs."""

from collections.abc import Sequence
from concurrent.futures import Executor
from functools import partial
from itertools import product

import numpy as np
import xarray as xr

from exugear.gearbox.gearbox import Gearbox
from exugear.multibody.assembly import build
from exugear.running.energy_balance import LOSSES
from exugear.running.run_data import scene_attributes
from exugear.running.steady_power import SteadyPower, first_duration, steady_power
from fem.support.arguments import Numbers, checked
from fem.support.progress import bar, shown
from fem.support.validation import increasing, require, require_within

#: Longest run of a point [s]: 0.2 kB of powers are recorded at each step and mesh.
LONGEST = 60.0
#: Range of the tolerance: the jumps of friction at the pitch point leave an error of up to 3e-6 at any step, measured.
TOLERANCES = 1e-6, 1e-2
OVER = "speed", "load"
#: Variables of each point: name in `SteadyPower`, unit, long name.
VARIABLES = {
    "efficiency": ("1", "power that leaves the gearbox over power that enters it"),
    "power_in": ("W", "mean power of the drive, less the increase of the stored energy"),
    "power_out": ("W", "mean power on the load"),
    "error": ("1", "estimated error of the efficiency, by the length of the run and the balance of powers"),
    "window": ("s", "length of the window of whole mesh cycles in which powers are averaged"),
}


@checked
def efficiency(
    gearbox: Gearbox,
    *,
    speeds: Numbers,
    loads: Numbers,
    tolerance: float = 1e-5,
    executor: Executor | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Efficiency and losses of a gearbox over the speed of its driving shaft and the load on its driven shaft.

    speeds      (n,) > 0, increasing [rad/s]
    loads       (m,) increasing, without 0 [N m]; a load < 0 drives, and the power leaves at the driving shaft
    tolerance   error wanted of the efficiency
    executor    any `concurrent.futures.Executor` of processes, over which the points are spread
    progress    show a bar with the time left

    Returns a Dataset over (speed, load): efficiency, power_in, power_out [W], loss (kind, speed, load) [W] of the kinds
    mesh, bearing, coupling, friction and drag that the gearbox has, error, window [s], and stopped: the reason where a
    run stopped or a load exceeds the map, else ""; such points are NaN. The inputs stand in the attributes.

    Each point is a run at constant speed from equilibrium. The powers are averaged over whole mesh cycles of all stages
    at its end; the run goes on until they no longer change. Light loads under which the teeth rattle may keep an error
    above the tolerance. Raises ValueError for input out of range.
    """
    speeds, loads = increasing("speeds", speeds), increasing("loads", loads)
    _check(speeds, loads, tolerance)
    model = build(gearbox)
    durations = [first_duration(model, speed, tolerance) for speed in speeds.tolist()]
    slow = f"speeds must be higher than {speeds[0]:g} rad/s, at which mesh cycles take too long to be solved"
    require(durations[0] < LONGEST, f"{slow}; the losses change little below")
    points = list(product(speeds.tolist(), loads.tolist()))
    spread = map if executor is None else executor.map
    with shown(progress):
        solved = spread(partial(_at, gearbox, tolerance), points)
        costs = np.ceil(np.repeat(durations, loads.size) / min(durations))
        powers = list(bar(solved, f"efficiency: {len(points)} points", costs))
    attributes = {"title": "efficiency", "tolerance": tolerance, "plan": str(model.plan), **scene_attributes(model)}
    return _labelled(powers, speeds, loads).assign_attrs(attributes)


def _at(gearbox: Gearbox, tolerance: float, point: tuple[float, float]) -> SteadyPower | str:
    """The powers at a point (speed, load); a function that processes can import."""
    return steady_power(gearbox, *point, tolerance)


def _check(speeds: np.ndarray, loads: np.ndarray, tolerance: float) -> None:
    """ValueError for speeds, loads and a tolerance out of range."""
    require_within("tolerance", tolerance, *TOLERANCES, remedy="as share of the throughput, say 1e-5")
    finite = bool(np.isfinite(speeds).all() and speeds[0] > 0)
    require(finite, f"speeds must be > 0 rad/s and finite, got {speeds[0]:g} to {speeds[-1]:g}")
    loaded = bool(np.isfinite(loads).all() and loads.all())
    idle = f"loads must be finite and not 0 N m, got {loads.tolist()}"
    require(loaded, f"{idle}; no power leaves an idle gearbox: take run_up(..., power=True) for its losses")


def _labelled(powers: Sequence[SteadyPower | str], speeds: np.ndarray, loads: np.ndarray) -> xr.Dataset:
    """The Dataset of the powers of all points, in the order of the speeds and, at each speed, of the loads."""
    shape = speeds.size, loads.size
    solved = [power if isinstance(power, SteadyPower) else None for power in powers]

    def over_points(values: list) -> np.ndarray:
        return np.array(values).reshape(shape)

    kinds = [name.removesuffix("_loss") for name in LOSSES]
    kinds = [kind for kind in kinds if any(power and kind in power.losses for power in solved)]
    losses = [over_points([power.losses[kind] if power else np.nan for power in solved]) for kind in kinds]
    reasons = over_points([power if isinstance(power, str) else "" for power in powers])
    variables = {
        name: (OVER, over_points([getattr(power, name, np.nan) for power in solved]), _about(*words))
        for name, words in VARIABLES.items()
    }
    coordinates = {
        "speed": ("speed", speeds, _about("rad/s", "speed of the driving shaft")),
        "load": ("load", loads, _about("N m", "torque on the driven shaft against its motion")),
        "kind": ("kind", kinds),
    }
    loss = ("kind", *OVER), np.reshape(losses, (len(kinds), *shape)), _about("W", "mean power that is dissipated")
    stopped = OVER, reasons, {"long_name": "reason why the point was not solved"}
    return xr.Dataset(variables | {"loss": loss, "stopped": stopped}, coordinates)


def _about(unit: str, words: str) -> dict[str, str]:
    return {"units": unit, "long_name": words}
