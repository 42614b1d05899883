"""A run: drives and loads of the shafts, integrated from equilibrium or from another run, with the meshes recorded.

`run` and `run_up` have more than seven arguments; all but the model are keywords. They become the operating conditions
(`Conditions`) and the scheme of integration and sampling (`Scheme`).
"""

import time as clock
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from math import nan
from typing import Any

import numpy as np
import xarray as xr

from exugear.multibody.drive_and_load import ShaftTorques, applied
from exugear.multibody.equilibrium import solve_initial_equilibrium
from exugear.multibody.exudyn_objects import INITIAL, quiet
from exugear.multibody.model import Model, end_coordinate, linearized
from exugear.multibody.shaft_motion import BearingForces, needs_speeds
from exugear.multibody.solve_errors import NoEquilibrium
from exugear.multibody.solver_settings import Scheme, check_cost, scheme_of
from exugear.multibody.time_integration import Solver
from exugear.multibody.turns import in_turn
from exugear.operation.conditions import Conditions, conditions_of, run_up_conditions
from exugear.operation.stop_conditions import Apart, SpeedReached
from exugear.operation.time_functions import TimeFunction
from exugear.planning.integrator_and_step import Rule
from exugear.planning.mirrored_flanks import remedy_of, warn_of_mirrored
from exugear.running.energy_balance import EnergyBalance, energy_balance
from exugear.running.joined_parts import Parts, parts_of
from exugear.running.part_integration import check_parts
from exugear.running.run_data import START_ANGLE, keep_valid, labelled, recording, stored, with_end_state
from exugear.running.step_error import checks_by_step, repeated_in_place, with_step_error
from fem.ste.ste_map import save
from fem.support.arguments import FilePath, Finite, checked
from fem.support.progress import shown
from fem.support.representation import short
from fem.support.validation import require

#: Difference of an imposed speed from that at the end of the other run over the speed that counts as vibration.
LARGEST_JUMP = 0.01


@checked
@short(wall_time="s", step="s")
@dataclass(frozen=True, eq=False)
class Run:
    """The result of a run.

    data        Dataset over time [s] and stage: speed of the driving shaft [rad/s], mesh_frequency (stage, time) [Hz],
                dte (stage, time) [m], mesh_force (stage, time) [N], phase (stage, time) of the driving flanks;
                with bearings also bearing_force (bearing, direction, time) [N], on request bearing_displacement [m],
                and the relative position of the gears;
                with friction friction_force [N] and friction_loss (stage, time) [W], with drag drag_torque [N m] and
                drag_loss (shaft, time) [W]; the attributes hold the conditions and the data of gears, shafts and stages
                A run that no error stopped also has its end_state, from which another run continues
    wall_time   of the integration [s], without that of the error estimate
    step        of the integrator [s]
    """

    data: xr.Dataset
    wall_time: float
    step: Finite

    @checked
    def energy_balance(self, start: Finite | None = None, end: Finite | None = None) -> EnergyBalance:
        """Work in and out, losses and stored energy between two times [s], by default over the whole run.

        Raises ValueError for a run without power=True and for times outside the run.
        """
        return energy_balance(self.data, start, end)

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


class StoppedAtStart(RunStopped, ValueError):
    """A run without a static equilibrium to start from: its load or acceleration is beyond the maps."""


