"""The first guess of a contact in a step, which saves iterations of Newton's method.

Exudyn begins each step with accelerations of 0, far from the solution, and keeps the matrix of its iteration over many
steps. So the first call of a contact in a step does not return the force in that state. It expects the acceleration y''
along the line of action to follow from that of the step before, y'' = free - compliance F, in which `free` contains all
other forces, solves this for the mesh force F with its present slopes, and returns the force with which the linear
solve by the matrix arrives there. All further calls return the force in their state, so that the residual, by which
the iteration ends, is the true one: a poor guess costs an iteration and no accuracy.
"""

from typing import NamedTuple

from exugear.contact.contact_events import corrected_step
from fem.support.numba_cache import compiled

#: Difference of two times from a step, over the step, up to which they are one step apart.
SAME_STEP = 0.01


class Guess(NamedTuple):
    """What is expected of a step along the line of action.

    free           acceleration without the mesh force [m/s^2]
    acceleration   at the end of the step [m/s^2]
    deflection     by this acceleration [m]
    rate           by this acceleration [m/s]
    """

    free: float
    acceleration: float
    deflection: float
    rate: float


@compiled
def begin_call(steps, t):
    """Note the time of a call, and whether it is the first of a step; a call that fails can be repeated."""
    apart = abs(t - steps.last_time - steps.duration)
    steps.guesses = 1.0 if steps.duration > 0.0 and apart < SAME_STEP * steps.duration else 0.0
    if steps.guesses == 0.0 and t != steps.last_time:
        steps.pulse = steps.next_pulse = steps.pulse_force = steps.shift = steps.shift_rate = 0.0
    steps.time = t


@compiled
def begin_solve(contact, t):
    """Note whether a call begins a solve: at the time of the first call of the solve before, or earlier."""
    contact.begins = 1.0 if t <= contact.begin else 0.0
    contact.begin = min(contact.begin, t)


@compiled
def guess_of(table, steps, line, offsets):
    """The `Guess` in the first call of a step, else zeros.

    line      `Line` as predicted: half a step of the last acceleration ahead
    offsets   as in `contact_events.push_at`
    """
    if steps.guesses == 0.0:
        return Guess(0.0, 0.0, 0.0, 0.0)
    acceleration = 2.0 * (line.rate - line.imposed_rate - steps.last_rate) / steps.duration
    change = line.by_bearings - steps.last_by_bearings
    free = acceleration + steps.compliance * (steps.last_force + steps.pulse_force) + change
    if steps.mobility > 0.0:
        acceleration = corrected_step(table, steps, line, offsets, acceleration)
    return Guess(free, acceleration, steps.deflection * acceleration, steps.rate * acceleration)


@compiled
def force_with_guess(steps, guess, line, force, slopes, penetration):
    """The force [N] that the contact returns, without that of a pulse.

    line          as in `guess_of`
    force         along the line of action at the guess, > 0 on the driving flank [N]
    slopes        of it there, over deflection and rate [N/m, N s/m]
    penetration   there [m], < 0 on the back flank
    """
    steps.last_time = steps.time
    if steps.guesses == 0.0:
        steps.last_rate, steps.last_imposed_rate = line.rate - line.imposed_rate, line.imposed_rate
        steps.last_force, steps.last_penetration = force, penetration
        return force
    steps.last_by_bearings = line.by_bearings
    slope = steps.deflection * slopes[0] + steps.rate * slopes[1]
    unforced = guess.free - steps.compliance * (force + steps.pulse_force - slope * guess.acceleration)
    acceleration = unforced / (1.0 + steps.compliance * slope)
    solved = force + slope * (acceleration - guess.acceleration)
    return solved - steps.matrix * acceleration
