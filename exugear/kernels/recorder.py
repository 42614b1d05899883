"""Samples of one contact, written from inside the kernel at no cost."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import carray, types
from numba.extending import intrinsic

from fem.support.arguments import checked
from fem.support.numba_cache import compiled
from fem.support.validation import require

INTERVAL, SAMPLES, ADDRESS, MOTION, NEAR = range(5)
HEADER = 5
#: Share of a step within which a time is that of the step: Exudyn sums the steps up, 1e7 of them err by 0.002.
SAME = 0.25
#: deflection, force, centre distance, misalignment, axial offset, centroid
COLUMNS = 6
#: displacements and tilts of both bodies, their velocities
MOTIONS = 20


def _at(typingctx, address):
    """The doubles at an address: an int argument costs Python a tenth of an array argument."""
    pointer = types.CPointer(types.float64)

    def codegen(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(pointer))

    return pointer(address), codegen


at: Any = intrinsic(_at)


def _singles_at(typingctx, address):
    """The same for numbers of single precision."""
    pointer = types.CPointer(types.float32)

    def codegen(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(pointer))

    return pointer(address), codegen


singles_at: Any = intrinsic(_singles_at)


@compiled
def sample_of(record, t):
    """Number of the sample at t, -1 where it is none; Newton's last call of a step, the converged one, stays."""
    r = carray(at(record), HEADER)
    if r[SAMPLES] == 0.0 or t < 0.0:
        return -1
    x = t / r[INTERVAL] + r[NEAR]
    k = int(x)
    return k if x - k < 2.0 * r[NEAR] and k < r[SAMPLES] else -1


@compiled
def write(record, k, deflection, force, offsets, centroid):
    """Store sample k."""
    r = carray(at(record), HEADER)
    samples = carray(at(np.int64(r[ADDRESS])), (int(r[SAMPLES]), COLUMNS))
    samples[k, 0], samples[k, 1] = deflection, force
    samples[k, 2], samples[k, 3], samples[k, 4] = offsets
    samples[k, 5] = centroid


@compiled
def write_motion(record, k, q_1, q_2, v_1, v_2):
    """Store displacements and velocities of sample k where they are wanted."""
    r = carray(at(record), HEADER)
    if r[MOTION] == 0.0:
        return
    motions = carray(singles_at(np.int64(r[MOTION])), (int(r[SAMPLES]), MOTIONS))
    for i in range(5):
        motions[k, i], motions[k, 5 + i], motions[k, 10 + i], motions[k, 15 + i] = q_1[i], q_2[i], v_1[i], v_2[i]


@dataclass(frozen=True, eq=False)
class Recorder:
    """What one contact does, written from inside the kernel at no cost.

    `start` it before a solve; then these hold the samples at t = 0, interval, ..., each (number,):

    deflection     dynamic transmission error [m], > 0 where the pinion is ahead in the contact's direction
    force          mesh force [N], > 0 on the driving flank, < 0 on the other
    a              centre distance in the pinion's mid-plane [m]
    misalignment   angle in the plane of action of the flank in contact by which the gap opens towards +z [rad]
    axial          z of the wheel's mid-plane less that of the pinion's [m]
    centroid       z of the mesh force less that of the pinion's mid-plane [m]; 0 without contact

    The last four are 0 of shafts that only spin about their nominal axes. z is that of the contact: the global one or,
    where the axes lie along another direction, the pinion's axis; it is the same whichever flank carries and whichever
    way the pinion turns. An STE map, `fem.Offsets` and `exugear.MeshForce` count z the other way round where the mesh
    force turns the pinion counter-clockwise (back flank, second stage): there change the signs of misalignment, axial
    and centroid to look them up.
    """

    header: np.ndarray = field(default_factory=lambda: np.zeros(HEADER), init=False, repr=False)
    samples: list[np.ndarray] = field(default_factory=list, init=False, repr=False)

    @checked
    def start(self, interval: float, number: int, *, steps: int = 250, motion: bool = False) -> None:
        """Make room for number samples, NaN until written; interval [s] must be a whole multiple of the step.

        steps    at most so many make an interval
        motion   keep what `motion` returns, too
        """
        require(interval > 0, f"interval must be > 0 s, got {interval}")
        require(number >= 1, f"number of samples must be at least 1, got {number}")
        require(steps >= 1, f"steps in an interval must be at least 1, got {steps}")
        self.samples[:] = [np.full((number, COLUMNS), np.nan)]
        if motion:
            self.samples.append(np.full((number, MOTIONS), np.nan, np.float32))
        places = [block.ctypes.data for block in self.samples]
        self.header[:] = interval, number, places[0], places[1] if motion else 0, SAME / steps

    def __getattr__(self, name: str) -> np.ndarray:
        if name not in NAMES:
            raise AttributeError(name)
        require(bool(self.samples), "the recorder holds nothing yet; start it before the solve")
        return self.samples[0][:, NAMES.index(name)]

    @checked
    def motion(self, side: int) -> tuple[np.ndarray, np.ndarray]:
        """Displacements and tilts (number, 5) [m, rad] of pinion (0) or wheel (1), and their rates."""
        require(len(self.samples) == 2, "the recorder holds no motion; start it with motion=True")
        q_1, q_2, v_1, v_2 = np.split(self.samples[1], 4, axis=1)
        return ((q_1, v_1), (q_2, v_2))[side]


NAMES = ("deflection", "force", "a", "misalignment", "axial", "centroid")
