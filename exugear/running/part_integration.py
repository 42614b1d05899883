"""Parts of a run that processes integrate: from the state that arrives there, or early from static equilibrium."""

import pickle
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from threading import Lock
from uuid import UUID, uuid4

import numpy as np

from exugear.multibody.assembly import build
from exugear.multibody.carrier_turns import rigid_coordinates, rigid_motion
from exugear.multibody.drive_and_load import ShaftTorques, applied
from exugear.multibody.equilibrium import solve_initial_equilibrium
from exugear.multibody.exudyn_objects import INITIAL, quiet, set_state_of_system
from exugear.multibody.model import (
    Model,
    further_loads,
    further_objects,
    linearized,
    matrices_without_meshes,
    motion_of,
)
from exugear.multibody.shaft_motion import needs_speeds
from exugear.multibody.solver_settings import Scheme
from exugear.multibody.time_integration import RunState, Segment, Solver
from exugear.operation.conditions import Conditions
from exugear.planning.linear_train import SEAM_TOLERANCE
from exugear.planning.plan import Plan
from exugear.running.run_data import AnyRecorder, recorders_of, recording
from exugear.running.step_error import vibration_at_half_the_step
from fem.support.progress import shown
from fem.support.validation import require

#: Number of states on either side of a seam from which the rms is taken.
NEAR = 16
#: Difference of equal states by rounding, in spacings of floats at the largest angle.
ROUNDED_SPACINGS = 8
#: Held by the thread that uses the model of this process: threads take turns.
MODEL_IN_USE = Lock()


@dataclass(frozen=True, eq=False)
class PartSamples:
    """Samples of a part of a run.

    numbers   of the samples in the whole run
    rows      (n,) of each quantity of all recorders; (1,) where all samples are equal
    """

    numbers: range
    rows: Sequence[np.ndarray]

    def copy_to(self, rows: Sequence[np.ndarray], begin: int) -> None:
        """Copy the samples from a number on to the rows of the whole run, each of which is constant from there on."""
        if begin >= self.numbers.stop:
            return
        whole, part = slice(begin, self.numbers.stop), slice(begin - self.numbers.start, None)
        for row, samples in zip(rows, self.rows, strict=True):
            if len(samples) > 1:
                row[whole] = samples[part]
            elif row[begin] != samples[0]:
                row[whole] = samples


def rows_of(recorders: Sequence[AnyRecorder]) -> list[np.ndarray]:
    """(number,) samples of each quantity that recorders hold, and of each of its components."""
    return [row for recorder in recorders for array in recorder.samples.values() for row in np.atleast_2d(array)]


def part_samples(recorders: Sequence[AnyRecorder], numbers: range) -> PartSamples:
    """The samples with these numbers of recorders."""
    first = int(recorders[0].header.first)
    rows = (row[numbers.start - first : numbers.stop - first] for row in rows_of(recorders))
    return PartSamples(numbers, [row[:1] if _is_constant(row) else row for row in rows])


