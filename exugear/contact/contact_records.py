"""The records of one contact: its frame, which never changes, and its state, which a run changes."""

from math import pi, tan

import numpy as np

from exugear.mesh_force.kernel_records import reader, record_of, record_type
from fem.gear.involute import involute

#: A gear on its body: base radius and axial position [m], reference coordinates of the body as an Rxyz body of the
#: frame of the mesh (`exugear.contact.body_motion`). In a rotated frame also the rotational reference
#: coordinates of its node, the axes of the gear on the body, its angles in the contact frame in the reference
#: configuration, and the factors of the fourth and sixth coordinate that count its turns for the recorder.
GEAR = record_type(
    ("r_b", "f8"),
    ("axial", "f8"),
    ("reference", "f8", 6),
    ("rotation", "f8", 4),
    ("axes", "f8", (3, 3)),
    ("angles", "f8", 3),
    ("spin_factors", "f8", 2),
)
#: Geometry of a contact. In the reference configuration: line of centres (e_x, e_y) on the pinion's body, height as
#: `relative_position.height`, angle of the line on the wheel's body less that on the pinion's [rad];
#: base_pitch: 0 where coordinates count the turns of both bodies, else the base pitch [m], up to whole multiples of
#: which attitudes tell the advance; axes: of a rotated contact frame (columns), 0 where it is the global frame;
#: between: from the pinion's body to the wheel's [m], along the global axes.
CONTACT_FRAME = record_type(
    ("pitches_per_radian", "f8"),
    ("phase", "f8"),
    ("direction", "f8"),
    ("inv_alpha_wt", "f8"),
    ("tan_beta_b", "f8"),
    ("e_x", "f8"),
    ("e_y", "f8"),
    ("height", "f8"),
    ("wheel_angle", "f8"),
    ("base_pitch", "f8"),
    ("axes", "f8", (3, 3)),
    ("between", "f8", 3),
    ("pinion", GEAR),
    ("wheel", GEAR),
)
#: What a contact knows of the steps of an integrator, for its first guess in a step (`exugear.contact.first_guess`).
#: duration: of a step [s], 0 without guesses; deflection and rate per acceleration along the line of action at the end
#: of a step [s^2, s]; compliance: acceleration per mesh force in a step [1/kg]; matrix: mesh force per acceleration
#: in the matrix of Newton's iteration [kg]; accelerations that bearings give per displacement and velocity of
#: pinion and wheel [1/s^2, 1/s] in a step; time [s], rate [m/s], force [N] and acceleration by bearings
#: [m/s^2] of the last call; time of this call [s]; guesses: 1 in the first call of a step.
#: For events (`exugear.contact.contact_events`), mobility: acceleration per mesh force without a step [1/kg], 0 where
#: events are not corrected; lag of the velocities [s^2]; rate by imposed motion [m/s] and penetration [m] in the last
#: call, < 0 on the back flank; accelerations by pulses at the end of this step and of the next [m/s^2], mesh force of
#: the pulse at the end of this step [N]; shift: corrected advance minus the integrated one [m], and its rate [m/s].
STEPS = record_type(
    *((name, "f8") for name in ("duration", "deflection", "rate", "compliance", "matrix")),
    *((name, "f8", (2, 6)) for name in ("by_displacement", "by_velocity")),
    *((name, "f8") for name in ("last_time", "last_rate", "last_force", "last_by_bearings", "time", "guesses")),
    *((name, "f8") for name in ("mobility", "lag", "last_imposed_rate", "last_penetration")),
    *((name, "f8") for name in ("pulse", "next_pulse", "pulse_force", "shift", "shift_rate")),
)
#: Values that a run sets. engaged: 0 takes the gears out of mesh; closed: 1 once teeth have touched. Where coordinates
#: do not count turns: advance in the last call [m], time of the first call of this solve [s], and whether this call is
#: at that time. The lag of the integrator's velocities, as in `force_kernels.corrected_rate`: by the mesh force [m/N],
#: and by the bearings of pinion and wheel, as factors of their velocities. mobility: acceleration per force [1/kg].
#: holding_force: mesh force that balances the load while the bearings are not displaced [N]. Of pinion and wheel:
#: constant torques about z that act beside the mesh [N m]; addresses of their imposed motions
#: (`exugear.contact.imposed_motion`), 0 without; inertias that the contact itself accelerates as imposed [kg m^2].
#: steps: `STEPS`.
CONTACT_STATE = record_type(
    ("engaged", "f8"),
    ("closed", "f8"),
    ("advance", "f8"),
    ("begin", "f8"),
    ("begins", "f8"),
    ("lag", "f8"),
    ("pinion_lag", "f8", 6),
    ("wheel_lag", "f8", 6),
    ("mobility", "f8"),
    ("holding_force", "f8"),
    ("torques", "f8", 2),
    ("imposed", "i8", 2),
    ("inertias", "f8", 2),
    ("steps", STEPS),
)
frame_at, state_at = reader(CONTACT_FRAME), reader(CONTACT_STATE)


def contact_state() -> np.record:
    """A new state: in mesh, velocities without lag, no call yet."""
    state = np.zeros(1, CONTACT_STATE)
    state["engaged"], state["begin"] = 1.0, np.inf
    return state[0]


def rotational_frame(pair, phase: float, direction: int) -> np.record:
    """Frame of a `fem.GearPair` or `RingPair` on two bodies that spin about fixed axes."""
    return record_of(
        CONTACT_FRAME,
        pitches_per_radian=pair.pinion.z / (2 * pi),
        phase=phase,
        direction=direction,
        inv_alpha_wt=involute(pair.alpha_wt),
        tan_beta_b=tan(pair.beta_b),
        pinion=record_of(GEAR, r_b=pair.pinion.r_b),
        wheel=record_of(GEAR, r_b=pair.wheel.r_b),
    )


def is_spatial(frame: np.record) -> bool:
    """Whether a frame holds the positions of its gears, as that of two bodies about fixed axes does not."""
    return bool(frame.e_x or frame.e_y)


def is_rotated(frame: np.record) -> bool:
    """Whether a contact frame is rotated against the global one."""
    return bool(frame.axes.any())
