"""Error of a run by its step, from parts of the run that are integrated again at half the step.

Among them are the largest jumps of the vibration from a branch to another. Where teeth part, several vibrations are
stable at a speed, and a sweep leaves its branch at a fold. Close to it the branch attracts weakly: errors of the
integration may drop the vibration early, while the rms before and after is right. So the part of a run about a jump is
integrated again from a state well before it: where the vibration then jumps elsewhere, the run says so.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import xarray as xr

from exugear.multibody.exudyn_objects import CURRENT, INITIAL, set_state_of_system, state_of_system
from exugear.multibody.model import Model
from exugear.multibody.solver_settings import Scheme
from exugear.multibody.time_integration import SEGMENTS, Segment, Solver
from fem.support.user_warning import warn_user

#: Ratio of the rms before and after, from which on a change within a segment counts as a jump.
LEAST_RATIO = 1.5
#: rms of the DTE below which it is rounding [m].
LEAST_RMS = 1e-12
#: Largest number of jumps that are checked.
MOST = 2
#: Share of the mesh frequency by which a jump may move at half the step without a warning, and where half the step does
#: not jump in that part of the run, so that it may move farther.
LARGEST_SHIFT, LARGEST_SHIFT_WITHOUT = 7.5e-3, 2.5e-3
#: At constant speed the share of the time of the three segments.
LARGEST_SHARE = 0.25
#: Error of a fourth-order result over its change when the step is halved.
RICHARDSON = 16 / 15
#: Least number of samples for a meaningful rms of a part of a run.
FEWEST_SAMPLES = 50
#: Segments -> (n_stage,) rms of the DTE of each, integrated at half the step.
Repeat = Callable[[Sequence[Segment]], Iterable[np.ndarray]]


@dataclass(frozen=True)
class VibrationJump:
    """A jump of the vibration of a mesh.

    part            of the run: the segment with the jump, the one before and the one behind
    mesh            number of the mesh
    before, after   rms of the DTE in the first and in the last of the three segments [m]
    """

    part: Segment
    mesh: int
    before: float
    after: float

    def share_before(self, rms: np.ndarray) -> float:
        """Share of the part before the jump, by the (n_mesh,) rms of the DTE in the part [m]."""
        share = (float(rms[self.mesh]) ** 2 - self.after**2) / (self.before**2 - self.after**2)
        return float(np.clip(share, 0.0, 1.0))


def vibration_jumps(segments: Sequence[Segment], rms: np.ndarray, parted: np.ndarray) -> list[VibrationJump]:
    """The largest jumps of a run beside loss of contact, at most `MOST`.

    rms      (n_segment, n_mesh) of the DTE in each segment [m]
    parted   (n_segment, n_mesh) whether teeth part in it
    """
    if len(segments) < 3:
        return []
    ratios = np.abs(np.log(np.maximum(rms[2:], LEAST_RMS) / np.maximum(rms[:-2], LEAST_RMS)))
    ratios[~(parted[2:] | parted[1:-1] | parted[:-2])] = 0.0
    jumps: list[VibrationJump] = []
    while len(jumps) < MOST and ratios.max() > np.log(LEAST_RATIO):
        i, mesh = map(int, np.unravel_index(ratios.argmax(), ratios.shape))
        part = replace(segments[i], last=segments[i + 2].last)
        jumps.append(VibrationJump(part, mesh, float(rms[i, mesh]), float(rms[i + 2, mesh])))
        ratios[max(i - 2, 0) : i + 3] = 0.0
    return jumps


def with_jumps(data: xr.Dataset, jumps: Iterable[tuple[VibrationJump, np.ndarray, np.ndarray]], h: float) -> xr.Dataset:
    """The data with a note on each jump that half the step moves, which is also a warning.

    jumps   with the (n_mesh,) rms of the DTE in their parts [m] at the step h [s] and at half of it
    """
    notes = [note for jump, coarse, fine in jumps if (note := _note(data, jump, coarse, fine, h))]
    for note in notes:
        warn_user(note)
    return data.assign_attrs(uncertain_jumps="; ".join(notes)) if notes else data


def _note(data: xr.Dataset, jump: VibrationJump, coarse: np.ndarray, fine: np.ndarray, h: float) -> str:
    """What half the step changes about a jump, in words; empty where it hardly moves."""
    times = np.array([jump.part.first, jump.part.last]) * h
    mesh = data.isel(stage=jump.mesh)
    frequency = np.interp(times, data["time"].values, mesh["mesh_frequency"].values)
    share, half_share = jump.share_before(coarse), jump.share_before(fine)
    low, change = frequency[0], frequency[1] - frequency[0]
    jumps, sweeps = 0.0 < half_share < 1.0, abs(change) > LARGEST_SHIFT_WITHOUT * low
    largest = (LARGEST_SHIFT if jumps else LARGEST_SHIFT_WITHOUT) * low / abs(change) if sweeps else LARGEST_SHARE
    if not abs(half_share - share) > largest:
        return ""
    (begin, span), unit = ((low, change), "Hz of the mesh") if sweeps else ((times[0], times[1] - times[0]), "s")
    at, at_half = begin + share * span, begin + half_share * span
    least = "" if jumps else "at least "
    moves = f"at half the step it moves by {least}{abs(at_half - at):.3g} {unit} ({abs(at_half / at - 1):.1%})"
    label = str(mesh["stage"].values)
    remedy = f"try tolerance={float(data.attrs['tolerance']) / 10:.1g} or step={h / 4:.2g}"
    return f"the jump of the vibration of {label} at {at:.5g} {unit} is uncertain: {moves}; {remedy}"


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
        return RICHARDSON * np.abs(self.coarse - self.fine) / np.maximum(self.fine, LEAST_RMS)


def checks_by_step(
    model: Model, scheme: Scheme, segments: Sequence[Segment], number: int, repeated: Repeat
) -> Iterator[Check]:
    """Hundredths of a run, at most number, and the parts of the run about its jumps, integrated again; none for 0.

    repeated   integrates segments at half the step; other processes begin with that at once
    """
    typical = representative(model, scheme, hundredths(segments), number)
    jumps = jumps_of(model, scheme, segments) if typical else []
    checked = typical + [jump.part for jump in jumps]
    coarse, fine = [vibration(model, scheme, segment) for segment in checked], repeated(checked)
    reasons: list[VibrationJump | None] = [None] * len(typical)
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
    """The segment that vibrates most and others spread over the run, at most number; skips short segments."""
    if number < 1 or not segments or segments[0].last - segments[0].first < FEWEST_SAMPLES * scheme.steps.every:
        return []
    rms = np.array([vibration(model, scheme, segment) for segment in segments])
    strongest = int(np.argmax((rms / np.maximum(rms.max(axis=0), np.finfo(float).tiny)).max(axis=1)))
    evenly = np.linspace(0, len(segments), number + 1).astype(int)[1:-1]
    return [segments[i] for i in sorted({strongest, *evenly.tolist()})]


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
    mbs, kinds = solver.model.bare_mbs, (INITIAL, CURRENT)
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
    set_state_of_system(solver.model.bare_mbs, segment.state.system, INITIAL)
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


def with_step_error(data: xr.Dataset, checks: Iterable[Check], h: float) -> tuple[xr.Dataset, KeyboardInterrupt | None]:
    """The data with the errors by the step h [s] of the segments that are integrated again at half of it, if any.

    Warns of jumps that half the step moves. Also the interruption where the user does not wait for the errors; the data
    are then without them.
    """
    try:
        checked = sorted(checks, key=lambda check: check.segment.first)
    except KeyboardInterrupt as interrupt:
        return data, interrupt
    if not checked:
        return data, None
    middles = [(check.segment.first + check.segment.last) / 2 * h for check in checked]
    relative = np.array([check.error for check in checked]).T
    data = with_jumps(data, [(check.jump, check.coarse, check.fine) for check in checked if check.jump], h)
    about = {"units": "1", "long_name": "relative error of the rms of the DTE by the step, estimated"}
    middle = {"units": "s", "long_name": "middle of the segment that was integrated again at half the step"}
    return data.assign(step_error=(("stage", "checked"), relative, about), checked=("checked", middles, middle)), None
