"""What the integrator's steps need of a contact beyond its force: predictor, true rates, and pulses at events.

Everything here is a scalar along the line of action: the motion is shifted before the push of the pure contact
(`exugear.contact.contact`), the force is replaced after it. Geometry, friction and torques know nothing of it.

What Exudyn does. Newmark's rule with gamma = 1/2 begins each step at the coordinates q_n + h v_n + h^2 (1/2 - beta) a_n
and velocities v_n + h/2 a_n, with end accelerations a = 0, far from the solution, and keeps the matrix of Newton's
iteration over many steps. The first iteration solves (M^ + s_K r r^T) a = f - r F for the returned mesh force F, with
the row r of the contact, M^ = M + beta h^2 K + gamma h C without this mesh, f all other forces, and s_K the mesh force
per acceleration along the line of action that the kept matrix contains (`matrix`).

Predictor. Along the line of action a = free - compliance F with compliance = r^T M^^-1 r. Newton's step linearized at
an acceleration a* would end at the force F(a*); the iteration arrives there with the kept matrix if the first call
returns

    F(a*) - s_K a*,

for any a*. The acceleration of the last step follows from the rates of the first call and of the last one before,
a_n = 2 (rate - last rate) / h, and `free` = a_n + compliance F_n + the change of the bearings' share. The law is
evaluated at the guess a_n and linearized there by s = beta h^2 k + gamma h c:

    a* = (free - compliance (F(a_n) - s a_n)) / (1 + compliance s),   F(a*) = F(a_n) + s (a* - a_n).

The mesh of a planet that orbits has turned away from its row in the kept matrix, and so have the forces of its pin. It
is evaluated at the accelerations that are expected of the bodies (`exugear.multibody.step_ends`), and the share J a of
the whole contact is returned with the force. The force expected there follows from the last three as they do:
F = 3 F_n - 3 F_n-1 + F_n-2, by which free = a + compliance F. How a* differs from a, as where teeth come into mesh, is
then expected of both bodies.

All further calls return the force in their state, so that the residual that ends the iteration is true: a poor guess
costs an iteration and no accuracy. Iterations per step fall from 1.8 to 1.01 (spin) and 1.04 (bearings), the time of a
run by a factor 1.2 and 1.3.

True rates. With beta = 1/12 the rule is of fourth order in q (Numerov; Fox & Goodwin 1949), but its velocities are
trapezoidal sums, v + lag v'' with lag = h^2 / 12 (Euler & Maclaurin). The damping force takes the rate without that
excess; it depends on the force itself, through the acceleration of the bodies, for which the equation is solved.

Events. The rule takes forces to be smooth over a step. Where contact begins or ends, or the ramp of the damping does,
they are not: the damping sets in over a micrometre, of which teeth cover ten in a step, and the stiffness jumps. The
error kicks the vibration by 1 % of the impact velocity at random, which drops it from a branch that is stable but
attracts weakly long before its fold. So the first call of a step looks ahead along the line of action, where the motion
y obeys y'' = free - mobility F with all other forces in `free`. If the rule ends the step on the other side of such an
event, Runge-Kutta substeps integrate the same equation truly. What the rule misses by, dx and dv, is made up for by
accelerations dv/h + dx/h^2 at the end of this step and -dx/h^2 at the end of the next one, fixed before Newton's
iteration: two steps later y has moved by dx + h dv and y' by dv. Until then the integrated motion lacks a known rest,
the shift, by which the contact evaluates its force at the corrected motion. Pulses enter neither the recorded force nor
the energies.
"""

from math import nan
from typing import NamedTuple

import numpy as np

from exugear.contact.contact import Motion, Push, push
from exugear.contact.relative_position import flank_of
from exugear.mesh_force.force_kernels import StaticForce
from exugear.mesh_force.kernel_records import record_type
from exugear.multibody.addresses import address_of, reader
from exugear.multibody.step_ends import SAME_STEP
from fem.support.numba_cache import apart, compiled

