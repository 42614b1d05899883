"""Bodies of any kind as Rxyz bodies about z of the contact frame: their displacements, and forces back on coordinates.

z of a rotated contact frame runs along the pinion's axis in the reference configuration. The attitude of a body in it
is Rx(a) Ry(b) Rz(c) with small tilts a, b and the spin c about the gear's axis, whatever coordinates its node has.
Forces on the coordinates follow by virtual work; `exugear.kernels.kinematics` computes the mesh in the contact frame.
"""

from math import atan2, cos, floor, hypot, pi, sin
from typing import NamedTuple

from exugear.contact_geometry.relative_position import Row, Vector
from exugear.contact_geometry.rotation import (
    EULER,
    IN_PLANE,
    RXYZ,
    SPIN_ALONE,
    UPRIGHT,
    VECTOR,
    angular_velocity,
    attitude,
    moments,
    product,
    times,
    transposed,
)
from fem.support.numba_cache import compiled, kept

#: Number of coordinates of each kind of body.
SIZES = {SPIN_ALONE: 1, IN_PLANE: 3, UPRIGHT: 6, RXYZ: 6, EULER: 7, VECTOR: 6}
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Orientation(NamedTuple):
    """Rotational coordinates (4) of a body and their rotation matrix, tilts in the contact frame."""

    rotation: tuple[float, float, float, float]
    matrix: tuple[Vector, Vector, Vector]
    a: float
    b: float


class Motion(NamedTuple):
    """Displacements q and velocities v of a body in the contact frame, and its orientation, which transforms forces."""

    q: Row
    v: Row
    orientation: Orientation


@compiled
def rows_of(matrix):
    """The rows of a matrix (3, 3)."""
    return (
        (matrix[0, 0], matrix[0, 1], matrix[0, 2]),
        (matrix[1, 0], matrix[1, 1], matrix[1, 2]),
        (matrix[2, 0], matrix[2, 1], matrix[2, 2]),
    )


@kept
def angles_of(matrix):
    """Angles a, b, c of a matrix Rx(a) Ry(b) Rz(c), or of a multiple of it."""
    (x, y, z), (_, _, w), (_, _, u) = matrix
    return atan2(-w, u), atan2(z, hypot(w, u)), atan2(-y, x)


@compiled
def rotational(kind, x):
    """The rotational coordinates (4) among those of a body (7)."""
    return x[3], x[4], x[5], x[6] if kind == EULER else 0.0


@compiled
def coordinates_of(x, i, kind):
    """Coordinates (7) of the body whose coordinates in x begin at i; displacements and tilts that it lacks are 0."""
    if kind == SPIN_ALONE:
        return 0.0, 0.0, 0.0, 0.0, 0.0, x[i], 0.0
    if kind == IN_PLANE:
        return x[i], x[i + 1], 0.0, 0.0, 0.0, x[i + 2], 0.0
    return x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4], x[i + 5], x[i + 6] if kind == EULER else 0.0


@compiled
def rotated_motion(frame, gear, kind, q, v):
    """Motion of a body in space in a rotated contact frame."""
    axes = transposed(rows_of(frame.axes))
    d, reference = rotational(kind, q), gear.rotation
    p = reference[0] + d[0], reference[1] + d[1], reference[2] + d[2], reference[3] + d[3]
    matrix = attitude(kind, p)
    a, b, c = angles_of(product(axes, product(matrix, rows_of(gear.axes))))
    counted, spin = gear.spin_factors[0] * q[3] + gear.spin_factors[1] * q[5], c - gear.reference[5]
    spin += 2.0 * pi * floor((counted - spin) / (2.0 * pi) + 0.5)
    x, y, z = times(axes, (q[0], q[1], q[2]))
    v_x, v_y, v_z = times(axes, (v[0], v[1], v[2]))
    omega = times(axes, angular_velocity(kind, p, matrix, rotational(kind, v)))
    c_t = (cos(a) * omega[2] - sin(a) * omega[1]) / cos(b)
    a_t, b_t = omega[0] - sin(b) * c_t, cos(a) * omega[1] + sin(a) * omega[2]
    displaced = x, y, z, a - gear.reference[3], b - gear.reference[4], spin
    return Motion(displaced, (v_x, v_y, v_z, a_t, b_t, c_t), Orientation(p, matrix, a, b))


@compiled
def rotated_forces(frame, kind, orientation, forces):
    """Generalized forces (7) on the coordinates of a body in space, from those (6) in a rotated contact frame."""
    a, b = orientation.a, orientation.b
    axes = rows_of(frame.axes)
    along = (forces[5] - sin(b) * forces[3]) / cos(b)
    moment = forces[3], cos(a) * forces[4] - sin(a) * along, sin(a) * forces[4] + cos(a) * along
    x, y, z = times(axes, (forces[0], forces[1], forces[2]))
    e, f, g, h = moments(kind, orientation.rotation, orientation.matrix, times(axes, moment))
    return x, y, z, e, f, g, h


@compiled(forceinline=True)
def motion_of(frame, gear, kind, q, v):
    """Motion of a body with coordinates q and velocities v (7); those of upright bodies are in the contact frame."""
    if kind >= RXYZ:
        return rotated_motion(frame, gear, kind, q, v)
    return Motion(q[:6], v[:6], Orientation((0.0, 0.0, 0.0, 0.0), IDENTITY, 0.0, 0.0))


@compiled(forceinline=True)
def motions_of(frame, kind_1, kind_2, n_1, n_2, x):
    """Motions of pinion and wheel, with n_1 and n_2 coordinates; x: their coordinates, then the rates of these."""
    q_1, v_1 = coordinates_of(x, 0, kind_1), coordinates_of(x, n_1 + n_2, kind_1)
    q_2, v_2 = coordinates_of(x, n_1, kind_2), coordinates_of(x, n_1 + n_2 + n_1, kind_2)
    return motion_of(frame, frame.pinion, kind_1, q_1, v_1), motion_of(frame, frame.wheel, kind_2, q_2, v_2)


@compiled(forceinline=True)
def forces_on(frame, kind, orientation, forces):
    """Generalized forces (7) on the coordinates of a body of any kind, from those (6) in the contact frame."""
    if kind >= RXYZ:
        return rotated_forces(frame, kind, orientation, forces)
    return forces[0], forces[1], forces[2], forces[3], forces[4], forces[5], 0.0
