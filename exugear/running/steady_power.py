"""Mean powers of a gearbox at constant speed and load, over whole mesh cycles of all its stages."""

from collections.abc import Sequence
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
from exugear.running.energy_balance import ENERGIES, LOSSES
from exugear.running.run import Run, run

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
        """Estimated error of the efficiency: by transients that have not yet died, and by the integration."""
        return self.change + abs(self.residual_share)

    @property
    def efficiency(self) -> float:
        """Power that leaves the gearbox over power that enters it; a load < 0 drives."""
        entering = max(self.power_in, 0.0) + max(-self.power_out, 0.0)
        leaving = max(self.power_out, 0.0) + max(-self.power_in, 0.0)
        return leaving / entering


def window_periods(model: Model, speed: float) -> np.ndarray:
    """(n,) whole mesh cycles [s] of all stages at a speed of the driving shaft [rad/s], each long enough."""
    periods = np.unique((1 / (model.mesh_cycles * speed)).round(15))
    least = WINDOW_PERIODS / _lowest_resonance(model)
    return periods * np.ceil(least / periods)


def first_duration(model: Model, speed: float, tolerance: float) -> float:
    """Duration [s] of a run whose transients have probably died in its first half, after which a window fits."""
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
        drives={model.gearbox.driving.name: speed},
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