#: Runge-Kutta substeps in a step with an event.
SUBSTEPS = 8
#: Largest number of iterations for the end of the step by the rule, and the change of the acceleration over that of
#: gravity at which they end.
ITERATIONS, SMALL = 8, 1e-6
#: Share of the travel in a step, and changes by the acceleration, within which an event may lie beside its forecast.
TRAVEL_SHARE, ACCELERATION_SHARE = 0.5, 2.0
#: A contact in the steps of an integrator. duration: of a step [s], 0 without predictor; deflection and rate per
#: acceleration along the line of action at the end of a step [s^2, s]; compliance: acceleration per mesh force in a
#: step [1/kg]; matrix: mesh force per acceleration in the matrix of Newton's iteration [kg]; accelerations that
#: bearings give per displacement and velocity of pinion and wheel [1/s^2, 1/s] in a step; time [s], rate [m/s],
#: force [N] and acceleration by bearings [m/s^2] of the last call; time of this call [s]; predicts: 1 in the first call
#: of a step.
#: For events, mobility: acceleration per mesh force without a step [1/kg], 0 where events are not corrected; lag of the
#: velocities [s^2]; rate by imposed motion [m/s] and penetration [m] in the last call, < 0 on the back flank;
#: accelerations by pulses at the end of this step and of the next [m/s^2], mesh force of the pulse at the end of this
#: step [N]; shift: corrected advance minus the integrated one [m], and its rate [m/s]. Of the mesh of a planet that
#: orbits: mesh forces at the ends of the last step but one and of that before [N], how many of them are known, and by
#: how much its acceleration along the line of action differs from the expected one [m/s^2].
STEPS = record_type(
    *((name, "f8") for name in ("duration", "deflection", "rate", "compliance", "matrix")),
    *((name, "f8", (2, 6)) for name in ("by_displacement", "by_velocity")),
    *((name, "f8") for name in ("last_time", "last_rate", "last_force", "last_by_bearings", "time", "predicts")),
    *((name, "f8") for name in ("mobility", "lag", "last_imposed_rate", "last_penetration")),
    *((name, "f8") for name in ("pulse", "next_pulse", "pulse_force", "shift", "shift_rate")),
    *(("forces", "f8", 2), ("known_forces", "f8"), ("change", "f8")),
)
#: In mesh; out of mesh; in mesh, and the numbers are noted that the law gives; these numbers, held, stand for the law.
IN_MESH, OUT_OF_MESH, NOTED, HELD = 1.0, 0.0, 2.0, 3.0
#: What a system changes in a contact. engaged: one of these four; closed: 1 once teeth have touched. Where coordinates
#: do not count turns: advance in the last call [m], time of the first call of this solve [s], and whether this call is
#: at that time. The lag of the integrator's velocities: by the mesh force [m/N], and by the bearings of pinion and
#: wheel, as factors of their velocities; mobility: acceleration per mesh force [1/kg], 0: unknown; holding_force: mesh
#: force that balances the load while the bearings are not displaced [N]. Of pinion, wheel and carrier: constant torques
#: about z that act beside the mesh [N m]; addresses of their imposed motions (`exugear.multibody.imposed_motion`), 0
#: without; inertias that the contact itself accelerates as imposed [kg m^2]. Addresses of an elastic ring
#: (`exugear.multibody.elastic_rings.RING`) and of `STEP_ENDS` of the mesh of a planet that orbits, 0 without. steps:
#: `STEPS`. Accelerations by elastic shafts of pinion and wheel in a step [m/s^2]
#: (`exugear.multibody.elastic_shafts.MeshesInSteps`). For slopes (`exugear.multibody.contact_tangent`): numbers that
#: the law gives, its stiffness [N/m], side of the flank and arguments of the law.
CONTACT_STATE = record_type(
    *((name, "f8") for name in ("engaged", "closed", "advance", "begin", "begins", "lag")),
    *(("pinion_lag", "f8", 6), ("wheel_lag", "f8", 6), ("mobility", "f8"), ("holding_force", "f8")),
    *(("torques", "f8", 3), ("imposed", "i8", 3), ("inertias", "f8", 3), ("ring", "i8"), ("ends", "i8")),
    ("steps", STEPS),
    ("by_shafts", "f8", 2),
    *(("numbers", "f8", 6), ("stiffness", "f8"), ("side", "f8"), ("arguments", "f8", 5)),
)
state_at = reader(CONTACT_STATE)


