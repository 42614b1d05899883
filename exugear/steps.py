"""Steps and samples of a run: how many, how long."""

from dataclasses import dataclass
from math import ceil, ulp

import numpy as np


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
