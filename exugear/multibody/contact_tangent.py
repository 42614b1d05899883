"""Slopes of the forces of a contact by coordinates and velocities: exact for modes, a spring for Newton's iteration.

The generalized forces depend on the law through a few numbers: the derivatives of its potential and the damping
coefficient. Held, they stand for the law. So, exactly,

    dF/dq = dF/dq at held numbers + sum over them of dF/d(number) d(number)/dq,

where d(number)/dq = sum of `law_slopes` times the slopes of the law's arguments by the coordinates, which are the
generalized forces of unit numbers, signs changed (virtual work). Only geometry, and the friction of a held force, is
differentiated by differences: no difference of a force meets the kink where contact begins or ends, and the slopes are
those of the side on which the motion is.

Newton's iteration takes the law as a spring along the force instead, which turns with the phase: with the rows r and p
of unit mesh force and unit torque by the phase, k r r^T + F_phase (r p^T + p r^T) + U_phase,phase p p^T stands for the
sum; the slopes by the phase follow from the numbers an instant later, in runs. Of static solves, where the teeth turn
little, k r r^T stands for the sum, with the row r of all numbers per force. What this leaves out are the changes with
the offsets and, in runs, those of the row: F / (k r_b) of the matrix, 1e-4 of it (iterations stay as many, and a matrix
takes 26 us for 62 in the plane). It needs no law but the contact's; `law_slopes` would lengthen the first compilation
by 3 s.
"""

from collections.abc import Sequence
from math import ulp
from typing import NamedTuple

import numpy as np

from exugear.contact.reference_configuration import turns_forces
from exugear.contact.rotation import BodyKind
from exugear.mesh_force.kernel_records import changed, start_of_field
from exugear.mesh_force.law_slopes import ARGUMENTS, BY_MISALIGNMENT, BY_PHASE, DAMPING, FORCE, law_slopes
from exugear.multibody.addresses import address_of, floats_of
from exugear.multibody.integrator_steps import CONTACT_STATE, HELD, NOTED, OUT_OF_MESH
from exugear.multibody.recorder import HEADER
from fem.support.numba_cache import kept