def contact_state(ring: np.record | None = None) -> np.record:
    """A new state: in mesh, velocities without lag, no call yet; ring: `RING`, which must outlive the state."""
    state = np.zeros(1, CONTACT_STATE)
    state["engaged"], state["begin"], state["ring"] = IN_MESH, np.inf, address_of(ring)
    return state[0]


class Beside(NamedTuple):
    """What acts on the line of action beside the mesh.

    imposed_rate   rate of the advance by bodies whose motion is imposed [m/s]
    by_bearings    acceleration by the bearings, in the first call of a step [m/s^2]
    lag_rate       by which the rate is too small, because of the bearings [m/s]
    held           mesh force that displaced bearings balance, times the lag [m]
    expected       acceleration at the end of the step of which the kept matrix takes its share [m/s^2], else 0
    """

    imposed_rate: float
    by_bearings: float
    lag_rate: float
    held: float
    expected: float


class Guess(NamedTuple):
    """Accelerations along the line of action [m/s^2] expected of a step: without the mesh force, and at its end.

    Zeros but in the first call of a step.
    """

    free: float
    acceleration: float


@compiled
def begin_call(steps, t):
    """Note the time of a call, and whether it is the first of a step; a call that fails can be repeated."""
    apart = abs(t - steps.last_time - steps.duration)
    steps.predicts = 1.0 if steps.duration > 0.0 and apart < SAME_STEP * steps.duration else 0.0
    if steps.predicts == 0.0 and t != steps.last_time:
        steps.known_forces = 0.0
        steps.pulse = steps.next_pulse = steps.pulse_force = steps.shift = steps.shift_rate = 0.0
    steps.time = t


@compiled
def begin_solve(state, t):
    """Note whether a call begins a solve: at the time of the first call of the solve before, or earlier."""
    state.begins = 1.0 if t <= state.begin else 0.0
    state.begin = min(state.begin, t)


@compiled(forceinline=True)
def push_in_step(law, state, motion, beside, offsets):
    """(`Motion` ahead, `Push` there, force for the integrator without that of a pulse [N], dissipated power [W])."""
    steps = state.steps
    guess = guess_of(law, state, motion, beside, offsets)
    shift = steps.deflection * guess.acceleration + steps.shift
    rate = beside.lag_rate + steps.rate * guess.acceleration + steps.shift_rate
    ahead = shifted(motion, shift, rate)
    push = push_if_engaged(law, state, ahead, offsets)
    force, rate, mobility = push.force, push.rate, state.mobility if push.flank.side > 0.0 else 0.0
    if push.damping > 0.0 and state.lag != 0.0:
        rate = true_rate(push, state.lag, mobility, state.holding_force - beside.held / state.lag)
        force = push.flank.side * push.static.force + push.damping * rate
    slope = slope_in_step(steps, push, state.lag, mobility)
    dissipation = push.damping * rate * rate + steps.pulse_force * ahead.rate
    penetration = push.flank.side * push.static.penetration
    return ahead, push, settled(steps, guess, motion, beside, force, slope, penetration), dissipation


@compiled
def shifted(motion, advance, rate):
    """The motion with a further advance [m] and rate [m/s]."""
    return Motion(motion.advance + advance, motion.rate + rate, motion.opening, motion.phase, motion.phase_rate)


