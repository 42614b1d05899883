"""Steps and samples of a run: how many, how long, and whether they meet the jumps of force laws."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, ulp

import numpy as np

from exugear.mesh_force.jumps import MANY, MISS, dividing, missed

#: Steps of a run over which a table is to be smoothed so that they need not meet its jumps.
SMOOTH = 2


@dataclass(frozen=True)
class Steps:
    """So many samples of so many steps of a size [s]."""

    size: float
    every: int
    samples: int

    @property
    def number(self) -> int:
        """Of all steps."""
        return self.samples * self.every

    @property
    def interval(self) -> float:
        """Between two samples [s]."""
        return self.every * self.size

    @property
    def time(self) -> np.ndarray:
        """(samples + 1,) of the samples [s]."""
        return np.arange(self.samples + 1) * self.every * self.size


def filling(duration: float, step: float, sample: float) -> Steps:
    """Steps of at most the given size that fill a duration with whole samples [s]."""
    every = max(1, int(sample / step * (1 + 1e-9)))
    samples = ceil(duration / (every * step) * (1 - 1e-9))
    return Steps(summable(duration / (samples * every), duration), every, samples)


def within(duration: float, step: float, sample: float) -> Steps:
    """Steps of the given size; the last whole sample within a duration ends the run [s]."""
    every = max(1, int(min(sample, duration) / step * (1 + 1e-9)))
    samples = max(1, int(duration / (every * step) * (1 + 1e-9)))
    return Steps(summable(step, duration), every, samples)


def summable(step: float, duration: float) -> float:
    """The step [s] rounded down so that sums of it, and of its half, up to a duration are exact.

    Exudyn sums its steps up, and makes one more where 1e-10 s are missing at the end.
    """
    unit = 2 * ulp(duration)
    return step // unit * unit


def steps_of(
    duration: float, step: float, sample: float, jumping: Mapping[str, tuple[float, np.ndarray]], *, steady: bool
) -> tuple[Steps, str]:
    """Steps of at most the given size [s], and words about the laws that jump; warns where steps may miss the jumps.

    jumping   shortest mesh period of the run [s] and phases of the jumps by the label of the stage
    steady    the mesh periods stay as they are: steps divide them
    """
    if not jumping:
        return filling(duration, step, sample), ""
    meshes = list(jumping.values())
    steps = within(duration, dividing(step, meshes), sample) if steady else filling(duration, step, sample)
    period = min(period for period, _ in meshes)
    at = [f"{label} at phase {', '.join(f'{x:.3f}' for x in phases)}" for label, (_, phases) in jumping.items()]
    words = f"the mesh force jumps: {'; '.join(at)}; {period / steps.size:.4g} steps in a mesh period"
    if steady and missed(steps.size, meshes) < MISS:
        return steps, words
    words += " miss the jumps" + ("" if steady else " while the speed changes")
    remedy = f"smooth the table over {SMOOTH * steps.size / period:.2g} of a pitch, or take step={period / MANY:.2g}"
    words += f" and excite subharmonics of the mesh frequency that are not there; {remedy} or less"
    if period / steps.size < MANY:
        warnings.warn(words, stacklevel=4)
    return steps, words
