"""Imposed motion of a shaft: its angle is a known function of time, which contacts evaluate, and no unknown.

The coordinate of such a shaft is free: the contact keeps the torque of the mesh from it and accelerates it as imposed,
so that it follows for sensors and graphics. So does the coupling behind whose spring a rotor turns as imposed.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from exugear.contact.body_motion import BodyMotion
from exugear.gearbox.shaft import Coupling
from exugear.mesh_force.kernel_records import doubles_at, record_type
from exugear.multibody.addresses import address_of, reader
from exugear.multibody.polynomial_pieces import piece_at, pieces_at
from fem.support.numba_cache import apart, compiled, kept

#: Size of the coefficients of a piece [bytes].
PIECE_SIZE = 40
#: Inertia of a rotor [kg m^2], torsional stiffness [N m/rad] and damping [N m s/rad] of its coupling, address of the
#: `PIECES` of the rotor's angle about z over time.
COUPLING = record_type(("inertia", "f8"), ("torsion", "f8"), ("damping", "f8"), ("motion", "i8"))
coupling_at = reader(COUPLING)
#: A motion that never begins: that of a held shaft.
AT_REST = np.array([0.0, 1.0]), np.zeros((1, 5))


class Spin(NamedTuple):
    """Angle [rad], speed [rad/s] and acceleration [rad/s^2] of a body about z; the last is 0 unless it is imposed."""

    angle: float
    speed: float
    acceleration: float


@compiled(forceinline=True)
def spin_of(address, t, angle, speed):
    """The `Spin` of a body at t by its imposed motion, or as its coordinate has it where the address is 0."""
    return imposed_spin(address, t) if address != 0 else Spin(angle, speed, 0.0)


@apart
def imposed_spin(address, t):
    """The `Spin` at t by the `PIECES` of an angle at an address."""
    angle = pieces_at(address)
    i, s = piece_at(angle, t)
    c = doubles_at(angle.coefficients + PIECE_SIZE * i)
    return Spin(
        c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * c[4]))),
        c[1] + s * (2.0 * c[2] + s * (3.0 * c[3] + s * 4.0 * c[4])),
        2.0 * c[2] + s * (6.0 * c[3] + s * 12.0 * c[4]),
    )


@compiled
def in_carrier(spin, carrier):
    """The `Spin` of a body against its carrier, with the acceleration against the ground."""
    return Spin(spin.angle - carrier.angle, spin.speed - carrier.speed, spin.acceleration)


@compiled(forceinline=True)
def with_spin(motion, spin):
    """The `BodyMotion` of a body in space with this `Spin`."""
    return BodyMotion((*motion.q[:5], spin.angle), (*motion.v[:5], spin.speed), motion.orientation)


@compiled
def torque_on(state, side, spin, torque):
    """Torque [N m] on the coordinate of pinion (side 0), wheel (1) or carrier (2), from that of the mesh."""
    if state.imposed[side] != 0:
        return state.inertias[side] * spin.acceleration
    return torque + state.torques[side]


def coupling_record(coupling: Coupling, motion: np.record) -> np.record:
    """The record of a coupling whose rotor has an imposed motion."""
    record = np.zeros(1, COUPLING)[0]
    record.inertia, record.torsion, record.damping = coupling.inertia, coupling.torsion, coupling.damping
    record.motion = address_of(motion)
    return record


@cache
def coupling_kernel(n: int):
    """The function (record, t, *coordinates, *velocities) -> forces of the rotor and of a shaft with n coordinates.

    record is the address of a `COUPLING`. The last coordinate of the shaft is its spin.
    """

    @kept
    def driven_coupling(record, t, *x):
        coupling = coupling_at(record)
        rotor = spin_of(coupling.motion, t, 0.0, 0.0)
        torque = coupling.torsion * (rotor.angle - x[n]) + coupling.damping * (rotor.speed - x[2 * n + 1])
        on_rotor = (coupling.inertia * rotor.acceleration,)
        if n == 1:
            return (*on_rotor, torque)
        if n == 3:
            return (*on_rotor, 0.0, 0.0, torque)
        return (*on_rotor, 0.0, 0.0, 0.0, 0.0, 0.0, torque)

    return driven_coupling
