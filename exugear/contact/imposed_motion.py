"""Imposed motion of a shaft: its angle is a known function of time, which contacts evaluate, and no unknown.

The coordinate of such a shaft is free: the contact keeps the torque of the mesh from it and accelerates it as imposed,
so that it follows for sensors and graphics.
"""

from typing import NamedTuple

import numpy as np
from numba import carray

from exugear.contact.body_motion import Motion
from exugear.mesh_force.kernel_records import doubles_at, reader, record_type
from fem.support.numba_cache import compiled

#: Number of pieces of the angle about z over time, addresses of their knots (number + 1) and coefficients (number, 5)
#: of 1, s, s^2 ..., s counted from the lower knot; the piece of the last call.
IMPOSED_MOTION = record_type(*((name, "i8") for name in ("number", "knots", "coefficients", "piece")))
#: Size of the coefficients of a piece [bytes].
PIECE_SIZE = 40
imposed_motion_at = reader(IMPOSED_MOTION)


class Spin(NamedTuple):
    """Angle [rad], speed [rad/s] and acceleration [rad/s^2] of a body about z; the last is 0 unless it is imposed."""

    angle: float
    speed: float
    acceleration: float


def imposed_motion(knots: np.ndarray, coefficients: np.ndarray) -> tuple[np.record, tuple]:
    """An `IMPOSED_MOTION`, and the arrays to which it points: they must live as long as the record."""
    record, arrays = np.zeros(1, IMPOSED_MOTION)[0], (np.array(knots, float), np.array(coefficients, float, order="C"))
    record.number, record.knots, record.coefficients = len(coefficients), *(array.ctypes.data for array in arrays)
    return record, arrays


@compiled
def spin_of(address, t, angle, speed):
    """The `Spin` of a body at t by its imposed motion, or as its coordinate has it where the address is 0."""
    if address == 0:
        return Spin(angle, speed, 0.0)
    motion = imposed_motion_at(address)
    knots, i = carray(doubles_at(motion.knots), motion.number + 1), motion.piece
    while i > 0 and t < knots[i]:
        i -= 1
    while i < motion.number - 1 and t >= knots[i + 1]:
        i += 1
    motion.piece = i
    c, s = carray(doubles_at(motion.coefficients + PIECE_SIZE * i), 5), t - knots[i]
    return Spin(
        c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * c[4]))),
        c[1] + s * (2.0 * c[2] + s * (3.0 * c[3] + s * 4.0 * c[4])),
        2.0 * c[2] + s * (6.0 * c[3] + s * 12.0 * c[4]),
    )


@compiled(forceinline=True)
def spin_in_space(address, t, motion):
    """The `Spin` of a body in space at t, and its `Motion` with that spin."""
    spin = spin_of(address, t, motion.q[5], motion.v[5])
    return spin, Motion((*motion.q[:5], spin.angle), (*motion.v[:5], spin.speed), motion.orientation)


@compiled
def torque_on(state, side, spin, torque):
    """Torque [N m] on the coordinate of pinion (side 0) or wheel (1), from that of the mesh."""
    if state.imposed[side] != 0:
        return state.inertias[side] * spin.acceleration
    return torque + state.torques[side]


@compiled(forceinline=True)
def with_torque_on(state, side, spin, forces):
    """The generalized forces (7) on pinion (side 0) or wheel (1), from those of the mesh."""
    return (*forces[:5], torque_on(state, side, spin, forces[5]), forces[6])
