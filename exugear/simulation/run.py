"""Operating conditions: imposed speed and load torque over time, integrated from static equilibrium."""

import time as clock
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import nan, pi, sqrt

import numpy as np
import xarray as xr

from exugear.elements.bearing_elements import reactions
from exugear.gearbox.stage import Stage
from exugear.mesh_force.jumps import PERIOD_STEPS
from exugear.plan.integrator import BETA, STABLE, Rule
from exugear.plan.time_steps import steps_of
from exugear.simulation.drive_and_load import finite, imposed
from exugear.simulation.equilibrium import start
from exugear.simulation.model import Model, measured, on_bearings, quiet
from exugear.simulation.run_data import keep_valid, stored
from exugear.simulation.step_error import Solver
from exugear.simulation.time_functions import Curve, line
from fem.ste.ste_map import pair_attributes, save
from fem.support.arguments import FilePath, Finite, checked
from fem.support.progress import shown
from fem.support.representation import short
from fem.support.validation import require, require_within
from fem.units import mm

#: Variables over stage and time: what the recorder calls them (signs: `Recorder`), unit, long name
RECORDED = {
    "dte": ("deflection", "m", "dynamic transmission error"),
    "mesh_force": ("force", "N", "mesh force"),
}
MOVING = {
    "centre_distance": ("a", "m", "centre distance"),
    "misalignment": ("misalignment", "rad", "angle by which the gap of the flank in contact opens towards +z"),
    "axial_offset": ("axial", "m", "z of the wheel less that of the pinion"),
    "centroid": ("centroid", "m", "z of the mesh force from the pinion's mid-plane"),
}
Course = float | tuple[float, float] | Callable[[float], float]


@checked
@short(wall_time="s", step="s")
@dataclass(frozen=True, eq=False)
class Run:
    """What came out of a run.

    data        Dataset over time [s] and stage: speed of the driving shaft [rad/s], mesh_frequency (stage, time) [Hz],
                dte (stage, time) [m], mesh_force (stage, time) [N]; with bearings also bearing_force (bearing,
                direction, time) [N] and how the gears stand to each other; all inputs in the attributes
    wall_time   of the integration [s], without what was solved again
    step        of the integrator [s]
    """

    data: xr.Dataset
    wall_time: float
    step: Finite

    @checked
    def save(self, path: FilePath):
        """Write the run as netCDF, whole or not at all; `load` reads it back."""
        return save(self.data.assign_attrs(wall_time=self.wall_time, step=self.step), path)

    @classmethod
    @checked
    def load(cls, path: FilePath) -> "Run":
        """Read what `save` wrote; wall_time is NaN where a file does not tell. ValueError for a file of no run."""
        data = stored(path)
        return cls(data, float(data.attrs.pop("wall_time", nan)), float(data.attrs["step"]))


class RunStopped(RuntimeError):
    """A run that left its map, whose bearings yielded until the teeth part, or whose Newton iteration failed.

    run   what was computed until then; its data's attribute "stopped" says what the message says
    """

    @checked
    def __init__(self, message: str, run: Run):
        super().__init__(message)
        self.run = run


