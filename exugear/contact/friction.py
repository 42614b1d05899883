"""Friction between the teeth (`exugear.MeshFriction`): from mesh force, phase and speeds to generalized forces."""

from math import floor, log, tanh
from typing import NamedTuple

from exugear.contact.relative_position import Row, normal_of, pitch_share, row_of
from exugear.contact.vectors import cross, row_dot, row_scaled, row_total, scaled, total
from exugear.mesh_force.force_kernels import centroid_of
from exugear.mesh_force.kernel_records import array_behind
from exugear.mesh_force.mesh_friction import FRICTION
from fem.support.numba_cache import compiled

FRICTION_SIZE = FRICTION.itemsize
NO_FORCES = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class SlidingFriction(NamedTuple):
    """Force on the wheel along t [N], power that friction dissipates [W], generalized forces on pinion and wheel.

    These are torques [N m] of bodies that spin, rows (6) of bodies in space.
    """

    force: float
    loss: float
    pinion: float | Row
    wheel: float | Row


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
    pull, lever = force_and_arm(friction, phase, force)
    return size * pull, size * lever


@compiled
def force_and_arm(friction, phase, force):
    """Values of the tables, linear over phase and over ln of the force."""
    n, m = friction.steps, friction.rows
    tables = array_behind(friction, FRICTION_SIZE, (2, m, n))
    cycles = phase * friction.per_pitches
    x = (cycles - floor(cycles)) * n
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
def friction_of_spins(friction, frame, push, v_1, v_2):
    """`SlidingFriction` of two bodies that spin with speeds v_1, v_2 [rad/s]; friction: its record, or None."""
    if friction is None:
        return SlidingFriction(0.0, 0.0, 0.0, 0.0)
    force, moment = friction_forces(friction, push.flank.phase, push.static.force, v_1 - v_2)
    on_pitch_circles = friction.tan_alpha_wt * force
    torque_1 = -frame.pinion.r_b * on_pitch_circles - moment
    torque_2 = -frame.wheel.r_b * on_pitch_circles + moment
    return SlidingFriction(force, -torque_1 * v_1 - torque_2 * v_2, torque_1, torque_2)


@compiled
def friction_in_space(friction, frame, position, push, v_1, v_2):
    """`SlidingFriction` of two Rxyz bodies; friction: its record, or None."""
    if friction is None:
        return SlidingFriction(0.0, 0.0, NO_FORCES, NO_FORCES)
    pinion, wheel = position.pinion, position.wheel
    z, no_force = pinion.z, (0.0, 0.0, 0.0)
    spin_1, spin_2 = row_of(pinion, no_force, z), row_of(wheel, no_force, z)
    speed = row_dot(spin_1, v_1) - row_dot(spin_2, v_2)
    force, moment = friction_forces(friction, push.flank.phase, push.static.force, speed)
    centroid = position.flank.side * frame.direction * centroid_of(push.static)
    from_pinion = total(scaled(pitch_share(frame), position.line), scaled(centroid, z))
    from_wheel = total(from_pinion, total(pinion.centre, scaled(-1.0, wheel.centre)))
    t = cross(z, normal_of(frame, position))
    row_1, row_2 = row_of(pinion, t, cross(from_pinion, t)), row_of(wheel, t, cross(from_wheel, t))
    on_pinion = row_total(row_scaled(-force, row_1), row_scaled(-moment, spin_1))
    on_wheel = row_total(row_scaled(force, row_2), row_scaled(moment, spin_2))
    return SlidingFriction(force, -row_dot(on_pinion, v_1) - row_dot(on_wheel, v_2), on_pinion, on_wheel)