@compiled(forceinline=True)
def push_if_engaged(law, state, motion, offsets):
    """The `Push` of a law, none where the gears are out of mesh; notes whether teeth have touched."""
    if state.engaged == OUT_OF_MESH or state.engaged == HELD:
        flank = flank_of(law, motion.advance, motion.opening, motion.phase)
        note_arguments(state, flank, (0.0, nan, 0.0) if offsets is None else offsets)
        return held_push(state, flank, motion.rate)
    pushed = push(law, motion, offsets)
    if pushed.static.force > 0.0:
        state.closed = 1.0
    if state.engaged == NOTED:
        static, numbers = pushed.static, state.numbers
        numbers[0], numbers[1], numbers[2] = static.force, static.by_phase, static.by_a
        numbers[3], numbers[4], numbers[5] = static.by_misalignment, static.by_axial, pushed.damping
        state.stiffness = static.stiffness
        note_arguments(state, pushed.flank, (0.0, nan, 0.0) if offsets is None else offsets)
    return pushed


@compiled
def note_arguments(state, flank, offsets):
    """Note the side of the flank and the arguments of its law."""
    arguments, state.side = state.arguments, flank.side
    arguments[0], arguments[1] = flank.deflection, flank.phase
    arguments[2], arguments[3], arguments[4] = offsets


@compiled
def held_push(state, flank, rate):
    """The `Push` of the held numbers, none out of mesh."""
    held, numbers = 1.0 if state.engaged == HELD else 0.0, state.numbers
    force, by_phase, c = held * numbers[0], held * numbers[1], held * numbers[5]
    by_offsets = held * numbers[2], held * numbers[3], held * numbers[4]
    static = StaticForce(0.0, 0.0, force, 0.0, 0.0, by_phase, by_offsets[0], by_offsets[1], by_offsets[2])
    return Push(flank, static, c, 0.0, rate, flank.side * force + c * rate)


@compiled
def true_rate(push, lag, mobility, holding_force):
    """The true rate of the advance [m/s], which is that of the integrator + lag d(force)/dt.

    lag             by how much the rate is too small, per time derivative of the force [m/N]
    mobility        acceleration of the bodies per force [1/kg]; 0: unknown
    holding_force   that balances all other forces [N]

    The force contains the damping force at the true rate, for which the equation is solved.
    """
    c, excess = push.damping, push.flank.side * push.static.force - holding_force
    return (push.rate + lag * (push.rise - c * mobility * excess)) / (1.0 + lag * mobility * c * c)


@compiled
def slope_in_step(steps, push, lag, mobility):
    """Slope of the force over the acceleration at the end of a step [kg]; lag, mobility: as in `true_rate`."""
    k, c = push.static.stiffness, push.damping
    yielding = 1.0 + lag * mobility * c * c
    return steps.deflection * (k / yielding) + steps.rate * (c * (1.0 + lag * k) / yielding)


@compiled(forceinline=True)
def guess_of(law, state, motion, beside, offsets):
    """The `Guess` of a call, from the motion half a step of the last acceleration ahead."""
    steps = state.steps
    if steps.predicts == 0.0:
        return Guess(0.0, 0.0)
    acceleration = 2.0 * (motion.rate - beside.imposed_rate - steps.last_rate) / steps.duration
    free = acceleration + steps.compliance * (steps.last_force + steps.pulse_force)
    free += beside.by_bearings - steps.last_by_bearings
    change = 0.0 if state.ends == 0 else beside.expected - acceleration
    if steps.mobility > 0.0:
        acceleration = acceleration_with_events(law, steps, motion, beside, offsets, acceleration, change)
    else:
        acceleration += change
    if state.ends == 0:
        return Guess(free, acceleration)
    return Guess(acceleration + steps.compliance * expected_force(steps), acceleration)


