"""Samples of a contact, which its compiled kernel writes."""

from dataclasses import dataclass, field

import numpy as np

from exugear.force_table.kernel_records import reader, record_type
from fem.support.arguments import checked
from fem.support.numba_cache import compiled
from fem.support.validation import require

NAMES = "deflection", "force", "a", "misalignment", "axial", "centroid", "pinion_torque", "wheel_torque", "phase"
SAMPLE = record_type(*((name, "f8") for name in NAMES))
#: Displacements [m] and tilts [rad] of pinion and wheel, and their rates.
MOTION = record_type(*((name, "f4", 5) for name in ("q_1", "q_2", "v_1", "v_2")))
#: Potential of the mesh [J], power that its damping dissipates [W], spins [rad] and speeds [rad/s] of the bodies.
POWER = record_type(*((name, "f8") for name in ("energy", "dissipation", "spin_1", "spin_2", "speed_1", "speed_2")))
#: Friction between the teeth: force along the flanks [N] and power that it dissipates [W].
FRICTION_NAMES = ("friction_force", "friction_loss")
FRICTION_SAMPLE = record_type(*((name, "f8") for name in FRICTION_NAMES))
#: Time between samples [s], their number, addresses of samples, motions, powers and friction (0: none are recorded),
#: the share of an interval by which the time of a call may differ from that of a sample, and the interval after t = 0
#: at whose end the first sample is taken.
HEADER = record_type(
    *(("interval", "f8"), ("number", "i8"), ("samples", "i8"), ("motions", "i8"), ("powers", "i8")),
    *(("friction", "i8"), ("tolerance", "f8"), ("first", "i8")),
)
SAMPLE_SIZE, MOTION_SIZE, POWER_SIZE = SAMPLE.itemsize, MOTION.itemsize, POWER.itemsize
header_at, sample_at, motion_at, power_at = reader(HEADER), reader(SAMPLE), reader(MOTION), reader(POWER)
friction_sample_at, FRICTION_SIZE = reader(FRICTION_SAMPLE), FRICTION_SAMPLE.itemsize
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


@compiled
def write(record, k, mesh_state, offsets, centroid, torques):
    """Store sample k; mesh_state: deflection [m], mesh force [N], phase of the driving flank."""
    sample = sample_at(header_at(record).samples + SAMPLE_SIZE * k)
    sample.deflection, sample.force, sample.phase = mesh_state
    sample.centroid = centroid
    sample.a, sample.misalignment, sample.axial = offsets
    sample.pinion_torque, sample.wheel_torque = torques


@compiled
def write_motion(record, k, q_1, q_2, v_1, v_2):
    """Store displacements and velocities of sample k if they are recorded."""
    motions = header_at(record).motions
    if motions == 0:
        return
    motion = motion_at(motions + MOTION_SIZE * k)
    for i in range(5):
        motion.q_1[i], motion.q_2[i], motion.v_1[i], motion.v_2[i] = q_1[i], q_2[i], v_1[i], v_2[i]


@compiled
def write_power(record, k, energy, dissipation, spins, speeds):
    """Store potential, dissipated power, spins and speeds of sample k if they are recorded."""
    powers = header_at(record).powers
    if powers == 0:
        return
    power = power_at(powers + POWER_SIZE * k)
    power.energy, power.dissipation = energy, dissipation
    power.spin_1, power.spin_2 = spins
    power.speed_1, power.speed_2 = speeds


@compiled
def write_friction(record, k, force, loss):
    """Store force [N] and loss [W] of friction of sample k if they are recorded."""
    friction = header_at(record).friction
    if friction != 0:
        sample = friction_sample_at(friction + FRICTION_SIZE * k)
        sample.friction_force, sample.friction_loss = force, loss


@dataclass(frozen=True, eq=False)
class Recorder:
    """Samples of a contact, which its compiled kernel writes without further cost.

    `start` it before a solve; afterwards these hold the samples at t = 0, interval, ..., each (number,):

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
    nor on the direction of the pinion. An STE map, `fem.Offsets` and `exugear.MeshForce` count z in the opposite sense
    where the mesh force turns the pinion counter-clockwise (back flank, second stage): change the signs of
    misalignment, axial and centroid to compare them.
    """

    header: np.record = field(default_factory=lambda: np.zeros(1, HEADER)[0], init=False, repr=False)
    samples: list[np.ndarray] = field(default_factory=list, init=False, repr=False)

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
    ) -> None:
        """Allocate a number of samples, NaN until written; interval [s] must be a whole multiple of the step.

        steps      largest number of steps in an interval
        first      number of intervals after t = 0 at which the first sample is taken
        motion     also record what `motion` returns
        power      also record what `power` returns
        friction   also record friction_force and friction_loss of a stage of a `Gearbox` that has friction
        """
        require(interval > 0, f"interval must be > 0 s, got {interval}")
        require(number >= 1, f"number of samples must be at least 1, got {number}")
        require(steps >= 1, f"steps in an interval must be at least 1, got {steps}")
        require(first >= 0, f"first must be at least 0 intervals after t = 0, got {first}")
        kinds = [SAMPLE, *[MOTION] * motion, *[POWER] * power, *[FRICTION_SAMPLE] * friction]
        self.samples[:] = [np.full(number, np.nan, kind) for kind in kinds]
        self.header.interval, self.header.number, self.header.tolerance = interval, number, SAME / steps
        self.header.first = first
        self.header.samples = self.samples[0].ctypes.data
        self.header.motions = self._recorded(MOTION).ctypes.data if motion else 0
        self.header.powers = self._recorded(POWER).ctypes.data if power else 0
        self.header.friction = self._recorded(FRICTION_SAMPLE).ctypes.data if friction else 0

    def _recorded(self, kind: np.dtype) -> np.ndarray:
        """The samples of a kind."""
        return next(block for block in self.samples if block.dtype == kind)

    def __getattr__(self, name: str) -> np.ndarray:
        if name not in (*NAMES, *FRICTION_NAMES):
            raise AttributeError(name)
        require(bool(self.samples), "the recorder has no samples; start it before the solve")
        if name in NAMES:
            return self.samples[0][name]
        require(bool(self.header.friction), "the recorder has no friction; start it with friction=True")
        return self._recorded(FRICTION_SAMPLE)[name]

    @checked
    def motion(self, side: int) -> tuple[np.ndarray, np.ndarray]:
        """Displacements and tilts (number, 5) [m, rad] of pinion (0) or wheel (1), and their rates."""
        require(bool(self.header.motions), "the recorder has no motion; start it with motion=True")
        q, v = (("q_1", "v_1"), ("q_2", "v_2"))[side]
        motion = self._recorded(MOTION)
        return motion[q], motion[v]

    @property
    def power(self) -> np.ndarray:
        """(number,) records of potential [J], dissipated power [W], spins [rad] and speeds [rad/s] of both bodies."""
        require(bool(self.header.powers), "the recorder has no power; start it with power=True")
        return self._recorded(POWER)
