"""A run in pieces, some of which are solved again at half the step: what the step does to the result."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import exudyn as exu
import numpy as np
from tqdm import tqdm

from exugear.plan.integrator import Rule
from exugear.plan.time_steps import Steps
from exugear.simulation.equilibrium import explained
from exugear.simulation.model import Model, integrated
from exugear.simulation.solver_settings import settings_for

PIECES = 100
BAR = "{desc} {percentage:3.0f}%|{bar}| {n:.3g}/{total:.3g} s [{elapsed}<{remaining}]"
#: Error by the step over its change by half of it: fourth order.
REST = 16 / 15
#: Shorter pieces say little [samples].
FEWEST = 50
#: rms of the DTE of gears that do not vibrate, but for rounding [m].
STILL = 1e-12
INITIAL, CURRENT = exu.ConfigurationType.Initial, exu.ConfigurationType.Current


@dataclass(frozen=True)
class Piece:
    """From one step to another [1], from a state on (Exudyn's system state)."""

    first: int
    last: int
    state: Any


@dataclass(frozen=True)
class Solver:
    """Solves a run of a model in pieces; speed_of(t) [rad/s] explains what stops it.

    The sensors of the system are written every so many steps.
    """

    model: Model
    rule: Rule
    tolerance: float
    speed_of: Any
    steps: Steps
    sensor_steps: int

    def run(self, progress: bool) -> tuple[list[Piece], BaseException | None]:
        """The pieces, between which the bar moves, and what stopped them: RuntimeError, Ctrl-C or None."""
        pieces: list[Piece] = []
        try:
            self._solve_all(pieces, progress)
            self._require_samples()
        except (RuntimeError, KeyboardInterrupt) as error:
            return pieces, error
        return pieces, None

    def _solve_all(self, pieces: list[Piece], progress: bool) -> None:
        h, mbs = self.rule.step, self.model.mbs
        style = {"bar_format": BAR, "unit_scale": h, "leave": False, "disable": not progress}
        with tqdm(total=self.steps.number, desc="run-up", **style) as bar, self._explained(self.rule):
            with self._advancing() as advance:
                for first, last in pairwise(self.bounds):
                    pieces.append(Piece(first, last, mbs.systemData.GetSystemState(CURRENT if first else INITIAL)))
                    advance(pieces[-1])
                    bar.update(last - first)
            mbs.systemData.SetSystemState(mbs.systemData.GetSystemState(CURRENT), INITIAL)

    @contextmanager
    def _advancing(self) -> Iterator[Callable[[Piece], None]]:
        """What solves the next piece: each a solve of its own, or one solve that halts where sensors must go on.

        A solver that can be halted is one of Python's, which Exudyn asks for overrides in every step: 0.7 us each.
        """
        if not self.speed_of.steady:
            self._evaluate()
        if self.model.mbs.systemData.NumberOfSensors():
            with self._engine() as (engine, settings):
                yield partial(self._go_on, engine, settings)
        else:
            yield self.solve

    def _settings(self, rule: Rule) -> exu.SimulationSettings:
        """Settings of the run, or of its pieces."""
        settings = settings_for(rule, rule.step, self.tolerance)
        if not self.speed_of.steady:
            # Exudyn's initial accelerations leave out the slope of an imposed speed; those of the state hold it.
            settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
        return settings

    def solve(self, piece: Piece) -> None:
        """One piece from the state on that the one before it left."""
        settings, h = self._settings(self.rule), self.rule.step
        integration = settings.timeIntegration
        integration.startTime, integration.endTime = piece.first * h, piece.last * h
        integration.numberOfSteps = piece.last - piece.first
        self.model.mbs.SolveDynamic(settings, updateInitialValues=True)

    def _go_on(self, engine, settings: exu.SimulationSettings, piece: Piece) -> None:
        """Let Exudyn's solver go on to the end of a piece; sensors have written its start already."""
        h = self.rule.step
        engine.it.endTime = piece.last * h
        if piece.first:
            engine.output.lastSensorsWritten = (piece.first + self.sensor_steps - 0.5) * h
        if not engine.SolveSteps(self.model.mbs, settings):
            raise RuntimeError("no convergence")

    @contextmanager
    def _engine(self) -> Iterator[tuple[Any, exu.SimulationSettings]]:
        """Exudyn's solver over the whole run, and its settings."""
        h, mbs = self.rule.step, self.model.mbs
        settings = self._settings(self.rule)
        engine: Any = exu.MainSolverImplicitSecondOrder()
        settings.timeIntegration.endTime = self.steps.number * h
        settings.timeIntegration.numberOfSteps = self.steps.number
        settings.solution.sensors.writePeriod = self.sensor_steps * h
        if not engine.InitializeSolver(mbs, settings):
            raise RuntimeError("no start")
        try:
            yield engine, settings
        finally:
            engine.FinalizeSolver(mbs, settings)

    def _evaluate(self) -> None:
        """All forces in the initial state: their first samples."""
        settings, mbs = settings_for(self.rule, self.rule.step, self.tolerance), self.model.mbs
        settings.solution.sensors.active = False
        solver: Any = exu.MainSolverStatic()
        solver.InitializeSolver(mbs, settings)
        solver.ComputeODE2RHS(mbs)
        solver.FinalizeSolver(mbs, settings)

    @contextmanager
    def _explained(self, rule: Rule) -> Iterator[None]:
        remedy = f"try step={self.rule.step / 2:.2g} or more damping"
        with integrated(self.model, rule), explained(self.model, remedy, self.speed_of):
            yield

    @property
    def bounds(self) -> list[int]:
        """Steps at which pieces end, each with a sample of the sensors: Exudyn writes one wherever it halts."""
        unit = max(self.steps.every, self.sensor_steps)
        parts = max(1, min(PIECES, self.steps.number // unit))
        inner = np.linspace(0, self.steps.number // unit, parts + 1).astype(int)[:-1] * unit
        return [*inner.tolist(), self.steps.number]

    def solve_again(self, piece: Piece, rule: Rule) -> None:
        """Integrate one piece from its state on, unseen by sensors."""
        settings = settings_for(rule, rule.step, self.tolerance)
        settings.solution.sensors.active = False
        integration, h = settings.timeIntegration, self.rule.step
        integration.startTime, integration.endTime = piece.first * h, piece.last * h
        integration.numberOfSteps = round((piece.last - piece.first) * h / rule.step)
        self.model.mbs.systemData.SetSystemState(piece.state, INITIAL)
        with self._explained(rule):
            self.model.mbs.SolveDynamic(settings)

    def _require_samples(self) -> None:
        """Where Newton's iteration fails Exudyn cuts the step, and may then miss the times of the samples."""
        for mesh in self.model.meshes:
            lost = np.flatnonzero(np.isnan(mesh.recorder.deflection))
            if lost.size:
                where = f"at t = {lost[0] * self.steps.interval:.6g} s"
                cause = f"Newton's iteration failed, {lost.size} samples are lost"
                raise RuntimeError(f"{where}: {cause}; try step={self.rule.step / 2:.2g} or more damping")

    def samples(self, piece: Piece) -> slice:
        """The samples that fall into a piece."""
        return slice(-(-piece.first // self.steps.every), piece.last // self.steps.every + 1)

    def liveliness(self, piece: Piece) -> np.ndarray:
        """(n_stage,) rms of the DTE about its mean in a piece [m]."""
        return np.array([mesh.recorder.deflection[self.samples(piece)].std() for mesh in self.model.meshes])

    def error(self, piece: Piece) -> np.ndarray:
        """(n_stage,) relative error of the rms of the DTE by the step; NaN where half the step does not get through.

        Leaves the samples as they were.
        """
        before, recorded = self.liveliness(piece), [mesh.recorder.samples for mesh in self.model.meshes]
        within = self.samples(piece)
        kept = [[block[within].copy() for block in blocks] for blocks in recorded]
        try:
            self.solve_again(piece, replace(self.rule, step=self.rule.step / 2))
            after = self.liveliness(piece)
            return REST * np.abs(before - after) / np.maximum(after, STILL)
        except RuntimeError:
            return np.full(before.size, np.nan)
        finally:
            for blocks, copies in zip(recorded, kept, strict=True):
                for block, copy in zip(blocks, copies, strict=True):
                    block[within] = copy

    def errors(self, pieces: Sequence[Piece]) -> np.ndarray:
        """(n, n_stage) errors of some pieces; the system ends in the state that it was in."""
        system, kinds = self.model.mbs.systemData, (INITIAL, CURRENT)
        ends = [system.GetSystemState(kind) for kind in kinds]
        errors = np.array([self.error(piece) for piece in pieces])
        for end, kind in zip(ends, kinds, strict=True):
            system.SetSystemState(end, kind)
        return errors

    def telling(self, pieces: Sequence[Piece], number: int) -> list[Piece]:
        """The liveliest piece, and others spread over the run; none of too short ones."""
        if pieces[0].last - pieces[0].first < FEWEST * self.steps.every:
            return []
        rms = np.array([self.liveliness(piece) for piece in pieces])
        liveliest = int(np.argmax((rms / np.maximum(rms.max(axis=0), np.finfo(float).tiny)).max(axis=1)))
        spread = np.linspace(0, len(pieces), number + 1).astype(int)[1:-1]
        return [pieces[i] for i in sorted({liveliest, *spread.tolist()})]
