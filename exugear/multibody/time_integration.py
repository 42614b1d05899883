"""Integration of a run in segments: each is a separate solve from the final state of the segment before."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, NamedTuple

import exudyn as exu
import numpy as np

from exugear.multibody.carrier_turns import rigid_motion
from exugear.multibody.contact_steps import lag_corrected, steps_of_contacts
from exugear.multibody.drive_and_load import is_known_function_of_time
from exugear.multibody.equilibrium import jammed
from exugear.multibody.exudyn_objects import CURRENT, INITIAL, SystemState, set_state_of_system, state_of_system
from exugear.multibody.model import Model, end_coordinate
from exugear.multibody.shaft_motion import recorded
from exugear.multibody.solve_errors import FAILED, explained
from exugear.multibody.solver_settings import CLOSE, LOOSER_ON_PINS, Scheme
from exugear.multibody.step_ends import StepEnds, step_ends_of
from exugear.operation.conditions import Conditions
from exugear.operation.piecewise_cubics import GOLDEN
from exugear.operation.stop_conditions import End, first_end
from exugear.planning.integrator_and_step import Rule
from fem.support.progress import moving

#: Least number of segments of a run, and steps in a segment of a long run: rounding turns the driving shaft by at most
#: 1e-16 of its angle in a step, and `Solver._realign` takes that back after each segment. A segment costs 50 us.
SEGMENTS, LONGEST_SEGMENT = 100, 3000
#: Turn of a carrier of planets on elastic pins in a segment [rad], but for the least number of steps. Each segment
#: renews the matrix of Newton's iteration, from which the directions of pins and meshes turn away: iterations a step
#: are 1.01 at a turn of 0.1, 1.08 at 0.3 and 1.20 at 0.6; renewing takes as long as 35 steps (measured).
CARRIER_TURN, LEAST_STEPS = 0.3, 400
#: Turn of a carrier of planets on pins in a segment [rad] up to which the first iteration of the next segment, whose
#: forces follow from the matrix of this segment, may end within the usual tolerance, and let planets vibrate by that.
LITTLE_TURN = 0.01
#: Shift of the ends of segments at constant speed, as share of a segment and by multiples of the golden ratio: they
#: then lie at all phases of the mesh cycle.
SHIFT = 0.25
BAR = "{desc} {percentage:3.0f}%|{bar}| {n:.3g}/{total:.3g} s [{elapsed}<{remaining}]"


class RunState(NamedTuple):
    """State of a run between two steps: that of the system, and what each contact remembers of the last step."""

    system: SystemState
    contacts: list[np.ndarray]


@dataclass(frozen=True)
class Segment:
    """Part of a run: its first and last step, and the state at the first step."""

    first: int
    last: int
    state: RunState


@dataclass(frozen=True)
class Solver:
    """Integrates a run of a model in segments.

    restarted    whether the run continues another run instead of starting from equilibrium
    iterations   of Newton's method in each solve; empty where a single solve halts for sensors
    """

    model: Model
    conditions: Conditions
    scheme: Scheme
    restarted: bool = False
    iterations: list[int] = field(default_factory=list)

    def run(self, progress: bool) -> tuple[list[Segment], End | None, BaseException | None]:
        """The segments, after each of which the bar moves; the condition that ended the run, if any; the error, if any.

        Errors are RuntimeError and KeyboardInterrupt.
        """
        segments: list[Segment] = []
        end = None
        try:
            end = self._integrate(segments, progress)
            self.require_samples(end)
        except (RuntimeError, KeyboardInterrupt) as error:
            return segments, end, error
        return segments, end, None

    @property
    def stopped_at(self) -> float:
        """Time of the system [s]."""
        return self.model.bare_mbs.systemData.GetTime()

    def segments_between(self, bounds: Sequence[int], state: RunState | None = None) -> Iterator[Segment]:
        """Integrate from the present state, at the first of these steps, to the others; each segment once it is solved.

        state   at the first step, of a run that goes on

        Raises RuntimeError, with the reason, where a solve fails.
        """
        with self.explained(self.scheme.rule), self._advancing(bounds[0]) as advance:
            if state and bounds[0]:
                for steps, of_state in zip(self._steps_of_contacts, state.contacts, strict=True):
                    steps[:] = of_state
            for first, last in pairwise(bounds):
                segment = Segment(first, last, self.state(self._present(first)))
                advance(segment)
                yield segment

    def state(self, configuration=INITIAL) -> RunState:
        """State of the system in a configuration, and what its contacts remember of the last step."""
        contacts = [steps.copy() for steps in self._steps_of_contacts]
        return RunState(state_of_system(self.model.bare_mbs, configuration), contacts)

    @cached_property
    def _steps_of_contacts(self) -> list[np.ndarray]:
        return steps_of_contacts(self.model)

    def _integrate(self, segments: list[Segment], progress: bool) -> End | None:
        """Integrate the run, appending each segment, until a condition ends it."""
        bounds, end = self.bounds, None
        check_every = max(1, len(bounds) // SEGMENTS)
        with progress_bar(self.scheme, progress) as bar:
            for segment in self.segments_between(bounds):
                segments.append(segment)
                bar.update(segment.last - segment.first)
                if len(segments) % check_every == 0 or segment.last == bounds[-1]:
                    end = self._end_in(segment.last)
                if end:
                    self._cut(segments, end.sample * self.scheme.steps.every)
                    break
        if self.model.bare_mbs.systemData.NumberOfSensors() and not end:
            set_state_of_system(self.model.bare_mbs, state_of_system(self.model.bare_mbs, CURRENT), INITIAL)
        return end

    def _present(self, step: int) -> exu.ConfigurationType:
        """The configuration that holds the state at a step between two segments."""
        halted = step and self.model.bare_mbs.systemData.NumberOfSensors()
        return CURRENT if halted else INITIAL

    def _end_in(self, last: int) -> End | None:
        """The first of the conditions that holds at a sample up to a step."""
        if not self.conditions.stop:
            return None
        number, labels = last // self.scheme.steps.every + 1, self.model.gearbox.labels
        speeds = {name: speed[:number] for name, speed in recorded(self.model, "speed").items()}
        forces = {labels[i]: mesh.recorder.force[:number] for i, mesh in enumerate(self.model.meshes)}
        return first_end(self.conditions.stop, speeds, forces, self.scheme.steps.interval)

    def _cut(self, segments: list[Segment], last: int) -> None:
        """Let the segments end at a step; the last one is integrated again up to there, without sensors."""
        while len(segments) > 1 and segments[-1].first >= last:
            segments.pop()
        segments[-1] = replace(segments[-1], last=last)
        settings = self.settings()
        settings.solution.sensors.active = False
        set_state_of_system(self.model.bare_mbs, segments[-1].state.system, INITIAL)
        self.solve(settings, segments[-1])

    @contextmanager
    def _advancing(self, begin: int) -> Iterator[Callable[[Segment], None]]:
        """The function that integrates the next segment, from a step on.

        Without sensors each segment is a separate solve. Sensors must not restart with each segment: with sensors a
        single solve halts after each segment. This needs a solver driven from Python, whose overrides Exudyn looks up
        in every step, at 0.7 us each.
        """
        if begin == 0 and not self._steady:
            self._compute_initial_forces()
        if self.model.bare_mbs.systemData.NumberOfSensors():
            with self._halting_solver() as (solver, settings):
                yield partial(self._continue, solver, settings)
        else:
            yield partial(self._solve_dynamic, self.settings())

    @property
    def _steady(self) -> bool:
        """Whether the run starts from equilibrium at constant imposed speeds."""
        constant = all(speed_of.constant for speed_of in self.conditions.speeds_of)
        return self.conditions.prescribed and constant and not self.restarted

    def settings(self) -> exu.SimulationSettings:
        """Settings of Exudyn for the run."""
        settings = self.scheme.settings()
        if not self._steady:
            # Exudyn's initial accelerations leave out the slope of the given speed; those of the state contain it.
            settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
        return settings

    def _solve_dynamic(self, settings: exu.SimulationSettings, segment: Segment) -> None:
        """Integrate a segment from the final state of the segment before."""
        settings.timeIntegration.newton.relativeTolerance = self._relative_tolerance(segment)
        self._renew_matrices(segment.first)
        self.solve(settings, segment)
        self._realign(segment.last)

    def _renew_matrices(self, step: int) -> None:
        """Let forces that turn with carriers know their matrices in the segment that begins at a step."""
        if self._turning:
            system = self.model.bare_mbs.systemData
            q, q_t = system.GetODE2Coordinates(INITIAL), system.GetODE2Coordinates_t(INITIAL)
            for ends, part in self._turning:
                ends.renew(step * self.scheme.steps.size, q[part].tolist(), q_t[part].tolist())

    @cached_property
    def _turning(self) -> list[tuple[StepEnds, np.ndarray]]:
        """Steps of the forces that turn with carriers, and numbers of the coordinates on which these act."""
        mbs = self.model.bare_mbs
        turning = [ends for ends in step_ends_of(mbs) if ends.item is not None]
        return [(ends, np.array(mbs.systemData.GetObjectLTGODE2(ends.item))) for ends in turning]

    def _realign(self, last: int) -> None:
        """Take back the angles by which the coordinates of held shafts have drifted from their imposed angles.

        Behind a constraint the whole train has drifted with it, by rounding. Contacts know the imposed angle: beside
        them only the coordinate of the shaft itself drifts, as it follows its acceleration step by step.
        """
        model, conditions, t = self.model, self.conditions, last * self.scheme.steps.size
        if not conditions.imposed:
            return
        system = model.bare_mbs.systemData
        q, rates = system.GetODE2Coordinates(INITIAL), system.GetODE2Coordinates_t(INITIAL)
        known = is_known_function_of_time(model)
        for imposed, speed_of, motion in zip(
            conditions.imposed, conditions.speeds_of, conditions.motions, strict=False
        ):
            spin, direction = end_coordinate(model, imposed.shaft), model.gearbox.directions[imposed.shaft]
            angle = direction * (imposed.start_angle + speed_of.integral(t))
            if known:
                q[spin], rates[spin] = angle, direction * speed_of(t)
            else:
                q += (angle - q[spin]) * rigid_motion(model, q, motion)
        if known:
            system.SetODE2Coordinates_t(rates, INITIAL)
        system.SetODE2Coordinates(q, INITIAL)

    def _relative_tolerance(self, segment: Segment) -> float:
        """Newton's relative tolerance in a segment: close where the first iteration may let planets on pins vibrate.

        These are the segment in which they begin to orbit, from which no accelerations are expected yet, segments in
        which their carrier turns little, and all segments where a mode is hardly damped: what is left of the residual
        feeds vibrations like a damping ratio of -2e-6 at the default tolerance (measured).
        """
        if not self.model.pins:
            return self.scheme.relative_tolerance
        usual = LOOSER_ON_PINS * self.scheme.relative_tolerance
        turn = self._highest_carrier_speed * (segment.last - segment.first) * self.scheme.steps.size
        undamped = self.model.plan.damping_ratio < usual
        return CLOSE if segment.first == 0 or 0.0 < turn < LITTLE_TURN or undamped else usual

    def solve(self, settings: exu.SimulationSettings, segment: Segment, halvings: int = 0) -> None:
        """Integrate a segment from the initial state; halvings: of its steps."""
        h, integration = self.scheme.steps.size, settings.timeIntegration
        integration.startTime, integration.endTime = segment.first * h, segment.last * h
        integration.numberOfSteps = (segment.last - segment.first) << halvings
        self.model.bare_mbs.SolveDynamic(settings, updateInitialValues=halvings == 0)
        if halvings == 0:
            self.iterations.append(self.model.bare_mbs.sys["dynamicSolver"].it.newtonStepsCount)

    def _continue(self, solver, settings: exu.SimulationSettings, segment: Segment) -> None:
        """Let a halted solver continue to the end of a segment; the sensors at its start have been written already."""
        h = self.scheme.steps.size
        solver.it.endTime = segment.last * h
        settings.timeIntegration.newton.relativeTolerance = self._relative_tolerance(segment)
        if segment.first:
            solver.output.lastSensorsWritten = (segment.first + self.scheme.sensor_steps - 0.5) * h
        if not solver.SolveSteps(self.model.bare_mbs, settings):
            raise RuntimeError("no convergence")

    @contextmanager
    def _halting_solver(self) -> Iterator[tuple[Any, exu.SimulationSettings]]:
        """Exudyn's solver over the whole run, driven from Python, and its settings."""
        h, mbs, number = self.scheme.steps.size, self.model.bare_mbs, self.scheme.steps.number
        settings = self.settings()
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
        settings, mbs = self.scheme.settings(), self.model.bare_mbs
        settings.solution.sensors.active = False
        solver: Any = exu.MainSolverStatic()
        solver.InitializeSolver(mbs, settings)
        solver.ComputeODE2RHS(mbs)
        solver.FinalizeSolver(mbs, settings)

    @contextmanager
    def explained(self, rule: Rule) -> Iterator[None]:
        """Contacts correct the lag of the velocities of a rule; errors become RuntimeError with the reason."""
        with lag_corrected(self.model, rule, self.conditions.held), explained(self.model, self._remedy, self._speed_at):
            yield

    def _speed_at(self, t: float) -> float:
        """Speed of the driving shaft [rad/s] at a time [s]: the imposed one, or the present one."""
        if self.conditions.prescribed:
            return float(self.conditions.driving_speed(t))
        spin = self.model.spins[self.model.gearbox.driving.name]
        return float(self.model.bare_mbs.systemData.GetODE2Coordinates_t()[spin])

    def _remedy(self) -> str:
        """What to try where Newton's iteration has failed in the present state."""
        jam = jammed(self.model, np.array(self.model.bare_mbs.systemData.GetODE2Coordinates()))
        return jam or f"try step={self.scheme.steps.size / 2:.2g} or more damping"

    @cached_property
    def bounds(self) -> list[int]:
        """Steps at which segments end; sensors are sampled at each of them, since Exudyn writes them where it halts."""
        steps = self.scheme.steps
        unit = max(steps.every, self.scheme.sensor_steps)
        number = max(SEGMENTS, steps.number // LONGEST_SEGMENT, self._renewals)
        number = max(1, min(number, steps.number // unit))
        i = np.arange(number)
        shifts = SHIFT * (GOLDEN * i % 1) if self.conditions.constant_speed else 0.0
        inner = np.unique(((i + shifts) * (steps.number // unit) / number).astype(int)) * unit
        return [*inner.tolist(), steps.number]

    @property
    def _renewals(self) -> int:
        """How often the matrix of Newton's iteration is renewed because carriers of planets on pins turn."""
        turn = self._highest_carrier_speed * self.conditions.duration
        return min(int(turn / CARRIER_TURN), self.scheme.steps.number // LEAST_STEPS)

    @cached_property
    def _highest_carrier_speed(self) -> float:
        """Of the carriers of planets on pins [rad/s]; 0 without."""
        return max(map(self.conditions.highest_speed_of, self.model.gearbox.carriers_of_pins), default=0.0)

    def require_samples(self, end: End | None) -> None:
        """Require all samples: where Newton's iteration fails Exudyn cuts the step and may miss times of samples."""
        for mesh in self.model.meshes:
            lost = np.flatnonzero(np.isnan(mesh.recorder.deflection[: end.sample + 1 if end else None]))
            if lost.size:
                where = f"at t = {lost[0] * self.scheme.steps.interval:.6g} s"
                cause = f"{FAILED}, {lost.size} samples are lost"
                raise RuntimeError(f"{where}: {cause}; {self._remedy()}")


def progress_bar(scheme: Scheme, progress: bool) -> Any:
    """A bar over the steps of a run, in seconds of its time, or lines in a log."""
    return moving(scheme.steps.number, "run", visible=progress, bar_format=BAR, unit_scale=scheme.steps.size)
