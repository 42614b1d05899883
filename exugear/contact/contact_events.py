"""Steps in which teeth touch, part, or pass the end of the damping's ramp: force pulses make up for their truncation.

The fourth-order rule takes forces to be smooth over a step. Where contact begins or ends they are not: the damping sets
in over a micrometre, of which teeth cover ten in a step, and the stiffness jumps. The error kicks the vibration by 1 %
of the impact velocity at random, which drops it from a branch that is stable but attracts weakly long before its fold.

So the first call of a step looks ahead along the line of action, where the motion y obeys y'' = free - mobility F with
all other forces in `free`. If the rule ends the step on the other side of such an event, Runge-Kutta substeps integrate
the same equation truly. What the rule misses by, dx and dv, is made up for by accelerations dv/h + dx/h^2 at the end of
this step and -dx/h^2 at the end of the next one, fixed before Newton's iteration: two steps later y has moved by
dx + h dv and y' by dv. Until then the integrated motion lacks a known rest, the shift, by which the contact evaluates
its force at the corrected motion. Pulses enter neither the recorded force nor the energies.

The velocity of the rule is v + h^2/12 d2v/dt2 (`force_kernels.corrected_rate`), which differs before and after the
event.
"""

from typing import NamedTuple

from exugear.contact.relative_position import flank_of
from exugear.mesh_force.force_kernels import corrected_rate, damping, spinning_force, static_force
from exugear.mesh_force.patches import table_of
from fem.support.numba_cache import compiled

#: Runge-Kutta substeps in a step with an event.
SUBSTEPS = 8
#: Largest number of iterations for the end of the step by the rule, and the change of the acceleration over that of
#: gravity at which they end.
ITERATIONS, SMALL = 8, 1e-6
#: Share of the travel in a step, and changes by the acceleration, within which an event may lie beside its forecast.
TRAVEL_SHARE, ACCELERATION_SHARE = 0.5, 2.0


class Line(NamedTuple):
    """A contact along the line of action, as predicted for the end of a step with its end acceleration left out.

    advance, rate       of the pinion [m, m/s]
    imposed_rate        the part of the rate by bodies whose motion is imposed [m/s]
    opening             gap of either flank [m]
    phase, phase_rate   of the driving flank [pitches, 1/s]
    by_bearings         acceleration that the bearings give [m/s^2]
    """

    advance: float
    rate: float
    imposed_rate: float
    opening: float
    phase: float
    phase_rate: float
    by_bearings: float


class Motion(NamedTuple):
    """Advance [m] and rate [m/s] of the pinion along the line of action."""

    advance: float
    rate: float


class Push(NamedTuple):
    """Force of a contact along the line of action.

    force          with damping, > 0 on the driving flank [N]
    slope          of it over the advance, without damping [N/m]
    coefficient    of the damping [N s/m]
    rise           its time derivative, without that of the damping [N/s]
    zone           `zone_of` the penetration
    """

    force: float
    slope: float
    coefficient: float
    rise: float
    zone: float


@compiled
def zone_of(table, penetration):
    """0 without contact, +-1 in the ramp of the damping, +-2 beyond it.

    penetration   of the flanks [m], < 0 on the back flank; zones likewise
    """
    if penetration == 0.0:
        return 0.0
    depth = 1.0 if table.damping > 0.0 and abs(penetration) < table.damping_ramp else 2.0
    return depth if penetration > 0.0 else -depth


@compiled
def push_at(table, line, offsets, motion, before, lag, mobility, free):
    """`Push` in a motion, some time [s] before the end of the step.

    offsets   a, misalignment, axial; None for a law without them
    lag       by which the rate is too large, per second derivative of the velocity [s^2]; 0 for true rates
    free      acceleration by all other forces [m/s^2], which matters for rates that lag
    """
    flank = flank_of(table, motion.advance, line.opening, line.phase - line.phase_rate * before)
    if offsets is None:
        static = spinning_force(table_of(table, flank.side), flank.phase, flank.deflection)
    else:
        static = static_force(
            table_of(table, flank.side), flank.phase, flank.deflection, offsets[0], offsets[1], offsets[2]
        )
    c, rate = damping(table, static.penetration), motion.rate
    rise = static.stiffness * rate + static.force_by_phase * line.phase_rate
    force = flank.side * static.force
    if c > 0.0:
        rate = corrected_rate(rate, lag * mobility, mobility, rise, force - free / mobility, c)
    zone = zone_of(table, flank.side * static.penetration)
    return Push(force + c * rate, static.stiffness, c, rise, zone)


@compiled
def jerk_of(push, mobility, free):
    """Second derivative of the rate [m/s^3] by the contact."""
    return -mobility * (push.rise + push.coefficient * (free - mobility * push.force))