#: Step of differences of the geometry [m, rad], over the spacing of floats at the largest coordinate at least, and over
#: the speed at which friction fades.
STEP, LEAST_SPACINGS, SHARE_OF_FADING = 1e-8, 1e5, 1e-5
#: Gap of teeth that just touch [m].
TOUCHING = 1e-9
#: Time [s] over which the stiffness changes as the bodies move.
AHEAD = 1e-8
#: Mesh frequency [Hz] below which the change over the phase is left out of Newton's matrix.
SLOWEST = 1.0
#: Relative step of the held numbers where friction depends on them.
HELD_STEP = 1e-6
#: Backlash [m] with which the flank of a held contact stays the same.
SAME_FLANK = 1e9
#: Where fields lie among the floats of a contact state; all that a contact notes of its law, up to the arguments used.
ENGAGED, LAG, MOBILITY = (start_of_field(CONTACT_STATE, name) // 8 for name in ("engaged", "lag", "mobility"))
FIRST = {name: start_of_field(CONTACT_STATE, name) // 8 for name in ("pinion_lag", "wheel_lag", "numbers", "arguments")}
PINION_LAG, WHEEL_LAG = (slice(FIRST[name], FIRST[name] + 6) for name in ("pinion_lag", "wheel_lag"))
NUMBERS, NOTES = slice(FIRST["numbers"], FIRST["numbers"] + 6), slice(FIRST["numbers"], FIRST["arguments"] + 2)
#: Header of a recorder that takes no samples, and its address.
NO_SAMPLES = np.zeros(1, HEADER)[0]
SAMPLES = address_of(NO_SAMPLES)
#: Numbers without a force, and units of each.
NO_NUMBERS, UNITS = np.zeros(ARGUMENTS + 1), np.eye(ARGUMENTS + 1)
#: Factors that leave the damping out.
STATIC = 1.0 - UNITS[DAMPING]


class ContactTangent(NamedTuple):
    """A contact of n coordinates, linearized.

    by_coordinates   (n, n) stiffness: slopes of the generalized forces by the coordinates, signs changed
    by_velocities    (n, n) damping, likewise
    rows             (5, n) slopes of the arguments of the law by the coordinates
    slopes           (6, 5) of the law (`exugear.mesh_force.law_slopes`)
    damping          coefficient along the line of action [N s/m]
    """

    by_coordinates: np.ndarray
    by_velocities: np.ndarray
    rows: np.ndarray
    slopes: np.ndarray
    damping: float


class Noted(NamedTuple):
    """What a contact notes of its law in a call.

    numbers     (6,) that the law gives
    stiffness   of the force by the deflection [N/m]
    side        of the flank
    deflection, phase   at which the law was evaluated [m, pitches]
    """

    numbers: list[float]
    stiffness: float
    side: float
    deflection: float
    phase: float


class HeldContact:
    """A contact whose law is replaced by held numbers: its forces depend on them, on geometry and on friction.

    kernel, records   `exugear.multibody.gear_contact.StoredContact`; the state among the records is a copy, whose lag
                      this leaves out
    kinds             of the bodies

    A run asks for its matrix in each segment: the state is read and written as floats, as numpy takes a microsecond and
    more for the field of a record.
    """

    def __init__(self, kernel, records, kinds: tuple[BodyKind, ...]):
        self.law, self.frame, self.state, self.friction = records
        self.kernel, self.kinds = kernel, kinds
        self.turns_forces = turns_forces(self.frame)
        self.on_flank = {side: changed(self.law.head, backlash=side * SAME_FLANK) for side in (1.0, -1.0)}
        rough = smooth = address_of(self.friction)
        if self.friction is not None:
            self.frictionless = changed(self.friction, head=changed(self.friction.head, factor=0.0))
            smooth = address_of(self.frictionless)
        self.addresses = {
            rubs: [address_of(self.law), address_of(self.frame), address_of(self.state), friction, SAMPLES]
            for rubs, friction in ((True, rough), (False, smooth))
        }
        self.laws = {0.0: address_of(self.law)} | {side: address_of(law) for side, law in self.on_flank.items()}
        self.floats = floats_of(self.state)
        self.lagging, self.lags = _lagging(kinds)
        self.t = 0.0

    def begin(self, t: float) -> None:
        """Evaluate from now on at t [s], without lag, whichever flank is nearest to contact."""
        self.t = t
        self.floats[LAG] = self.floats[PINION_LAG] = self.floats[WHEEL_LAG] = 0.0
        self.hold_flank(0.0)

    def hold_flank(self, side: float) -> None:
        """Keep the flank that is nearest to contact: +1 driving, -1 back flank; 0: do not."""
        self.addresses[True][0] = self.addresses[False][0] = self.laws[side]

    def noted(self, point: list[float], t: float) -> Noted:
        """What the law gives at coordinates and velocities (2 n,)."""
        self.floats[ENGAGED] = NOTED
        self.kernel(*self.addresses[True], t, *point)
        *numbers, stiffness, side, deflection, phase = self.floats[NOTES].tolist()
        return Noted(numbers, stiffness, side, deflection, phase)

    def forces(self, point: list[float], numbers: Sequence[float] | np.ndarray, *, rubs: bool) -> np.ndarray:
        """(n,) generalized forces at coordinates and velocities (2 n,) under held numbers (6,)."""
        self.floats[ENGAGED], self.floats[NUMBERS] = HELD, numbers
        return np.array(self.kernel(*self.addresses[rubs], self.t, *point))

    def by_coordinates(self, point: list[float], numbers: Sequence[float] | np.ndarray) -> np.ndarray:
        """(n, n) slopes of the forces under held numbers by the coordinates."""
        q = point[: len(point) // 2]
        return self._differences(point, numbers, range(len(q)), max(STEP, LEAST_SPACINGS * ulp(max(map(abs, q)))))

    def by_rubbing(self, point: list[float], numbers: Sequence[float] | np.ndarray) -> np.ndarray:
        """(n, n) slopes of the forces under held numbers without damping by the velocities, through friction."""
        n = len(point) // 2
        step = max(SHARE_OF_FADING * float(self.friction.head.speed), LEAST_SPACINGS * ulp(max(map(abs, point[n:]))))
        return self._differences(point, numbers, range(n, 2 * n), step)

    def _differences(
        self, point: list[float], numbers: Sequence[float] | np.ndarray, entries, step: float
    ) -> np.ndarray:
        """(n, n) slopes of the forces under held numbers by entries of the point, by central differences."""
        self.floats[ENGAGED], self.floats[NUMBERS] = HELD, numbers
        state, addresses, columns = list(point), self.addresses[True], []
        for i in entries:
            middle = state[i]
            state[i] = middle + step
            after, above = self.kernel(*addresses, self.t, *state), state[i]
            state[i] = middle - step
            before = self.kernel(*addresses, self.t, *state)
            columns.append([(b - a) / (above - state[i]) for a, b in zip(before, after, strict=True)])
            state[i] = middle
        return np.array(columns).T


def _lagging(kinds: tuple[BodyKind, ...]) -> tuple[list[int], list[int]]:
    """Coordinates of a contact whose velocities lag by its bearings, and where their lags lie in its state."""
    coordinates: list[int] = []
    lags: list[int] = []
    first = 0
    for kind, lag in zip(kinds, ("pinion_lag", "wheel_lag"), strict=False):
        components = [i for i in kind.components if i < 6]
        coordinates += range(first, first + len(components))
        lags += [FIRST[lag] + i for i in components]
        first += kind.size
    return coordinates, lags


def spring_matrix(held: HeldContact, t: float, q, q_t, factors: tuple[float, float]) -> np.ndarray:
    """(n, n) matrix -factor dF/dq - factor_t dF/dq_t of a contact whose law is a spring along its force.

    Arguments as those of `contact_tangent`; factors of the derivatives by coordinates and by velocities. Teeth that
    just touch count as pressed: static solves begin there. The slopes
    along the line of action are those with the correction of the lag of velocities (`integrator_steps.true_rate`).
    """
    n, point, rubs = len(q), [*map(float, q), *map(float, q_t)], held.friction is not None
    engaged, lag, mobility = (float(held.floats[i]) for i in (ENGAGED, LAG, MOBILITY))
    if engaged == OUT_OF_MESH:
        return np.zeros((n, n))
    by_bearings = _by_bearings(held, n) if lag else np.zeros(n)
    held.begin(t)
    law = held.noted(point, t)
    if law.numbers[FORCE] <= 0.0:
        row = held.forces(point, NO_NUMBERS, rubs=False) - held.forces(point, UNITS[FORCE], rubs=False)
        touching = TOUCHING * row / max(row @ row, TOUCHING)
        point = [*(np.array(point[:n]) + touching).tolist(), *point[n:]]
        law = held.noted(point, t)
    force, k, c = law.numbers[FORCE], law.stiffness, law.numbers[DAMPING]
    if force <= 0.0:
        return np.zeros((n, n))
    stiffening = across = along = 0.0
    if lag:
        later = [x + AHEAD * v for x, v in zip(point, point[n:], strict=False)] + point[n:]
        ahead = held.noted(later, t + AHEAD)
        stiffening, phase_rate = (ahead.stiffness - k) / AHEAD, (ahead.phase - law.phase) / AHEAD
        if abs(phase_rate) > SLOWEST:
            deflection_rate = (ahead.deflection - law.deflection) / AHEAD
            rate, rate_by_phase = ((ahead.numbers[i] - law.numbers[i]) / AHEAD for i in (FORCE, BY_PHASE))
            across = (rate - k * deflection_rate) / phase_rate
            along = (rate_by_phase - across * deflection_rate) / phase_rate
    mobility = mobility if law.side > 0 else 0.0
    yielding = 1.0 + lag * mobility * c**2
    static = [*law.numbers[:DAMPING], 0.0]
    held.hold_flank(law.side)
    at_zero, roll = held.forces(point, NO_NUMBERS, rubs=False), np.zeros(n)
    if across or along:
        row, roll = (at_zero - held.forces(point, UNITS[i], rubs=False) for i in (FORCE, BY_PHASE))
    else:
        row = (at_zero - held.forces(point, static, rubs=False)) / force
    rubbing = row
    if rubs:
        smooth, rough = (held.forces(point, static, rubs=x) for x in (False, True))
        rubbing = row + (smooth - rough) / force
    by_motion = (k + c * lag * stiffening) / yielding, c * (1.0 + lag * k) / yielding, mobility * c**2 / yielding
    spring = _spring((rubbing, row, roll), by_bearings, by_motion, (across, along), factors)
    if (rubs or held.turns_forces) and not lag:
        with_damping = [*law.numbers[:DAMPING], by_motion[1]]
        spring -= factors[0] * held.by_coordinates(point, with_damping)
    return spring - factors[1] * held.by_rubbing(point, static) if rubs else spring


@kept
def _spring(rows, by_bearings, by_motion, by_phase, factors):
    """(n, n) matrix of a spring along the force of a contact, which turns with the phase; numpy took 10 us more.

    rows          (n,) each: of the force with friction, of the force, of the torque by the phase, each per its unit
    by_bearings   (n,) as of `_by_bearings`
    by_motion     slopes of the force by the advance [N/m] and by its rate [N s/m], and by the rate that bearings add
    by_phase      slopes of the force and of the torque by the phase
    factors       of the derivatives by coordinates and by velocities
    """
    (rubbing, row, roll), (k, c, by_lag), (across, along), (factor, factor_t) = rows, by_motion, by_phase, factors
    n = len(row)
    spring = np.empty((n, n))
    for j in range(n):
        force = factor * (k * row[j] - by_lag * by_bearings[j] + across * roll[j])
        by_rate, torque = factor_t * c * (row[j] + by_bearings[j]), factor * (across * row[j] + along * roll[j])
        for i in range(n):
            spring[i, j] = rubbing[i] * force + row[i] * by_rate + roll[i] * torque
    return spring


def _by_bearings(held: HeldContact, n: int) -> np.ndarray:
    """(n,) factors of the velocities by which bearings let the rate of the advance lag."""
    factors = np.zeros(n)
    factors[held.lagging] = held.floats[held.lags]
    return factors


def contact_tangent(held: HeldContact, q, q_t) -> ContactTangent:
    """The tangent of a contact at coordinates and velocities (n,).

    Velocities are true: without the correction of their lag.
    """
    n, point, rubs = len(q), [*map(float, q), *map(float, q_t)], held.friction is not None
    held.begin(0.0)
    without = held.forces(point, NO_NUMBERS, rubs=False)
    side = float(held.state.side)
    numbers, slopes = law_slopes(held.law.head, side, tuple(held.state.arguments.tolist()))
    if not numbers.any():
        return ContactTangent(np.zeros((n, n)), np.zeros((n, n)), np.zeros((ARGUMENTS, n)), slopes, 0.0)
    held.hold_flank(side)
    by_number = np.zeros((ARGUMENTS + 1, n))
    acting = slopes[:ARGUMENTS].any(axis=1) | (numbers[:ARGUMENTS] != 0) | slopes.any(axis=0)
    for i in (*np.flatnonzero(acting), DAMPING):
        by_number[i] = held.forces(point, UNITS[i], rubs=False) - without
    rows = -by_number[:ARGUMENTS]
    by_coordinates, by_velocities = np.zeros((n, n)), numbers[DAMPING] * np.outer(rows[FORCE], rows[FORCE])
    for i in (FORCE, BY_MISALIGNMENT) if rubs else ():
        change = HELD_STEP * numbers[FORCE] * UNITS[i]
        after, before = (held.forces(point, numbers + x, rubs=True) for x in (change, -change))
        by_number[i] = (after - before) / (2 * change[i])
    if rubs or held.turns_forces:
        by_coordinates = -held.by_coordinates(point, numbers)
    if rubs:
        by_velocities = by_velocities - held.by_rubbing(point, numbers * STATIC)
    along = _by_coordinates(rows, held.kinds, held.frame, q)
    return ContactTangent(
        by_coordinates - by_number.T @ (slopes @ along), by_velocities, along, slopes, numbers[DAMPING]
    )


def _by_coordinates(rows: np.ndarray, kinds: tuple[BodyKind, ...], frame: np.record, q) -> np.ndarray:
    """(5, n) slopes by the coordinates from those by their rates: of a rotation vector these are angular velocities."""
    rows, first = rows.copy(), 0
    for kind, gear in zip(kinds, (frame.pinion, frame.wheel), strict=False):
        if kind.angular_rates:
            angles = slice(first + 3, first + 6)
            rows[:, angles] = rows[:, angles] @ kind.angular_rates(gear.rotation[:3] + np.array(q[angles]))
        first += kind.size
    return rows
