"""Samples of a run and whole steps between them, which fit the duration and meet the jumps of force laws.

The step that accuracy and stability allow is chosen in `integrator_and_step`.

A jump that lies at another fraction of a time step in every mesh period excites subharmonics of the mesh frequency
that the gears do not have: 6 % of the rms and 21 % of the peak to peak of a lightly damped mesh at 12.5 steps in a
period. Steps that divide the mesh period, and the time between its jumps, avoid this.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, ulp

import numpy as np

from fem.support.user_warning import warn_user

#: Steps in a mesh period of a law that jumps, at a tolerance of 1e-3, measured; the error falls with the square of
#: their number.
PERIOD_STEPS = 100
#: Share of a mesh period by which a step may miss a jump.
LARGEST_MISS = 5e-4
#: Steps in a mesh period above which missed jumps change the rms by less than about 1 %.
HARMLESS_STEPS = 150
#: Number of steps over which a jump has to be smoothed so that the steps need not meet it.
SMOOTHING_STEPS = 2
#: Number of phases of jumps that are listed.
LISTED = 6
#: Relative error of quotients that should be whole numbers.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Steps:
    """Steps of equal size, some of which are sampled.

    size      duration of a step [s]
    every     number of steps between two samples
    samples   number of samples after the sample at t = 0
    """

    size: float
    every: int
    samples: int

    @property
    def number(self) -> int:
        """Number of steps in total."""
        return self.samples * self.every

    @property
    def interval(self) -> float:
        """Time between two samples [s]."""
        return self.every * self.size

    @property
    def time(self) -> np.ndarray:
        """(samples + 1,) times of the samples [s]."""
        return np.arange(self.samples + 1) * self.interval

    def within(self, period: float) -> int:
        """Number of whole steps in a period [s], at least one."""
        return max(1, int(period / self.size * (1 + ROUNDING)))


def steps_filling(duration: float, step: float, sample: float) -> Steps:
    """Steps of at most the given size [s] that fill a duration [s] with whole samples."""
    every = max(1, int(sample / step * (1 + ROUNDING)))
    samples = ceil(duration / (every * step) * (1 - ROUNDING))
    return Steps(exactly_summable(duration / (samples * every), duration), every, samples)


def steps_of_size(duration: float, step: float, sample: float) -> Steps:
    """Steps of the given size [s]; the run ends with the last whole sample within the duration [s]."""
    every = max(1, int(min(sample, duration) / step * (1 + ROUNDING)))
    samples = max(1, int(duration / (every * step) * (1 + ROUNDING)))
    return Steps(exactly_summable(step, duration), every, samples)


def exactly_summable(step: float, duration: float) -> float:
    """The step [s] rounded down so that sums of it, and of its half, up to a duration [s] are exact.

    Exudyn adds its steps up, and makes a further step where 1e-10 s are missing at the end.
    """
    unit = 2 * ulp(duration)
    return step // unit * unit


def listed_phases(phases: np.ndarray) -> str:
    """Phases in words, the first ones of many."""
    listed = ", ".join(f"{x:.3f}" for x in phases[:LISTED])
    return listed if phases.size <= LISTED else f"{listed} and {phases.size - LISTED} more"


def steps_of(
    duration: float, step: float, sample: float, jumping: Mapping[str, tuple[float, np.ndarray]], *, steady: bool
) -> tuple[Steps, str]:
    """Steps of at most the given size [s], and a note on laws that jump; warns where steps may miss the jumps.

    jumping   shortest mesh period of the run [s] and phases of the jumps by the label of the stage
    steady    whether the mesh periods are constant, so that steps can divide them
    """
    if not jumping:
        return steps_filling(duration, step, sample), ""
    meshes = list(jumping.values())
    if steady:
        steps = steps_of_size(duration, dividing_step(step, meshes), sample)
    else:
        steps = steps_filling(duration, step, sample)
    period = min(period for period, _ in meshes)
    phases = [f"{label} at phase {listed_phases(jumps)}" for label, (_, jumps) in jumping.items()]
    note = f"the mesh force jumps: {'; '.join(phases)}; {period / steps.size:.4g} steps in a mesh period"
    if steady and largest_miss(steps.size, meshes) < LARGEST_MISS:
        return steps, note
    note += " miss the jumps" + ("" if steady else " while the speed changes")
    width, fine = SMOOTHING_STEPS * steps.size / period, period / HARMLESS_STEPS
    remedy = f"smooth the table over {width:.2g} of a pitch, or take step={fine:.2g}"
    note += f" and excite subharmonics of the mesh frequency that the gears do not have; {remedy} or less"
    if period / steps.size < HARMLESS_STEPS:
        warn_user(note)
    return steps, note


def dividing_step(step: float, meshes: Sequence[tuple[float, np.ndarray]]) -> float:
    """The largest step up to the given one [s] that divides the mesh periods and the times of their jumps.

    meshes   mesh period [s] and phases of the jumps, of each mesh that jumps

    Where no step down to half the given size divides them: the step with the smallest miss.
    """
    period = meshes[0][0]
    fewest = int(np.ceil(period / step * (1 - 1e-9)))
    sizes = period / np.arange(fewest, 2 * fewest + 1)
    misses = np.array([largest_miss(size, meshes) for size in sizes])
    good = np.flatnonzero(misses < LARGEST_MISS)
    return float(sizes[good[0] if good.size else misses.argmin()])


def largest_miss(step: float, meshes: Sequence[tuple[float, np.ndarray]]) -> float:
    """Largest share of a mesh period by which steps [s] from the first jump on miss a jump or the end of the period."""
    worst = 0.0
    for period, phases in meshes:
        step_counts = np.r_[1.0, phases - phases[0]] * period / step
        worst = max(worst, float(np.abs(step_counts - np.round(step_counts)).max()) * step / period)
    return worst
