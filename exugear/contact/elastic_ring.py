"""A ring whose rim vibrates in modes: what their amplitudes add to the motion along the line of action, and back.

Where a mode displaces the flank of the ring by g(phase) per amplitude a, the advance of the pinion is smaller by g a.
By virtual work the mesh force F is a force F g on the amplitude, and a torque F g' a on the phase, so that the mesh
with its ring conserves energy at any position. g runs around the ring with the mesh; between its values stand cubic
polynomials with their slopes, whose derivative is exact.
"""

from math import pi
from typing import NamedTuple

import numpy as np
from numba import carray

from exugear.contact.contact import Push
from exugear.contact.relative_position import flank_of
from exugear.mesh_force.force_kernels import StaticForce
from exugear.mesh_force.kernel_records import doubles_at, reader, record_type
from exugear.mesh_force.pchip import hermite, hermite_slope
from fem.support.numba_cache import compiled

#: The ring in a mesh. Numbers of modes and of values around the ring; addresses of g and its slope per spacing
#: (2, points, modes, 2), of the driving and the coast flank, of modal masses, stiffnesses and damping (modes), of room
#: for amplitudes and rates (2 modes), and for g here (modes) and forces (modes); position of the mesh on the ring at
#: phase 0 and its change per pitch, in spacings; sum of g^2 over the modal masses in the reference configuration
#: [1/kg].
RING = record_type(
    *((name, "i8") for name in ("modes", "points", "table", "masses", "stiffness", "damping")),
    *((name, "i8") for name in ("state", "along", "forces")),
    *((name, "f8") for name in ("start", "pitch", "mobility")),
)
ring_at = reader(RING)


class Flexed(NamedTuple):
    """What the amplitudes of a ring do along the line of action.

    advance, rate   by which they let the pinion's advance lag [m, m/s]
    by_phase        slope of the advance by the phase [m]
    mobility        acceleration of the advance per mesh force by the modes alone, less that in the reference
                    configuration [1/kg]
    acceleration    of the advance by the stiffness of the modes [m/s^2]
    jerk            its change per time [m/s^3]
    in_step         acceleration by their stiffness and damping in a step of the integrator [m/s^2]
    """

    advance: float
    rate: float
    by_phase: float
    mobility: float
    acceleration: float
    jerk: float
    in_step: float


class Span(NamedTuple):
    """Where a mesh stands between two of the positions around the ring.

    before, after   (modes, 2) displacement g of the flank by each mode, and its slope per spacing, at both
    share           of the spacing behind the mesh
    """

    before: np.ndarray
    after: np.ndarray
    share: float


@compiled
def span_at(ring, side, phase):
    """`Span` of a ring, pressed on a side, at the phase of the driving flank."""
    table = carray(doubles_at(ring.table), (2, ring.points, ring.modes, 2))[0 if side > 0.0 else 1]
    position = ring.start + ring.pitch * phase
    first = np.floor(position)
    i = int(first) % ring.points
    return Span(table[i], table[(i + 1) % ring.points], position - first)


@compiled
def shape_in(span, mode):
    """Displacement g of the flank by a mode, and its slope per spacing."""
    y_0, m_0 = span.before[mode, 0], span.before[mode, 1]
    y_1, m_1 = span.after[mode, 0], span.after[mode, 1]
    return hermite(span.share, y_0, m_0, y_1, m_1), hermite_slope(span.share, y_0, m_0, y_1, m_1)


@compiled
def flexed(ring, law, motion, steps):
    """`Flexed` in a motion of rigid gears; notes g of all modes; steps: of the integrator, of the contact's state."""
    flank, m = flank_of(law, motion.advance, motion.opening, motion.phase), ring.modes
    masses, stiffness = carray(doubles_at(ring.masses), m), carray(doubles_at(ring.stiffness), m)
    damping = carray(doubles_at(ring.damping), m)
    state, along = carray(doubles_at(ring.state), 2 * m), carray(doubles_at(ring.along), m)
    span = span_at(ring, flank.side, motion.phase)
    advance, rate, slope, acceleration, jerk, in_step, mobility = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -ring.mobility
    for j in range(m):
        g, g_u = shape_in(span, j)
        x, y = state[j], state[m + j]
        along[j] = g
        advance, rate, slope = advance + g * x, rate + g * y, slope + g_u * x
        spring, mobility = g * stiffness[j], mobility + g * g / masses[j]
        acceleration, jerk = acceleration + spring * x / masses[j], jerk + spring * y / masses[j]
        yielding = masses[j] + steps.deflection * stiffness[j] + steps.rate * damping[j]
        in_step = in_step + (spring * x + g * damping[j] * y) / yielding
    by_phase = ring.pitch * slope
    return Flexed(advance, rate + by_phase * motion.phase_rate, by_phase, mobility, acceleration, jerk, in_step)


@compiled
def with_torque_on_phase(push, flexed, force):
    """The push of a force [N] with the torque on the phase by the shape of a flexed ring."""
    s = push.static
    by_phase = s.by_phase - push.flank.side * force * flexed.by_phase
    static = StaticForce(
        s.energy,
        s.penetration,
        s.force,
        s.stiffness,
        s.force_by_phase,
        by_phase,
        s.by_a,
        s.by_misalignment,
        s.by_axial,
    )
    return Push(push.flank, static, push.damping, push.rise, push.rate, push.force)


@compiled
def note_forces(ring, force):
    """Note the forces of a mesh force [N] on the amplitudes, where the ring was flexed last."""
    along, forces = carray(doubles_at(ring.along), ring.modes), carray(doubles_at(ring.forces), ring.modes)
    for j in range(ring.modes):
        forces[j] = force * along[j]


def spacings(angle: float, points: int) -> float:
    """An angle [rad] in spacings of so many points around the ring."""
    return angle * points / (2 * pi)
