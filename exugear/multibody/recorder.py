"""Samples of a contact, which its compiled kernel writes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from exugear.contact.rotation import BodyKind
from exugear.mesh_force.kernel_records import doubles_at, record_type
from exugear.multibody.addresses import floats_at, reader
from fem.support.arguments import checked
from fem.support.numba_cache import apart, compiled
from fem.support.validation import require, set_fields

NAMES = "deflection", "force", "a", "misalignment", "axial", "centroid", "pinion_torque", "wheel_torque", "phase"
#: Displacements [m] and tilts [rad] of pinion and wheel, and their rates: `COMPONENTS` of each.
MOTION_NAMES, COMPONENTS = ("q_1", "q_2", "v_1", "v_2"), 5
#: Potential of the mesh [J], power that its damping dissipates [W], spins [rad] and speeds [rad/s] of the bodies.
POWER_NAMES = "energy", "dissipation", "spin_1", "spin_2", "speed_1", "speed_2"
#: Spin [rad] and speed [rad/s] of the carrier of the bodies, and torque of the mesh on it [N m].
CARRIER_NAMES = "spin_3", "speed_3", "torque_3"
#: Friction between the teeth: force along the flanks [N] and power that it dissipates [W].
FRICTION_NAMES = "friction_force", "friction_loss"
#: Quantities in the data of runs: name here (signs: `Recorder`), unit, long name; on bearings further ones.
IN_RUNS = {
    "dte": ("deflection", "m", "dynamic transmission error"),
    "mesh_force": ("force", "N", "mesh force"),
    "phase": ("phase", "1", "phase of the driving flank in pitches, which grows by 1 in a mesh cycle"),
}
IN_RUNS_ON_BEARINGS = {
    "centre_distance": ("a", "m", "centre distance"),
    "misalignment": ("misalignment", "rad", "angle by which the gap of the flank in contact opens towards +z"),
    "axial_offset": ("axial", "m", "position of the wheel along the pinion's axis, from the pinion"),
    "centroid": ("centroid", "m", "z of the mesh force from the pinion's mid-plane"),
}
#: Friction in the data of runs: unit, long name.
FRICTION_IN_RUNS = {
    "friction_force": ("N", "friction between the teeth, along the flanks"),
    "friction_loss": ("W", "power that friction between the teeth dissipates"),
}
#: Quantities in the order of their addresses in the header of a contact's recorder.
SCALARS = (*NAMES, *POWER_NAMES, *FRICTION_NAMES, *CARRIER_NAMES)
#: Room for the addresses of samples.
MOST_SAMPLES = 30
#: Time between samples [s], the share of it by which the time of a call may differ from that of a sample, the number of
#: samples, the interval after t = 0 at whose end the first is taken, and the addresses of the arrays of all quantities
#: (0: not recorded), of a contact `SCALARS` and then `MOTION_NAMES`.
HEADER = record_type(
    *(("interval", "f8"), ("tolerance", "f8"), ("number", "i8"), ("first", "i8"), ("samples", "i8", MOST_SAMPLES)),
)
header_at = reader(HEADER)
#: Share of a step by which a time may differ from that of the step: Exudyn adds the steps up, with an error of 0.002
#: steps after 1e7 of them.
SAME = 0.25


@compiled
def sample_of(record, t):
    """Number of the sample at t, from the first one on, -1 where there is none.

    Newton's iteration calls several times in a step; its last, converged call overwrites the others.
    """
    header = header_at(record)
    if header.number == 0:
        return -1
    x = t / header.interval + header.tolerance - header.first
    k = int(x) if x >= 0.0 else -1
    return k if x - k < 2.0 * header.tolerance and k < header.number else -1


def recorded_components(*kinds: BodyKind) -> int:
    """Number of displacements and tilts up to the last one that moves in one of these kinds of bodies."""
    return max([1 + i for kind in kinds for i in kind.components if i < COMPONENTS], default=0)


@compiled
def store(addresses, k, values):
    """Store sample k of quantities in the arrays at these addresses, if they are recorded."""
    for i in range(len(values)):
        if addresses[i] != 0:
            doubles_at(addresses[i])[k] = values[i]


@apart
def write(record, k, values, components, motions):
    """Store those quantities of sample k that are recorded.

    values       in the order of `SCALARS`
    components   number of displacements and tilts of the bodies; those that they lack stay 0
    motions      displacements and velocities (q_1, q_2, v_1, v_2), (6) each; None of bodies that spin
    """
    header = header_at(record)
    addresses = header.samples
    store(addresses, k, values)
    if motions is not None and addresses[len(values)] != 0:
        for j in range(len(motions)):
            for i in range(components):
                floats_at(addresses[len(values) + j])[i * header.number + k] = motions[j][i]


@dataclass(frozen=True, eq=False)
class Recorder:
    """Samples of a contact, which its compiled kernel writes without further cost.

    `start` it before a solve; afterwards these hold the samples at t = 0, interval, ..., each (number,), and NaN where
    no step ended (at t = 0 where the solver computes no initial accelerations):

    deflection     dynamic transmission error [m], > 0 where the pinion is ahead in the contact's direction
    force          mesh force [N], > 0 on the driving flank, < 0 on the back flank
    a              centre distance in the pinion's mid-plane [m]
    misalignment   angle in the plane of action of the flank in contact by which the gap opens towards +z [rad]
    axial          position of the wheel's centre along the pinion's axis, from the pinion's centre [m]
    centroid       z of the force centroid minus z of the pinion's mid-plane [m]; 0 without contact
    pinion_torque  torque of the mesh on the spin of the pinion's body [N m]
    wheel_torque   torque of the mesh on the spin of the wheel's body [N m]
    phase          of the driving flank [pitches], which grows by 1 in a mesh cycle; whole pitches do not matter

    Offsets and centroid are 0 for shafts that only spin about their nominal axes. z is the axis of the contact: the
    global z, or the pinion's axis where that lies along another direction; it does not depend on the flank in contact
    nor on the direction of the pinion. An STE map and `fem.Offsets` count z in the opposite sense where the pinion's
    direction is -1 (second stage); `exugear.MeshForce` does so where the mesh force turns the pinion counter-clockwise
    (back flank, second stage): change the signs of misalignment, axial and centroid to compare them.
    """

    header: np.record = field(default_factory=lambda: np.zeros(1, HEADER)[0], init=False, repr=False)
    samples: Mapping[str, np.ndarray] = field(default_factory=dict, init=False, repr=False)

    @checked
    def start(
        self,
        interval: float,
        number: int,
        *,
        steps: int = 250,
        first: int = 0,
        motion: bool = False,
        power: bool = False,
        friction: bool = False,
        carrier: bool = False,
        zeroed: bool = False,
    ) -> None:
        """Allocate a number of samples.

        interval   time between samples [s], a whole multiple of the step: explicit solvers with adaptive steps need a
                   `CreateGearSensor` instead
        steps      largest number of steps in an interval
        first      number of intervals after t = 0 at which the first sample is taken
        motion     also record what `motion` returns
        power      also record what `power` returns
        friction   also record friction_force and friction_loss of a contact that has friction
        carrier    with power, also record spin_3, speed_3 and torque_3 of the carrier
        zeroed     all samples but the deflection are 0, not NaN, until they are written, and take no memory until then;
                   the motion always

        Raises ValueError for intervals and numbers out of range.
        """
        require(interval > 0, f"interval must be > 0 s, got {interval}")
        require(number >= 1, f"number of samples must be at least 1, got {number}")
        require(steps >= 1, f"steps in an interval must be at least 1, got {steps}")
        require(first >= 0, f"first must be at least 0 intervals after t = 0, got {first}")
        names = (*NAMES, *POWER_NAMES * power, *FRICTION_NAMES * friction, *CARRIER_NAMES * (power and carrier))
        samples = {name: np.zeros(number) for name in names}
        for values in samples.values() if not zeroed else [samples["deflection"]]:
            values[:] = np.nan
        samples |= {name: np.zeros((COMPONENTS, number), np.float32) for name in MOTION_NAMES * motion}
        self._hold(samples)
        for i, name in enumerate((*SCALARS, *MOTION_NAMES)):
            self.header.samples[i] = samples[name].ctypes.data if name in samples else 0
        self.header.interval, self.header.tolerance = interval, SAME / steps
        self.header.number, self.header.first = number, first

    @checked
    def keep_first(self, number: int) -> None:
        """Keep the first samples, this many; ValueError for a number < 0."""
        require(number >= 0, f"number of samples must be at least 0, got {number}")
        self._hold({name: array[..., :number] for name, array in self.samples.items()})

    def _hold(self, samples: dict[str, np.ndarray]) -> None:
        set_fields(self, samples=MappingProxyType(samples))

    def __getstate__(self) -> dict[str, np.ndarray]:
        return dict(self.samples)

    def __setstate__(self, samples: dict[str, np.ndarray]) -> None:
        """A copy has the samples, and takes no further ones before its start."""
        set_fields(self, header=np.zeros(1, HEADER)[0])
        self._hold(samples)

    def __getattr__(self, name: str) -> np.ndarray:
        if name not in (*NAMES, *FRICTION_NAMES):
            raise AttributeError(name)
        require(bool(self.samples), "the recorder has no samples; start it before the solve")
        require(name in self.samples, "the recorder has no friction; start it with friction=True")
        return self.samples[name]

    @checked
    def motion(self, side: int) -> tuple[np.ndarray, np.ndarray]:
        """Displacements and tilts (number, 5) [m, rad] of pinion (0) or wheel (1), and their rates."""
        require("q_1" in self.samples, "the recorder has no motion; start it with motion=True")
        q, v = (("q_1", "v_1"), ("q_2", "v_2"))[side]
        return self.samples[q].T, self.samples[v].T

    @property
    def power(self) -> dict[str, np.ndarray]:
        """(number,) potential [J], dissipated power [W], spins [rad] and speeds [rad/s] of both bodies, by name.

        Of gears on a carrier also its spin_3, speed_3 and torque_3 [N m] where these are recorded.
        """
        require("energy" in self.samples, "the recorder has no power; start it with power=True")
        return {name: self.samples[name] for name in (*POWER_NAMES, *CARRIER_NAMES) if name in self.samples}


@dataclass(frozen=True, eq=False)
class BodyRecorder:
    """Samples of a shaft, a pin or an elastic shaft at t = 0, interval, ..., which its compiled kernel writes.

    names         of the quantities, in the order in which the kernel stores them
    vector_size   of each quantity, as vectors (number, size) in single precision; by default scalars in double
                  precision
    """

    names: tuple[str, ...]
    vector_size: int | None = None
    header: np.record = field(default_factory=lambda: np.zeros(1, HEADER)[0], init=False, repr=False)
    samples: dict[str, np.ndarray] = field(default_factory=dict, init=False, repr=False)

    def start(self, interval: float, number: int, *, steps: int, first: int = 0) -> None:
        """Allocate a number of samples, 0 until written; arguments as those of `Recorder.start`."""
        for name in self.names:
            shape, kind = (number, np.float64) if self.vector_size is None else ((number, self.vector_size), np.float32)
            self.samples[name] = np.zeros(shape, kind)
        self.header.interval, self.header.tolerance = interval, SAME / steps
        self.header.number, self.header.first = number, first
        self.header.samples[: len(self.names)] = [self.samples[name].ctypes.data for name in self.names]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.samples[name]
