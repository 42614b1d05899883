"""The contact of two gears: coordinates and velocities in, generalized forces, energy and losses out.

Three steps. The motion tells where the pinion stands along the line of action, and how fast it moves; the push is the
force there, by the law of the mesh with its damping; the forces act on the coordinates, by virtual work. Whoever
integrates the motion may shift the motion before the push, or replace the force after it.

The transverse force F balances a torque F r_b1; it acts along the line of action, at the force centroid
(`exugear.contact.relative_position`). All generalized forces are the slopes of the potential
U(phase, deflection, offsets), those of the damping force F_d = c d(deflection)/dt are -F_d d(deflection)/d(coordinate).
"""

from typing import NamedTuple

from exugear.contact.friction import SlidingFriction, friction_in_space, friction_of_spins
from exugear.contact.relative_position import (
    Flank,
    Position,
    Row,
    Vector,
    deflection_slopes,
    flank_of,
    gradient,
    position_of,
)
from exugear.contact.vectors import row_dot, row_scaled, row_total
from exugear.mesh_force.force_kernels import StaticForce, centroid_of, damping, spinning_force, static_force
from exugear.mesh_force.patches import table_of
from fem.support.numba_cache import compiled

NO_OFFSETS = (0.0, 0.0, 0.0)


class Motion(NamedTuple):
    """Two gears along the line of action.

    advance, rate       of the pinion, > 0 in the direction in which it drives [m, m/s]
    opening             gap of either flank by a larger centre distance [m]
    phase, phase_rate   of the driving flank [pitches, 1/s]
    """

    advance: float
    rate: float
    opening: float
    phase: float
    phase_rate: float


class Push(NamedTuple):
    """Force of the mesh along the line of action, of the flank nearest to contact.

    flank         of which the static force is
    static        without damping, of the law
    damping       coefficient [N s/m]
    rise          time derivative of the static force, > 0 on the driving flank [N/s]
    rate          of the advance [m/s]
    force         with damping, > 0 on the driving flank [N]
    """

    flank: Flank
    static: StaticForce
    damping: float
    rise: float
    rate: float
    force: float


class Geometry(NamedTuple):
    """Relative position of two gears in space, and rows (6): slopes of the advance by the coordinates of each body."""

    position: Position
    pinion: Row
    wheel: Row


class Contact(NamedTuple):
    """What a contact does: motion and push along the line of action, friction, generalized forces on the bodies.

    pinion, wheel   torques [N m] of bodies that spin, rows (6) of bodies in space; friction included
    offsets         a [m], misalignment [rad], axial [m], as `Recorder` counts them
    centroid        of the force [m], likewise
    """

    motion: Motion
    push: Push
    friction: SlidingFriction
    pinion: float | Row
    wheel: float | Row
    offsets: Vector
    centroid: float


@compiled
def contact_of_spins(law, frame, q_1, q_2, v_1, v_2, friction=None):
    """`Contact` of bodies that spin about fixed axes, with angles q [rad] and speeds v [rad/s]."""
    motion = spin_motion(frame, q_1, q_2, v_1, v_2)
    pushed = push(law, motion, None)
    torque_1, torque_2 = spin_forces(frame, pushed, pushed.force)
    rub = friction_of_spins(friction, frame, pushed, v_1, v_2)
    return Contact(motion, pushed, rub, torque_1 + rub.pinion, torque_2 + rub.wheel, NO_OFFSETS, 0.0)


@compiled
def contact_in_space(law, frame, q_1, q_2, v_1, v_2, friction=None, before=(0.0, 1.0)):
    """`Contact` of Rxyz bodies with displacements q (6) and velocities v (6).

    before   as for `relative_position.remembered_advance`
    """
    motion, geometry = space_motion(law, frame, q_1, q_2, v_1, v_2, before)
    pushed = push(law, motion, geometry.position.offsets)
    row_1, row_2 = space_forces(frame, geometry, pushed, pushed.force)
    rub = friction_in_space(friction, frame, geometry.position, pushed, v_1, v_2)
    offsets, centroid = measures_in_space(frame, geometry, pushed)
    return Contact(motion, pushed, rub, row_total(row_1, rub.pinion), row_total(row_2, rub.wheel), offsets, centroid)


@compiled
def spin_motion(frame, q_1, q_2, v_1, v_2):
    """`Motion` of bodies that spin about fixed axes."""
    d, r_1, r_2, turns = frame.direction, frame.pinion.r_b, frame.wheel.r_b, frame.pitches_per_radian
    advance, rate = d * (r_1 * q_1 + r_2 * q_2) - frame.gap, d * (r_1 * v_1 + r_2 * v_2)
    return Motion(advance, rate, 0.0, d * turns * q_1 + frame.phase, d * turns * v_1)


@compiled(forceinline=True)
def space_motion(law, frame, q_1, q_2, v_1, v_2, before):
    """`Motion` and `Geometry` of Rxyz bodies; before: as for `relative_position.remembered_advance`."""
    position = position_of(law, frame, q_1, q_2, before)
    along = deflection_slopes(frame, position, position.flank.side, 0.0, NO_OFFSETS)
    row_1, row_2 = gradient(frame, position, along)
    rate, phase_rate = row_dot(row_1, v_1) + row_dot(row_2, v_2), frame.direction * frame.pitches_per_radian * v_1[5]
    motion = Motion(position.advance, rate, position.opening, position.phase, phase_rate)
    return motion, Geometry(position, row_1, row_2)


@compiled(forceinline=True)
def push(law, motion, offsets):
    """`Push` of a law in a motion; offsets: a, misalignment, axial as the law counts them, None for bodies that spin.

    Raises ValueError(deflection, largest deflection) beyond the law.
    """
    flank = flank_of(law, motion.advance, motion.opening, motion.phase)
    table = table_of(law, flank.side)
    if offsets is None:
        static = spinning_force(table, flank.phase, flank.deflection)
    else:
        static = static_force(table, flank.phase, flank.deflection, offsets[0], offsets[1], offsets[2])
    c, rate = damping(law, static.penetration), motion.rate
    rise = static.stiffness * rate + static.force_by_phase * motion.phase_rate
    return Push(flank, static, c, rise, rate, flank.side * static.force + c * rate)


@compiled
def spin_forces(frame, push, force):
    """Torques [N m] on bodies that spin; force: along the line of action, that of the push or in its place [N]."""
    d, side = frame.direction, push.flank.side
    by_phase = side * d * frame.pitches_per_radian * push.static.by_phase
    return -frame.pinion.r_b * d * force - by_phase, -frame.wheel.r_b * d * force


@compiled(forceinline=True)
def space_forces(frame, geometry, push, force):
    """Generalized forces (6), (6) on Rxyz bodies; force: as for `spin_forces`."""
    static = push.static
    by_offsets = static.by_a, static.by_misalignment, static.by_axial
    beside = deflection_slopes(frame, geometry.position, 0.0, static.by_phase, by_offsets)
    further_1, further_2 = gradient(frame, geometry.position, beside)
    return (
        row_scaled(-1.0, row_total(row_scaled(force, geometry.pinion), further_1)),
        row_scaled(-1.0, row_total(row_scaled(force, geometry.wheel), further_2)),
    )


@compiled
def measures_in_space(frame, geometry, push):
    """Offsets (a, misalignment, axial) and force centroid [m], with the signs of `Recorder`."""
    (a, misalignment, axial), sense = geometry.position.offsets, geometry.position.flank.side * frame.direction
    return (a, sense * misalignment, sense * axial), sense * centroid_of(push.static)