def _is_constant(row: np.ndarray) -> bool:
    """Whether all samples are equal; most rows that are not constant differ in the middle."""
    return row.size > 0 and bool(row[row.size // 2] == row[0] and (row == row[0]).all())


def stored(samples: PartSamples, folder: Path) -> PartSamples | Path:
    """Store samples in a new file of a folder: processes of one machine share it several times as fast as a pipe."""
    if not folder.is_dir():
        return samples
    path = folder / str(uuid4())
    with path.open("wb") as file:
        pickle.dump(samples, file, protocol=pickle.HIGHEST_PROTOCOL)
    return path


def loaded(samples: PartSamples | Path) -> PartSamples:
    """The samples, also from the file in which they are stored, which is deleted: its memory serves the next ones."""
    if isinstance(samples, PartSamples):
        return samples
    with samples.open("rb") as file:
        content = pickle.load(file)
    samples.unlink()
    return content


@dataclass(frozen=True)
class Job:
    """A run as data from which a process builds its model; jobs are equal if their numbers are.

    conditions   of the whole run; its gearbox is that of the model
    folder       in which processes of this machine store samples
    """

    number: UUID
    plan: Plan = field(compare=False)
    conditions: Conditions = field(compare=False)
    scheme: Scheme = field(compare=False)
    restarted: bool = field(compare=False)
    folder: Path = field(compare=False)


@dataclass(frozen=True)
class Part:
    """Segments of a run that a process integrates one after the other.

    bounds     steps at which they begin and end
    seam       step after which the samples belong to the run; what lies before it lets vibrations settle
    state      of the system at the first step; None: static equilibrium at the speed of that time
    expected   states at the bounds after the seam; the part ends as soon as it is in one of them
    """

    bounds: Sequence[int]
    seam: int
    state: RunState | None = None
    expected: Mapping[int, RunState] = field(default_factory=dict)


@dataclass(frozen=True)
class Integrated:
    """What a process returns of a part.

    states       by the step, from the seam on
    samples      behind the seam, or the file that holds them; that at t = 0 is behind the seam at step 0
    reason       why the integration has stopped; else empty
    stopped_at   time of the system [s]
    """

    states: dict[int, RunState]
    samples: PartSamples | Path
    reason: str
    stopped_at: float

    @property
    def last(self) -> int:
        """The step to which the part has come, -1 where it has not reached its seam."""
        return max(self.states, default=-1)


def integrate(job: Job, part: Part) -> Integrated:
    """Integrate a part; a function that processes can import."""
    steps = job.scheme.steps
    states: dict[int, RunState] = {part.seam: part.state} if part.state else {}
    begin, reason, stopped_at = samples_before(job.scheme, part.seam), "", 0.0
    samples = PartSamples(range(begin, begin), ())
    try:
        with _system_of(job, part) as (solver, torques):
            try:
                for segment in solver.segments_between(part.bounds, part.state):
                    if segment.last >= part.seam:
                        states[segment.last] = solver.state()
                    if _is_joined(solver, segment.last, states, part.expected):
                        break
            finally:
                stopped_at = solver.model.bare_mbs.systemData.GetTime()
                end = max(begin, int(stopped_at / steps.interval + 0.5) + 1)
                samples = part_samples(recorders_of(solver.model, torques), range(begin, end))
    except (RuntimeError, ValueError) as error:
        reason = str(error)
    return Integrated(states, stored(samples, job.folder), reason, stopped_at)


def rms_at_half_the_step(job: Job, segment: Segment) -> np.ndarray:
    """(n_stage,) rms of the DTE of a segment, integrated at half the step; a function that processes can import."""
    with _system_of(job, Part((segment.first, segment.last), segment.first, segment.state)) as (solver, _):
        return vibration_at_half_the_step(solver, segment)


@lru_cache(maxsize=1)
def _model_of(job: Job) -> Model:
    """The model of a job, built once in a process."""
    return linearized(build(job.conditions.gearbox, plan=job.plan), job.conditions.held, job.conditions.highest_speed)


@contextmanager
def _system_of(job: Job, part: Part) -> Iterator[tuple[Solver, ShaftTorques]]:
    """The system of a run in the state in which a part begins, with its recorders started."""
    conditions, steps = job.conditions, job.scheme.steps
    with MODEL_IN_USE, shown(False), quiet():
        model = _model_of(job)
        begin = replace(conditions, start_time=0.0 if part.state else part.bounds[0] * steps.size)
        with applied(model, begin) as acting:
            if not part.state:
                solve_initial_equilibrium(model, begin, job.scheme.rule)
            acting.release()
            if part.state:
                set_state_of_system(model.bare_mbs, part.state.system, INITIAL)
            samples = range(part.seam // steps.every, part.bounds[-1] // steps.every + 1)
            power = needs_speeds(model, conditions)
            with recording(model, steps, acting.torques, power=power, samples=samples):
                yield Solver(model, conditions, job.scheme, job.restarted), acting.torques


def samples_before(scheme: Scheme, step: int) -> int:
    """Number of samples up to a step at which a part begins; that at t = 0 belongs to the part behind it."""
    return step // scheme.steps.every + (step > 0)


def _is_joined(solver: Solver, step: int, states: Mapping[int, RunState], expected: Mapping[int, RunState]) -> bool:
    """Whether the state at a step is the one that is expected there."""
    return step in expected and seam_error(solver, step, states[step], expected) <= SEAM_TOLERANCE


def seam_error(solver: Solver, step: int, state: RunState, expected: Mapping[int, RunState]) -> float:
    """Largest difference of a state from the expected one at a step, over the rms of each coordinate and velocity.

    expected   states at steps about it, by which the rms is known

    The rms is that of the vibrations, about their means, relative to the train as a rigid body at its imposed speed.
    """
    steps = sorted(expected)
    middle = steps.index(step)
    near = steps[max(0, middle - NEAR) : middle + NEAR + 1]
    vibrations = np.array([_vibration(solver, each, expected[each]) for each in near])
    difference = np.abs(_vibration(solver, step, state) - _vibration(solver, step, expected[step]))
    scale = vibrations.std(axis=0) + _rounding(solver.model, expected[step]) / SEAM_TOLERANCE
    return float((difference / scale).max())


def _vibration(solver: Solver, step: int, state: RunState) -> np.ndarray:
    """(2 n_coordinates,) coordinates and velocities of a state less those of the train as a rigid body."""
    model, conditions, t = solver.model, solver.conditions, step * solver.scheme.steps.size
    rigid = rigid_coordinates(model, conditions.shaft_angles(t))
    velocities = state.system.velocities - rigid_motion(model, rigid, conditions.shaft_speeds(t))
    return np.concatenate([state.system.coordinates - rigid, velocities])


def _rounding(model: Model, state: RunState) -> np.ndarray:
    """(2 n_coordinates,) differences of coordinates and velocities that are rounding."""
    angle = ROUNDED_SPACINGS * float(np.spacing(np.abs(state.system.coordinates).max()))
    spins = np.array([motion_of(model, motion) for motion in model.gearbox.motions]).any(axis=0)
    lever = max(float(np.abs(mesh.row[spins]).max()) for mesh in model.meshes)
    coordinates = angle * np.where(spins, 1.0, lever)
    return np.concatenate([coordinates, model.plan.omega_mesh * coordinates])


def check_parts(model: Model, conditions: Conditions) -> None:
    """ValueError unless the speed at later times is known, and other processes can build the system."""
    free = "executor: the speed of a free train is known only once it has run"
    few = f"{free}; impose {len(conditions.anchors)} by exugear.Speed, or leave executor out"
    require(conditions.prescribed, few)
    require(not conditions.stop, "executor: stop is not known before the run; give a duration, or leave executor out")
    sensors = model.bare_mbs.systemData.NumberOfSensors()
    added = "executor: model.mbs has objects, loads or sensors beside those of the gearbox"
    remedy = "which other processes cannot build; leave executor out"
    require(not (further_objects(model) or further_loads(model) or sensors), f"{added}, {remedy}")
    copy = build(model.gearbox, plan=model.scene)
    matrices = zip(matrices_without_meshes(model), matrices_without_meshes(copy), strict=True)
    unchanged = all(np.allclose(matrix, built, rtol=1e-9, atol=0) for matrix, built in matrices)
    require(unchanged, f"executor: mass, stiffness or damping of the system model.mbs were changed, {remedy}")
