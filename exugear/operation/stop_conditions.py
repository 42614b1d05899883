"""Conditions that end a run, evaluated on its samples."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fem.support.arguments import Finite, checked
from fem.support.validation import require, require_within


@checked
@dataclass(frozen=True)
class SpeedReached:
    """A run ends where the speed of a shaft passes a value, from either side.

    shaft   its name
    speed   [rad/s], > 0 in the sense in which the shaft turns when the driving shaft turns about +z

    Raises ValueError for a speed that is not finite.
    """

    shaft: str
    speed: Finite

    def _first_sample(self, speeds: Mapping[str, np.ndarray], forces: Mapping[str, np.ndarray], interval: float) -> int:
        """First sample at which the condition holds, -1 if there is none.

        speeds     (n,) of each shaft [rad/s]
        forces     (n,) mesh force of each stage [N]
        interval   between two samples [s]
        """
        excess = np.sign(speeds[self.shaft] - self.speed)
        off = np.flatnonzero(excess)
        return _first(excess != excess[off[0]], start=int(off[0])) if off.size else -1

    def __str__(self) -> str:
        return f"speed {self.speed:g} rad/s of shaft {self.shaft!r} reached"


@checked
@dataclass(frozen=True)
class Apart:
    """A run ends once the teeth of a stage have been out of contact for a duration.

    duration   [s]
    stage      label of the stage (`Gearbox.labels`), by default any stage

    Raises ValueError for a duration out of range.
    """

    duration: float
    stage: str | None = None

    def __post_init__(self):
        require_within("duration", self.duration, 0, 1e5, remedy="s")

    def _first_sample(self, speeds: Mapping[str, np.ndarray], forces: Mapping[str, np.ndarray], interval: float) -> int:
        """First sample at which the condition holds, -1 if there is none; arguments as of `SpeedReached`."""
        samples = max(1, int(np.ceil(self.duration / interval * (1 - 1e-9))))
        stages = list(forces) if self.stage is None else [self.stage]
        firsts = [_end_of_run(forces[stage] == 0, samples + 1) for stage in stages]
        return min((first for first in firsts if first >= 0), default=-1)

    def __str__(self) -> str:
        return f"teeth of {self.stage or 'a stage'} out of contact for {self.duration:g} s"


StopCondition = SpeedReached | Apart


@dataclass(frozen=True)
class End:
    """The sample at which a condition has ended a run."""

    sample: int
    condition: StopCondition


def first_end(stop: Sequence[StopCondition], speeds, forces, interval: float) -> End | None:
    """The condition that holds first; arguments as those of `SpeedReached._first_sample`."""
    ends = [End(condition._first_sample(speeds, forces, interval), condition) for condition in stop]
    return min((end for end in ends if end.sample >= 0), key=lambda end: end.sample, default=None)


def check_stop(stop, shafts, labels) -> None:
    """ValueError for conditions on shafts or stages that the gearbox lacks."""
    for condition in stop:
        require(isinstance(condition, StopCondition), f"stop must hold SpeedReached and Apart, got {condition!r}")
        if isinstance(condition, SpeedReached):
            require(condition.shaft in shafts, f"stop: no shaft {condition.shaft!r}; the shafts are {list(shafts)}")
        elif condition.stage is not None:
            require(condition.stage in labels, f"stop: no stage {condition.stage!r}; the stages are {list(labels)}")


def _first(holds: np.ndarray, start: int = 0) -> int:
    """Index of the first True from start on, -1 if there is none."""
    indices = np.flatnonzero(holds[start:])
    return start + int(indices[0]) if indices.size else -1


def _end_of_run(holds: np.ndarray, length: int) -> int:
    """Index at which a value has held at `length` samples in a row for the first time, -1 if there is none."""
    broken = np.r_[-1, np.flatnonzero(~holds), holds.size]
    long = np.flatnonzero(np.diff(broken) > length)
    return int(broken[long[0]]) + length if long.size else -1
