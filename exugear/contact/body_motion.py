"""Bodies of any kind as Rxyz bodies about z of the frame of their mesh: displacements, and forces back on coordinates.

The mesh of two gears depends on their relative position alone (`exugear.contact.relative_position`). Where
both bodies move in space on nodes of any kind, z of the frame of the mesh is the pinion's axis at this instant: the
wheel is tilted in it by little, wherever the pair has turned, so that no attitude in space is singular. Where a body
turns about global z or moves in that plane, the frame of the mesh is the global one. Velocities are those against the
ground, by their components in the frame; forces on the coordinates follow by virtual work.

Attitudes do not tell whole turns, but a coordinate of Rxyz nodes counts them. Without it the advance follows up to
whole base pitches, of which the contact remembers the last (`relative_position.remembered_advance`).
"""

from math import atan2, cos, floor, hypot, pi, sin, sqrt
from typing import NamedTuple

from exugear.contact.relative_position import Row, Vector
from exugear.contact.rotation import (
    RXYZ,
    angular_velocity,
    attitude,
    coordinates_of,
    moments,
    product,
    times,
    transposed,
)
from exugear.contact.vectors import cross, dot, scaled, total
from fem.support.numba_cache import compiled, kept

#: Component of a gear's axis along global x above which global y gives the other axes.
LEANING = 0.8
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Posture(NamedTuple):
    """Rotational coordinates (4) of a body in space, its rotation matrix, and the axes of its gear (columns)."""

    rotation: tuple[float, float, float, float]
    matrix: tuple[Vector, Vector, Vector]
    gear: tuple[Vector, Vector, Vector]


class Orientation(NamedTuple):
    """`Posture` of a body, the axes of the frame of its mesh (columns), and the tilts of the gear in that frame."""

    posture: Posture
    frame: tuple[Vector, Vector, Vector]
    a: float
    b: float


class BodyMotion(NamedTuple):
    """Displacements q and velocities v of a body in the frame of its mesh, and its orientation for forces."""

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
def posture_of(gear, kind, q):
    """`Posture` of a body in space with coordinates q (7)."""
    d, reference = q[3:], gear.rotation
    p = reference[0] + d[0], reference[1] + d[1], reference[2] + d[2], reference[3] + d[3]
    matrix = attitude(kind, p)
    return Posture(p, matrix, product(matrix, rows_of(gear.axes)))


@kept
def axes_without_spin(gear):
    """Axes (columns) of a frame whose z is that of a gear with these axes (columns).

    Its other axes do not depend on the spin, so that rounding of positions does not, either. Axes by Euler parameters
    are as long as the squared length of these.
    """
    z = gear[0][2], gear[1][2], gear[2][2]
    z = scaled(1.0 / sqrt(dot(z, z)), z)
    along = (1.0, 0.0, 0.0) if abs(z[0]) < LEANING else (0.0, 1.0, 0.0)
    x = total(along, scaled(-dot(along, z), z))
    x = scaled(1.0 / sqrt(dot(x, x)), x)
    return transposed((x, cross(z, x), z))


@compiled
def turns_of(gear, q):
    """Angle [rad] that a coordinate of an Rxyz node counts about the gear's axis; 0 where none does."""
    return gear.spin_factors[0] * q[3] + gear.spin_factors[1] * q[5]


@compiled
def counted_turns(angle, counted):
    """The angle, known up to whole turns, that is nearest to a counted one [rad]."""
    return angle + 2.0 * pi * floor((counted - angle) / (2.0 * pi) + 0.5)


@compiled
def motion_in(frame_axes, kind, posture, position, v, reference):
    """`BodyMotion` of a body in space in a frame with these axes (columns).

    position, v   displacement (3) of the body [m] and rates (7) of its coordinates
    reference     coordinates (6) in the frame from which its attitude counts
    """
    into = transposed(frame_axes)
    a, b, c = angles_of(product(into, posture.gear))
    x, y, z = times(into, position)
    v_x, v_y, v_z = times(into, (v[0], v[1], v[2]))
    omega = times(into, angular_velocity(kind, posture.rotation, posture.matrix, v[3:]))
    c_t = (cos(a) * omega[2] - sin(a) * omega[1]) / cos(b)
    a_t, b_t = omega[0] - sin(b) * c_t, cos(a) * omega[1] + sin(a) * omega[2]
    displaced = x, y, z, a - reference[3], b - reference[4], c - reference[5]
    return BodyMotion(displaced, (v_x, v_y, v_z, a_t, b_t, c_t), Orientation(posture, frame_axes, a, b))


