"""The mesh between two bodies: force from the potential of the mesh, generalized forces by virtual work.

F is the transverse force, which balances a torque F r_b1; it acts along the line of action, at the force centroid
(`exugear.contact.relative_position`). All generalized forces are the slopes of the potential
U(phase, deflection, offsets), those of the damping force F_d = c d(deflection)/dt are -F_d d(deflection)/d(coordinate).
"""

from typing import NamedTuple

from exugear.contact.contact_events import Line
from exugear.contact.first_guess import force_with_guess, guess_of
from exugear.contact.relative_position import (
    Flank,
    Position,
    Row,
    Vector,
    deflection_slopes,
    driving_phase,
    flank_of,
    gradient,
    position_of,
)
from exugear.contact.vectors import row_dot, row_scaled, row_total
from exugear.mesh_force.force_kernels import (
    NO_CONTACT,
    centroid_of,
    corrected_rate,
    damping,
    spinning_force,
    static_force,
)
from exugear.mesh_force.patches import table_of
from fem.support.numba_cache import compiled

NO_OFFSETS = (0.0, 0.0, 0.0)


class SpinForces(NamedTuple):
    """A mesh of bodies that spin: deflection [m], force [N], torques [N m], potential [J], dissipated power [W].

    flank          nearest to contact
    static_force   of that flank, without damping [N]
    pulse          torques of a force pulse (`exugear.contact.contact_events`) [N m]: in the power, not in the torques
    """

    deflection: float
    force: float
    torques: tuple[float, float]
    energy: float
    dissipation: float
    flank: Flank
    static_force: float
    pulse: tuple[float, float]


class MeshForces(NamedTuple):
    """Deflection [m], mesh force [N], generalized forces, potential [J], dissipated power [W].

    Offsets and force centroid [m] are signed as in `exugear.contact.recorder.Recorder`.

    position       of the gears
    static_force   of the flank in contact, without damping [N]
    pulse          generalized forces of a force pulse (`exugear.contact.contact_events`): in the power, not in those
    """

    deflection: float
    force: float
    pinion: Row
    wheel: Row
    offsets: Vector
    centroid: float
    energy: float
    dissipation: float
    position: Position
    static_force: float
    pulse: tuple[Row, Row]


@compiled
def damping_force(table, state, static, side, rate, phase_rate, displacement_force):
    """(damping force [N], dissipated power [W]) of a flank.

    side                 +1 driving or -1 back flank
    rate                 of the deflection [m/s]
    phase_rate           time derivative of the phase [1/s]
    displacement_force   mesh force that the displaced bearings balance [N], times the lag [m/N]
    """
    c = damping(table, static.penetration)
    if c > 0.0 and state.lag != 0.0:
        rise = static.stiffness * rate + static.force_by_phase * phase_rate
        excess = static.force + side * (displacement_force / state.lag - state.holding_force)
        rate = corrected_rate(rate, state.lag, state.mobility if side > 0.0 else 0.0, rise, excess, c)
    return c * rate, c * rate * rate


@compiled
def slopes_of_force(table, state, static, side):
    """Slopes of the force with damping over the deflection [N/m] and over its rate [N s/m]."""
    c = damping(table, static.penetration)
    yielding = 1.0 + (state.lag * state.mobility * c * c if side > 0.0 else 0.0)
    return static.stiffness / yielding, c * (1.0 + state.lag * static.stiffness) / yielding


@compiled
def note_contact(state, static):
    """Note that the teeth have touched, if they do."""
    if static.force > 0.0:
        state.closed = 1.0


@compiled
def rotational_mesh(table, frame, state, q_1, q_2, v_1, v_2):
    """`SpinForces` of two rotational coordinates."""
    d, r_1, r_2, turns = frame.direction, frame.pinion.r_b, frame.wheel.r_b, frame.pitches_per_radian
    advance = d * (r_1 * q_1 + r_2 * q_2)
    if state.engaged == 0.0:
        return SpinForces(advance, 0.0, (0.0, 0.0), 0.0, 0.0, Flank(1.0, advance, 0.0), 0.0, (0.0, 0.0))
    steps, phase, phase_rate = state.steps, d * turns * q_1 + frame.phase, d * turns * v_1
    imposed_rate = d * ((r_1 * v_1 if state.imposed[0] else 0.0) + (r_2 * v_2 if state.imposed[1] else 0.0))
    line = Line(advance, d * (r_1 * v_1 + r_2 * v_2), imposed_rate, 0.0, phase, phase_rate, 0.0)
    guess = guess_of(table, steps, line, None)
    advance += guess.deflection + steps.shift
    flank = flank_of(table, advance, 0.0, phase)
    side = flank.side
    static = spinning_force(table_of(table, side), flank.phase, flank.deflection)
    note_contact(state, static)
    rate = side * (line.rate + guess.rate + steps.shift_rate)
    damped, dissipation = damping_force(table, state, static, side, rate, side * phase_rate, 0.0)
    slopes, push = slopes_of_force(table, state, static, side), side * (static.force + damped)
    force = force_with_guess(steps, guess, line, push, slopes, side * static.penetration)
    torques = -r_1 * d * force - side * d * turns * static.by_phase, -r_2 * d * force
    dissipation += steps.pulse_force * side * rate
    pulse = -d * steps.pulse_force
    return SpinForces(
        advance, force, torques, static.energy, dissipation, flank, static.force, (r_1 * pulse, r_2 * pulse)
    )


