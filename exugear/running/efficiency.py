"""Efficiency and losses of a gearbox over speed and load, from short steady runs.

The powers of a run are averaged over whole mesh cycles of all stages.
"""

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from math import log

import numpy as np
import scipy
import xarray as xr

from exugear.gearbox.gearbox import Gearbox
from exugear.multibody.assembly import build
from exugear.multibody.model import Model
from exugear.running.energy_balance import ENERGIES, LOSSES, efficiency_of
from exugear.running.run import Run, run
from exugear.running.run_data import scene_attributes
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
#: Least length of a window in periods of the lowest mesh resonance, and longest time to settle in such periods.
WINDOW_PERIODS, SETTLING_PERIODS = 20, 100
#: How often a run that has not settled goes on for as long again.
DOUBLINGS = 5
#: Error of the efficiency by the step over the tolerance of the run, at most, measured; largest such tolerance.
STEP_SHARE = 1e-2
LARGEST_TOLERANCE = 1e-3


@dataclass(frozen=True)
class SteadyPower:
    """Mean powers over a window at the end of a run.

    power_in    by the drive, less the increase of the stored energy [W]
    power_out   on the load [W]
    losses      by kind: mesh, bearing, coupling, friction, drag [W]
    window      length [s]
    change      largest change of the loss share since the windows at half and at three quarters of the time
    """

    power_in: float
    power_out: float
    losses: dict[str, float]
    window: float
    change: float = np.inf

    @property
    def throughput(self) -> float:
        """Mean of the magnitudes of power in and power out [W]."""
        return (abs(self.power_in) + abs(self.power_out)) / 2

    @property
    def loss_share(self) -> float:
        """All losses over the throughput."""
        return sum(self.losses.values()) / self.throughput

    @property
    def residual_share(self) -> float:
        """Power in less power out and losses over the throughput: the error of the integration."""
        return (self.power_in - self.power_out) / self.throughput - self.loss_share

    @property
    def error(self) -> float:
        """Estimated error of the efficiency: by transients that have not yet decayed, and by the integration."""
        return self.change + abs(self.residual_share)

    @property
    def efficiency(self) -> float:
        """Power that leaves the gearbox over power that enters it; a load < 0 drives."""
        return efficiency_of(self.power_in, self.power_out)


def window_periods(model: Model, speed: float) -> np.ndarray:
    """(n,) whole mesh cycles [s] of all stages at a speed of the driving shaft [rad/s], each long enough."""
    periods = np.unique((1 / (model.mesh_cycles * speed)).round(15))
    least = WINDOW_PERIODS / _lowest_resonance(model)
    return periods * np.ceil(least / periods)


def first_duration(model: Model, speed: float, tolerance: float) -> float:
    """Duration [s] of a run whose transients have probably decayed in its first half, after which a window fits."""
    rates = [mesh.stage.force.damping * mesh.mobility / 2 for mesh in model.meshes]
    longest = SETTLING_PERIODS / _lowest_resonance(model)
    settling = min(log(1 / tolerance) / min(rates), longest) if min(rates) > 0 else longest
    return 2 * max(settling, float(window_periods(model, speed).sum()))


def _lowest_resonance(model: Model) -> float:
    """Lowest main resonance of a mesh [Hz], the driving speed imposed."""
    return min(imposed for imposed, _ in model.plan.mesh_resonances.values())


def steady_power(gearbox: Gearbox, speed: float, load: float, tolerance: float) -> SteadyPower | str:
    """Mean powers at constant speed and load; the reason where the run stops or the load exceeds a map.

    The run starts in equilibrium and goes on for as long again until the losses change by less than the tolerance,
    relative to the throughput, `DOUBLINGS` times at most.
    """
    try:
        return _settled(build(gearbox), speed, load, tolerance)
    except (RuntimeError, ValueError) as stop:
        return str(stop)


def _settled(model: Model, speed: float, load: float, tolerance: float) -> SteadyPower:
    periods, duration = window_periods(model, speed), first_duration(model, speed, tolerance)
    steady_run = partial(
        run,
        model,
        drives={name: abs(model.gearbox.ratios[name]) * speed for name in model.gearbox.independent},
        loads={model.gearbox.driven.name: load},
        tolerance=min(tolerance / STEP_SHARE, LARGEST_TOLERANCE),
        progress=False,
        checks=0,
        power=True,
    )
    last = steady_run(duration=duration)
    power = _last_of([_mean_power(last, share * duration, periods) for share in (0.5, 0.75, 1.0)])
    for doubling in range(DOUBLINGS):
        if power.change < tolerance:
            break
        further = duration * 2**doubling
        last = steady_run(duration=further, initial=last)
        power = _last_of([power, *(_mean_power(last, share * further, periods) for share in (0.5, 1.0))])
    return power


def _mean_power(of_run: Run, end: float, periods: np.ndarray) -> SteadyPower:
    """Mean powers of a run over the window that ends at a time [s] at the latest."""
    data = of_run.data
    end = min(end, float(data["time"][-1]))
    stored = sum(_cycle_mean(data[name], end, periods, derivative=1) for name in ENERGIES)
    losses = {name.removesuffix("_loss"): _cycle_mean(data[name], end, periods) for name in LOSSES if name in data}
    means = {name: _cycle_mean(data[name], end, periods) for name in ("power_in", "power_out")}
    return SteadyPower(means["power_in"] - stored, means["power_out"], losses, float(periods.sum()))


def _cycle_mean(values: xr.DataArray, end: float, periods: np.ndarray, derivative: int = 0) -> float:
    """Moving averages over all periods in succession, up to an end [s]: without the harmonics of any period."""
    time, rows = values["time"].values, values.transpose(..., "time").values.reshape(-1, values["time"].size)
    near = slice(max(0, int(np.searchsorted(time, end - periods.sum())) - 8), None)
    spline = scipy.interpolate.CubicSpline(time[near] - end, rows.sum(axis=0)[near])
    integral = spline.antiderivative(len(periods) - derivative) if len(periods) > derivative else spline
    corners = product((0, 1), repeat=len(periods))
    total = sum((-1) ** sum(corner) * float(integral(-np.dot(corner, periods))) for corner in corners)
    return total / float(periods.prod())


def _last_of(powers: Sequence[SteadyPower]) -> SteadyPower:
    """The last of the powers of successive windows, with its change."""
    *earlier, last = powers
    return replace(last, change=max(abs(last.loss_share - power.loss_share) for power in earlier))


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
    mapped = map if executor is None else executor.map
    with shown(progress):
        solved = mapped(partial(_at, gearbox, tolerance), points)
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
