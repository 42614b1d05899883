"""Compiled: what the modes of an elastic ring do in a mesh of a steady state, and the mesh on them."""

from typing import NamedTuple

import numpy as np

from exugear.contact.elastic_ring import shape_in, span_at
from exugear.mesh_force.kernel_records import array_behind, behind, record_type
from fem.support.numba_cache import compiled

#: Head of a `SteadyRing`: numbers of modes, of values around the ring, and of the first state of the modes; starts of
#: its arrays [bytes from here]; position of the mesh on the ring at phase 0 and its change per pitch, in spacings.
STEADY_RING = record_type(
    *((name, "i8") for name in ("modes", "points", "first", "table_start", "damping_rate_start", "frequency_start")),
    *((name, "i8") for name in ("by_impulses_start", "along_start")),
    *((name, "f8") for name in ("start", "pitch")),
)
ring_behind = behind(STEADY_RING)


class SteadyRing(NamedTuple):
    """A ring of m modes in a mesh.

    first                     number of the first state of the modes
    table                     (2, points, m, 2) shapes g and their slopes per spacing, of driving and coast flank
    damping_rate, frequency   (m,) real and imaginary parts of the eigenvalues [1/s]
    by_impulses               (m,) changes of the second states per impulse
    along                     (2, m) where g here and its slope per pitch are noted
    start, pitch              position of the mesh on the ring at phase 0 and its change per pitch, in spacings
    """

    first: int
    table: np.ndarray
    damping_rate: np.ndarray
    frequency: np.ndarray
    by_impulses: np.ndarray
    along: np.ndarray
    start: float
    pitch: float


@compiled
def ring_of(mesh):
    """The `SteadyRing` of a `STEADY_MESH`."""
    ring = ring_behind(mesh, mesh.ring)
    m = ring.modes
    return SteadyRing(
        ring.first,
        array_behind(ring, ring.table_start, (2, ring.points, m, 2)),
        array_behind(ring, ring.damping_rate_start, m),
        array_behind(ring, ring.frequency_start, m),
        array_behind(ring, ring.by_impulses_start, m),
        array_behind(ring, ring.along_start, (2, m)),
        ring.start,
        ring.pitch,
    )


class Yielding(NamedTuple):
    """What the modes of a ring do along the line of action.

    advance, rate   by which they let the deflection lag [m, m/s]
    by_phase        slope of the advance by the phase [m]
    phase_rate      pitches per time [1/s]
    mobility        change of the rate per impulse of the mesh force [1/kg]
    """

    advance: float
    rate: float
    by_phase: float
    phase_rate: float
    mobility: float


@compiled
def rigid_ring():
    """`Yielding` of a ring as stiff as its map."""
    return Yielding(0.0, 0.0, 0.0, 0.0, 0.0)


@compiled
def yielding_at(ring, side, phase, phase_rate, states):
    """`Yielding` of a ring at the phase of the driving flank, pressed on a side; notes g and its slopes."""
    m, span = len(ring.frequency), span_at(ring, side, phase)
    damping_rate, frequency, by_impulses, along = ring.damping_rate, ring.frequency, ring.by_impulses, ring.along
    advance, rate, slope, mobility = 0.0, 0.0, 0.0, 0.0
    for j in range(m):
        g, g_u = shape_in(span, j)
        g_phase = ring.pitch * g_u
        x, y = states[ring.first + 2 * j], states[ring.first + 2 * j + 1]
        along[0, j], along[1, j] = g, g_phase
        advance, slope = advance + g * x, slope + g_phase * x
        rate += g * (damping_rate[j] * x - frequency[j] * y)
        mobility -= g * g * frequency[j] * by_impulses[j]
    return Yielding(advance, rate + slope * phase_rate, slope, phase_rate, mobility)


@compiled
def push_ring(ring, impulse, states):
    """Change the states of the modes by an impulse of the mesh force [N s], where the ring was last."""
    for j in range(len(ring.by_impulses)):
        states[ring.first + 2 * j + 1] += impulse * ring.along[0, j] * ring.by_impulses[j]


@compiled
def ring_changes(ring, impulse, yielding, matrix, changes):
    """Add to the changes (5, c) of the impulses of a mesh those by the states of the modes.

    changes   of the impulse along the line of action, on the phase, and on the misalignment; of deflection and phase
    """
    damping_rate, frequency, along = ring.damping_rate, ring.frequency, ring.along
    for j in range(len(frequency)):
        g, g_phase, at = along[0, j], along[1, j], ring.first + 2 * j
        by_first = -impulse.by_advance * g - impulse.by_rate * (g * damping_rate[j] + g_phase * yielding.phase_rate)
        by_second = impulse.by_rate * g * frequency[j]
        on_phase = -impulse.by_phase * g - impulse.on_ring * g_phase
        for i in range(matrix.shape[1]):
            changes[0, i] += by_first * matrix[at, i] + by_second * matrix[at + 1, i]
            changes[1, i] += on_phase * matrix[at, i]
    for i in range(matrix.shape[1]):
        changes[1, i] -= yielding.by_phase * (changes[0, i] + impulse.by_linear * changes[3, i])


@compiled
def push_ring_columns(ring, impulse, matrix, changes):
    """Change the columns of a matrix (2 n, c) by the changes (5, c), as `ring_changes`, of the impulse on the modes."""
    by_impulses, along = ring.by_impulses, ring.along
    for j in range(len(by_impulses)):
        at = ring.first + 2 * j + 1
        by_push, by_phase = along[0, j] * by_impulses[j], impulse.on_ring * along[1, j] * by_impulses[j]
        for i in range(matrix.shape[1]):
            total = changes[0, i] + impulse.by_linear * changes[3, i]
            matrix[at, i] += by_push * total + by_phase * changes[4, i]