@compiled
def acceleration_by_bearings(steps, q_1, q_2, v_1, v_2):
    """Acceleration along the line of action [m/s^2] that bearings give two Rxyz bodies, in the first call of a step."""
    if steps.guesses == 0.0:
        return 0.0
    by_displacement, by_velocity = steps.by_displacement, steps.by_velocity
    along = row_dot(by_displacement[0], q_1) + row_dot(by_displacement[1], q_2)
    return along + row_dot(by_velocity[0], v_1) + row_dot(by_velocity[1], v_2)


@compiled(forceinline=True)
def imposed_rate(state, row_1, row_2, v_1, v_2):
    """Rate of the advance [m/s] by the bodies whose motion is imposed."""
    by_pinion = row_1[5] * v_1[5] if state.imposed[0] else 0.0
    return by_pinion + (row_2[5] * v_2[5] if state.imposed[1] else 0.0)


@compiled(forceinline=True)
def force_at(table, state, position, ahead):
    """`StaticForce` at an advance [m] beyond that of the position; none before the teeth engage."""
    if state.engaged == 0.0:
        return NO_CONTACT
    flank, (a, misalignment, axial) = position.flank, position.offsets
    deflection = flank.deflection + flank.side * ahead
    return static_force(table_of(table, flank.side), flank.phase, deflection, a, misalignment, axial)


@compiled(forceinline=True)
def spatial_mesh(table, frame, state, q_1, q_2, v_1, v_2):
    """`MeshForces` of two Rxyz bodies."""
    position = position_of(table, frame, q_1, q_2, (state.advance, state.begins))
    state.advance = position.advance
    flank, (a, misalignment, axial) = position.flank, position.offsets
    row_1, row_2 = gradient(frame, position, deflection_slopes(frame, position, 1.0, 0.0, NO_OFFSETS))
    rate = row_dot(row_1, v_1) + row_dot(row_2, v_2)
    side_d, steps = flank.side * frame.direction, state.steps
    phase_rate = side_d * frame.pitches_per_radian * v_1[5]
    line = Line(
        position.advance,
        flank.side * rate,
        flank.side * imposed_rate(state, row_1, row_2, v_1, v_2),
        position.opening,
        driving_phase(table, flank),
        flank.side * phase_rate,
        acceleration_by_bearings(steps, q_1, q_2, v_1, v_2),
    )
    guess = guess_of(table, steps, line, position.offsets)
    static = force_at(table, state, position, guess.deflection + steps.shift)
    note_contact(state, static)
    lag = row_dot(state.pinion_lag, v_1) + row_dot(state.wheel_lag, v_2)
    rate += flank.side * (lag + guess.rate + steps.shift_rate)
    displacement_force = row_dot(state.pinion_lag, q_1) + row_dot(state.wheel_lag, q_2)
    damped, dissipation = damping_force(table, state, static, flank.side, rate, phase_rate, displacement_force)
    slopes, push = slopes_of_force(table, state, static, flank.side), flank.side * (static.force + damped)
    penetration = flank.side * static.penetration
    force = flank.side * force_with_guess(steps, guess, line, push, slopes, penetration)
    dissipation += flank.side * steps.pulse_force * rate
    pulse = -flank.side * steps.pulse_force
    by_offsets = static.by_a, static.by_misalignment, static.by_axial
    slopes_beside_force = deflection_slopes(frame, position, 0.0, static.by_phase, by_offsets)
    further_1, further_2 = gradient(frame, position, slopes_beside_force)
    return MeshForces(
        position.advance - position.opening + steps.shift,
        flank.side * force,
        row_scaled(-1.0, row_total(row_scaled(force, row_1), further_1)),
        row_scaled(-1.0, row_total(row_scaled(force, row_2), further_2)),
        (a, side_d * misalignment, side_d * axial),
        side_d * centroid_of(static),
        static.energy,
        dissipation,
        position,
        static.force,
        (row_scaled(pulse, row_1), row_scaled(pulse, row_2)),
    )
