"""The frame of a contact whose axes do not lie along global z: its bodies seen there as Rxyz bodies about z.

z of the contact frame runs along the pinion's axis in the reference configuration. A body's attitude there is
Rx(a) Ry(b) Rz(c) with small tilts a, b and the spin c about the gear's axis, whatever coordinates its node has.
Displacements, velocities and, by virtual work, forces go to and fro; the mesh itself is that of
`exugear.kernels.kinematics`.
"""

from dataclasses import dataclass, replace
from math import atan2, cos, floor, hypot, pi, sin

import numpy as np

from exugear.kernels.attitude import (
    EULER,
    IN_PLANE,
    RXYZ,
    SPIN_ALONE,
    VECTOR,
    attitude,
    moments,
    product,
    times,
    transposed,
    turn,
)
from exugear.kernels.kinematics import (
    BASE_PITCH,
    BODY_1,
    BODY_2,
    CONTACT_AXES,
    REFERENCE_1,
    REFERENCE_2,
    reference_line,
    spatial_frame,
)
from fem.support.numba_cache import compiled, kept
from fem.support.validation import require
from fem.units import mm

#: Largest angle between pinion and wheel, and from global z, that counts as a tilt [rad].
TILT = 0.05
#: Least angle between the z axis of an Rxyz body and global x [rad].
LOCK = 0.1
E_Z = np.array([0.0, 0.0, 1.0])
#: Numbers of a body: rotational reference coordinates (4), body axes of the gear (9), coordinates that count turns (2).
GEAR_AXES, WINDS = 4, 13


@compiled
def matrix_at(frame, start):
    """The matrix (9) of a frame that begins at start."""
    return (
        (frame[start], frame[start + 1], frame[start + 2]),
        (frame[start + 3], frame[start + 4], frame[start + 5]),
        (frame[start + 6], frame[start + 7], frame[start + 8]),
    )


@kept
def angles_of(matrix):
    """Angles a, b, c of Rx(a) Ry(b) Rz(c), of any multiple of it."""
    (x, y, z), (_, _, w), (_, _, u) = matrix
    return atan2(-w, u), atan2(z, hypot(w, u)), atan2(-y, x)


@compiled
def rotational(kind, x):
    """The rotational coordinates (4) among those of a body (7)."""
    return x[3], x[4], x[5], x[6] if kind == EULER else 0.0


@compiled
def seven_of(x, i, kind):
    """Coordinates (7) of the body that begins at i, zeros behind them."""
    if kind == SPIN_ALONE:
        return 0.0, 0.0, 0.0, 0.0, 0.0, x[i], 0.0
    if kind == IN_PLANE:
        return x[i], x[i + 1], 0.0, 0.0, 0.0, x[i + 2], 0.0
    return x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4], x[i + 5], x[i + 6] if kind == EULER else 0.0


@compiled
def six_in_frame(frame, body, reference, kind, q, v):
    """Displacements (6) and velocities (6) of a body in the contact frame, and what takes its forces back."""
    axes = transposed(matrix_at(frame, CONTACT_AXES))
    d = rotational(kind, q)
    p = frame[body] + d[0], frame[body + 1] + d[1], frame[body + 2] + d[2], frame[body + 3] + d[3]
    matrix = attitude(kind, p)
    a, b, c = angles_of(product(axes, product(matrix, matrix_at(frame, body + GEAR_AXES))))
    counted, spin = frame[body + WINDS] * q[3] + frame[body + WINDS + 1] * q[5], c - frame[reference + 5]
    spin += 2.0 * pi * floor((counted - spin) / (2.0 * pi) + 0.5)
    x, y, z = times(axes, (q[0], q[1], q[2]))
    u, v_y, w = times(axes, (v[0], v[1], v[2]))
    turning = times(axes, turn(kind, p, matrix, rotational(kind, v)))
    c_t = (cos(a) * turning[2] - sin(a) * turning[1]) / cos(b)
    a_t, b_t = turning[0] - sin(b) * c_t, cos(a) * turning[1] + sin(a) * turning[2]
    displaced = x, y, z, a - frame[reference + 3], b - frame[reference + 4], spin
    return displaced, (u, v_y, w, a_t, b_t, c_t), (p, matrix, a, b)


@compiled
def forces_of(frame, kind, standing, forces):
    """Generalized forces (7) on the body's coordinates of those (6) in the contact frame."""
    p, matrix, a, b = standing
    axes = matrix_at(frame, CONTACT_AXES)
    along = (forces[5] - sin(b) * forces[3]) / cos(b)
    moment = forces[3], cos(a) * forces[4] - sin(a) * along, sin(a) * forces[4] + cos(a) * along
    x, y, z = times(axes, (forces[0], forces[1], forces[2]))
    e, f, g, h = moments(kind, p, matrix, times(axes, moment))
    return x, y, z, e, f, g, h


@compiled
def seen(frame, body, reference, kind, q, v):
    """The same of any body: one in the plane stands along z as it is."""
    if kind >= RXYZ:
        return six_in_frame(frame, body, reference, kind, q, v)
    upright = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    return q[:6], v[:6], ((0.0, 0.0, 0.0, 0.0), upright, 0.0, 0.0)


@compiled
def bodies_seen(frame, kind_1, kind_2, size_1, size_2, x):
    """Displacements and velocities of both bodies in the contact frame, and what takes their forces back."""
    both = size_1 + size_2
    first = seven_of(x, 0, kind_1), seven_of(x, both, kind_1)
    second = seven_of(x, size_1, kind_2), seven_of(x, both + size_1, kind_2)
    q_1, v_1, standing_1 = seen(frame, BODY_1, REFERENCE_1, kind_1, *first)
    q_2, v_2, standing_2 = seen(frame, BODY_2, REFERENCE_2, kind_2, *second)
    return (q_1, q_2, v_1, v_2), standing_1, standing_2


