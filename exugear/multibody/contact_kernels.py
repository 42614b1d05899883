"""The compiled contact that Exudyn's user function calls: a function for each pair of kinds of bodies.

The steps of the pure contact (`exugear.contact.contact`) with what a run adds to them. The chain, for bodies that spin
and for bodies in space alike: imposed motion of the bodies, motion along the line of action, push in the step of the
integrator, forces, friction, record, imposed torque.
"""

from functools import cache
from math import cos, sin

import numpy as np

from exugear.contact.body_motion import BodyMotion, forces_on, motions_of, recorded_motions
from exugear.contact.contact import (
    NO_OFFSETS,
    measures_in_space,
    space_forces,
    space_motion,
    spin_forces,
    spin_motion,
)
from exugear.contact.elastic_ring import flexed, note_forces, with_torque_on_phase
from exugear.contact.friction import friction_in_space, friction_of_spins
from exugear.contact.reference_configuration import CONTACT_FRAME, is_rotated, is_spatial
from exugear.contact.rotation import IN_PLANE, KINDS, SPIN, UPRIGHT, BodyKind, code_of, coordinates_of, on_coordinates
from exugear.contact.vectors import cross, dot, row_dot, row_total
from exugear.mesh_force.layout import FORCE_TABLE
from exugear.mesh_force.mesh_friction import FRICTION
from exugear.multibody.addresses import as_tuple, put_all, reader
from exugear.multibody.elastic_rings import ring_at, ring_record_at
from exugear.multibody.imposed_motion import Spin, in_carrier, spin_of, torque_on, with_spin
from exugear.multibody.integrator_steps import (
    Beside,
    begin_call,
    begin_solve,
    push_in_step,
    shifted,
    state_at,
)
from exugear.multibody.recorder import recorded_components, sample_of, write
from exugear.multibody.step_ends import accelerations_at, at_step_end, expect_change, for_newton
from fem.support.numba_cache import compiled, kept

table_at, frame_at, friction_at = reader(FORCE_TABLE), reader(CONTACT_FRAME), reader(FRICTION)
STANDING = Spin(0.0, 0.0, 0.0)
#: Velocity in the plane of an axis that stands.
AT_REST = (0.0, 0.0, 0.0, 0.0)


def codes_of(kinds: tuple[BodyKind, ...], frame: np.record) -> list[int]:
    """Codes of the bodies of pinion and wheel in a contact frame."""
    return [code_of(kind, rotated=is_rotated(frame)) for kind in kinds[:2]]


def reads_step_ends(kinds: tuple[BodyKind, ...], frame: np.record) -> bool:
    """Whether the contact of two bodies of these kinds can be evaluated at the expected ends of steps."""
    code_1, code_2 = codes_of(kinds, frame)
    return _reads_step_ends(code_1, code_2, len(kinds) - 2, int(frame.modes))


def _reads_step_ends(kind_1: int, kind_2: int, carried: int, modes: int) -> bool:
    """Of two kinds of bodies that move in the global frame, neither on a carrier nor with an elastic ring."""
    return not carried and not modes and max(kind_1, kind_2) in (IN_PLANE, UPRIGHT)


def kernel_of(kinds: tuple[BodyKind, ...], frame: np.record, *, rubs: bool):
    """The function (law, frame, state, friction, record, t, *coordinates, *velocities) -> generalized forces.

    The first five are addresses: of a table's head, a contact frame, a contact state, a record of the friction, and a
    recorder's header. Coordinates and velocities are separate arguments: a list would cost 14 us more in each call from
    Python. Three bodies that only spin are pinion, wheel and their carrier. The amplitudes of an elastic ring follow.

    kinds   of the bodies
    frame   of the contact: bodies that only spin may be displaced from the pair's nominal positions
    rubs    whether there is friction; else its address is 0
    """
    if set(kinds) == {SPIN} and not is_spatial(frame):
        return _spin_contact(len(kinds), int(rubs), int(frame.modes))
    codes = codes_of(kinds, frame)
    return _spatial_contact(*codes, int(rubs), len(kinds) - 2, int(frame.modes))


