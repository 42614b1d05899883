"""Error of a run by its step, from parts of the run that are integrated again at half the step."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from exugear.multibody.exudyn_objects import CURRENT, INITIAL, set_state_of_system, state_of_system
from exugear.multibody.model import Model
from exugear.multibody.solver_settings import Scheme
from exugear.multibody.time_integration import SEGMENTS, Segment, Solver
from exugear.running.vibration_jumps import VibrationJump, vibration_jumps

#: Error of a fourth-order result over its change when the step is halved.
RICHARDSON = 16 / 15
#: Least number of samples for a meaningful rms of a part of a run.
FEWEST_SAMPLES = 50
#: rms of the DTE below which it is rounding [m].
NO_VIBRATION = 1e-12
#: Segments -> (n_stage,) rms of the DTE of each, integrated at half the step.
Repeat = Callable[[Sequence[Segment]], Iterable[np.ndarray]]


class Check(NamedTuple):
    """A segment that is integrated again: (n_stage,) rms of its DTE [m] at the step and at half of it.

    jump   in the segment, if it was chosen for that
    """

    segment: Segment
    coarse: np.ndarray
    fine: np.ndarray
    jump: VibrationJump | None

    @property
    def error(self) -> np.ndarray:
        """(n_stage,) relative errors of the rms."""
        return RICHARDSON * np.abs(self.coarse - self.fine) / np.maximum(self.fine, NO_VIBRATION)


def checks_by_step(
    model: Model, scheme: Scheme, segments: Sequence[Segment], number: int, repeated: Repeat
) -> Iterator[Check]:
    """Hundredths of a run, at most number, and the parts of the run about its jumps, integrated again; none for 0.

    repeated   integrates segments at half the step; other processes begin with that at once
    """
    spread = representative(model, scheme, hundredths(segments), number)
    jumps = jumps_of(model, scheme, segments) if spread else []
    checked = spread + [jump.part for jump in jumps]
    coarse, fine = [vibration(model, scheme, segment) for segment in checked], repeated(checked)
    reasons: list[VibrationJump | None] = [None] * len(spread)
    return map(Check, checked, coarse, fine, [*reasons, *jumps])


def jumps_of(model: Model, scheme: Scheme, segments: Sequence[Segment]) -> list[VibrationJump]:
    """The largest jumps of the vibration in a run of segments long enough for a rms."""
    if min(segment.last - segment.first for segment in segments) < FEWEST_SAMPLES * scheme.steps.every:
        return []
    rms = np.array([vibration(model, scheme, segment) for segment in segments])
    parted = [
        [bool((mesh.recorder.force[samples_in(scheme, segment)] == 0.0).any()) for mesh in model.meshes]
        for segment in segments
    ]
    return vibration_jumps(segments, rms, np.array(parted))


def hundredths(segments: Sequence[Segment]) -> list[Segment]:
    """The segments of a run, joined to a hundred at most."""
    firsts = np.unique(np.linspace(0, len(segments), SEGMENTS + 1).astype(int)).tolist()
    return [replace(segments[i], last=segments[j - 1].last) for i, j in pairwise(firsts)]


def representative(model: Model, scheme: Scheme, segments: Sequence[Segment], number: int) -> list[Segment]:
    """The segment that vibrates most and others spread over the run, at most number; none of short segments."""
    if number < 1 or not segments or segments[0].last - segments[0].first < FEWEST_SAMPLES * scheme.steps.every:
        return []
    rms = np.array([vibration(model, scheme, segment) for segment in segments])
    strongest = int(np.argmax((rms / np.maximum(rms.max(axis=0), np.finfo(float).tiny)).max(axis=1)))
    spread = np.linspace(0, len(segments), number + 1).astype(int)[1:-1]
    return [segments[i] for i in sorted({strongest, *spread.tolist()})]


def samples_in(scheme: Scheme, segment: Segment) -> slice:
    """The samples that fall into a segment."""
    every = scheme.steps.every
    return slice(-(-segment.first // every), segment.last // every + 1)


def vibration(model: Model, scheme: Scheme, segment: Segment) -> np.ndarray:
    """(n_stage,) rms of the DTE about its mean in a segment [m]."""
    samples = samples_in(scheme, segment)
    firsts = [int(mesh.recorder.header.first) for mesh in model.meshes]
    parts = [
        mesh.recorder.deflection[samples.start - first : samples.stop - first]
        for mesh, first in zip(model.meshes, firsts, strict=True)
    ]
    return np.array([part.std() for part in parts])


def repeated_in_place(solver: Solver, segments: Sequence[Segment]) -> Iterator[np.ndarray]:
    """(n_stage,) rms of the DTE of each segment at half the step; samples and state of the system are restored."""
    mbs, kinds = solver.model.mbs, (INITIAL, CURRENT)
    for segment in segments:
        ends = [state_of_system(mbs, kind) for kind in kinds]
        with _samples_kept(solver, segment):
            vibrations = vibration_at_half_the_step(solver, segment)
        for end, kind in zip(ends, kinds, strict=True):
            set_state_of_system(mbs, end, kind)
        yield vibrations


def vibration_at_half_the_step(solver: Solver, segment: Segment) -> np.ndarray:
    """(n_stage,) rms of the DTE of a segment, integrated from its state without sensors; NaN where that fails."""
    rule = replace(solver.scheme.rule, step=solver.scheme.steps.size / 2)
    settings = solver.scheme.settings(rule)
    settings.solution.sensors.active = False
    set_state_of_system(solver.model.mbs, segment.state.system, INITIAL)
    try:
        with solver.explained(rule):
            solver.solve(settings, segment, halvings=1)
    except RuntimeError:
        return np.full(len(solver.model.meshes), np.nan)
    return vibration(solver.model, solver.scheme, segment)


@contextmanager
def _samples_kept(solver: Solver, segment: Segment) -> Iterator[None]:
    """Restore the samples of a segment afterwards."""
    samples = samples_in(solver.scheme, segment)
    arrays = [array for mesh in solver.model.meshes for array in mesh.recorder.samples.values()]
    copies = [array[..., samples].copy() for array in arrays]
    try:
        yield
    finally:
        for array, copy in zip(arrays, copies, strict=True):
            array[..., samples] = copy