@compiled
def expected_force(steps):
    """Mesh force [N] to expect at the end of a step from those of the last three; notes the last one."""
    forces, last = steps.forces, steps.last_force
    if steps.known_forces == 0.0:
        forces[0] = forces[1] = last
    elif steps.known_forces == 1.0:
        forces[1] = 2.0 * forces[0] - last
    expected = 3.0 * (last - forces[0]) + forces[1]
    forces[1], forces[0] = forces[0], last
    steps.known_forces = min(steps.known_forces + 1.0, 2.0)
    return expected


@compiled
def settled(steps, guess, motion, beside, force, slope, penetration):
    """The force [N] for the integrator, without that of a pulse; notes the call for the next step.

    motion        of the integrator
    force         at the guess [N], with its slope over the acceleration at the end of the step [kg]
    penetration   there [m], < 0 on the back flank
    """
    steps.last_time = steps.time
    if steps.predicts == 0.0:
        steps.last_rate, steps.last_imposed_rate = motion.rate - beside.imposed_rate, beside.imposed_rate
        steps.last_force, steps.last_penetration = force, penetration
        return force
    steps.last_by_bearings = beside.by_bearings
    unforced = guess.free - steps.compliance * (force + steps.pulse_force - slope * guess.acceleration)
    acceleration = unforced / (1.0 + steps.compliance * slope)
    expected = force + slope * (acceleration - guess.acceleration)
    steps.change = acceleration - beside.expected
    return expected - steps.matrix * steps.change


@compiled
def zone_of(law, penetration):
    """0 without contact, +-1 in the ramp of the damping, +-2 beyond it.

    penetration   of the flanks [m], < 0 on the back flank; zones likewise
    """
    if penetration == 0.0:
        return 0.0
    depth = 1.0 if law.damping > 0.0 and abs(penetration) < law.damping_ramp else 2.0
    return depth if penetration > 0.0 else -depth


@compiled
def moved(motion, advance, rate, before):
    """The motion at an earlier time, by before [s], with this advance [m] and rate [m/s]."""
    return Motion(advance, rate, motion.opening, motion.phase - motion.phase_rate * before, motion.phase_rate)


@apart
def true_push(law, offsets, motion, lag, mobility, free):
    """(`Push`, true force [N]) in a motion whose rate is too large by lag [s^2] times its second derivative.

    lag    0 for true rates
    free   acceleration by all other forces [m/s^2], which matters for rates that lag
    """
    pushed = push(law, motion, offsets)
    if pushed.damping == 0.0:
        return pushed, pushed.force
    rate = true_rate(pushed, lag * mobility, mobility, free / mobility)
    return pushed, pushed.flank.side * pushed.static.force + pushed.damping * rate


@compiled
def jerk_of(push, force, mobility, free):
    """Second derivative of the rate [m/s^3] by the contact."""
    return -mobility * (push.rise + push.damping * (free - mobility * force))


@apart
def end_by_rule(law, steps, offsets, predicted, free, acceleration):
    """(acceleration [m/s^2], zone) at the end of a step by the rule, without pulses, from a first guess."""
    beta_h2, gamma_h, mobility, zone = steps.deflection, steps.rate, steps.mobility, 0.0
    for _ in range(ITERATIONS):
        motion = shifted(predicted, beta_h2 * acceleration, gamma_h * acceleration)
        push, force = true_push(law, offsets, motion, steps.lag, mobility, free)
        zone = zone_of(law, push.flank.side * push.static.penetration)
        slope = beta_h2 * push.static.stiffness + gamma_h * push.damping
        change = (free - mobility * force - acceleration) / (1.0 + mobility * slope)
        acceleration += change
        if abs(change) < SMALL:
            break
    return acceleration, zone


