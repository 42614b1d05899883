"""Steps and samples of a run: their number and size, and whether they meet the jumps of force laws."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, ulp

import numpy as np

from exugear.mesh_force.jumps import MANY, MISS, dividing, missed

#: Steps of a run over which a table is to be smoothed so that they need not meet its jumps.
SMOOTH = 2
#: Relative error of quotients that should be whole numbers.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Steps:
    """Steps of equal size, some of which are sampled.

    size      of a step [s]
    every     steps from a sample to the next
    samples   number of samples after that at t = 0
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
        return np.arange(self.samples + 1) * self.every * self.size

    def within(self, period: float) -> int:
        """Number of whole steps in a period [s], at least one."""
        return max(1, int(period / self.size * (1 + ROUNDING)))


def filling(duration: float, step: float, sample: float) -> Steps:
    """Steps of at most the given size [s] that fill a duration [s] with whole samples."""
    every = max(1, int(sample / step * (1 + ROUNDING)))
    samples = ceil(duration / (every * step) * (1 - ROUNDING))
    return Steps(summable(duration / (samples * every), duration), every, samples)


def of_size(duration: float, step: float, sample: float) -> Steps:
    """Steps of the given size [s]; the run ends with the last whole sample within the duration [s]."""
    every = max(1, int(min(sample, duration) / step * (1 + ROUNDING)))
    samples = max(1, int(duration / (every * step) * (1 + ROUNDING)))
    return Steps(summable(step, duration), every, samples)


def summable(step: float, duration: float) -> float:
    """The step [s] rounded down so that sums of it, and of its half, up to a duration [s] are exact.

    Exudyn adds its steps up, and makes a further one where 1e-10 s are missing at the end.
    """
    unit = 2 * ulp(duration)
    return step // unit * unit


def steps_of(
    duration: float, step: float, sample: float, jumping: Mapping[str, tuple[float, np.ndarray]], *, steady: bool
) -> tuple[Steps, str]:
    """Steps of at most the given size [s], and a note on laws that jump; warns where steps may miss the jumps.

    jumping   shortest mesh period of the run [s] and phases of the jumps by the label of the stage
    steady    whether the mesh periods stay as they are, so that steps can divide them
    """
    if not jumping:
        return filling(duration, step, sample), ""
    meshes = list(jumping.values())
    steps = of_size(duration, dividing(step, meshes), sample) if steady else filling(duration, step, sample)
    period = min(period for period, _ in meshes)
    phases = [f"{label} at phase {', '.join(f'{x:.3f}' for x in jumps)}" for label, (_, jumps) in jumping.items()]
    note = f"the mesh force jumps: {'; '.join(phases)}; {period / steps.size:.4g} steps in a mesh period"
    if steady and missed(steps.size, meshes) < MISS:
        return steps, note
    note += " miss the jumps" + ("" if steady else " while the speed changes")
    remedy = f"smooth the table over {SMOOTH * steps.size / period:.2g} of a pitch, or take step={period / MANY:.2g}"
    note += f" and excite subharmonics of the mesh frequency that are not there; {remedy} or less"
    if period / steps.size < MANY:
        warnings.warn(note, stacklevel=5)
    return steps, note