@checked
@in_turn
def run(
    model: Model,
    *,
    drives: Mapping[str, Any] | None = None,
    loads: Mapping[str, Any] | None = None,
    duration: float,
    start_speed: float | Mapping[str, float] | None = None,
    initial: Run | None = None,
    stop: Sequence[SpeedReached | Apart] | None = None,
    tolerance: float = 1e-3,
    step: float | Rule | None = None,
    sample: float = 4e-5,
    sensor_period: float | None = None,
    progress: bool = True,
    checks: int = 3,
    power: bool = False,
    displacement: bool = False,
    executor: Executor | None = None,
) -> Run:
    """Run a gearbox under drives and loads on any of its shafts, and record its meshes.

    drives          name of a shaft -> what acts on it with its motion at positive speed: `Speed` (also a number,
                    (from, to), a function of time or arrays (t, speed)), `Torque`, or `MotorCurve`. It acts on the
                    rotor behind the coupling of the shaft, if there is one
    loads           likewise, against the motion; numbers, functions and arrays stand for a `Torque`
    duration        of the run [s], unless a condition ends it before
    start_speed     of the driving shaft at the start [rad/s] where no speed is imposed; 0 by default. Where a gearbox
                    leaves several speeds free, also a mapping of shafts to speeds in their senses of motion, as many
                    as are not imposed; by default they are in their nominal ratio to the imposed ones
    initial         `Run` of the same gearbox from whose end this run goes on; its time starts at 0 again
    stop            conditions that end the run at the first sample where one of them holds: `SpeedReached`, `Apart`
    tolerance, step, sample, sensor_period, progress, checks, power, displacement, executor
                    as for `run_up`; with an executor the run needs an imposed speed and no stop

    A shaft in neither of them is free. At most one speed is imposed, or as many as a gearbox leaves free
    (`Gearbox(speeds=...)`); with fewer the train, or what they leave free of it, accelerates under the torques.
    The run starts from static equilibrium under the torques at the start and the inertia torques of the acceleration
    that follows from them, or that the imposed speed has.

    Returns a `Run`. Raises ValueError for shafts that the gearbox lacks, for drives and loads that contradict, and
    otherwise as `run_up`.
    """
    conditions = conditions_of(
        model.gearbox,
        drives or {},
        loads or {},
        duration=duration,
        start_speed=start_speed,
        stop=stop or (),
        initial=initial.data if initial else None,
        power=power,
        displacement=displacement,
    )
    steps = {"tolerance": tolerance, "step": step, "sample": sample, "sensor_period": sensor_period}
    return _solved(model, conditions, initial, executor, progress, checks, **steps)


@checked
@in_turn
def run_up(
    model: Model,
    *,
    speed: TimeFunction,
    load: TimeFunction,
    duration: float,
    tolerance: float = 1e-3,
    step: float | Rule | None = None,
    sample: float = 4e-5,
    sensor_period: float | None = None,
    progress: bool = True,
    checks: int = 3,
    power: bool = False,
    displacement: bool = False,
    executor: Executor | None = None,
) -> Run:
    """Run a gearbox at a given speed and load over time, and record its meshes.

    speed           of the driving shaft [rad/s]: a constant, (from, to), a function of time [s], or arrays (t, speed),
                    such as a measurement, through which a monotone cubic runs
    load            torque on the driven shaft against its motion at positive speed [N m], given like the speed
    duration        of the run [s]
    tolerance       relative error wanted of the rms of the DTE in windows of time; integrator and step follow
    step            step of the fourth-order integrator [s], instead of a choice by the tolerance; or an integrator with
                    its step: a `Rule`, as `model.plan.rule()` returns it
    sample          time between two recorded samples [s], rounded down to whole steps
    sensor_period   time between two samples of your own sensors [s], rounded down to whole steps; by default sample
    progress        show a bar with the time left
    checks          number of segments, each a hundredth of the run, that are integrated again at half the step, among
                    them the segment that vibrates most; the change estimates the error by the step, step_error in
                    the data. Segments of a short run are not checked
    power           record where the power goes: powers of drive and load, losses, energies, at every step (0.2 kB a
                    step and mesh); the steps are a third of those by the tolerance, so that `Run.energy_balance` closes
    displacement    keep the displacements of the shafts at their bearings, for orbits: bearing_displacement in the
                    data (24 bytes a sample and bearing), with rolling bearings also bearing_tilt, for their life
    executor        any `concurrent.futures.Executor` of processes, over which parts of the run are spread. Parts start
                    early from static equilibrium; where a part is not in the state that arrives (to 1e-6 of the rms),
                    it is integrated again from there until it is, so that the run is the serial one. seam_error in the
                    data has the difference at each seam; `model.plan` says how early parts start

    Returns a `Run`; `run.data["dte"]` is the dynamic transmission error.

    The angle of the driving shaft is the integral of the speed. The run starts from static equilibrium under the
    initial load and the inertia torques of the initial acceleration.

    Raises ValueError for input out of range and for a step beyond the stability limit. Raises `RunStopped`, a
    RuntimeError with the attribute run up to that time, where the run leaves the map, bearings yield until the teeth
    part, Newton's iteration fails or a process is killed; where that is so in the equilibrium at the start, the run has
    no samples, and the exception is a ValueError, too. Ctrl-C raises KeyboardInterrupt with the same attribute.
    """
    output = {"power": power, "displacement": displacement}
    conditions = run_up_conditions(model.gearbox, speed, load, duration, **output)
    steps = {"tolerance": tolerance, "step": step, "sample": sample, "sensor_period": sensor_period}
    return _solved(model, conditions, None, executor, progress, checks, **steps)


