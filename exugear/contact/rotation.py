"""Kinds of bodies of Exudyn and their attitude: rotation matrix, angular velocity and generalized moments.

Matrices are tuples of three rows; moments and angular velocities are components along the global axes. Rotational
coordinates are passed as four numbers, unused ones as 0: angles of Rx(a) Ry(b) Rz(c); Euler parameters; or a rotation
vector, whose rates are the angular velocity along the axes of the body.
"""

from math import cos, sin, sqrt

import numpy as np

from fem.support.numba_cache import compiled, kept

#: Kinds of bodies for compiled code. In a rotated contact frame the attitude of those from RXYZ on has to be computed;
#: those beyond RXYZ do not count turns.
SPIN_ALONE, IN_PLANE, UPRIGHT, RXYZ, EULER, VECTOR = 1, 3, 5, 6, 7, 8
#: Number of coordinates of each kind of body.
SIZES = {SPIN_ALONE: 1, IN_PLANE: 3, UPRIGHT: 6, RXYZ: 6, EULER: 7, VECTOR: 6}
#: Names of the kinds.
SPIN, PLANAR, SPATIAL = "spin", "planar", "spatial"
PARAMETERS, ROTATION_VECTOR = "Euler parameters", "rotation vector"
CODES = {SPIN: SPIN_ALONE, PLANAR: IN_PLANE, SPATIAL: RXYZ, PARAMETERS: EULER, ROTATION_VECTOR: VECTOR}

#: Angle [rad] below which series of two terms are exact.
SMALL_ANGLE = 1e-4


@compiled
def times(m, v):
    """Matrix times vector."""
    return (
        m[0][0] * v[0] + m[0][1] * v[1] + m[0][2] * v[2],
        m[1][0] * v[0] + m[1][1] * v[1] + m[1][2] * v[2],
        m[2][0] * v[0] + m[2][1] * v[1] + m[2][2] * v[2],
    )


@compiled
def transposed(m):
    """The transposed matrix."""
    return (m[0][0], m[1][0], m[2][0]), (m[0][1], m[1][1], m[2][1]), (m[0][2], m[1][2], m[2][2])


@compiled
def product(m, n):
    """Matrix times matrix."""
    columns = transposed(n)
    return transposed((times(m, columns[0]), times(m, columns[1]), times(m, columns[2])))


@compiled
def by_angles(p):
    """Rotation matrix Rx(a) Ry(b) Rz(c) of the angles p = (a, b, c, ...)."""
    a, b, s, t = p[0], p[1], sin(p[2]), cos(p[2])
    return (
        (cos(b) * t, -cos(b) * s, sin(b)),
        (cos(a) * s + sin(a) * sin(b) * t, cos(a) * t - sin(a) * sin(b) * s, -sin(a) * cos(b)),
        (sin(a) * s - cos(a) * sin(b) * t, sin(a) * t + cos(a) * sin(b) * s, cos(a) * cos(b)),
    )


@compiled
def by_parameters(p):
    """Rotation matrix of Euler parameters, times their squared length."""
    e, f, g, h = p
    return (
        (e * e + f * f - g * g - h * h, 2 * (f * g - e * h), 2 * (f * h + e * g)),
        (2 * (f * g + e * h), e * e - f * f + g * g - h * h, 2 * (g * h - e * f)),
        (2 * (f * h - e * g), 2 * (g * h + e * f), e * e - f * f - g * g + h * h),
    )


@compiled
def by_vector(p):
    """Rotation matrix of a rotation vector, whose length is the angle, by way of Euler parameters."""
    half = 0.5 * sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2])
    share = 0.5 * sin(half) / half if half > 1e-9 else 0.5
    return by_parameters((cos(half), share * p[0], share * p[1], share * p[2]))


@kept
def attitude(kind, p):
    """Rotation matrix of a body with rotational coordinates p (4)."""
    if kind == EULER:
        return by_parameters(p)
    return by_vector(p) if kind == VECTOR else by_angles(p)


@compiled
def angular_velocity(kind, p, matrix, v):
    """Angular velocity (3) [rad/s] at rates v (4) of the rotational coordinates p (4)."""
    if kind == EULER:
        e, f, g, h = p
        return (
            2.0 * (-f * v[0] + e * v[1] - h * v[2] + g * v[3]),
            2.0 * (-g * v[0] + h * v[1] + e * v[2] - f * v[3]),
            2.0 * (-h * v[0] - g * v[1] + f * v[2] + e * v[3]),
        )
    if kind == VECTOR:
        return times(matrix, (v[0], v[1], v[2]))
    s, c = sin(p[0]), cos(p[0])
    return v[0] + matrix[0][2] * v[2], c * v[1] + matrix[1][2] * v[2], s * v[1] + matrix[2][2] * v[2]


@compiled
def moments(kind, p, matrix, m):
    """Generalized moments (4) of a moment m (3) [N m]; with the rates they have the power m . `angular_velocity`."""
    if kind == EULER:
        e, f, g, h = p
        return (
            2.0 * (-f * m[0] - g * m[1] - h * m[2]),
            2.0 * (e * m[0] + h * m[1] - g * m[2]),
            2.0 * (-h * m[0] + e * m[1] + f * m[2]),
            2.0 * (g * m[0] - f * m[1] + e * m[2]),
        )
    if kind == VECTOR:
        x, y, z = times(transposed(matrix), m)
        return x, y, z, 0.0
    z = matrix[0][2] * m[0] + matrix[1][2] * m[1] + matrix[2][2] * m[2]
    return m[0], cos(p[0]) * m[1] + sin(p[0]) * m[2], z, 0.0


def velocity_by_vector(vector: np.ndarray) -> np.ndarray:
    """(3, 3) angular velocity along the axes of a body = matrix . time derivative of its rotation vector (3).

    Source: Bullo and Murray, Proportional derivative control on the Euclidean group, ECC (1995).
    """
    x, y, z = vector.tolist()
    crossed = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = sqrt(x * x + y * y + z * z)
    if angle < SMALL_ANGLE:
        return np.eye(3) - crossed / 2 + crossed @ crossed / 6
    return np.eye(3) - (1 - cos(angle)) / angle**2 * crossed + (angle - sin(angle)) / angle**3 * crossed @ crossed
