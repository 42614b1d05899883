"""A ring whose rim vibrates in modes: what their amplitudes add to the motion along the line of action, and back.

Where a mode displaces the flank of the ring by g(phase) per amplitude a, the advance of the pinion is smaller by g a.
By virtual work the mesh force F is a force F g on the amplitude, and a torque F g' a on the phase, so that the mesh
with its ring conserves energy at any position. g runs around the ring with the mesh; between its values stand cubic
polynomials with their slopes, whose derivative is exact.
"""

from math import pi
from typing import NamedTuple

import numpy as np

from exugear.contact.contact import Push
from exugear.contact.relative_position import flank_of
from exugear.mesh_force.force_kernels import StaticForce
from exugear.mesh_force.pchip import hermite, hermite_slope
from fem.support.numba_cache import compiled


class Ring(NamedTuple):
    """A ring of m modes in a mesh.

    table                        (2, points, m, 2) g and its slope per spacing, of the driving and the coast flank
    masses, stiffness, damping   (m,) modal ones
    state                        (2 m,) amplitudes and their rates
    along, forces                (m,) where g here and the forces on the amplitudes are noted
    start, pitch                 position of the mesh on the ring at phase 0 and its change per pitch, in spacings
    mobility                     sum of g^2 over the modal masses in the reference configuration [1/kg]
    """

    table: np.ndarray
    masses: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    state: np.ndarray
    along: np.ndarray
    forces: np.ndarray
    start: float
    pitch: float
    mobility: float


class Flexed(NamedTuple):
    """What the amplitudes of a ring do along the line of action.

    advance, rate   by which they let the pinion's advance lag [m, m/s]
    by_phase        slope of the advance by the phase [m]
    mobility        acceleration of the advance per mesh force by the modes alone, less that in the reference
                    configuration [1/kg]
    acceleration    of the advance by the stiffness of the modes [m/s^2]
    jerk            its change per time [m/s^3]
    """

    advance: float
    rate: float
    by_phase: float
    mobility: float
    acceleration: float
    jerk: float


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
    table = ring.table[0 if side > 0.0 else 1]
    position = ring.start + ring.pitch * phase
    first = np.floor(position)
    i = int(first) % len(table)
    return Span(table[i], table[(i + 1) % len(table)], position - first)


@compiled
def shape_in(span, mode):
    """Displacement g of the flank by a mode, and its slope per spacing."""
    y_0, m_0 = span.before[mode, 0], span.before[mode, 1]
    y_1, m_1 = span.after[mode, 0], span.after[mode, 1]
    return hermite(span.share, y_0, m_0, y_1, m_1), hermite_slope(span.share, y_0, m_0, y_1, m_1)


@compiled
def flexed(ring, law, motion):
    """`Flexed` in a motion of rigid gears; notes g of all modes."""
    flank, m = flank_of(law, motion.advance, motion.opening, motion.phase), len(ring.masses)
    masses, stiffness, state, along = ring.masses, ring.stiffness, ring.state, ring.along
    span = span_at(ring, flank.side, motion.phase)
    advance, rate, slope, acceleration, jerk, mobility = 0.0, 0.0, 0.0, 0.0, 0.0, -ring.mobility
    for j in range(m):
        g, g_u = shape_in(span, j)
        x, y = state[j], state[m + j]
        along[j] = g
        advance, rate, slope = advance + g * x, rate + g * y, slope + g_u * x
        spring, mobility = g * stiffness[j], mobility + g * g / masses[j]
        acceleration, jerk = acceleration + spring * x / masses[j], jerk + spring * y / masses[j]
    by_phase = ring.pitch * slope
    return Flexed(advance, rate + by_phase * motion.phase_rate, by_phase, mobility, acceleration, jerk)


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
    for j in range(len(ring.forces)):
        ring.forces[j] = force * ring.along[j]


def spacings(angle: float, points: int) -> float:
    """An angle [rad] in spacings of so many points around the ring."""
    return angle * points / (2 * pi)