@cache
def _spin_contact(bodies: int, rubs: int, modes: int):
    """The compiled contact of two bodies that spin about fixed axes, and of the carrier of these axes, if any.

    modes   number of amplitudes of an elastic ring
    It encloses numbers only, by which the cache on disk identifies it; branches that they exclude are not compiled.
    """
    before_rates, rates = bodies + modes, 2 * bodies + modes

    @kept
    def spin_contact(law, frame, state, friction, record, t, *coordinates):
        law, frame, state = table_at(law), frame_at(frame), state_at(state)
        begin_call(state.steps, t)
        x = coordinates if modes == 0 else coordinates[:bodies] + coordinates[before_rates:rates]
        body_1 = spin_of(state.imposed[0], t, x[0], x[bodies])
        body_2 = spin_of(state.imposed[1], t, x[1], x[bodies + 1])
        carrier = STANDING if bodies == 2 else spin_of(state.imposed[2], t, x[2], x[5])
        pinion, wheel = in_carrier(body_1, carrier), in_carrier(body_2, carrier)
        motion = spin_motion(frame, pinion.angle, wheel.angle, pinion.speed, wheel.speed)
        by_pinion = frame.pinion.r_b * body_1.speed if state.imposed[0] else 0.0
        by_wheel = frame.wheel.r_b * body_2.speed if state.imposed[1] else 0.0
        by_carrier = (frame.pinion.r_b + frame.wheel.r_b) * carrier.speed if state.imposed[2] else 0.0
        beside = Beside(frame.direction * (by_pinion + by_wheel - by_carrier), 0.0, 0.0, 0.0, 0.0)
        amplitudes = None if modes == 0 else coordinates[bodies:before_rates] + coordinates[rates:]
        pushed = push_by_ring(law, state, motion, beside, None, amplitudes)
        motion, push, force, pulsed, dissipation, lag = pushed
        torque_1, torque_2 = spin_forces(frame, push, pulsed)
        rub = friction_of_spins(friction_at(friction) if rubs == 1 else None, frame, push, pinion.speed, wheel.speed)
        torque_1, torque_2 = torque_1 + rub.pinion, torque_2 + rub.wheel
        k = sample_of(record, t)
        if k >= 0:
            mesh = motion.advance + lag, force, *NO_OFFSETS, 0.0, torque_1, torque_2, motion.phase
            power = push.static.energy, dissipation, body_1.angle, body_2.angle, body_1.speed, body_2.speed
            on_carrier = carrier.angle, carrier.speed, -torque_1 - torque_2
            write(record, k, (*mesh, *power, rub.force, rub.loss, *on_carrier), 0, None)
        torque_3 = -torque_1 - torque_2
        torque_1, torque_2 = torque_on(state, 0, pinion, torque_1), torque_on(state, 1, wheel, torque_2)
        torques = (torque_1, torque_2) if bodies == 2 else (torque_1, torque_2, torque_on(state, 2, carrier, torque_3))
        if modes > 0:
            return torques + as_tuple(ring_at(state.ring).forces, modes)
        return torques

    return spin_contact


@compiled(forceinline=True)
def beside_mesh(state, geometry, pinion, wheel, carrier_speed):
    """`Beside` the mesh of two bodies in space with these `BodyMotion`; speed of their carrier [rad/s]."""
    steps, (q_1, v_1, _), (q_2, v_2, _) = state.steps, pinion, wheel
    by_pinion = geometry.pinion[5] * (v_1[5] + carrier_speed) if state.imposed[0] else 0.0
    by_wheel = geometry.wheel[5] * (v_2[5] + carrier_speed) if state.imposed[1] else 0.0
    by_carrier = 0.0
    if state.imposed[2]:
        by_shift = geometry.pinion[0] * v_1[0] + geometry.pinion[1] * v_1[1]
        by_shift = by_shift + geometry.wheel[0] * v_2[0] + geometry.wheel[1] * v_2[1]
        by_shift = by_shift + geometry.pinion[3] * v_1[3] + geometry.pinion[4] * v_1[4]
        by_shift = by_shift + geometry.wheel[3] * v_2[3] + geometry.wheel[4] * v_2[4]
        by_carrier = (geometry.pinion[5] + geometry.wheel[5]) * carrier_speed - by_shift
    imposed_rate, by_bearings = by_pinion + by_wheel - by_carrier, 0.0
    turning, across, along = orbit_of(geometry, v_1, v_2)
    if steps.predicts != 0.0:
        imposed_rate += steps.duration * turning * across
        by_bearings = row_dot(steps.by_displacement[0], q_1) + row_dot(steps.by_displacement[1], q_2)
        by_bearings = by_bearings + row_dot(steps.by_velocity[0], v_1) + row_dot(steps.by_velocity[1], v_2)
        by_bearings = by_bearings + state.by_shafts[0] + state.by_shafts[1]
    lag_rate = row_dot(state.pinion_lag, v_1) + row_dot(state.wheel_lag, v_2) + steps.lag * turning * turning * along
    held = row_dot(state.pinion_lag, q_1) + row_dot(state.wheel_lag, q_2)
    return Beside(imposed_rate, by_bearings, lag_rate, held, 0.0)


