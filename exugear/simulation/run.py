"""A run-up: speed and load over time, integrated from static equilibrium, with the meshes recorded.

`run_up` has more than seven arguments; all but the model are keywords. They become the operating conditions
(`Conditions`) and the scheme of integration and sampling (`Scheme`).
"""

import time as clock
from dataclasses import dataclass
from math import nan
from typing import Any

import xarray as xr

from exugear.elements.exudyn_objects import quiet
from exugear.plan.integrator_and_step import Rule
from exugear.simulation.drive_and_load import applied
from exugear.simulation.equilibrium import start
from exugear.simulation.model import Model, linearized
from exugear.simulation.run_data import keep_valid, labelled, start_recorders, stored
from exugear.simulation.solver_settings import scheme_of
from exugear.simulation.step_error import Solver
from exugear.simulation.time_functions import Conditions, TimeFunction
from fem.ste.ste_map import save
from fem.support.arguments import FilePath, Finite, checked
from fem.support.progress import shown
from fem.support.representation import short


@checked
@short(wall_time="s", step="s")
@dataclass(frozen=True, eq=False)
class Run:
    """The result of a run.

    data        Dataset over time [s] and stage: speed of the driving shaft [rad/s], mesh_frequency (stage, time) [Hz],
                dte (stage, time) [m], mesh_force (stage, time) [N]; with bearings also bearing_force (bearing,
                direction, time) [N] and the relative position of the gears; with friction friction_force [N] and
                friction_loss (stage, time) [W], with drag drag_torque [N m] and drag_loss (shaft, time) [W]; the
                attributes hold all inputs
    wall_time   of the integration [s], without that of the error estimate
    step        of the integrator [s]
    """

    data: xr.Dataset
    wall_time: float
    step: Finite

    @checked
    def save(self, path: FilePath):
        """Write the run as netCDF, completely or not at all; `load` reads it."""
        return save(self.data.assign_attrs(wall_time=self.wall_time, step=self.step), path)

    @classmethod
    @checked
    def load(cls, path: FilePath) -> "Run":
        """Read a file that `save` wrote; wall_time is NaN where the file lacks it. ValueError for other files."""
        data = stored(path)
        return cls(data, float(data.attrs.pop("wall_time", nan)), float(data.attrs["step"]))


class RunStopped(RuntimeError):
    """A run left its map, its bearings yielded until the teeth parted, or its Newton iteration failed.

    run   the `Run` up to that time; the attribute "stopped" of its data holds the message
    """

    @checked
    def __init__(self, message: str, run: Run):
        super().__init__(message)
        self.run = run


@checked
def run_up(
    model: Model,
    *,
    speed: TimeFunction,
    duration: float,
    load: TimeFunction,
    tolerance: float = 1e-3,
    step: float | Rule | None = None,
    sample: float = 4e-5,
    sensor_period: float | None = None,
    progress: bool = True,
    checks: int = 3,
) -> Run:
    """Run a gearbox at a given speed and load over time, and record its meshes.

    speed           of the driving shaft [rad/s]: a constant, (from, to), or a function of time [s]
    duration        of the run [s]
    load            torque on the driven shaft against its motion at positive speed [N m], given like the speed
    tolerance       relative error wanted of the rms of the DTE in windows of time; integrator and step follow
    step            step of the fourth-order integrator [s], instead of a choice by the tolerance; or an integrator with
                    its step, as `model.plan.rule()` returns it
    sample          time between two recorded samples [s], rounded down to whole steps
    sensor_period   time between two samples of your own sensors [s], rounded down to whole steps; by default sample
    progress        show a bar with the time left
    checks          number of segments, each a hundredth of the run, that are integrated again at half the step, among
                    them the segment that vibrates most; the change estimates the error by the step, step_error in
                    the data. Segments of a short run are not checked

    Returns a `Run`; `run.data["dte"]` is the dynamic transmission error.

    The angle of the driving shaft is the integral of the speed. The run starts from static equilibrium under the
    initial load and the inertia torques of the initial acceleration.

    Raises ValueError for input out of range and for a step beyond the stability limit. Raises `RunStopped`, a
    RuntimeError with the attribute run up to that time, where the run leaves the map, bearings yield until the teeth
    part, or Newton's iteration fails. Ctrl-C raises KeyboardInterrupt with the same attribute.
    """
    model = linearized(model)
    conditions = Conditions(speed, load, duration)
    scheme = scheme_of(model, conditions, tolerance=tolerance, step=step, sample=sample, sensor_period=sensor_period)
    solver = Solver(model, conditions, scheme)
    with shown(progress), quiet(), applied(model, conditions):
        start(model, conditions)
        start_recorders(model, scheme.steps)
        began = clock.perf_counter()
        segments, stop = solver.run(progress)
        wall_time = clock.perf_counter() - began
        stop = keep_valid(model, scheme.steps, stop)
        checked_segments = [] if stop else solver.errors(segments, checks)
    run = Run(labelled(model, conditions, scheme, checked_segments), wall_time, scheme.steps.size)
    if stop:
        raise _stopped(stop, run) from None
    return run


def _stopped(stop: Any, run: Run) -> BaseException:
    """The exception with a run that stopped early."""
    interrupted = isinstance(stop, KeyboardInterrupt)
    run.data.attrs["stopped"] = "interrupted" if interrupted else str(stop)
    if not interrupted:
        return RunStopped(str(stop), run)
    stop.run = run
    return stop
