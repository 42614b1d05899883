"""Parts of a run side by side: a part is joined at a seam where the state that arrives equals the part's state there.

Where it does not, the part is integrated again from the state that arrives until that meets a state of the part. Only
the states of one unbroken chain enter the run, which is therefore the serial one.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass, field
from itertools import pairwise, repeat
from math import ceil, inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from uuid import uuid4

import numpy as np
import xarray as xr

from exugear.multibody.drive_and_load import ShaftTorques
from exugear.multibody.exudyn_objects import INITIAL, set_state_of_system
from exugear.multibody.shaft_motion import BearingForces
from exugear.multibody.time_integration import RunState, Segment, Solver, progress_bar
from exugear.planning.linear_train import SEAM_TOLERANCE, settling_time
from exugear.running.part_integration import (
    Integrated,
    Job,
    Part,
    PartSamples,
    integrate,
    loaded,
    rms_at_half_the_step,
    rows_of,
    samples_before,
    seam_error,
)
from exugear.running.run_data import recorders_of
from fem.support.user_warning import warn_user

#: Most parts for each process: where a part is repeated, the other processes have further ones to integrate.
PARTS_PER_PROCESS = 4
#: Length of a part over that of its early start: wanted, and at least.
WANTED_LENGTH, LEAST_LENGTH = 16, 2
#: Share of the run that may be integrated again without a warning.
LARGEST_REPEATED_SHARE = 0.5


@dataclass(frozen=True)
class Division:
    """How a run is divided into parts.

    bounds       steps at which the segments of the run end
    ends         indices of the bounds at which the parts begin and end
    early        number of segments by which a part starts early
    processes    number of processes
    """

    bounds: Sequence[int]
    ends: Sequence[int]
    early: int
    processes: int

    @property
    def number(self) -> int:
        """Number of parts."""
        return len(self.ends) - 1

    def part(self, i: int, state: RunState | None = None, expected: Any = None) -> Part:
        """The part with a number: from the state that arrives, or early from static equilibrium."""
        begin = self.ends[i] if state else max(self.ends[i] - self.early, 0)
        return Part(self.bounds[begin : self.ends[i + 1] + 1], self.bounds[self.ends[i]], state, expected or {})


def division_of(solver: Solver, executor: Executor) -> Division:
    """The parts of a run: a single one where vibrations do not decay, for a single process and for a short run.

    A part starts one segment earlier than vibrations need to settle: in that segment Newton's iteration, whose matrix
    is that at the beginning of the segment, becomes the same.
    """
    bounds, processes, decay = solver.bounds, number_of_processes(executor), solver.model.plan.decay
    segments = len(bounds) - 1
    settling = settling_time(decay, SEAM_TOLERANCE) / solver.conditions.duration if decay > 0 else inf
    early = ceil(min(settling, 1.0) * segments) + 1
    wanted = processes * min(max(segments // (processes * WANTED_LENGTH * early), 1), PARTS_PER_PROCESS)
    parts = max(1, min(wanted, segments // (LEAST_LENGTH * early))) if processes > 1 else 1
    return Division(bounds, np.linspace(0, segments, parts + 1).astype(int).tolist(), early, processes)


def number_of_processes(executor: Executor) -> int:
    """Number of processes of an executor: of a process pool, of Dask or of MPI; else that of the processors."""
    client = getattr(executor, "_client", None)
    if client is not None:
        return len(client.ncores())
    number = getattr(executor, "_max_workers", None) or getattr(executor, "num_workers", None)
    return int(number or os.cpu_count() or 1)


@dataclass
class JoinedRun:
    """The run as far as its parts are joined.

    solver     of the whole run
    states     of the system at the bounds of the segments, by step
    forces     of the bearings in the run
    arrived    samples of joined parts, or their files, with the number from which the run takes them
    seams      differences of the states that were joined, by step
    front      step up to which the run is joined
    reason     why a part from the state that had arrived has stopped; else empty
    repeated   steps of parts that were integrated again
    """

    solver: Solver
    states: dict[int, RunState]
    forces: BearingForces
    arrived: list[tuple[PartSamples | Path, int]] = field(default_factory=list)
    bar: Any = None
    seams: dict[int, float] = field(default_factory=dict)
    front: int = 0
    reason: str = ""
    stopped_at: float = 0.0
    repeated: int = 0

    def meets(self, part: Integrated) -> bool:
        """Whether the state at the front is that of a part; remembers the difference as that of a seam."""
        if part.reason or self.front not in part.states:
            return False
        error = seam_error(self.solver, self.front, self.states[self.front], part.states)
        if error <= SEAM_TOLERANCE:
            self.seams[self.front] = error
        return error <= SEAM_TOLERANCE

    def extend(self, part: Integrated) -> None:
        """Take what a part has behind the front."""
        self.arrived.append((part.samples, samples_before(self.solver.scheme, self.front)))
        self.states |= part.states
        self.bar.update(max(part.last - self.front, 0))
        self.front, self.reason, self.stopped_at = max(part.last, self.front), part.reason, part.stopped_at

    def copy_samples(self, rows: Sequence[np.ndarray]) -> None:
        """Copy the samples that have arrived to the rows of the whole run, and compute the forces of the bearings."""
        for samples, begin in self.arrived:
            loaded(samples).copy_to(rows, begin)
        self.arrived.clear()
        self.forces.extend(samples_before(self.solver.scheme, self.front))


@dataclass
class Joining:
    """Submits the parts of a run to an executor and joins them.

    joined     number of parts that are joined
    running    parts that processes integrate
    early      parts that were started early and wait for the state that arrives
    arriving   the part from the state that has arrived, if that runs
    """

    chain: JoinedRun
    division: Division
    job: Job
    executor: Executor
    joined: int = 0
    running: dict[Future, int] = field(default_factory=dict)
    early: dict[int, Integrated] = field(default_factory=dict)
    arriving: Future | None = None

    def begin(self) -> "Joining":
        """Submit the first parts."""
        self._join()
        self._start_early()
        return self

    def run(self, rows: Sequence[np.ndarray]) -> None:
        """Integrate and join all parts; RuntimeError, with the reason, where the executor or a solve fails.

        rows   of the samples of the whole run, to which those of the parts are copied while processes integrate
        """
        try:
            while self.joined < self.division.number:
                done, _ = wait(self.running, return_when=FIRST_COMPLETED)
                for future in done:
                    self._receive(future)
                self._join()
                self._start_early()
                self.chain.copy_samples(rows)
        finally:
            for future in self.running:
                future.cancel()
            self.chain.copy_samples(rows)

    def _join(self) -> None:
        """Join the parts that fit; the next that does not is integrated from the state that arrives."""
        while self.arriving is None and self.joined < self.division.number:
            part = self.early.get(self.joined)
            if part is None and self.joined in self.running.values():
                return
            if part and self.chain.meets(part):
                self.chain.extend(self.early.pop(self.joined))
                self.joined += 1
            else:
                expected = part.states if part and not part.reason else {}
                state = self.chain.states[self.chain.front]
                self.arriving = self._submit(self.joined, self.division.part(self.joined, state, expected))

    def _start_early(self) -> None:
        """Start further parts early while processes are free."""
        begun = {*self.running.values(), *self.early, *range(self.joined + 1)}
        for i in range(self.division.number):
            if i not in begun and len(self.running) < self.division.processes:
                self._submit(i, self.division.part(i))

    def _submit(self, i: int, part: Part) -> Future:
        future = submitted(self.executor, integrate, self.job, part)
        self.running[future] = i
        return future

    def _receive(self, future: Future) -> None:
        """Keep a part that was started early; join one from the state that had arrived."""
        i, part = self.running.pop(future), result_of(future)
        if future is not self.arriving:
            self.early[i] = part
            return
        self.arriving, started_early, begin = None, self.early.pop(i, None), self.chain.front
        self.chain.extend(part)
        if self.chain.reason:
            raise RuntimeError(self.chain.reason)
        if started_early:
            self.chain.repeated += self.chain.front - begin
            if self.chain.front < self.division.bounds[self.division.ends[i + 1]]:
                self.chain.meets(started_early)
                self.chain.extend(started_early)
        self.joined += 1


def submitted(executor: Executor, function: Callable, job: Job, part: Part | Segment) -> Future:
    """A future of the executor; RuntimeError in words where it has no processes left."""
    try:
        return executor.submit(function, job, part)
    except Exception as error:
        raise _failure(error) from None


def result_of(future: Future) -> Any:
    """The result of a future; RuntimeError in words where its process has failed."""
    try:
        return future.result()
    except Exception as error:
        raise _failure(error) from None


def _failure(error: Exception) -> RuntimeError:
    """The error of an executor in words."""
    text = f"{type(error).__name__}: {error}".splitlines()[0]
    cause = f"executor: a process that integrated a part of the run has failed or was killed ({text})"
    return RuntimeError(f"{cause}; take a new executor, with fewer processes if memory was short, or leave it out")


@dataclass
class Parts:
    """A run as parts that an executor integrates side by side."""

    joining: Joining
    solver: Solver
    torques: ShaftTorques
    folder: TemporaryDirectory

    @property
    def stopped_at(self) -> float:
        """Time up to which the run is joined, or at which a part has stopped [s]."""
        chain = self.joining.chain
        return chain.stopped_at if chain.reason else (chain.front + 0.5) * self.solver.scheme.steps.size

    def run(self, progress: bool) -> tuple[list[Segment], None, BaseException | None]:
        """As `Solver.run`."""
        mbs, chain, stop = self.solver.model.bare_mbs, self.joining.chain, None
        try:
            with self.folder, progress_bar(self.solver.scheme, progress) as chain.bar:
                self.joining.run(rows_of(recorders_of(self.solver.model, self.torques)))
            self.solver.require_samples(None)
        except (RuntimeError, KeyboardInterrupt) as error:
            stop = error
        set_state_of_system(mbs, chain.states[chain.front].system, INITIAL)
        bounds = sorted(step for step in chain.states if step <= chain.front)
        return [Segment(first, last, chain.states[first]) for first, last in pairwise(bounds)], None, stop

    def repeated(self, segments: Sequence[Segment]) -> Iterator[np.ndarray]:
        """(n_stage,) rms of the DTE of each segment at half the step, which processes begin to integrate at once.

        NaN, with a warning, where a process fails: the run itself is there.
        """
        job, executor = self.joining.job, self.joining.executor
        try:
            futures = [submitted(executor, rms_at_half_the_step, job, segment) for segment in segments]
        except RuntimeError as error:
            return repeat(self._unknown(error), len(segments))
        return map(self._rms_of, futures)

    def _rms_of(self, future: Future) -> np.ndarray:
        """(n_stage,) rms that a process returns."""
        try:
            return result_of(future)
        except RuntimeError as error:
            return self._unknown(error)

    def _unknown(self, error: RuntimeError) -> np.ndarray:
        """(n_stage,) NaN, with a warning of the reason."""
        warn_user(f"step_error is NaN; {error}")
        return np.full(len(self.solver.model.meshes), np.nan)

    def with_seams(self, data: xr.Dataset) -> xr.Dataset:
        """The data of the run with the differences at the seams."""
        chain, division, h = self.joining.chain, self.joining.division, self.solver.scheme.steps.size
        repeated = chain.repeated / self.solver.scheme.steps.number
        text = f"{division.number} on {division.processes} processes, {repeated:.3g} of the run integrated again"
        if repeated > LARGEST_REPEATED_SHARE:
            cause = (
                f"executor: {repeated:.0%} of the run were integrated again, as parts did not meet the states before"
            )
            warn_user(f"{cause}; the run took as long as without executor")
        about = {"units": "1", "long_name": "difference of the states that were joined, over the rms of the vibration"}
        seam = {"units": "s", "long_name": "time at which parts of the run were joined"}
        times, errors = np.array(list(chain.seams)) * h, np.array(list(chain.seams.values()), float)
        return data.assign(seam_error=("seam", errors, about), seam=("seam", times, seam)).assign_attrs(parts=text)


def parts_of(solver: Solver, torques: ShaftTorques, forces: BearingForces, executor: Executor) -> Parts | None:
    """The run as parts, the first of which are submitted; None where it is better serial.

    Warns where vibrations do not decay.
    """
    if not solver.model.plan.decay:
        warn_user("executor: the run is serial, as vibrations do not decay; damp all modes")
    division = division_of(solver, executor)
    if division.number < 2:
        return None
    folder = TemporaryDirectory(ignore_cleanup_errors=True)
    run = solver.model.scene, solver.conditions.tabulated(), solver.scheme, solver.restarted
    job = Job(uuid4(), *run, Path(folder.name))
    chain = JoinedRun(solver, {0: solver.state()}, forces)
    try:
        return Parts(Joining(chain, division, job, executor).begin(), solver, torques, folder)
    except BaseException:
        folder.cleanup()
        raise