@compiled
def given_back(frame, kind, standing, forces):
    """Generalized forces (7) on the body's coordinates, of any body."""
    if kind >= RXYZ:
        return forces_of(frame, kind, standing, forces)
    return forces[0], forces[1], forces[2], forces[3], forces[4], forces[5], 0.0


@dataclass(frozen=True, eq=False)
class GearBody:
    """What carries a gear: kind, reference coordinates of its node, the gear's axis (3) and centre (3) on the body."""

    kind: int
    reference: np.ndarray
    axis: np.ndarray
    position: np.ndarray

    @property
    def matrix(self) -> np.ndarray:
        """(3, 3) attitude in the reference configuration."""
        return np.array(attitude(self.kind, tuple(np.append(self.reference[3:], 0.0)[:4])))

    @property
    def direction(self) -> np.ndarray:
        """(3,) of the gear's axis there."""
        return self.matrix @ self.axis

    @property
    def axial(self) -> float:
        """Place of the gear's centre along its axis [m]."""
        return float(self.position @ self.axis)

    def along(self, z: np.ndarray) -> "GearBody":
        """The same with the sense of the axis that agrees with z."""
        return self if self.direction @ z > 0 else replace(self, axis=-self.axis)


def frame_between(pair, phase: float, direction: int, bodies: tuple[GearBody, GearBody]) -> np.ndarray:
    """The numbers of two bodies, one of them at least in space; ValueError where they do not carry the pair."""
    upright = any(body.kind < RXYZ for body in bodies)
    z = E_Z if upright else bodies[0].direction
    bodies = bodies[0].along(z), bodies[1].along(z)
    _check_parallel(*bodies)
    global_z = bool(bodies[0].direction @ E_Z > np.cos(TILT))
    axes = np.eye(3) if global_z else bodies[0].matrix @ axes_about(bodies[0].axis)
    seated = [_in_frame(axes, body) for body in bodies]
    axial = [body.axial for body in bodies]
    check_distance(pair, reference_line(axial, seated))
    frame = spatial_frame(pair, phase, direction, axial, seated)
    if global_z and all(body.kind <= RXYZ and body.axis[2] == 1 for body in bodies):
        return frame
    frame[CONTACT_AXES:BODY_1] = axes.ravel()
    winds = [_winds(body) for body in bodies]
    for start, body, wind in zip((BODY_1, BODY_2), bodies, winds, strict=True):
        rotational = np.append(body.reference[3:], 0.0)[:4]
        frame[start : start + BODY_2 - BODY_1] = np.r_[rotational, axes_about(body.axis).ravel(), wind]
    counted = all(any(wind) for wind in winds)
    frame[BASE_PITCH] = 0.0 if counted else 2 * pi * pair.pinion.r_b / pair.pinion.z
    return frame


def axes_about(z: np.ndarray) -> np.ndarray:
    """(3, 3) rotation that turns e_z into z; the identity and the cyclic ones where z is a coordinate axis."""
    x = np.eye(3)[(int(np.argmax(np.abs(z))) + 1) % 3]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.c_[x, np.cross(z, x), z]


def check_distance(pair, line: np.ndarray) -> None:
    """Require the pair's centre distance, and faces that meet."""
    distance, shift = hypot(line[0], line[1]), line[2]
    a = abs(pair.a)
    agree = abs(distance - a) < 1e-6 * a
    remedy = f"the pair's a = {a / mm:.6g} mm; move the bodies or change a"
    require(agree, f"reference distance of the gear centres, {distance / mm:.6g} mm, must be {remedy}")
    apart = f"gear centres are {shift / mm:g} mm apart along z (face width {pair.b / mm:g} mm)"
    require(abs(shift) < pair.b, f"{apart}; move the bodies or localPositions")


def _in_frame(axes: np.ndarray, body: GearBody) -> np.ndarray:
    """Reference coordinates (6) of a body as Rxyz body of the contact frame."""
    matrix = axes.T @ body.matrix @ axes_about(body.axis)
    return np.r_[axes.T @ body.reference[:3], angles_of(tuple(map(tuple, matrix)))]


def _check_parallel(pinion: GearBody, wheel: GearBody) -> None:
    angle = hypot(*np.cross(pinion.direction, wheel.direction))
    skew = (
        f"axes of pinion and wheel must be parallel within {TILT} rad in the reference configuration, got {angle:.4g}"
    )
    remedy = "turn one body by referenceRotationMatrix, or give its gear's axis in localAxes"
    require(bool(angle < TILT), f"{skew}; {remedy}")


def _winds(body: GearBody) -> tuple[float, float]:
    """Factors of the fourth and sixth coordinate that count the body's turns about the gear's axis; 0: none does.

    An Rxyz node is singular where its z axis points along global x, and there turns are counted no more.
    """
    if body.kind in (EULER, VECTOR):
        return 0.0, 0.0
    if body.kind < RXYZ:
        return 0.0, 1.0
    from_x, from_z = float(body.direction[0]), float(body.axis[2])
    apart = abs(np.arccos(min(abs(from_x), 1)) - np.arccos(min(abs(from_z), 1)))
    lock = "a body on an Rxyz node must not turn its z axis into global x, where the node is singular"
    remedy = "use nodeType=exu.NodeType.RotationRotationVector, or lay the gear's axis along another axis of the body"
    example = "for a shaft along x no referenceRotationMatrix and localAxes=[[1, 0, 0], [1, 0, 0]]"
    require(bool(apart > LOCK), f"{lock}; {remedy}: {example}")
    return (0.0, float(np.sign(from_z))) if abs(from_z) > abs(from_x) else (float(np.sign(from_x)), 0.0)
