"""Jumps of the vibration from a branch to another, and how far the step moves them.

Where teeth part, several vibrations are stable at a speed, and a sweep leaves its branch at a fold. Close to it the
branch attracts weakly: errors of the integration may drop the vibration early, while the rms before and after is right.
So the part of a run about a jump is integrated again at half the step, from a state well before it: where the vibration
then jumps elsewhere, the run says so.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from exugear.multibody.time_integration import Segment
from fem.support.user_warning import warn_user

#: Ratio of the rms before and after, from which on a change within a segment counts as a jump.
LEAST_RATIO = 1.5
#: Vibration below which it is rounding [m].
LEAST_RMS = 1e-12
#: Largest number of jumps that are checked.
MOST = 2
#: Share of the mesh frequency by which a jump may move at half the step without a warning, and where half the step does
#: not jump in that part of the run, so that it may move farther.
LARGEST_SHIFT, LARGEST_SHIFT_WITHOUT = 7.5e-3, 2.5e-3
#: At constant speed the share of the time of the three segments.
LARGEST_SHARE = 0.25


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
    low, width = frequency[0], frequency[1] - frequency[0]
    jumps, sweeps = 0.0 < half_share < 1.0, abs(width) > LARGEST_SHIFT_WITHOUT * low
    largest = (LARGEST_SHIFT if jumps else LARGEST_SHIFT_WITHOUT) * low / abs(width) if sweeps else LARGEST_SHARE
    if not abs(half_share - share) > largest:
        return ""
    (begin, span), unit = ((low, width), "Hz of the mesh") if sweeps else ((times[0], times[1] - times[0]), "s")
    at, at_half = begin + share * span, begin + half_share * span
    least = "" if jumps else "at least "
    moves = f"at half the step it moves by {least}{abs(at_half - at):.3g} {unit} ({abs(at_half / at - 1):.1%})"
    label = str(mesh["stage"].values)
    remedy = f"try tolerance={float(data.attrs['tolerance']) / 10:.1g} or step={h / 4:.2g}"
    return f"the jump of the vibration of {label} at {at:.5g} {unit} is uncertain: {moves}; {remedy}"
