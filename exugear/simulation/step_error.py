"""Integration of a run in segments; repeating some of them at half the step estimates the error by the step."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import exudyn as exu
import numpy as np
from tqdm import tqdm

from exugear.elements.exudyn_objects import set_state_of_system, state_of_system
from exugear.operation.conditions import Conditions
from exugear.operation.stop_conditions import End, first_end
from exugear.plan.integrator_and_step import Rule
from exugear.simulation.shaft_motion import recorded
from exugear.simulation.solver_settings import Scheme
from exugear.system.contact_steps import lag_corrected
from exugear.system.equilibrium import explained
from exugear.system.imposed_speed import driven_by_contacts
from exugear.system.model import Model, end_coordinate

#: Number of segments of a run; more where a segment would have more steps: rounding turns the driving shaft by at most
#: 1e-16 of its angle in a step, and `Solver._realign` takes that back after each segment.
SEGMENTS, LONGEST_SEGMENT = 100, 100_000
BAR = "{desc} {percentage:3.0f}%|{bar}| {n:.3g}/{total:.3g} s [{elapsed}<{remaining}]"
#: Error of a fourth-order result over its change when the step is halved.
RICHARDSON = 16 / 15
#: Least number of samples for a meaningful rms of a segment.
FEWEST_SAMPLES = 50
#: rms of the DTE below which it is rounding [m].
NO_VIBRATION = 1e-12
INITIAL, CURRENT = exu.ConfigurationType.Initial, exu.ConfigurationType.Current


@dataclass(frozen=True)
class Segment:
    """Part of a run: its first and last step, and the state of the system at the first step (`state_of_system`)."""

    first: int
    last: int
    state: Any


@dataclass(frozen=True)
class Solver:
    """Integrates a run of a model in segments.

    restarted   whether the run continues another run instead of starting from equilibrium
    """

    model: Model
    conditions: Conditions
    scheme: Scheme
    restarted: bool = False

    def run(self, progress: bool) -> tuple[list[Segment], End | None, BaseException | None]:
        """The segments, after each of which the bar moves; the condition that ended the run, if any; the error, if any.

        Errors are RuntimeError and KeyboardInterrupt.
        """
        segments: list[Segment] = []
        end = None
        try:
            end = self._integrate(segments, progress)
            self._require_samples(end)
        except (RuntimeError, KeyboardInterrupt) as error:
            return segments, end, error
        return segments, end, None

    def errors(self, segments: Sequence[Segment], number: int) -> list[tuple[Segment, np.ndarray]]:
        """Representative segments, at most number, with the (n_stage,) relative errors of their rms of the DTE.

        The samples and the state of the system are restored.
        """
        mbs, kinds = self.model.mbs, (INITIAL, CURRENT)
        ends = [state_of_system(mbs, kind) for kind in kinds]
        errors = [(segment, self.error(segment)) for segment in self.representative(segments, number)]
        for end, kind in zip(ends, kinds, strict=True):
            set_state_of_system(mbs, end, kind)
        return errors

    def _integrate(self, segments: list[Segment], progress: bool) -> End | None:
        """Integrate the run, appending each segment before it is solved, until a condition ends it."""
        end = None
        h, mbs = self.scheme.steps.size, self.model.mbs
        style = {"bar_format": BAR, "unit_scale": h, "leave": False, "disable": not progress}
        with tqdm(total=self.scheme.steps.number, desc="run", **style) as bar, self._explained(self.scheme.rule):
            with self._advancing() as advance:
                for first, last in pairwise(self.bounds):
                    segments.append(Segment(first, last, state_of_system(mbs, self._present(first))))
                    advance(segments[-1])
                    bar.update(last - first)
                    end = self._end_in(last)
                    if end:
                        break
            if end:
                segments[-1] = self._cut(segments[-1], end.sample * self.scheme.steps.every)
            if mbs.systemData.NumberOfSensors() and not end:
                set_state_of_system(mbs, state_of_system(mbs, CURRENT), INITIAL)
        return end

    def _present(self, step: int) -> exu.ConfigurationType:
        """The configuration that holds the state at a step between two segments."""
        halted = step and self.model.mbs.systemData.NumberOfSensors()
        return CURRENT if halted else INITIAL

    def _end_in(self, last: int) -> End | None:
        """The first of the conditions that holds at a sample up to a step."""
        if not self.conditions.stop:
            return None
        number, labels = last // self.scheme.steps.every + 1, self.model.gearbox.labels
        speeds = {name: speed[:number] for name, speed in recorded(self.model, "speed").items()}
        forces = {labels[i]: mesh.recorder.force[:number] for i, mesh in enumerate(self.model.meshes)}
        return first_end(self.conditions.stop, speeds, forces, self.scheme.steps.interval)

    def _cut(self, segment: Segment, last: int) -> Segment:
        """The segment that ends at a step: it is integrated again up to there, without sensors."""
        segment = replace(segment, last=last)
        settings = self._settings()
        settings.solution.sensors.active = False
        set_state_of_system(self.model.mbs, segment.state, INITIAL)
        self._solve(settings, segment)
        return segment

    @contextmanager
    def _advancing(self) -> Iterator[Callable[[Segment], None]]:
        """The function that integrates the next segment.

        Without sensors each segment is a separate solve. Sensors must not restart with each segment: with sensors a
        single solve halts after each segment. This needs a solver driven from Python, whose overrides Exudyn looks up
        in every step, at 0.7 us each.
        """
        if not self._steady:
            self._compute_initial_forces()
        if self.model.mbs.systemData.NumberOfSensors():
            with self._halting_solver() as (solver, settings):
                yield partial(self._continue, solver, settings)
        else:
            yield self._solve_dynamic

    @property
    def _steady(self) -> bool:
        """Whether the run starts from equilibrium at a constant imposed speed."""
        speed_of = self.conditions.speed_of
        return speed_of is not None and speed_of.constant and not self.restarted

    def _settings(self) -> exu.SimulationSettings:
        settings = self.scheme.settings()
        if not self._steady:
            # Exudyn's initial accelerations leave out the slope of the given speed; those of the state contain it.
            settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
        return settings

    def _solve_dynamic(self, segment: Segment) -> None:
        """Integrate a segment from the final state of the segment before."""
        self._solve(self._settings(), segment)
        self._realign(segment.last)

    def _realign(self, last: int) -> None:
        """Take back the angle by which the coordinate of the held shaft has drifted from its imposed angle.

        Behind a constraint the whole train has drifted with it, by rounding. Contacts know the imposed angle: beside
        them only the coordinate of the shaft itself drifts, as it follows its acceleration step by step.
        """
        model, held = self.model, self.conditions.held
        if not held:
            return
        system, spin, t = model.mbs.systemData, end_coordinate(model, held), last * self.scheme.steps.size
        direction, speed_of = model.gearbox.directions[held], self.conditions.speed_of
        q, imposed = (
            system.GetODE2Coordinates(INITIAL),
            direction * (self.conditions.start_angle + speed_of.integral(t)),
        )
        if driven_by_contacts(model):
            rates = system.GetODE2Coordinates_t(INITIAL)
            q[spin], rates[spin] = imposed, direction * speed_of(t)
            system.SetODE2Coordinates_t(rates, INITIAL)
        else:
            ratios = model.speed_ratios
            q += (imposed - q[spin]) * ratios / ratios[spin]
        system.SetODE2Coordinates(q, INITIAL)

    def _solve(self, settings: exu.SimulationSettings, segment: Segment, halvings: int = 0) -> None:
        """Integrate a segment from the initial state, its steps halved so many times."""
        h, integration = self.scheme.steps.size, settings.timeIntegration
        integration.startTime, integration.endTime = segment.first * h, segment.last * h
        integration.numberOfSteps = (segment.last - segment.first) << halvings
        self.model.mbs.SolveDynamic(settings, updateInitialValues=halvings == 0)

    def _continue(self, solver, settings: exu.SimulationSettings, segment: Segment) -> None:
        """Let a halted solver continue to the end of a segment; the sensors at its start have been written already."""
        h = self.scheme.steps.size
        solver.it.endTime = segment.last * h
        if segment.first:
            solver.output.lastSensorsWritten = (segment.first + self.scheme.sensor_steps - 0.5) * h
        if not solver.SolveSteps(self.model.mbs, settings):
            raise RuntimeError("no convergence")

    @contextmanager
    def _halting_solver(self) -> Iterator[tuple[Any, exu.SimulationSettings]]:
        """Exudyn's solver over the whole run, driven from Python, and its settings."""
        h, mbs, number = self.scheme.steps.size, self.model.mbs, self.scheme.steps.number
        settings = self._settings()
        solver: Any = exu.MainSolverImplicitSecondOrder()
        settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = number * h, number
        settings.solution.sensors.writePeriod = self.scheme.sensor_steps * h
        if not solver.InitializeSolver(mbs, settings):
            raise RuntimeError("no start")
        try:
            yield solver, settings
        finally:
            solver.FinalizeSolver(mbs, settings)

    def _compute_initial_forces(self) -> None:
        """Evaluate all forces in the initial state, so that the recorders take their first samples."""
        settings, mbs = self.scheme.settings(), self.model.mbs
        settings.solution.sensors.active = False
        solver: Any = exu.MainSolverStatic()
        solver.InitializeSolver(mbs, settings)
        solver.ComputeODE2RHS(mbs)
        solver.FinalizeSolver(mbs, settings)

    @contextmanager
    def _explained(self, rule: Rule) -> Iterator[None]:
        with lag_corrected(self.model, rule), explained(self.model, self._remedy, self._speed_at):
            yield

    def _speed_at(self, t: float) -> float:
        """Speed of the driving shaft [rad/s] at a time [s]: the imposed one, or the present one."""
        if self.conditions.held:
            return float(self.conditions.driving_speed(t))
        spin = self.model.spins[self.model.gearbox.driving.name]
        return float(self.model.mbs.systemData.GetODE2Coordinates_t()[spin])

    @property
    def _remedy(self) -> str:
        return f"try step={self.scheme.steps.size / 2:.2g} or more damping"

    @property
    def bounds(self) -> list[int]:
        """Steps at which segments end; sensors are sampled at each of them, since Exudyn writes them where it halts."""
        steps = self.scheme.steps
        unit = max(steps.every, self.scheme.sensor_steps)
        wanted = max(SEGMENTS, steps.number // LONGEST_SEGMENT)
        number = max(1, min(wanted, steps.number // unit))
        inner = np.linspace(0, steps.number // unit, number + 1).astype(int)[:-1] * unit
        return [*inner.tolist(), steps.number]

    def _require_samples(self, end: End | None) -> None:
        """Require all samples: where Newton's iteration fails Exudyn cuts the step and may miss times of samples."""
        for mesh in self.model.meshes:
            lost = np.flatnonzero(np.isnan(mesh.recorder.deflection[: end.sample + 1 if end else None]))
            if lost.size:
                where = f"at t = {lost[0] * self.scheme.steps.interval:.6g} s"
                cause = f"Newton's iteration failed, {lost.size} samples are lost"
                raise RuntimeError(f"{where}: {cause}; {self._remedy}")

    def representative(self, segments: Sequence[Segment], number: int) -> list[Segment]:
        """The segment that vibrates most and others spread over the run, at most number; none of short segments."""
        length = segments[0].last - segments[0].first
        if number < 1 or length < FEWEST_SAMPLES * self.scheme.steps.every:
            return []
        rms = np.array([self.vibration(segment) for segment in segments])
        strongest = int(np.argmax((rms / np.maximum(rms.max(axis=0), np.finfo(float).tiny)).max(axis=1)))
        spread = np.linspace(0, len(segments), number + 1).astype(int)[1:-1]
        return [segments[i] for i in sorted({strongest, *spread.tolist()})]

    def vibration(self, segment: Segment) -> np.ndarray:
        """(n_stage,) rms of the DTE about its mean in a segment [m]."""
        return np.array([mesh.recorder.deflection[self._samples(segment)].std() for mesh in self.model.meshes])

    def _samples(self, segment: Segment) -> slice:
        """The samples that fall into a segment."""
        every = self.scheme.steps.every
        return slice(-(-segment.first // every), segment.last // every + 1)

    def error(self, segment: Segment) -> np.ndarray:
        """(n_stage,) relative error of the rms of the DTE by the step; NaN where the solve at half the step fails."""
        with self._samples_kept(segment):
            before = self.vibration(segment)
            try:
                self._solve_at_half_the_step(segment)
            except RuntimeError:
                return np.full(before.size, np.nan)
            after = self.vibration(segment)
            return RICHARDSON * np.abs(before - after) / np.maximum(after, NO_VIBRATION)

    @contextmanager
    def _samples_kept(self, segment: Segment) -> Iterator[None]:
        """Restore the samples of a segment afterwards."""
        blocks = [block for mesh in self.model.meshes for block in mesh.recorder.samples]
        copies = [block[self._samples(segment)].copy() for block in blocks]
        try:
            yield
        finally:
            for block, copy in zip(blocks, copies, strict=True):
                block[self._samples(segment)] = copy

    def _solve_at_half_the_step(self, segment: Segment) -> None:
        """Integrate a segment again from its state, without sensors."""
        rule = replace(self.scheme.rule, step=self.scheme.steps.size / 2)
        settings = self.scheme.settings(rule)
        settings.solution.sensors.active = False
        set_state_of_system(self.model.mbs, segment.state, INITIAL)
        with self._explained(rule):
            self._solve(settings, segment, halvings=1)
