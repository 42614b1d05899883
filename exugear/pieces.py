"""A run in pieces, some of which are solved again at half the step: what the step does to the result."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import exudyn as exu
import numpy as np
from tqdm import tqdm

from exugear.equilibrium import explained
from exugear.integrator import Rule, settings_for
from exugear.model import Model, integrated

PIECES = 100
BAR = "{desc} {percentage:3.0f}%|{bar}| {n:.3g}/{total:.3g} s [{elapsed}<{remaining}]"
#: Error by the step over its change by half of it: fourth order.
REST = 16 / 15
#: Shorter pieces say little [samples].
FEWEST = 50


@dataclass(frozen=True)
class Piece:
    """From one step to another [1], from a state on (Exudyn's system state)."""

    first: int
    last: int
    state: Any


@dataclass(frozen=True)
class Solver:
    """Solves pieces of a run of a model; speed_of(t) [rad/s] explains what stops it, every so many steps one sample."""

    model: Model
    rule: Rule
    tolerance: float
    speed_of: Any
    every: int

    def solve(self, piece: Piece, rule: Rule) -> None:
        """Integrate one piece from the state that the system is in."""
        settings = settings_for(rule, rule.step, self.tolerance)
        integration, h = settings.timeIntegration, self.rule.step
        integration.startTime, integration.endTime = piece.first * h, piece.last * h
        integration.numberOfSteps = round((piece.last - piece.first) * h / rule.step)
        # Exudyn's initial accelerations leave out the slope of an imposed speed; those of the state hold it.
        integration.generalizedAlpha.computeInitialAccelerations = self.speed_of.steady
        remedy = f"try step={h / 2:.2g} or more damping"
        with integrated(self.model, rule), explained(self.model, remedy, self.speed_of):
            if piece.first == 0 and not self.speed_of.steady:
                self._evaluate(settings)
            self.model.mbs.SolveDynamic(settings, updateInitialValues=True)

    def _evaluate(self, settings: exu.SimulationSettings) -> None:
        """All forces in the initial state: their first samples."""
        mbs = self.model.mbs
        solver: Any = exu.MainSolverStatic()
        solver.InitializeSolver(mbs, settings)
        solver.ComputeODE2RHS(mbs)
        solver.FinalizeSolver(mbs, settings)

    def run(self, steps: int, progress: bool) -> list[Piece]:
        """All pieces, between which the bar moves; they restart from the very state that they reached."""
        h, pieces = self.rule.step, []
        bounds = np.linspace(0, steps, (min(PIECES, steps) if progress else 1) + 1).astype(int)
        style = {"bar_format": BAR, "unit_scale": h, "leave": False, "disable": not progress}
        with tqdm(total=steps, desc="run-up", **style) as bar:
            for first, last in pairwise(bounds.tolist()):
                pieces.append(Piece(first, last, self.state))
                self.solve(pieces[-1], self.rule)
                bar.update(last - first)
        self._require_samples()
        return pieces

    def _require_samples(self) -> None:
        """Where Newton's iteration fails Exudyn cuts the step, and may then miss the times of the samples."""
        for mesh in self.model.meshes:
            lost = np.flatnonzero(np.isnan(mesh.recorder.deflection))
            if lost.size:
                where = f"at t = {lost[0] * self.every * self.rule.step:.6g} s"
                cause = f"Newton's iteration failed, {lost.size} samples are lost"
                raise RuntimeError(f"{where}: {cause}; try step={self.rule.step / 2:.2g} or more damping")

    @property
    def state(self) -> Any:
        """What the next piece starts from."""
        return self.model.mbs.systemData.GetSystemState(exu.ConfigurationType.Initial)

    def samples(self, piece: Piece) -> slice:
        """The samples that fall into a piece."""
        return slice(-(-piece.first // self.every), piece.last // self.every + 1)

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
        self.model.mbs.systemData.SetSystemState(piece.state, exu.ConfigurationType.Initial)
        try:
            self.solve(piece, replace(self.rule, step=self.rule.step / 2))
            return REST * np.abs(before / self.liveliness(piece) - 1)
        except RuntimeError:
            return np.full(before.size, np.nan)
        finally:
            for blocks, copies in zip(recorded, kept, strict=True):
                for block, copy in zip(blocks, copies, strict=True):
                    block[within] = copy

    def errors(self, pieces: Sequence[Piece]) -> np.ndarray:
        """(n, n_stage) errors of some pieces; the system ends in the state that it was in."""
        end = self.state
        found = np.array([self.error(piece) for piece in pieces])
        self.model.mbs.systemData.SetSystemState(end, exu.ConfigurationType.Initial)
        return found

    def telling(self, pieces: Sequence[Piece], number: int) -> list[Piece]:
        """The liveliest piece, and others spread over the run; none of too short ones."""
        if pieces[0].last - pieces[0].first < FEWEST * self.every:
            return []
        rms = np.array([self.liveliness(piece) for piece in pieces])
        liveliest = int(np.argmax((rms / np.maximum(rms.max(axis=0), np.finfo(float).tiny)).max(axis=1)))
        spread = np.linspace(0, len(pieces), number + 1).astype(int)[1:-1]
        return [pieces[i] for i in sorted({liveliest, *spread.tolist()})]