@compiled
def beside_orbit(state, beside, geometry, a_1, a_2):
    """`Beside` the mesh of a planet that orbits, of whose bodies these accelerations (7, 7) are expected."""
    expected = row_dot(geometry.pinion, a_1) + row_dot(geometry.wheel, a_2)
    if state.imposed[0]:
        expected -= geometry.pinion[5] * a_1[5]
    if state.imposed[1]:
        expected -= geometry.wheel[5] * a_2[5]
    return Beside(beside.imposed_rate, beside.by_bearings, beside.lag_rate, beside.held, expected)


@compiled(forceinline=True)
def push_by_ring(law, state, motion, beside, offsets, amplitudes):
    """(`Motion` ahead, `Push`, force, force with that of a pulse [N], dissipated power [W], lag of the advance [m]).

    What `push_in_step` gives, also of a ring whose rim is flexed, by which the advance lags.

    amplitudes   of an elastic ring and their rates; None of gears that are rigid
    """
    if amplitudes is None:
        ahead, push, force, dissipation = push_in_step(law, state, motion, beside, offsets)
        return ahead, push, force, force + state.steps.pulse_force, dissipation, 0.0
    put_all(ring_record_at(state.ring).state, amplitudes)
    ring = ring_at(state.ring)
    rim = flexed(ring, law, motion)
    behind, with_modes = shifted(motion, -rim.advance, -rim.rate), beside_ring(state, beside, ring, rim)
    ahead, push, force, dissipation = push_in_step(law, state, behind, with_modes, offsets)
    pulsed = force + state.steps.pulse_force
    note_forces(ring, pulsed)
    return ahead, with_torque_on_phase(push, rim, pulsed), force, pulsed, dissipation, rim.advance


@compiled
def beside_ring(state, beside, ring, rim):
    """`Beside` the mesh with the springs of the modes of an elastic ring, which is `Flexed`."""
    lag, force = state.steps.lag, state.steps.last_force
    by_bearings, lag_rate = beside.by_bearings + springs_in_step(ring, state.steps), beside.lag_rate - lag * rim.jerk
    held = beside.held + lag * (rim.mobility * force - rim.acceleration)
    return Beside(beside.imposed_rate, by_bearings, lag_rate, held, 0.0)


@compiled
def springs_in_step(ring, steps):
    """Acceleration of the advance by stiffness and damping of the modes of a ring in a step [m/s^2]."""
    m, acceleration = len(ring.masses), 0.0
    for j in range(m):
        g, x, y = ring.along[j], ring.state[j], ring.state[m + j]
        spring, damper = g * ring.stiffness[j], g * ring.damping[j]
        yielding = ring.masses[j] + steps.deflection * ring.stiffness[j] + steps.rate * ring.damping[j]
        acceleration = acceleration + (spring * x + damper * y) / yielding
    return acceleration


