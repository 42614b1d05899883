"""Samples of the motion of a shaft and of the torque on it, which its compiled kernel writes."""

from dataclasses import dataclass, field

import numpy as np

from exugear.contact.recorder import HEADER, SAME

#: About z: angle [rad], speed [rad/s], torque [N m].
SHAFT_NAMES = "angle", "speed", "torque"


@dataclass(frozen=True, eq=False)
class ShaftRecorder:
    """Angle, speed and torque of a shaft about z at t = 0, interval, ..., as `exugear.Recorder` samples a contact."""

    header: np.record = field(default_factory=lambda: np.zeros(1, HEADER)[0], init=False, repr=False)
    samples: dict[str, np.ndarray] = field(default_factory=dict, init=False, repr=False)

    def start(self, interval: float, number: int, *, steps: int, first: int = 0) -> None:
        """Allocate a number of samples, 0 until written; arguments as those of `exugear.Recorder.start`."""
        self.samples.update({name: np.zeros(number) for name in SHAFT_NAMES})
        self.header.interval, self.header.tolerance = interval, SAME / steps
        self.header.number, self.header.first = number, first
        self.header.samples[: len(SHAFT_NAMES)] = [self.samples[name].ctypes.data for name in SHAFT_NAMES]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.samples[name]