def _solved(
    model: Model,
    conditions: Conditions,
    initial: Run | None,
    executor: Executor | None,
    progress: bool,
    checks: int,
    **steps: Any,
) -> Run:
    """The run under its conditions; steps as those of `scheme_of`."""
    require(checks >= 0, f"checks must be at least 0 segments (0: none is integrated again), got {checks}")
    if executor:
        check_parts(model, conditions)
    model = linearized(model, conditions.held, conditions.highest_speed)
    scheme = scheme_of(model, conditions, **steps)
    check_cost(model, scheme)
    state = None if initial is None else _end_state_of(model, conditions, initial.data)
    conditions = conditions if state is None else _continued(model, conditions, state)
    with shown(progress), quiet(), applied(model, conditions) as acting:
        torques = acting.torques
        try:
            _set_start_state(model, conditions, state, scheme.rule)
        except NoEquilibrium as error:
            run = Run(_without_samples(model, conditions, scheme, torques), 0.0, scheme.steps.size)
            run.data.attrs["stopped"] = str(error)
            raise StoppedAtStart(str(error), run) from None
        acting.release()
        solver = Solver(model, conditions, scheme, restarted=state is not None)
        forces = BearingForces(model, scheme.steps.samples + 1, _needs_moments(model, conditions))
        parts = parts_of(solver, torques, forces, executor) if executor else None
        data, wall_time, stop = _integrated(solver, parts, torques, forces, progress, checks)
    data = parts.with_seams(data) if parts else data
    if state is not None:
        data.attrs |= {f"{name}{START_ANGLE}": float(state[0, spin]) for name, spin in model.spins.items()}
    if solver.iterations:
        data.attrs["newton_iterations"] = sum(solver.iterations) / scheme.steps.number
    run = Run(data, wall_time, scheme.steps.size)
    remedy = remedy_of(model.plan)
    warn_of_mirrored(model.plan.mirrored, model.gearbox.labels, data["mesh_force"].values, remedy=remedy)
    if stop:
        raise _stopped(stop, run) from None
    return run


def _end_state_of(model: Model, conditions: Conditions, data: xr.Dataset) -> np.ndarray:
    """(3, n_coordinates) end state of another run; ValueError unless this model can go on from there."""
    ended = "initial must be a run that came to its end, this one was stopped by an error"
    require("end_state" in data, f"{ended}, or saved by an older version; run it again")
    state, number = data["end_state"].values, model.bare_mbs.systemData.ODE2Size()
    stages, labels = data["stage"].values.tolist(), list(model.gearbox.labels)
    same = state.shape[1] == number and stages == labels
    unlike = f"initial is a run of {stages} with {state.shape[1]} coordinates, the model has {labels}, {number}"
    require(same, f"{unlike}; pass a run of the same gearbox and plan")
    for label, stage in zip(labels, model.gearbox.stages, strict=True):
        gears = {"a": stage.pair.a, "pinion_z": stage.pair.pinion.z, "wheel_z": stage.pair.wheel.z}
        of_run, of_model = [data.attrs.get(f"{label}_{name}", x) for name, x in gears.items()], [*gears.values()]
        unlike = f"initial is a run with a, z = {of_run} in {label!r}, the model has {of_model}"
        require(of_run == of_model, f"{unlike}; continue with the same gears")
    for imposed, speed_of in zip(conditions.imposed, conditions.speeds_of, strict=True):
        shaft, direction = imposed.shaft, model.gearbox.directions[imposed.shaft]
        ended_at, starts_at = direction * float(state[1, end_coordinate(model, shaft)]), float(speed_of(0.0))
        jump = f"initial ends with shaft {shaft!r} at {ended_at:.6g} rad/s, the imposed speed starts at"
        near = abs(starts_at - ended_at) <= LARGEST_JUMP * max(abs(starts_at), abs(ended_at))
        require(near, f"{jump} {starts_at:.6g}; let it start there")
    return state