@checked
def run_up(
    model: Model,
    *,
    speed: Course,
    duration: float,
    load: Course,
    tolerance: float = 1e-3,
    step: float | Rule | None = None,
    sample: float = 4e-5,
    sensor_period: float | None = None,
    progress: bool = True,
    checks: int = 3,
) -> Run:
    """Impose the driving shaft's speed, load the driven shaft, integrate, record the meshes.

    speed       [rad/s]: constant, (from, to), or a function of time [s]; the angle is its integral
    duration    [s]
    load        torque on the driven shaft against its motion at positive speed [N m]: likewise
    tolerance   relative error wanted of the rms of the DTE in windows of time; chooses the step
    step        [s] of the fourth-order integrator, instead of what tolerance chooses; or an integrator with its step
    sample      time between two recorded samples [s], rounded down to whole steps
    sensor_period
                time between two samples of your own sensors [s], rounded down to whole steps; by default sample
    progress    bar with the time left
    checks      so many hundredths of the run, the liveliest among them, are solved again at half the step; what that
                changes stands as step_error in the data, unless they are short

    The run starts from equilibrium under the initial load and the inertia torques of the speed's initial slope. Raises
    ValueError for input out of range and a step beyond the stability limit; RunStopped, a RuntimeError with what was
    computed, where the run leaves the map, bearings yield until the teeth part, or Newton's iteration fails. Ctrl-C
    raises KeyboardInterrupt with the same attribute run.
    """
    model = measured(model)
    require_within("duration", duration, 0, 1e5, remedy="s")
    require(0 < sample <= duration, f"sample must lie in (0, duration] s, got {sample}")
    period = sample if sensor_period is None else sensor_period
    require(0 < period < np.inf, f"sensor_period must be > 0 s, got {sensor_period}")
    speed_of = Curve(speed, duration) if callable(speed) else line("speed", speed, duration)
    load_of = load if callable(load) else line("load", load, duration)
    rule = _rule(model, tolerance, step, _fastest(model, speed_of, duration))
    steps, jumps = _steps(model, rule.step, duration, sample, speed_of, tolerance if step is None else None)
    with shown(progress), quiet(), imposed(model, speed_of, load_of):
        start(model, finite(load_of(0.0), 0.0), float(speed_of(0.0)), speed_of.slope)
        for mesh in model.meshes:
            mesh.recorder.start(steps.interval, steps.samples + 1, steps=steps.every, motion=on_bearings(model, mesh))
        began = clock.perf_counter()
        sensor_steps = max(1, int(period / steps.size * (1 + 1e-9)))
        solver = Solver(model, replace(rule, step=steps.size), tolerance, speed_of, steps, sensor_steps)
        pieces, stop = solver.run(progress)
        wall_time = clock.perf_counter() - began
        stop = keep_valid(model, steps, stop)
        again = [] if stop or not checks else solver.telling(pieces, checks)
        errors = solver.errors(again)
    told = {name: getattr(value, "__name__", str(value)) for name, value in (("speed", speed), ("load", load))}
    inputs = told | {"duration": duration, "tolerance": tolerance, "sample": steps.interval, "step": steps.size}
    used = {"integrator": str(rule), "plan": str(model.plan)} | ({"jumps": jumps} if jumps else {})
    data = _labelled(model, steps.time[: model.meshes[0].recorder.deflection.size], speed_of)
    data = data.assign(_beyond_maps(model, steps.interval) | (_step_error(again, errors, steps.size) if again else {}))
    data.attrs |= {"title": "run-up"} | inputs | used | _inputs(model)
    run = Run(data, wall_time, steps.size)
    if stop:
        raise _stopped(stop, run) from None
    return run


def _stopped(stop: BaseException, run: Run) -> BaseException:
    """What to raise where a run stopped early."""
    reason = "interrupted" if isinstance(stop, KeyboardInterrupt) else str(stop)
    run.data.attrs["stopped"] = reason
    if isinstance(stop, KeyboardInterrupt):
        stop.run = run  # type: ignore[attr-defined]
        return stop
    return RunStopped(reason, run)


def _fastest(model: Model, speed_of, duration: float) -> float:
    """Highest mesh frequency [Hz]; ValueError for speeds that are none."""
    top = float(np.abs(speed_of(np.linspace(0, duration, 1001))).max())
    require(top < 1e5, f"speed must stay below 1e5 rad/s, got {top:g}; pass 3500*rpm")
    return max(_cycles(model, stage) for stage in model.gearbox.stages) * top


def _cycles(model: Model, stage: Stage) -> float:
    """Mesh cycles of a stage per radian of the driving shaft."""
    return abs(model.gearbox.ratios[stage.fast.name]) * stage.pair.pinion.z / (2 * pi)


def _rule(model: Model, tolerance: float, step: float | Rule | None, mesh_frequency: float) -> Rule:
    chosen = model.plan.rule(tolerance, mesh_frequency)
    if step is None or isinstance(step, Rule):
        return step or chosen
    largest = model.plan.largest_step
    require(step > 0, f"step must be > 0 s, got {step}")
    limit = f"omega h < {STABLE:.3g} at {model.plan.omega / 2 / pi:.4g} Hz"
    require(step < largest, f"step must be below {largest:.4g} s ({limit}: stability), got {step:g} s")
    return Rule(BETA, step)