@apart
def true_end(law, steps, offsets, end, start, free):
    """(advance [m], rate [m/s]) at the end of a step in truth, the rate as the rule has it.

    end     the motion at the end, of which opening and phases count
    start   advance and rate at the beginning, the latter as the rule has it
    free    acceleration by all other forces at the beginning and at the end [m/s^2]
    """
    h, m = steps.duration, steps.mobility
    push, force = true_push(law, offsets, moved(end, start[0], start[1], h), steps.lag, m, free[0])
    y, v = start[0], start[1] - steps.lag * jerk_of(push, force, m, free[0])
    dt, drift = h / SUBSTEPS, (free[1] - free[0]) / h
    for i in range(SUBSTEPS):
        dy = dv = 0.0
        y_stage, v_stage = y, v
        for stage in range(4):
            s = (i + 0.5 * ((stage + 1) // 2)) * dt
            force = true_push(law, offsets, moved(end, y_stage, v_stage, h - s), 0.0, m, 0.0)[1]
            a = free[0] + drift * s - m * force
            weight = dt / 3.0 if stage == 1 or stage == 2 else dt / 6.0
            dy, dv = dy + weight * v_stage, dv + weight * a
            ahead = dt if stage == 2 else 0.5 * dt
            y_stage, v_stage = y + ahead * v_stage, v + ahead * a
        y, v = y + dy, v + dv
    push, force = true_push(law, offsets, moved(end, y, v, 0.0), 0.0, m, 0.0)
    return y, v + steps.lag * jerk_of(push, force, m, free[1])


@compiled
def may_meet_event(law, steps, change, acceleration):
    """Whether a step that changes the advance so [m] may touch the ramp of the damping or a loss of contact."""
    if abs(zone_of(law, steps.last_penetration)) < 2.0:
        return True
    side = 1.0 if steps.last_penetration > 0.0 else -1.0
    margin = TRAVEL_SHARE * abs(change) + ACCELERATION_SHARE * steps.deflection * abs(acceleration)
    return abs(steps.last_penetration) + min(side * change, 0.0) - margin < law.damping_ramp


@compiled(forceinline=True)
def acceleration_with_events(law, steps, motion, beside, offsets, acceleration, change_expected):
    """The acceleration [m/s^2] to expect at the end of a step, whose pulse and shift it sets.

    acceleration      of the coordinates that are not imposed, at the beginning of the step [m/s^2]
    change_expected   of it in the step where nothing happens [m/s^2]
    """
    h, h2, beta_h2, gamma_h = steps.duration, steps.duration * steps.duration, steps.deflection, steps.rate
    earlier, pulse, next_pulse = steps.pulse, steps.next_pulse, 0.0
    x, v = steps.shift + h * steps.shift_rate, steps.shift_rate
    x, v = x - (0.5 * h2 - beta_h2) * earlier, v - gamma_h * earlier
    imposed = (beside.imposed_rate - steps.last_imposed_rate) / h
    change = h * motion.rate - beta_h2 * acceleration - 0.5 * h2 * imposed
    expected = acceleration + change_expected - earlier
    if may_meet_event(law, steps, change, acceleration):
        free = acceleration - earlier + steps.mobility * steps.last_force
        free_end = free + beside.by_bearings - steps.last_by_bearings
        predicted = shifted(motion, x, v)
        expected, zone = end_by_rule(law, steps, offsets, predicted, free_end, expected)
        if zone != zone_of(law, steps.last_penetration):
            before = motion.rate - gamma_h * acceleration - h * imposed
            start = motion.advance - change + steps.shift, before + steps.shift_rate
            y, rate = true_end(law, steps, offsets, motion, start, (free + imposed, free_end + imposed))
            dx = y - predicted.advance - beta_h2 * expected
            dv = rate - predicted.rate - gamma_h * expected
            pulse, next_pulse = pulse + dv / h + dx / h2, -dx / h2
            x, v = x + dx, v + dv
    steps.pulse, steps.next_pulse, steps.pulse_force = pulse, next_pulse, -pulse / steps.mobility
    steps.shift, steps.shift_rate = x - beta_h2 * pulse, v - gamma_h * pulse
    return expected + pulse
