"""The kernels of `exugear.MeshFriction`: from the mesh force, the phase and the speeds to generalized forces."""

from functools import cache
from math import floor, tanh

from numba import carray

from exugear.contact_geometry.body_motion import SIZES, forces_on, motions_of
from exugear.contact_geometry.contact_records import frame_at
from exugear.contact_geometry.relative_position import flank_of, normal_of, pitch_share, position_of, row_of
from exugear.contact_geometry.vectors import cross, row_dot, row_scaled, row_total, scaled, total
from exugear.force_table.force_kernels import centroid_of, spinning_force, static_force
from exugear.force_table.kernel_records import doubles_at, reader, start_of
from exugear.force_table.patches import table_at
from exugear.kernels.contact_kernels import SPIN, codes_of
from exugear.mesh_force.friction import FRICTION
from fem.support.numba_cache import compiled, kept

FRICTION_SIZE = FRICTION.itemsize
friction_at = reader(FRICTION)


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
    size = friction.coefficient * force * tanh(speed / friction.speed)
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
    pinion, wheel, flank, n = position.pinion, position.wheel, position.flank, normal_of(frame, position)
    static = static_force(table, flank.phase, flank.deflection, *position.offsets)
    z, no_force = pinion.z, (0.0, 0.0, 0.0)
    spin_1, spin_2 = row_of(pinion, no_force, z), row_of(wheel, no_force, z)
    push, moment = friction_forces(friction, flank.phase, static.force, row_dot(spin_1, v_1) - row_dot(spin_2, v_2))
    along = scaled(flank.side * frame.direction * centroid_of(static), z)
    from_pinion = total(scaled(pitch_share(frame), position.line), along)
    from_wheel = total(from_pinion, total(pinion.centre, scaled(-1.0, wheel.centre)))
    t = cross(z, n)
    row_1, row_2 = row_of(pinion, t, cross(from_pinion, t)), row_of(wheel, t, cross(from_wheel, t))
    on_pinion = row_total(row_scaled(-push, row_1), row_scaled(-moment, spin_1))
    return on_pinion, row_total(row_scaled(push, row_2), row_scaled(moment, spin_2))


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