def _steps(model: Model, size: float, duration: float, sample: float, speed_of, tolerance: float | None):
    """Steps and words about the laws that jump: as many in their mesh periods as a tolerance asks for, if any."""
    speeds = np.abs(speed_of(np.linspace(0, duration, 1001)))
    jumping = {}
    for label, mesh in zip(model.gearbox.labels, model.meshes, strict=True):
        frequency = speeds.max() * _cycles(model, mesh.stage)
        if frequency > 0 and mesh.law.jumps.size:
            jumping[label] = 1 / frequency, mesh.law.jumps
            size = size if tolerance is None else min(size, 1 / frequency / PERIOD_STEPS * sqrt(tolerance / 1e-3))
    return steps_of(duration, size, sample, jumping, steady=bool(np.ptp(speeds) <= 1e-9 * speeds.max()))


def _beyond_maps(model: Model, interval: float) -> dict:
    """For how long and how far meshes went where their laws are continued beyond the map; nothing where none is."""
    ends = np.array([mesh.law.mapped_force for mesh in model.meshes])
    if np.isinf(ends).all():
        return {}
    shares = np.abs([mesh.recorder.force for mesh in model.meshes]) / ends[:, None]
    long, far = "time of the samples beyond the map", "largest mesh force of the samples over the map's largest"
    return {
        "beyond_map_time": ("stage", (shares > 1).sum(axis=1) * interval, {"units": "s", "long_name": long}),
        "beyond_map_force": ("stage", shares.max(axis=1, initial=0.0), {"units": "1", "long_name": far}),
    }


def _step_error(pieces, errors: np.ndarray, h: float) -> dict:
    """Errors of the pieces that were solved again."""
    about = {"units": "1", "long_name": "relative error of the rms of the DTE by the step, estimated"}
    middle = {"units": "s", "long_name": "middle of what was solved again at half the step"}
    places = ("checked", [(piece.first + piece.last) / 2 * h for piece in pieces], middle)
    return {"step_error": (("stage", "checked"), errors.T, about), "checked": places}


def _labelled(model: Model, time: np.ndarray, speed_of) -> xr.Dataset:
    turning, over = speed_of(time), ("stage", "time")
    cycles = np.array([_cycles(model, stage) for stage in model.gearbox.stages])
    data = xr.Dataset(
        {
            "speed": ("time", turning, {"units": "rad/s", "long_name": "speed of the driving shaft"}),
            "mesh_frequency": (over, np.outer(cycles, np.abs(turning)), {"units": "Hz", "long_name": "mesh frequency"}),
        },
        coords={
            "time": ("time", time, {"units": "s", "long_name": "time"}),
            "stage": ("stage", list(model.gearbox.labels)),
        },
    )
    moving = any(on_bearings(model, mesh) for mesh in model.meshes)
    for name, (recorded, unit, long_name) in (RECORDED | (MOVING if moving else {})).items():
        values = np.array([getattr(mesh.recorder, recorded) for mesh in model.meshes])
        data[name] = over, values, {"units": unit, "long_name": long_name}
    return data.assign(_bearing_forces(model)) if moving else data


def _bearing_forces(model: Model) -> dict:
    """Forces of the bearings on their shafts over time."""
    found: dict[str, np.ndarray] = {}
    for mesh in model.meshes:
        for side, shaft in enumerate((mesh.stage.fast, mesh.stage.slow)):
            if model.plan.shafts[shaft.name].on_bearings:
                forces = reactions(shaft, *mesh.recorder.motion(side))
                found |= {f"{shaft.name} at {axial / mm:g} mm": force.T for axial, force in forces.items()}
    values = np.array(list(found.values()))
    about = {"units": "N", "long_name": "force of the bearing on its shaft"}
    return {
        "bearing_force": (("bearing", "direction", "time"), values, about),
        "bearing": ("bearing", list(found)),
        "direction": ("direction", ["x", "y", "z"]),
    }


def _inputs(model: Model) -> dict[str, float | str]:
    """Shafts, pairs and force laws as flat numbers."""
    inputs: dict[str, float | str] = {}
    for shaft in model.gearbox.shafts:
        inputs |= {f"{shaft.name}_{name}": getattr(shaft, name) for name in ("inertia", "mass", "transverse")}
    for label, stage in zip(model.gearbox.labels, model.gearbox.stages, strict=True):
        numbers = pair_attributes(stage.pair) | {"damping": stage.force.damping, "backlash": stage.force.backlash}
        inputs |= {f"{label}_{name}": value for name, value in numbers.items()}
    return inputs
