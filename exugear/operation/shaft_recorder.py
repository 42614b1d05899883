"""Samples of the motion of a shaft and of the torque on it, which its compiled kernel writes."""

from dataclasses import dataclass, field

import numpy as np

from exugear.force_table.kernel_records import record_type
from exugear.kernels.recorder import HEADER, SAME

#: A sample, about z: angle [rad], speed [rad/s], torque [N m].
SHAFT_SAMPLE = record_type(("angle", "f8"), ("speed", "f8"), ("torque", "f8"))


@dataclass(frozen=True, eq=False)
class ShaftRecorder:
    """Angle, speed and torque of a shaft about z at t = 0, interval, ..., as `exugear.Recorder` samples a contact."""

    header: np.record = field(default_factory=lambda: np.zeros(1, HEADER)[0], init=False, repr=False)
    samples: list[np.ndarray] = field(default_factory=list, init=False, repr=False)

    def start(self, interval: float, number: int, *, steps: int, first: int = 0) -> None:
        """Allocate a number of samples, NaN until written; arguments as those of `exugear.Recorder.start`."""
        self.samples[:] = [np.full(number, np.nan, SHAFT_SAMPLE)]
        self.header.interval, self.header.number, self.header.tolerance = interval, number, SAME / steps
        self.header.first = first
        self.header.samples = self.samples[0].ctypes.data

    def __getitem__(self, name: str) -> np.ndarray:
        return self.samples[0][name]