def _continued(model: Model, conditions: Conditions, state: np.ndarray) -> Conditions:
    """The conditions of a run that goes on from a state (3, n_coordinates): its shafts keep their angles."""
    directions = model.gearbox.directions
    angles = [directions[name] * float(state[0, end_coordinate(model, name)]) for name in conditions.held]
    imposed = [replace(x, start_angle=angle) for x, angle in zip(conditions.imposed, angles, strict=True)]
    return replace(conditions, imposed=tuple(imposed))


def _set_start_state(model: Model, conditions: Conditions, state: np.ndarray | None, rule: Rule) -> None:
    """Put the system into a state (3, n_coordinates), or without it into static equilibrium; rule: of the run."""
    if state is None:
        solve_initial_equilibrium(model, conditions, rule)
        return
    system = model.bare_mbs.systemData
    system.SetODE2Coordinates(state[0], INITIAL)
    system.SetODE2Coordinates_t(state[1], INITIAL)
    system.SetODE2Coordinates_tt(state[2], INITIAL)


def _needs_moments(model: Model, conditions: Conditions) -> bool:
    """Whether moments of bearings are in the data: with a housing, whose surface they move, and with displacements."""
    return model.gearbox.housing is not None or conditions.displacement


def _without_samples(model: Model, conditions: Conditions, scheme: Scheme, torques: ShaftTorques) -> xr.Dataset:
    """The data of a run that could not start: the inputs, and no sample."""
    forces = BearingForces(model, 0, _needs_moments(model, conditions))
    with recording(model, scheme.steps, torques, power=needs_speeds(model, conditions), samples=range(1)):
        for mesh in model.meshes:
            mesh.recorder.keep_first(0)
        return labelled(model, replace(conditions, power=False), scheme, torques, forces)


def _integrated(
    solver: Solver, parts: Parts | None, torques: ShaftTorques, forces: BearingForces, progress: bool, checks: int
) -> tuple[xr.Dataset, float, Any]:
    """The data, the wall time of the integration [s] and what stopped the run, if anything."""
    model, conditions, scheme = solver.model, solver.conditions, solver.scheme
    powered, samples = needs_speeds(model, conditions), range(scheme.steps.samples + 1)
    began = clock.perf_counter()
    with recording(model, scheme.steps, torques, power=powered, samples=samples):
        segments, end, stop = (parts or solver).run(progress)
        wall_time = clock.perf_counter() - began
        stop = keep_valid(model, scheme.steps, end, stop, (parts or solver).stopped_at)
        repeated = parts.repeated if parts else partial(repeated_in_place, solver)
        errors = checks_by_step(model, scheme, segments, 0 if stop else checks, repeated)
        data = labelled(model, conditions, scheme, torques, forces)
        data = data if stop else with_end_state(model, data, end)
        data, interrupt = with_step_error(data, errors, scheme.steps.size)
    return data, wall_time, stop or interrupt


def _stopped(stop: Any, run: Run) -> BaseException:
    """The exception with a run that stopped early."""
    interrupted = isinstance(stop, KeyboardInterrupt)
    run.data.attrs["stopped"] = "interrupted" if interrupted else str(stop)
    if not interrupted:
        return RunStopped(str(stop), run)
    stop.run = run
    return stop
