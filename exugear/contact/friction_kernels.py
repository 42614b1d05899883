"""The kernels of `exugear.MeshFriction`: from the mesh force, the phase and the speeds to generalized forces."""

from functools import cache
from math import floor, log, tanh
from typing import NamedTuple

from numba import carray

from exugear.contact.body_motion import SIZES, forces_on, motions_of
from exugear.contact.contact_kernels import SPIN, codes_of
from exugear.contact.contact_records import frame_at, state_at
from exugear.contact.relative_position import Row, flank_of, normal_of, pitch_share, position_of, row_of
from exugear.contact.vectors import cross, row_dot, row_scaled, row_total, scaled, total
from exugear.mesh_force.force_kernels import centroid_of, spinning_force, static_force
from exugear.mesh_force.kernel_records import doubles_at, reader, start_of
from exugear.mesh_force.mesh_friction import FRICTION
from exugear.mesh_force.patches import table_at, table_of
from fem.support.numba_cache import compiled, kept

FRICTION_SIZE = FRICTION.itemsize
friction_at = reader(FRICTION)


class SlidingFriction(NamedTuple):
    """Force on the wheel along t [N], power that friction dissipates [W], generalized forces on pinion and wheel."""

    force: float
    loss: float
    pinion: Row
    wheel: Row


class SpinFriction(NamedTuple):
    """Force on the wheel along t [N], power that friction dissipates [W], torques on pinion and wheel [N m]."""

    force: float
    loss: float
    torques: tuple[float, float]


@compiled
def coefficient(friction, force, speed):
    """Coefficient of friction over cos(beta_b), as `PowerLaw.at`."""
    if friction.exponent == 0.0:
        return friction.factor
    sum_speed = min(max(abs(speed) * friction.sum_speed, friction.slowest), friction.fastest)
    limited = min(max(force, friction.least_force), friction.largest_force)
    return friction.factor * (limited / sum_speed) ** friction.exponent


@compiled
def friction_forces(friction, phase, force, speed):
    """Force along t [N] and moment about z [N m] on the wheel, t as in `exugear.mesh_force.mesh_friction`.

    force   static mesh force [N]
    speed   omega_1 - omega_2 [rad/s]
    """
    if force <= 0.0:
        return 0.0, 0.0
    size = coefficient(friction, force, speed) * force * tanh(speed / friction.speed)
    pull, lever = pull_and_lever(friction, phase, force)
    return size * pull, size * lever


@compiled
def pull_and_lever(friction, phase, force):
    """Values of the tables, linear over phase and over ln of the force."""
    n, m = friction.steps, friction.rows
    tables = carray(doubles_at(start_of(friction) + FRICTION_SIZE), (2, m, n))
    x = (phase - floor(phase)) * n
    i = min(int(x), n - 1)
    following, t = (i + 1) % n, x - i
    if m == 1:
        return along_phase(tables[0, 0], i, following, t), along_phase(tables[1, 0], i, following, t)
    y = min(max((log(force) - friction.log_first) / friction.log_step, 0.0), m - 1.0)
    j = min(int(y), m - 2)
    w = y - j
    pull = (1.0 - w) * along_phase(tables[0, j], i, following, t) + w * along_phase(tables[0, j + 1], i, following, t)
    lever = (1.0 - w) * along_phase(tables[1, j], i, following, t) + w * along_phase(tables[1, j + 1], i, following, t)
    return pull, lever


@compiled
def along_phase(row, i, following, t):
    """Value of a row of a table, linear over the phase."""
    return (1.0 - t) * row[i] + t * row[following]


@compiled
def friction_of_spins(friction, frame, phase, force, v_1, v_2):
    """`SpinFriction` of two rotational coordinates with speeds v_1, v_2 [rad/s]; phase, force: `friction_forces`."""
    push, moment = friction_forces(friction, phase, force, v_1 - v_2)
    on_pitch_circles = friction.tan_alpha_wt * push
    torques = -frame.pinion.r_b * on_pitch_circles - moment, -frame.wheel.r_b * on_pitch_circles + moment
    return SpinFriction(push, -torques[0] * v_1 - torques[1] * v_2, torques)