@compiled
def orbit_of(geometry, v_1, v_2):
    """Speed [rad/s] at which the line of centres turns, and velocities [m/s] across and along the line of action.

    The turn changes the rate of the advance by the speed times the velocity across. The first guess of a step takes any
    change of the rate for that by accelerations; of planets that orbit this part is large, and without it Newton's
    iteration takes 1.3 calls in a step instead of 1.0. The velocities of an orbit lag, too, by the lag times the
    squared speed.
    """
    position, row_1, row_2 = geometry.position, geometry.pinion, geometry.wheel
    u_1, u_2 = (v_1[0], v_1[1], v_1[2]), (v_2[0], v_2[1], v_2[2])
    on_1, on_2 = (row_1[0], row_1[1], row_1[2]), (row_2[0], row_2[1], row_2[2])
    turning = dot(position.e_t, (u_2[0] - u_1[0], u_2[1] - u_1[1], u_2[2] - u_1[2])) / position.distance
    z = position.pinion.z
    return turning, dot(cross(z, on_1), u_1) + dot(cross(z, on_2), u_2), dot(on_1, u_1) + dot(on_2, u_2)


@compiled
def in_carrier_frame(x, carrier):
    """Coordinates and velocities (4) of two bodies that spin on a carrier, against it; x (6) with the carrier's."""
    return x[0] - carrier.angle, x[1] - carrier.angle, x[3] - carrier.speed, x[4] - carrier.speed


@compiled
def fixed_in_housing(displacement, carrier):
    """Displacement and tilts (4) seen from their carrier, less those at angle 0, and their slopes by its angle.

    displacement   (4,) of an axis that stands in the housing [m, rad]; tilts turn as vectors, to their first order
    """
    s, c = sin(carrier.angle), cos(carrier.angle)
    x, y, a, b = displacement[0], displacement[1], displacement[2], displacement[3]
    moved = (c - 1.0) * x + s * y, (c - 1.0) * y - s * x, (c - 1.0) * a + s * b, (c - 1.0) * b - s * a
    return moved, (c * y - s * x, -c * x - s * y, c * b - s * a, -c * a - s * b)


@compiled
def displaced(motion, moved, slope, speed):
    """A `BodyMotion` with further displacement and tilts (4) and their rates: slopes times the speed of the carrier."""
    q, v = motion.q, motion.v
    at = q[0] + moved[0], q[1] + moved[1], q[2], q[3] + moved[2], q[4] + moved[3], q[5]
    moving = (
        v[0] + slope[0] * speed,
        v[1] + slope[1] * speed,
        v[2],
        v[3] + slope[2] * speed,
        v[4] + slope[3] * speed,
        v[5],
    )
    return BodyMotion(at, moving, motion.orientation)


