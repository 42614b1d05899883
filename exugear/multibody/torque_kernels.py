"""The kernel of a torque on a shaft: it evaluates the table, tells the meshes, and records torque and motion."""

from functools import cache
from math import floor, pi

import numpy as np

from exugear.mesh_force.kernel_records import doubles_at, record_type
from exugear.multibody.addresses import address_of, integers_at, reader
from exugear.multibody.integrator_steps import state_at
from exugear.multibody.polynomial_pieces import piece_at, pieces_at, pieces_record
from exugear.multibody.recorder import header_at, sample_of, store
from exugear.operation.torque_tables import ANGLE, SPEED, TorqueTable
from fem.support.numba_cache import compiled, kept

#: What is recorded of a torque about z: angle [rad] and speed [rad/s] of the shaft, torque on it [N m].
SHAFT_NAMES = "angle", "speed", "torque"
#: A torque about z. direction: of the shaft at positive speed; sense: +1 with the motion (drive), -1 against it (load);
#: held: 1 keeps the torque constant, for static solves. table: address of its `PIECES`. Number of meshes, addresses of
#: the addresses of their states and of their mesh forces per torque [1/m]. torque: about z, as evaluated last [N m].
SHAFT_TORQUE = record_type(
    *((name, "i8") for name in ("variable", "held", "table", "meshes", "states", "factors")),
    *((name, "f8") for name in ("direction", "sense", "torque")),
)
#: Differences of the angle [rad] and of the speed [rad/s] for the slopes of a torque.
ANGLE_STEP, SPEED_STEP = 1e-6, 1e-3
#: Size of the coefficients of a piece [bytes].
PIECE_SIZE = 32
torque_at = reader(SHAFT_TORQUE)


def torque_record(table: TorqueTable, direction: int, sense: int, states, factors) -> tuple[np.record, tuple]:
    """A `SHAFT_TORQUE`, and what it points to: that must live as long as the record.

    states    of the contacts whose holding force depends on the torque
    factors   mesh force per torque about z, of each contact [1/m]
    """
    pieces, arrays = pieces_record(table.cubic.knots, table.cubic.coefficients)
    addresses, per_torque = np.array([address_of(state) for state in states], np.int64), np.array(factors, float)
    record = np.zeros(1, SHAFT_TORQUE)[0]
    record.variable, record.direction, record.sense = table.variable, direction, sense
    record.table, record.meshes = address_of(pieces), len(addresses)
    record.states, record.factors = addresses.ctypes.data, per_torque.ctypes.data
    return record, (pieces, arrays, addresses, per_torque)


@compiled
def table_value(shaft, x):
    """Value of the table of a torque at x."""
    table = pieces_at(shaft.table)
    i, s = piece_at(table, x)
    c = doubles_at(table.coefficients + PIECE_SIZE * i)
    return c[0] + s * (c[1] + s * (c[2] + s * c[3]))


@compiled
def torque_about_z(shaft, t, angle, speed):
    """Torque about z [N m] at a time, an angle and a speed about z."""
    if shaft.held != 0:
        return shaft.torque
    x = t
    if shaft.variable == SPEED:
        x = shaft.direction * speed
    elif shaft.variable == ANGLE:
        turns = shaft.direction * angle / (2.0 * pi)
        x = 2.0 * pi * (turns - floor(turns))
    return shaft.direction * shaft.sense * table_value(shaft, x)


@compiled
def apply_torque(record, recorder, t, angle, speed):
    """The torque about z; adds its change to the forces that the meshes expect to hold, and records the sample."""
    shaft = torque_at(record)
    torque = torque_about_z(shaft, t, angle, speed)
    states, factors = integers_at(shaft.states), doubles_at(shaft.factors)
    for i in range(shaft.meshes):
        state = state_at(states[i])
        state.holding_force += factors[i] * (torque - shaft.torque)
    shaft.torque = torque
    k = sample_of(recorder, t)
    if k >= 0:
        store(header_at(recorder).samples, k, (angle, speed, torque))
    return torque


@kept
def torque_slopes(record, t, angle, speed):
    """Derivatives of the torque about z by the angle [N m/rad] and by the speed [N m s/rad]."""
    shaft = torque_at(record)
    by_angle = torque_about_z(shaft, t, angle + ANGLE_STEP, speed) - torque_about_z(shaft, t, angle - ANGLE_STEP, speed)
    by_speed = torque_about_z(shaft, t, angle, speed + SPEED_STEP) - torque_about_z(shaft, t, angle, speed - SPEED_STEP)
    return by_angle / (2.0 * ANGLE_STEP), by_speed / (2.0 * SPEED_STEP)


@cache
def torque_kernel(n: int):
    """The function (record, recorder, t, *coordinates, *velocities) -> forces of a body with n coordinates.

    The first two are addresses: of a `SHAFT_TORQUE` and of a recorder's header. The last coordinate is the spin.
    """

    @kept
    def shaft_torque(record, recorder, t, *x):
        torque = apply_torque(record, recorder, t, x[n - 1], x[2 * n - 1])
        if n == 1:
            return (torque,)
        return (0.0, 0.0, torque) if n == 3 else (0.0, 0.0, 0.0, 0.0, 0.0, torque)

    return shaft_torque