@compiled
def rotational_friction(table, frame, friction, q_1, q_2, v_1, v_2):
    """Torques (2) [N m] on two rotational coordinates."""
    d = frame.direction
    advance = d * (frame.pinion.r_b * q_1 + frame.wheel.r_b * q_2)
    flank = flank_of(table, advance, 0.0, d * frame.pitches_per_radian * q_1 + frame.phase)
    static = spinning_force(table_of(table, flank.side), flank.phase, flank.deflection)
    return friction_of_spins(friction, frame, flank.phase, static.force, v_1, v_2).torques


@compiled
def friction_in_space(friction, frame, position, force, centroid, v_1, v_2):
    """`SlidingFriction` of two Rxyz bodies.

    force      static mesh force [N]
    centroid   z of the force centroid minus z of the pinion's mid-plane [m]
    """
    pinion, wheel = position.pinion, position.wheel
    z, no_force = pinion.z, (0.0, 0.0, 0.0)
    spin_1, spin_2 = row_of(pinion, no_force, z), row_of(wheel, no_force, z)
    speed = row_dot(spin_1, v_1) - row_dot(spin_2, v_2)
    push, moment = friction_forces(friction, position.flank.phase, force, speed)
    from_pinion = total(scaled(pitch_share(frame), position.line), scaled(centroid, z))
    from_wheel = total(from_pinion, total(pinion.centre, scaled(-1.0, wheel.centre)))
    t = cross(z, normal_of(frame, position))
    row_1, row_2 = row_of(pinion, t, cross(from_pinion, t)), row_of(wheel, t, cross(from_wheel, t))
    on_pinion = row_total(row_scaled(-push, row_1), row_scaled(-moment, spin_1))
    on_wheel = row_total(row_scaled(push, row_2), row_scaled(moment, spin_2))
    return SlidingFriction(push, -row_dot(on_pinion, v_1) - row_dot(on_wheel, v_2), on_pinion, on_wheel)


@compiled
def spatial_friction(table, frame, friction, q_1, q_2, v_1, v_2, before=(0.0, 1.0)):
    """Generalized forces (6), (6) on two Rxyz bodies; before: as for `position_of`."""
    position = position_of(table, frame, q_1, q_2, before)
    flank = position.flank
    static = static_force(table_of(table, flank.side), flank.phase, flank.deflection, *position.offsets)
    centroid = flank.side * frame.direction * centroid_of(static)
    forces = friction_in_space(friction, frame, position, static.force, centroid, v_1, v_2)
    return forces.pinion, forces.wheel


@cache
def friction_of(kinds: tuple[str, ...], rotated: bool = False):
    """The function (table, frame, state, friction, t, *coordinates, *velocities) -> generalized forces of two bodies.

    The first four are addresses: of the records of their contact (a table's head, a contact frame and a state) and of a
    friction record. rotated: whether the contact frame is rotated against the global one.
    """
    if kinds == (SPIN, SPIN) and not rotated:
        return spin_friction
    return _spatial_friction(*codes_of(kinds, rotated))


@kept
def spin_friction(table, frame, state, friction, t, q_1, q_2, v_1, v_2):
    """Torques of friction on two bodies that spin about fixed axes."""
    return rotational_friction(table_at(table), frame_at(frame), friction_at(friction), q_1, q_2, v_1, v_2)


def _spatial_friction(kind_1: int, kind_2: int):
    """The compiled friction of two kinds of bodies; it encloses numbers only, as `contact_kernels._spatial_contact`."""
    n_1, n_2 = SIZES[kind_1], SIZES[kind_2]

    @kept
    def friction_between(table, frame, state, friction, t, *x):
        geometry, contact = frame_at(frame), state_at(state)
        pinion, wheel = motions_of(geometry, kind_1, kind_2, n_1, n_2, x)
        forces_1, forces_2 = spatial_friction(
            table_at(table),
            geometry,
            friction_at(friction),
            pinion.q,
            wheel.q,
            pinion.v,
            wheel.v,
            (contact.advance, contact.begins),
        )
        f = forces_on(kind_1, pinion.orientation, forces_1)
        g = forces_on(kind_2, wheel.orientation, forces_2)
        on_pinion = (f[5],) if n_1 == 1 else (f[0], f[1], f[5]) if n_1 == 3 else f[:n_1]
        on_wheel = (g[5],) if n_2 == 1 else (g[0], g[1], g[5]) if n_2 == 3 else g[:n_2]
        return on_pinion + on_wheel

    return friction_between