@compiled
def relative_motions(frame, kind_1, kind_2, q_1, q_2, v_1, v_2):
    """Motions of two bodies in space in a frame along the pinion's axis, whose origin is the pinion's body."""
    pinion, wheel = posture_of(frame.pinion, kind_1, q_1), posture_of(frame.wheel, kind_2, q_2)
    axes = axes_without_spin(pinion.gear)
    into, gear = transposed(axes), transposed(pinion.gear)
    omega = times(into, angular_velocity(kind_1, pinion.rotation, pinion.matrix, v_1[3:]))
    v_x, v_y, v_z = times(into, (v_1[0], v_1[1], v_1[2]))
    spin_1 = atan2(-dot(into[0], gear[1]), dot(into[0], gear[0])) - frame.pinion.reference[5]
    at_origin, velocity = (0.0, 0.0, 0.0, 0.0, 0.0, spin_1), (v_x, v_y, v_z, omega[0], omega[1], omega[2])
    d, e = frame.between, frame.wheel.reference
    between = d[0] + q_2[0] - q_1[0], d[1] + q_2[1] - q_1[1], d[2] + q_2[2] - q_1[2]
    motion_2 = motion_in(axes, kind_2, wheel, between, v_2, e)
    x, y, z, a, b, spin_2 = motion_2.q
    if frame.base_pitch == 0.0:
        counted = turns_of(frame.wheel, q_2) - turns_of(frame.pinion, q_1)
        spin_2 = counted_turns(spin_2, spin_1 + counted)
    displaced = x - e[0], y - e[1], z - e[2], a, b, spin_2
    return (
        BodyMotion(at_origin, velocity, Orientation(pinion, axes, 0.0, 0.0)),
        BodyMotion(displaced, motion_2.v, motion_2.orientation),
    )


@compiled
def forces_in_space(kind, orientation, forces):
    """Generalized forces (7) on the coordinates of a body in space, from those (6) in the frame of its mesh."""
    a, b, posture = orientation.a, orientation.b, orientation.posture
    along = (forces[5] - sin(b) * forces[3]) / cos(b)
    moment = forces[3], cos(a) * forces[4] - sin(a) * along, sin(a) * forces[4] + cos(a) * along
    x, y, z = times(orientation.frame, (forces[0], forces[1], forces[2]))
    e, f, g, h = moments(kind, posture.rotation, posture.matrix, times(orientation.frame, moment))
    return x, y, z, e, f, g, h


@compiled(forceinline=True)
def motion_of(frame, gear, kind, q, v):
    """BodyMotion of a body with coordinates q and velocities v (7) in the contact frame."""
    if kind >= RXYZ:
        axes, posture = rows_of(frame.axes), posture_of(gear, kind, q)
        moved = motion_in(axes, kind, posture, (q[0], q[1], q[2]), v, gear.reference)
        x, y, z, a, b, spin = moved.q
        return BodyMotion((x, y, z, a, b, counted_turns(spin, turns_of(gear, q))), moved.v, moved.orientation)
    upright = Posture((0.0, 0.0, 0.0, 0.0), IDENTITY, IDENTITY)
    return BodyMotion(q[:6], v[:6], Orientation(upright, IDENTITY, 0.0, 0.0))


@compiled(forceinline=True)
def motions_of(frame, kind_1, kind_2, n_1, n_2, x):
    """Motions of pinion and wheel, with n_1 and n_2 coordinates; x: their coordinates, then the rates of these."""
    q_1, v_1 = coordinates_of(x, 0, kind_1), coordinates_of(x, n_1 + n_2, kind_1)
    q_2, v_2 = coordinates_of(x, n_1, kind_2), coordinates_of(x, n_1 + n_2 + n_1, kind_2)
    if kind_1 >= RXYZ and kind_2 >= RXYZ:
        return relative_motions(frame, kind_1, kind_2, q_1, q_2, v_1, v_2)
    return motion_of(frame, frame.pinion, kind_1, q_1, v_1), motion_of(frame, frame.wheel, kind_2, q_2, v_2)


@compiled
def recorded_motion(frame, gear, kind, coordinates, motion):
    """The motion of a body in the contact frame, where `motion` is that in the frame of its mesh.

    coordinates   q and their rates (7, 7)

    A coordinate of an Rxyz node counts the turns of the gear; those of other nodes in space are not known.
    """
    if kind < RXYZ:
        return motion
    (q, v), reference = coordinates, (0.0, 0.0, 0.0, gear.angles[0], gear.angles[1], gear.angles[2])
    turned = motion_in(rows_of(frame.axes), kind, motion.orientation.posture, (q[0], q[1], q[2]), v, reference)
    x, y, z, a, b, spin = turned.q
    return BodyMotion((x, y, z, a, b, counted_turns(spin, turns_of(gear, q))), turned.v, turned.orientation)


@compiled(forceinline=True)
def recorded_motions(frame, kind_1, kind_2, n_1, n_2, x, pinion, wheel):
    """`recorded_motion` of pinion and wheel; arguments as those of `motions_of`, and the motions that it returns."""
    q_1, v_1 = coordinates_of(x, 0, kind_1), coordinates_of(x, n_1 + n_2, kind_1)
    q_2, v_2 = coordinates_of(x, n_1, kind_2), coordinates_of(x, n_1 + n_2 + n_1, kind_2)
    return (
        recorded_motion(frame, frame.pinion, kind_1, (q_1, v_1), pinion),
        recorded_motion(frame, frame.wheel, kind_2, (q_2, v_2), wheel),
    )


@compiled(forceinline=True)
def forces_on(kind, orientation, forces):
    """Generalized forces (7) on the coordinates of a body of any kind, from those (6) in the frame of its mesh."""
    if kind >= RXYZ:
        return forces_in_space(kind, orientation, forces)
    return forces[0], forces[1], forces[2], forces[3], forces[4], forces[5], 0.0