@cache
def _spatial_contact(kind_1: int, kind_2: int, rubs: int, carried: int, modes: int):
    """The compiled contact of two kinds of bodies, as `_spin_contact`; carried: 1 of spins on a carrier."""
    n_1, n_2 = KINDS[kind_1].size, KINDS[kind_2].size
    components, bodies = recorded_components(KINDS[kind_1], KINDS[kind_2]), n_1 + n_2 + carried
    before_rates, rates = bodies + modes, 2 * bodies + modes
    reads_ends = int(_reads_step_ends(kind_1, kind_2, carried, modes))

    @kept
    def spatial_contact(law, frame, state, friction, record, t, *all_coordinates):
        law, frame, state = table_at(law), frame_at(frame), state_at(state)
        begin_call(state.steps, t)
        begin_solve(state, t)
        if reads_ends == 1:
            all_coordinates = at_step_end(state.ends, t, all_coordinates)
        coordinates = all_coordinates if modes == 0 else all_coordinates[:bodies] + all_coordinates[before_rates:rates]
        carrier = STANDING if carried == 0 else spin_of(state.imposed[2], t, coordinates[2], coordinates[5])
        x = coordinates if carried == 0 else in_carrier_frame(coordinates, carrier)
        pinion, wheel = motions_of(frame, kind_1, kind_2, n_1, n_2, x)
        absolute_1, absolute_2 = pinion.q[5] + carrier.angle, wheel.q[5] + carrier.angle
        spin_1 = spin_of(state.imposed[0], t, absolute_1, pinion.v[5] + carrier.speed)
        spin_2 = spin_of(state.imposed[1], t, absolute_2, wheel.v[5] + carrier.speed)
        spin_1, spin_2 = in_carrier(spin_1, carrier), in_carrier(spin_2, carrier)
        pinion, wheel = with_spin(pinion, spin_1), with_spin(wheel, spin_2)
        slope_1, slope_2 = AT_REST, AT_REST
        if carried == 1:
            moved_1, slope_1 = fixed_in_housing(frame.fixed[0], carrier)
            moved_2, slope_2 = fixed_in_housing(frame.fixed[1], carrier)
            pinion = displaced(pinion, moved_1, slope_1, carrier.speed)
            wheel = displaced(wheel, moved_2, slope_2, carrier.speed)
        motion, geometry = space_motion(law, frame, pinion.q, wheel.q, pinion.v, wheel.v, (state.advance, state.begins))
        state.advance = motion.advance
        beside = beside_mesh(state, geometry, pinion, wheel, carrier.speed)
        predicts_orbit = reads_ends == 1 and state.ends != 0 and state.steps.predicts != 0.0
        if predicts_orbit:
            a = accelerations_at(state.ends)
            a_1, a_2 = coordinates_of(a, 0, kind_1), coordinates_of(a, n_1, kind_2)
            beside = beside_orbit(state, beside, geometry, a_1, a_2)
            motion = shifted(motion, -state.steps.deflection * beside.expected, -state.steps.rate * beside.expected)
        amplitudes = None if modes == 0 else all_coordinates[bodies:before_rates] + all_coordinates[rates:]
        pushed = push_by_ring(law, state, motion, beside, geometry.position.offsets, amplitudes)
        motion, push, force, pulsed, dissipation, lag = pushed
        if predicts_orbit:
            row_1, row_2 = (
                on_coordinates(kind_1, (*geometry.pinion, 0.0)),
                on_coordinates(kind_2, (*geometry.wheel, 0.0)),
            )
            expect_change(state.ends, row_1[:n_1] + row_2[:n_2], state.steps.change)
        forces_1, forces_2 = space_forces(frame, geometry, push, pulsed)
        rub = friction_in_space(
            friction_at(friction) if rubs == 1 else None, frame, geometry.position, push, pinion.v, wheel.v
        )
        forces_1, forces_2 = row_total(forces_1, rub.pinion), row_total(forces_2, rub.wheel)
        f, g = forces_on(kind_1, pinion.orientation, forces_1), forces_on(kind_2, wheel.orientation, forces_2)
        torque_3 = 0.0
        if carried == 1:
            by_shift = f[0] * slope_1[0] + f[1] * slope_1[1] + f[3] * slope_1[2] + f[4] * slope_1[3]
            by_shift = by_shift + g[0] * slope_2[0] + g[1] * slope_2[1] + g[3] * slope_2[2] + g[4] * slope_2[3]
            torque_3 = by_shift - f[5] - g[5]
        k = sample_of(record, t)
        if k >= 0:
            body_1, body_2 = recorded_motions(frame, kind_1, kind_2, n_1, n_2, x, pinion, wheel)
            offsets, centroid = measures_in_space(frame, geometry, push)
            mesh = (
                motion.advance + lag - motion.opening,
                force,
                *offsets,
                centroid,
                forces_1[5],
                forces_2[5],
                motion.phase,
            )
            spins = body_1.q[5] + carrier.angle, body_2.q[5] + carrier.angle
            speeds = body_1.v[5] + carrier.speed, body_2.v[5] + carrier.speed
            power = push.static.energy, dissipation, *spins, *speeds
            motions = body_1.q, body_2.q, body_1.v, body_2.v
            on_carrier = carrier.angle, carrier.speed, torque_3
            write(record, k, (*mesh, *power, rub.force, rub.loss, *on_carrier), components, motions)
        spun_1, spun_2 = torque_on(state, 0, spin_1, f[5]), torque_on(state, 1, spin_2, g[5])
        if carried == 1:
            torques = spun_1, spun_2, torque_on(state, 2, carrier, torque_3)
            if modes > 0:
                return torques + as_tuple(ring_at(state.ring).forces, modes)
            return torques
        on_pinion = on_coordinates(kind_1, (*f[:5], spun_1, f[6]))[:n_1]
        on_wheel = on_coordinates(kind_2, (*g[:5], spun_2, g[6]))[:n_2]
        if modes > 0:
            return on_pinion + on_wheel + as_tuple(ring_at(state.ring).forces, modes)
        if reads_ends == 1:
            return for_newton(state.ends, on_pinion + on_wheel)
        return on_pinion + on_wheel

    return spatial_contact