@compiled
def end_by_rule(table, steps, line, offsets, predicted, free, acceleration):
    """(acceleration [m/s^2], zone) at the end of a step by the rule, without pulses, from a first guess."""
    beta_h2, gamma_h, mobility, zone = steps.deflection, steps.rate, steps.mobility, 0.0
    for _ in range(ITERATIONS):
        motion = Motion(predicted.advance + beta_h2 * acceleration, predicted.rate + gamma_h * acceleration)
        push = push_at(table, line, offsets, motion, 0.0, steps.lag, mobility, free)
        zone = push.zone
        slope = beta_h2 * push.slope + gamma_h * push.coefficient
        change = (free - mobility * push.force - acceleration) / (1.0 + mobility * slope)
        acceleration += change
        if abs(change) < SMALL:
            break
    return acceleration, zone


@compiled
def true_end(table, steps, line, offsets, start, free):
    """The true `Motion` at the end of a step, with the velocity of the rule.

    start   at the beginning, likewise
    free    acceleration by all other forces at the beginning and at the end [m/s^2]
    """
    h, m = steps.duration, steps.mobility
    push = push_at(table, line, offsets, start, h, steps.lag, m, free[0])
    y, v = start.advance, start.rate - steps.lag * jerk_of(push, m, free[0])
    dt, drift = h / SUBSTEPS, (free[1] - free[0]) / h
    for i in range(SUBSTEPS):
        dy = dv = 0.0
        y_stage, v_stage = y, v
        for stage in range(4):
            s = (i + 0.5 * ((stage + 1) // 2)) * dt
            force = push_at(table, line, offsets, Motion(y_stage, v_stage), h - s, 0.0, m, 0.0).force
            a = free[0] + drift * s - m * force
            weight = dt / 3.0 if stage == 1 or stage == 2 else dt / 6.0
            dy, dv = dy + weight * v_stage, dv + weight * a
            ahead = dt if stage == 2 else 0.5 * dt
            y_stage, v_stage = y + ahead * v_stage, v + ahead * a
        y, v = y + dy, v + dv
    push = push_at(table, line, offsets, Motion(y, v), 0.0, 0.0, m, 0.0)
    return Motion(y, v + steps.lag * jerk_of(push, m, free[1]))


@compiled
def may_meet_event(table, steps, change, acceleration):
    """Whether a step that changes the advance so [m] may touch the ramp of the damping or a loss of contact."""
    if abs(zone_of(table, steps.last_penetration)) < 2.0:
        return True
    side = 1.0 if steps.last_penetration > 0.0 else -1.0
    margin = TRAVEL_SHARE * abs(change) + ACCELERATION_SHARE * steps.deflection * abs(acceleration)
    return abs(steps.last_penetration) + min(side * change, 0.0) - margin < table.damping_ramp


@compiled
def corrected_step(table, steps, line, offsets, acceleration):
    """The acceleration [m/s^2] to expect at the end of a step, whose pulse and shift it sets.

    acceleration   of the coordinates that are not imposed, at the beginning of the step [m/s^2]
    """
    h, h2, beta_h2, gamma_h = steps.duration, steps.duration**2, steps.deflection, steps.rate
    earlier, pulse, next_pulse = steps.pulse, steps.next_pulse, 0.0
    x, v = steps.shift + h * steps.shift_rate, steps.shift_rate
    x, v = x - (0.5 * h2 - beta_h2) * earlier, v - gamma_h * earlier
    imposed = (line.imposed_rate - steps.last_imposed_rate) / h
    change = h * line.rate - beta_h2 * acceleration - 0.5 * h2 * imposed
    expected = acceleration - earlier
    if may_meet_event(table, steps, change, acceleration):
        free = expected + steps.mobility * steps.last_force
        free_end = free + line.by_bearings - steps.last_by_bearings
        predicted = Motion(line.advance + x, line.rate + v)
        expected, zone = end_by_rule(table, steps, line, offsets, predicted, free_end, expected)
        if zone != zone_of(table, steps.last_penetration):
            before = line.rate - gamma_h * acceleration - h * imposed
            start = Motion(line.advance - change + steps.shift, before + steps.shift_rate)
            end = true_end(table, steps, line, offsets, start, (free + imposed, free_end + imposed))
            dx = end.advance - predicted.advance - beta_h2 * expected
            dv = end.rate - predicted.rate - gamma_h * expected
            pulse, next_pulse = pulse + dv / h + dx / h2, -dx / h2
            x, v = x + dx, v + dv
    steps.pulse, steps.next_pulse, steps.pulse_force = pulse, next_pulse, -pulse / steps.mobility
    steps.shift, steps.shift_rate = x - beta_h2 * pulse, v - gamma_h * pulse
    return expected + pulse
