"""The kernels of `exugear.MeshFriction`: from the mesh force, the phase and the speeds to generalized forces."""

from functools import cache
from math import cos, floor, sin, tanh

from numba import carray

from exugear.kernels.contact_frame import bodies_seen, given_back
from exugear.kernels.contact_kernels import CODES, SIZES, SPIN, bodies_of, table
from exugear.kernels.kinematics import (
    DIRECTION,
    FRAME,
    PHASE,
    R_B1,
    R_B2,
    TURNS,
    added,
    dot,
    flank_of,
    meeting,
    row_of,
    scaled,
)
from exugear.kernels.recorder import at
from exugear.mesh_force.force_kernels import static_force
from fem.support.numba_cache import compiled, kept

#: Numbers of `MeshFriction.numbers`, which follow those of the frame, and where its tables begin.
COEFFICIENT, SPEED, TAN_ALPHA, STEPS, TABLES = (FRAME + i for i in range(5))


@compiled
def framed(frame):
    """The array of the frame and the friction behind it."""
    return carray(at(frame), TABLES + 2 * int(carray(at(frame), TABLES)[STEPS]))


@compiled
def rubbing(frame, phase, force, speed):
    """(push along t [N], moment about z [N m]) on the wheel; speed omega_1 - omega_2."""
    n = int(frame[STEPS])
    x = (phase - floor(phase)) * n
    i = min(int(x), n - 1)
    a, b, t = TABLES + i, TABLES + (i + 1) % n, x - i
    size = frame[COEFFICIENT] * force * tanh(speed / frame[SPEED])
    return size * ((1.0 - t) * frame[a] + t * frame[b]), size * ((1.0 - t) * frame[a + n] + t * frame[b + n])


@compiled
def rotational_friction(law, frame, q_1, q_2, v_1, v_2):
    """Torques (2) [N m] on two rotational coordinates."""
    d, r_1, r_2 = frame[DIRECTION], frame[R_B1], frame[R_B2]
    lead = d * (r_1 * q_1 + r_2 * q_2)
    _, deflection, phase = flank_of(law, lead, 0.0, d * frame[TURNS] * q_1 + frame[PHASE])
    _, force, _, _ = static_force(law, phase, deflection, 0.0, 0.0, 0.0)
    push, moment = rubbing(frame, phase, force, v_1 - v_2)
    push *= frame[TAN_ALPHA]
    return -r_1 * push - moment, -r_2 * push + moment


@compiled
def spatial_friction(law, frame, q_1, q_2, v_1, v_2):
    """Generalized forces (6), (6) on two Rxyz bodies."""
    _, (side, deflection, phase), (x, y, _, r_w), n, offsets, bodies = meeting(law, frame, q_1, q_2)
    _, force, centroid, _ = static_force(law, phase, deflection, *offsets)
    (pole_1, a_1, b_1, _, centre_1), (pole_2, a_2, b_2, _, _) = bodies
    spin_1, spin_2 = turn_of(a_1, b_1), turn_of(a_2, b_2)
    push, moment = rubbing(frame, phase, force, dot(spin_1, v_1) - dot(spin_2, v_2))
    contact = (centre_1[0] + r_w * x, centre_1[1] + r_w * y, centre_1[2] + side * frame[DIRECTION] * centroid)
    t = (-n[1], n[0], 0.0)
    row_1, row_2 = row_of(pole_1, contact, t, a_1, b_1), row_of(pole_2, contact, t, a_2, b_2)
    return added(scaled(row_1, -push), scaled(spin_1, -moment)), added(scaled(row_2, push), scaled(spin_2, moment))


@compiled
def turn_of(a, b):
    """Row (6) of one Rxyz body for a unit moment about z; times its velocity: how fast it turns about z."""
    return 0.0, 0.0, 0.0, 0.0, sin(a), cos(a) * cos(b)


@cache
def friction_of(kinds: tuple[str, ...], turned: bool = False):
    """The function (law, frame, record, t, *coordinates, *velocities) -> generalized forces of two bodies.

    Addresses of law, and frame with the friction's numbers behind it; turned bodies have a contact frame of their own.
    """
    if turned:
        return _turned(*(CODES[kind] for kind in kinds), *(SIZES[kind] for kind in kinds))
    return rotational if kinds == (SPIN, SPIN) else _general(*(SIZES[kind] for kind in kinds))


@kept
def rotational(law, frame, record, t, q_1, q_2, v_1, v_2):
    """Torques of friction on two bodies that spin about resting axes."""
    return rotational_friction(table(law), framed(frame), q_1, q_2, v_1, v_2)


def _general(n_1: int, n_2: int):
    @kept
    def general(law, frame, record, t, *x):
        row_1, row_2 = spatial_friction(table(law), framed(frame), *bodies_of(x, n_1, n_2))
        one = (row_1[5],) if n_1 == 1 else (row_1[0], row_1[1], row_1[5]) if n_1 == 3 else row_1
        other = (row_2[5],) if n_2 == 1 else (row_2[0], row_2[1], row_2[5]) if n_2 == 3 else row_2
        return one + other

    return general


def _turned(kind_1: int, kind_2: int, n_1: int, n_2: int):
    """The same of bodies that stand in a contact frame of their own."""

    @kept
    def turned(law, frame, record, t, *x):
        numbers = framed(frame)
        motion, standing_1, standing_2 = bodies_seen(numbers, kind_1, kind_2, n_1, n_2, x)
        row_1, row_2 = spatial_friction(table(law), numbers, *motion)
        back_1 = given_back(numbers, kind_1, standing_1, row_1)
        back_2 = given_back(numbers, kind_2, standing_2, row_2)
        one = (back_1[5],) if n_1 == 1 else (back_1[0], back_1[1], back_1[5]) if n_1 == 3 else back_1[:n_1]
        other = (back_2[5],) if n_2 == 1 else (back_2[0], back_2[1], back_2[5]) if n_2 == 3 else back_2[:n_2]
        return one + other

    return turned
