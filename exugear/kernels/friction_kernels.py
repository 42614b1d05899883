"""The kernels of `exugear.MeshFriction`: from the mesh force, the phase and the speeds to generalized forces."""

from functools import cache
from math import cos, floor, sin, tanh

from numba import carray

from exugear.force_table.force_kernels import spinning_force, static_force, table_at
from exugear.force_table.kernel_records import doubles_at, reader, start_of
from exugear.kernels.body_motion import SIZES, forces_on, motions_of
from exugear.kernels.contact_kernels import SPIN, codes_of
from exugear.kernels.contact_records import frame_at
from exugear.kernels.kinematics import added, dot, flank_of, position_of, row_of, scaled
from exugear.mesh_force.friction import FRICTION
from fem.support.numba_cache import compiled, kept

FRICTION_SIZE = FRICTION.itemsize
friction_at = reader(FRICTION)


@compiled
def coefficient(friction, force, speed):
    """Coefficient of friction over cos(beta_b), as `PowerLaw.at`."""
    if friction.exponent == 0.0:
        return friction.factor
    sum_speed = min(max(abs(speed) * friction.sum_speed, friction.slowest), friction.fastest)
    return friction.factor * (max(force, friction.least_force) / sum_speed) ** friction.exponent


@compiled
def friction_forces(friction, phase, force, speed):
    """Force along t [N] and moment about z [N m] on the wheel, t as in `exugear.mesh_force.friction`.

    force   static mesh force [N]
    speed   omega_1 - omega_2 [rad/s]
    """
    n = friction.steps
    pull_and_lever = carray(doubles_at(start_of(friction) + FRICTION_SIZE), (2, n))
    x = (phase - floor(phase)) * n
    i = min(int(x), n - 1)
    following, t = (i + 1) % n, x - i
    size = coefficient(friction, force, speed) * force * tanh(speed / friction.speed)
    pull = (1.0 - t) * pull_and_lever[0, i] + t * pull_and_lever[0, following]
    return size * pull, size * ((1.0 - t) * pull_and_lever[1, i] + t * pull_and_lever[1, following])


@compiled
def rotational_friction(table, frame, friction, q_1, q_2, v_1, v_2):
    """Torques (2) [N m] on two rotational coordinates."""
    d, r_1, r_2 = frame.direction, frame.pinion.r_b, frame.wheel.r_b
    lead = d * (r_1 * q_1 + r_2 * q_2)
    flank = flank_of(table, lead, 0.0, d * frame.pitches_per_radian * q_1 + frame.phase)
    static = spinning_force(table, flank.phase, flank.deflection)
    push, moment = friction_forces(friction, flank.phase, static.force, v_1 - v_2)
    push *= friction.tan_alpha_wt
    return -r_1 * push - moment, -r_2 * push + moment


@compiled
def spatial_friction(table, frame, friction, q_1, q_2, v_1, v_2):
    """Generalized forces (6), (6) on two Rxyz bodies."""
    position = position_of(table, frame, q_1, q_2)
    pinion, wheel, flank, n = position.pinion, position.wheel, position.flank, position.normal
    static = static_force(table, flank.phase, flank.deflection, *position.offsets)
    spin_1, spin_2 = spin_row(pinion.a, pinion.b), spin_row(wheel.a, wheel.b)
    push, moment = friction_forces(friction, flank.phase, static.force, dot(spin_1, v_1) - dot(spin_2, v_2))
    (x, y), r_w, z = position.line.e_r, position.r_w, flank.side * frame.direction * static.centroid
    point = (pinion.centre[0] + r_w * x, pinion.centre[1] + r_w * y, pinion.centre[2] + z)
    t = (-n[1], n[0], 0.0)
    row_1, row_2 = row_of(pinion, point, t), row_of(wheel, point, t)
    return added(scaled(row_1, -push), scaled(spin_1, -moment)), added(scaled(row_2, push), scaled(spin_2, moment))


@compiled
def spin_row(a, b):
    """Row (6) of an Rxyz body for a unit moment about z; row . velocity is the angular velocity about z."""
    return 0.0, 0.0, 0.0, 0.0, sin(a), cos(a) * cos(b)


@cache
def friction_of(kinds: tuple[str, ...], rotated: bool = False):
    """The function (table, frame, friction, t, *coordinates, *velocities) -> generalized forces of two bodies.

    The first three are addresses: of a table's head, a contact frame and a friction record. rotated: whether the
    contact frame is rotated against the global one.
    """
    if kinds == (SPIN, SPIN) and not rotated:
        return spin_friction
    return _spatial_friction(*codes_of(kinds, rotated))


@kept
def spin_friction(table, frame, friction, t, q_1, q_2, v_1, v_2):
    """Torques of friction on two bodies that spin about fixed axes."""
    return rotational_friction(table_at(table), frame_at(frame), friction_at(friction), q_1, q_2, v_1, v_2)


def _spatial_friction(kind_1: int, kind_2: int):
    """The compiled friction of two kinds of bodies; it encloses numbers only, as `contact_kernels._spatial_contact`."""
    n_1, n_2 = SIZES[kind_1], SIZES[kind_2]

    @kept
    def friction_between(table, frame, friction, t, *x):
        geometry = frame_at(frame)
        pinion, wheel = motions_of(geometry, kind_1, kind_2, n_1, n_2, x)
        forces_1, forces_2 = spatial_friction(
            table_at(table), geometry, friction_at(friction), pinion.q, wheel.q, pinion.v, wheel.v
        )
        f = forces_on(geometry, kind_1, pinion.orientation, forces_1)
        g = forces_on(geometry, kind_2, wheel.orientation, forces_2)
        on_pinion = (f[5],) if n_1 == 1 else (f[0], f[1], f[5]) if n_1 == 3 else f[:n_1]
        on_wheel = (g[5],) if n_2 == 1 else (g[0], g[1], g[5]) if n_2 == 3 else g[:n_2]
        return on_pinion + on_wheel

    return friction_between
