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
the offsets. It needs no further compiled code; `law_slopes` would lengthen the first compilation by 3 s.
"""

from math import ulp
from typing import NamedTuple

import numpy as np

from exugear.contact.recorder import HEADER
from exugear.contact.reference_configuration import turns_forces
from exugear.contact.rotation import CODES, PLANAR, ROTATION_VECTOR, SIZES, SPIN, velocity_by_vector
from exugear.mesh_force.kernel_records import address_of, changed
from exugear.mesh_force.law_slopes import ARGUMENTS, BY_MISALIGNMENT, BY_PHASE, DAMPING, FORCE, law_slopes
from exugear.multibody.integrator_steps import HELD, NOTED, OUT_OF_MESH

#: Step of differences of the geometry [m, rad], over the spacing of floats at the largest coordinate at least, and over
#: the speed at which friction fades.
STEP, LEAST_SPACINGS, SHARE_OF_FADING = 1e-8, 1e5, 1e-5
#: Gap of teeth that just touch [m].
TOUCHING = 1e-9
#: Time [s] over which the stiffness changes as the bodies move.
AHEAD = 1e-8
#: Mesh frequency [Hz] below which the change over the phase is left out of Newton's matrix.
SLOWEST = 1.0
#: Displacements of bodies that do not move in space among those of an Rxyz body.
COMPONENTS = {SPIN: [5], PLANAR: [0, 1, 5]}
#: Relative step of the held numbers where friction depends on them.
HELD_STEP = 1e-6
#: Backlash [m] with which the flank of a held contact stays the same.
SAME_FLANK = 1e9
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


class HeldContact:
    """A contact whose law is replaced by held numbers: its forces depend on them, on geometry and on friction.

    kernel, records   `exugear.multibody.gear_contact.StoredContact`; the state among the records is a copy, whose lag
                      this leaves out
    kinds             of the bodies
    """

    def __init__(self, kernel, records, kinds: tuple[str, ...]):
        self.law, self.frame, self.state, self.friction = records
        self.kernel, self.kinds, self.numbers = kernel, kinds, self.state["numbers"]
        self.on_flank = {side: changed(self.law.head, backlash=side * SAME_FLANK) for side in (1.0, -1.0)}
        rough = smooth = address_of(self.friction)
        if self.friction is not None:
            self.frictionless = changed(self.friction, head=changed(self.friction.head, factor=0.0))
            smooth = address_of(self.frictionless)
        self.addresses = {
            rubs: [address_of(self.law), address_of(self.frame), address_of(self.state), friction, SAMPLES]
            for rubs, friction in ((True, rough), (False, smooth))
        }
        self.t = 0.0

    def begin(self, t: float) -> None:
        """Evaluate from now on at t [s], without lag, whichever flank is nearest to contact."""
        self.t, self.state.lag = t, 0.0
        self.state["pinion_lag"], self.state["wheel_lag"] = 0.0, 0.0
        self._take(self.law)

    def hold_flank(self, side: float) -> None:
        """Keep the flank that is nearest to contact: +1 driving, -1 back flank."""
        self._take(self.on_flank[side])

    def _take(self, law: np.record) -> None:
        address = address_of(law)
        self.addresses[True][0], self.addresses[False][0] = address, address

    def noted(self, point: np.ndarray, t: float) -> tuple[np.ndarray, float]:
        """Numbers (6,) that the law gives, and its stiffness [N/m]."""
        self.state.engaged = NOTED
        self.kernel(*self.addresses[True], t, *point.tolist())
        return self.numbers.copy(), float(self.state.stiffness)

    def rates(
        self, point: np.ndarray, t: float, numbers: np.ndarray, stiffness: float
    ) -> tuple[np.ndarray, float, np.ndarray]:
        """Rates (6,) of the numbers and of the stiffness as the bodies move, and (2,) of deflection and phase [1/s]."""
        n, arguments = point.size // 2, []
        later = point + AHEAD * np.array([*point[n:], *[0.0] * n])
        for self.t, x in ((t + AHEAD, later), (t, point)):
            self.forces(x, NO_NUMBERS, rubs=False)
            arguments.append(self.state.arguments[:2].copy())
        numbers_later, stiffness_later = self.noted(later, t + AHEAD)
        change = numbers_later - numbers, stiffness_later - stiffness, arguments[0] - arguments[1]
        return change[0] / AHEAD, change[1] / AHEAD, change[2] / AHEAD

    def forces(self, point: np.ndarray, numbers: np.ndarray, *, rubs: bool) -> np.ndarray:
        """(n,) generalized forces at coordinates and velocities (2 n,) under held numbers (6,)."""
        self.state.engaged, self.numbers[:] = HELD, numbers
        return np.array(self.kernel(*self.addresses[rubs], self.t, *point.tolist()))

    def by_coordinates(self, point: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        """(n, n) slopes of the forces under held numbers by the coordinates."""
        q = point[: point.size // 2]
        return self._differences(point, numbers, range(q.size), max(STEP, LEAST_SPACINGS * ulp(np.abs(q).max())))

    def by_rubbing(self, point: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        """(n, n) slopes of the forces under held numbers without damping by the velocities, through friction."""
        n = point.size // 2
        step = max(SHARE_OF_FADING * float(self.friction.head.speed), LEAST_SPACINGS * ulp(np.abs(point[n:]).max()))
        return self._differences(point, numbers, range(n, 2 * n), step)

    def _differences(self, point: np.ndarray, numbers: np.ndarray, entries, step: float) -> np.ndarray:
        """(n, n) slopes of the forces under held numbers by entries of the point, by central differences."""
        self.state.engaged, self.numbers[:] = HELD, numbers
        state, addresses, columns = point.tolist(), self.addresses[True], []
        for i in entries:
            middle = state[i]
            state[i] = middle + step
            after, above = self.kernel(*addresses, self.t, *state), state[i]
            state[i] = middle - step
            before = self.kernel(*addresses, self.t, *state)
            columns.append([(b - a) / (above - state[i]) for a, b in zip(before, after, strict=True)])
            state[i] = middle
        return np.array(columns).T


def spring_matrix(held: HeldContact, t: float, q, q_t, factors: tuple[float, float]) -> np.ndarray:
    """(n, n) matrix -factor dF/dq - factor_t dF/dq_t of a contact whose law is a spring along its force.

    Arguments as those of `contact_tangent`; factors of the derivatives by coordinates and by velocities. Teeth that
    just touch count as pressed: static solves begin there. The slopes
    along the line of action are those with the correction of the lag of velocities (`integrator_steps.true_rate`).
    """
    n, point, state, rubs = len(q), np.array([*q, *q_t], float), held.state, held.friction is not None
    lag, mobility = float(state.lag), float(state.mobility)
    by_bearings = _by_bearings(state, held.kinds, n) if lag else 0.0
    if state.engaged == OUT_OF_MESH:
        return np.zeros((n, n))
    held.begin(t)
    numbers, k = held.noted(point, t)
    if numbers[FORCE] <= 0.0:
        row = held.forces(point, NO_NUMBERS, rubs=False) - held.forces(point, UNITS[FORCE], rubs=False)
        point[:n] += TOUCHING * row / max(row @ row, TOUCHING)
        numbers, k = held.noted(point, t)
    force, c, side = float(numbers[FORCE]), float(numbers[DAMPING]), float(state.side)
    if force <= 0.0:
        return np.zeros((n, n))
    stiffening = across = along = 0.0
    if lag:
        rates, stiffening, (deflection_rate, phase_rate) = held.rates(point, t, numbers, k)
        if abs(phase_rate) > SLOWEST:
            across = (rates[FORCE] - k * deflection_rate) / phase_rate
            along = (rates[BY_PHASE] - across * deflection_rate) / phase_rate
    mobility = mobility if side > 0 else 0.0
    yielding = 1.0 + lag * mobility * c**2
    numbers[DAMPING] = c * (1.0 + lag * k) / yielding
    held.hold_flank(side)
    static = numbers * STATIC
    at_zero = held.forces(point, NO_NUMBERS, rubs=False)
    if across or along:
        row, roll = (at_zero - held.forces(point, UNITS[i], rubs=False) for i in (FORCE, BY_PHASE))
    else:
        row, roll = (at_zero - held.forces(point, static, rubs=False)) / force, np.zeros(n)
    rubbing = row
    if rubs:
        smooth, rough = (held.forces(point, static, rubs=x) for x in (False, True))
        rubbing = row + (smooth - rough) / force
    by_coordinates = ((k + c * lag * stiffening) * row - mobility * c**2 * by_bearings) / yielding + across * roll
    by_velocities = c * (1.0 + lag * k) * (row + by_bearings) / yielding
    spring = factors[0] * (np.outer(rubbing, by_coordinates) + np.outer(roll, across * row + along * roll))
    spring += factors[1] * np.outer(row, by_velocities)
    if rubs or turns_forces(held.frame):
        spring -= factors[0] * held.by_coordinates(point, numbers)
    return spring - factors[1] * held.by_rubbing(point, static) if rubs else spring


def _by_bearings(state: np.record, kinds: tuple[str, ...], n: int) -> np.ndarray:
    """(n,) factors of the velocities by which bearings let the rate of the advance lag."""
    lags = state.pinion_lag, state.wheel_lag, np.zeros(6)
    of_bodies = np.concatenate([lag[COMPONENTS.get(kind, range(6))] for kind, lag in zip(kinds, lags, strict=False)])
    return np.append(of_bodies, np.zeros(n - of_bodies.size))


def contact_tangent(held: HeldContact, q, q_t) -> ContactTangent:
    """The tangent of a contact at coordinates and velocities (n,).

    Velocities are true: without the correction of their lag.
    """
    n, point, rubs = len(q), np.array([*q, *q_t], float), held.friction is not None
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
    if rubs or turns_forces(held.frame):
        by_coordinates = -held.by_coordinates(point, numbers)
    if rubs:
        by_velocities = by_velocities - held.by_rubbing(point, numbers * STATIC)
    along = _by_coordinates(rows, held.kinds, held.frame, q)
    return ContactTangent(
        by_coordinates - by_number.T @ (slopes @ along), by_velocities, along, slopes, numbers[DAMPING]
    )


def _by_coordinates(rows: np.ndarray, kinds: tuple[str, ...], frame: np.record, q) -> np.ndarray:
    """(5, n) slopes by the coordinates from those by their rates: of a rotation vector these are angular velocities."""
    if ROTATION_VECTOR not in kinds:
        return rows
    rows, first = rows.copy(), 0
    for kind, gear in zip(kinds, (frame.pinion, frame.wheel), strict=False):
        if kind == ROTATION_VECTOR:
            angles = slice(first + 3, first + 6)
            rows[:, angles] = rows[:, angles] @ velocity_by_vector(gear.rotation[:3] + np.array(q[angles]))
        first += SIZES[CODES[kind]]
    return rows
