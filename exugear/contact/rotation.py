"""Kinds of bodies that carry gears: their coordinates, attitude, angular velocity and generalized forces.

Matrices are tuples of three rows; moments and angular velocities are components along the global axes. Rotational
coordinates are passed as four numbers, unused ones as 0: angles of Rx(a) Ry(b) Rz(c); Euler parameters; or a rotation
vector, whose rates are the angular velocity along the axes of the body.
"""

from collections.abc import Callable
from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np

from fem.support.numba_cache import compiled, kept

#: Angle [rad] below which series of two terms are exact.
SMALL_ANGLE = 1e-4


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


class BodyKind(NamedTuple):
    """A kind of body that carries a gear.

    name            in messages
    code            for compiled code: kinds below `RXYZ` spin about z of the contact frame, those beyond it do not
                    count their turns
    components      that are its coordinates, in their order: 0, 1, 2 of the displacement, 3 to 6 of the rotation, of
                    which 5 is the spin of kinds up to `RXYZ`
    angular_rates   (3, 3) rates per time derivative of its rotational coordinates (3), where the former are no
                    derivatives but angular velocities
    """

    name: str
    code: int
    components: tuple[int, ...]
    angular_rates: Callable[[np.ndarray], np.ndarray] | None = None

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.components)

    @property
    def turns_about_z(self) -> bool:
        """Whether it spins about z of the contact frame."""
        return self.code < RXYZ

    @property
    def counts_turns(self) -> bool:
        """Whether a coordinate counts its turns."""
        return self.code <= RXYZ


#: Codes of the kinds. An upright body is a spatial one in a contact frame that is not rotated: its coordinates are
#: displacements and angles in that frame, and its attitude need not be computed.
SPIN_ALONE, IN_PLANE, UPRIGHT, RXYZ, EULER, VECTOR = range(6)
SPIN = BodyKind("spin", SPIN_ALONE, (5,))
PLANAR = BodyKind("planar", IN_PLANE, (0, 1, 5))
SPATIAL = BodyKind("spatial", RXYZ, (0, 1, 2, 3, 4, 5))
PARAMETERS = BodyKind("Euler parameters", EULER, (0, 1, 2, 3, 4, 5, 6))
ROTATION_VECTOR = BodyKind("rotation vector", VECTOR, (0, 1, 2, 3, 4, 5), velocity_by_vector)
#: Kinds by their codes.
KINDS = {x.code: x for x in (SPIN, PLANAR, SPATIAL._replace(code=UPRIGHT), SPATIAL, PARAMETERS, ROTATION_VECTOR)}
_components = [KINDS[code].components for code in sorted(KINDS)]
#: For compiled code, by kind: positions of the components (7) among its coordinates, -1 of those that it lacks, and
#: components of its coordinates, followed by 0 up to a number of 7.
POSITIONS = tuple(tuple(x.index(i) if i in x else -1 for i in range(7)) for x in _components)
COMPONENTS = tuple(x + (0,) * (7 - len(x)) for x in _components)


def code_of(kind: BodyKind, *, rotated: bool) -> int:
    """The code of a body in a contact frame that is rotated or not."""
    return UPRIGHT if kind == SPATIAL and not rotated else kind.code


@compiled
def component(x, i, position):
    """The component at a position among the coordinates of a body, which begin at i; 0 where the body lacks it."""
    return x[i + position] if position >= 0 else 0.0


@compiled
def coordinates_of(x, i, kind):
    """Components (7) of the body whose coordinates in x begin at i; displacements and tilts that it lacks are 0."""
    p = POSITIONS[kind]
    return (
        component(x, i, p[0]),
        component(x, i, p[1]),
        component(x, i, p[2]),
        component(x, i, p[3]),
        component(x, i, p[4]),
        component(x, i, p[5]),
        component(x, i, p[6]),
    )


@compiled
def on_coordinates(kind, forces):
    """Generalized forces (7) whose first are those on the coordinates of a body, from those (7) on all components."""
    c = COMPONENTS[kind]
    return forces[c[0]], forces[c[1]], forces[c[2]], forces[c[3]], forces[c[4]], forces[c[5]], forces[c[6]]


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
