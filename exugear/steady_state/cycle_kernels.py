"""Compiled motion over a common period of the meshes: the linear system moves exactly, mesh forces act at mid-step.

Splitting after Strang: half a step of the linear part with the mean mesh stiffnesses, an impulse of the remaining force
of every mesh, half a step of the linear part. Meshes act in turn, in the reverse order in every second step, so that
the splitting stays of second order. It is stable for all modes that the meshes hardly move. Steps meet the phases at
which a force jumps. The modes of an elastic ring take the whole mesh force by impulses, as the mesh runs around them.
"""

from math import cos, exp, pi, sin
from typing import NamedTuple

import numpy as np

from exugear.contact.relative_position import flank_of
from exugear.mesh_force.kernel_records import record_type, within
from exugear.mesh_force.layout import FORCE_TABLE
from exugear.mesh_force.patches import phase_cell, table_of
from exugear.steady_state.flank_means import flank_means
from exugear.steady_state.ring_kernels import (
    push_ring,
    push_ring_columns,
    rigid_ring,
    ring_changes,
    ring_of,
    yielding_at,
)
from fem.support.numba_cache import compiled, fast, kept

#: A mesh about its equilibrium: force [N], deflection [m] and mean stiffness [N/m], which the linear system contains;
#: slopes of the potential by phase [N m per pitch] and misalignment [N m]; misalignment beside that of the table [rad];
#: opening of the flanks by the displaced bearings [m]; side of the loaded flank, +1 or -1; phase at the beginning of
#: the common period, and number of mesh cycles in it, < 0 where the phase falls; mobility [1/kg] along the line of
#: action; start of a `STEADY_RING` [bytes from here], 0 of a ring as stiff as its map.
STEADY_MESH = record_type(
    *((name, "f8") for name in ("force", "deflection", "stiffness", "by_phase", "by_misalignment")),
    *((name, "f8") for name in ("lever", "opening", "side", "phase", "cycles", "mobility")),
    ("ring", "i8"),
)
table_within, mesh_within = within(FORCE_TABLE), within(STEADY_MESH)
#: Number of measures of a mesh: deflection [m], phase, misalignment [rad], less those of the equilibrium.
MEASURES = 3


class Impulse(NamedTuple):
    """Impulses of the mesh in a step on deflection [N s], phase and misalignment, beside those of the linear system.

    on_ring                                             of the whole mesh force [N s], on the modes of an elastic ring
    by_deflection, by_rate, by_phase, by_misalignment   slopes of the first of them
    by_advance                                          likewise by the deflection without the linear system's force
    by_linear                                           slope of that force's impulse by the deflection
    moment_slope                                        of the third by the misalignment
    force, static_force                                 meanwhile [N]
    """

    value: float
    on_phase: float
    on_misalignment: float
    on_ring: float
    by_deflection: float
    by_rate: float
    by_phase: float
    by_misalignment: float
    by_advance: float
    by_linear: float
    moment_slope: float
    force: float
    static_force: float


@compiled
def impulse_of(table, mesh, phase, deflection, misalignment, rate, yielding_ring, step):
    """`Impulse` at a phase, a deflection [m], a misalignment [rad] and a rate [m/s] before it; step [s].

    The misalignment, less that of the equilibrium, acts on the loaded flank alone. The modes of a ring let deflection
    and rate lag; they take the linear system's share of the mesh force, too, half of it until the middle of the step.
    """
    linear = mesh.force + mesh.stiffness * (deflection - mesh.deflection)
    rate = rate - yielding_ring.rate - 0.5 * yielding_ring.mobility * step * linear
    flank = flank_of(table, deflection - yielding_ring.advance + mesh.opening, mesh.opening, phase)
    side, travel = flank.side, flank.side * rate * step
    lever = mesh.lever + misalignment if side == mesh.side else 0.0
    of_flank = table_of(table, side)
    static, c, slopes = flank_means(of_flank, phase_cell(of_flank, flank.phase), flank.deflection, lever, travel)
    mobility = mesh.mobility + yielding_ring.mobility
    yielding = 1.0 + 0.5 * mobility * c.value * step
    impulse = step * (side * static.value - linear + c.value * rate) / yielding
    mean_rate = rate - 0.5 * mobility * impulse
    by_advance = static.by_penetration + side * c.by_penetration * mean_rate
    by_rate = c.value + step * (static.by_travel + side * c.by_travel * mean_rate)
    by_linear = 1.0 + 0.5 * yielding_ring.mobility * step * by_rate
    loaded = 1.0 if side == mesh.side else 0.0
    on_ring = impulse + step * linear
    return Impulse(
        impulse,
        step * (side * slopes.by_phase - mesh.by_phase) - on_ring * yielding_ring.by_phase,
        step * (loaded * slopes.by_lever - mesh.by_misalignment),
        on_ring,
        step * (by_advance - mesh.stiffness * by_linear) / yielding,
        step * by_rate / yielding,
        step * (slopes.force_by_phase - by_advance * yielding_ring.by_phase),
        step * loaded * side * slopes.force_by_lever,
        step * by_advance / yielding,
        step * mesh.stiffness,
        step * loaded * slopes.moment_by_lever,
        side * static.value + c.value * mean_rate,
        side * static.value,
    )


@compiled
def dot(rows, k, row, states):
    """Product of a row of mesh k with the states."""
    total = 0.0
    for j in range(states.size):
        total += rows[k, row, j] * states[j]
    return total


@compiled
def measures_at(rows, k, measured, states):
    """(rate, deflection, phase, misalignment) of mesh k by the states: sums that do not wait for one another."""
    rate = rate_2 = deflection = deflection_2 = phase = phase_2 = misalignment = misalignment_2 = 0.0
    for j in range(0, states.size, 2):
        a, b = states[j], states[j + 1]
        rate += rows[k, 0, j] * a
        rate_2 += rows[k, 0, j + 1] * b
        deflection += rows[k, 1, j] * a
        deflection_2 += rows[k, 1, j + 1] * b
        if measured > 1:
            phase += rows[k, 2, j] * a
            phase_2 += rows[k, 2, j + 1] * b
            misalignment += rows[k, 3, j] * a
            misalignment_2 += rows[k, 3, j + 1] * b
    return rate + rate_2, deflection + deflection_2, phase + phase_2, misalignment + misalignment_2


@compiled
def apply_impulse(states, rows, k, measured, impulse):
    """Change states by the impulses of mesh k."""
    if measured == 1:
        for j in range(states.size):
            states[j] += impulse.value * rows[k, 2, j]
    else:
        for j in range(states.size):
            tilt = impulse.on_misalignment * rows[k, 6, j]
            states[j] += impulse.value * rows[k, 4, j] + impulse.on_phase * rows[k, 5, j] + tilt


@compiled
def propagate(propagators, states, matrix):
    """Move states (2 n,) and the columns of a matrix (2 n, m) by the propagators (n, 2, 2) of their blocks."""
    for j in range(len(propagators)):
        p, upper, lower = propagators[j], matrix[2 * j], matrix[2 * j + 1]
        a, b = states[2 * j], states[2 * j + 1]
        states[2 * j], states[2 * j + 1] = p[0, 0] * a + p[0, 1] * b, p[1, 0] * a + p[1, 1] * b
        for i in range(matrix.shape[1]):
            a, b = upper[i], lower[i]
            upper[i] = p[0, 0] * a + p[0, 1] * b
            lower[i] = p[1, 0] * a + p[1, 1] * b


@compiled
def impulse_changes(rows, k, measured, impulse, matrix, changes):
    """Changes (3, c) of the impulses of mesh k on its measures by the columns of a matrix (2 n, c)."""
    size, number = matrix.shape
    for i in range(number):
        changes[0, i] = changes[1, i] = changes[2, i] = 0.0
    for j in range(size):
        deflection = rows[k, 1, j]
        slope = impulse.by_deflection * deflection + impulse.by_rate * rows[k, 0, j]
        if measured > 1:
            phase, misalignment = rows[k, 2, j], rows[k, 3, j]
            slope += impulse.by_phase * phase + impulse.by_misalignment * misalignment
            on_phase = impulse.by_phase * deflection
            on_misalignment = impulse.by_misalignment * deflection + impulse.moment_slope * misalignment
            for i in range(number):
                changes[0, i] += slope * matrix[j, i]
                changes[1, i] += on_phase * matrix[j, i]
                changes[2, i] += on_misalignment * matrix[j, i]
        else:
            for i in range(number):
                changes[0, i] += slope * matrix[j, i]


@compiled
def measure_changes(rows, k, measured, matrix, changes):
    """Changes (c,) of deflection and phase of mesh k by the columns of a matrix (2 n, c), in the rows 3 and 4."""
    for i in range(matrix.shape[1]):
        changes[3, i] = changes[4, i] = 0.0
    for j in range(matrix.shape[0]):
        deflection, phase = rows[k, 1, j], rows[k, 2, j] if measured > 1 else 0.0
        for i in range(matrix.shape[1]):
            changes[3, i] += deflection * matrix[j, i]
            changes[4, i] += phase * matrix[j, i]


@compiled
def push_columns(rows, k, measured, matrix, changes):
    """Change the columns of a matrix (2 n, c) by the changes (3, c) of the impulses of mesh k."""
    size, number = matrix.shape
    for j in range(size):
        if measured > 1:
            first, second, third = rows[k, 4, j], rows[k, 5, j], rows[k, 6, j]
            for i in range(number):
                matrix[j, i] += first * changes[0, i] + second * changes[1, i] + third * changes[2, i]
        else:
            yielding = rows[k, 2, j]
            for i in range(number):
                matrix[j, i] += yielding * changes[0, i]


@kept
def propagators(first, second, oscillating, pieces):
    """Matrices (p, 2, n, 2, 2) by which states move over half a step and a step of each piece, without impulses.

    first, second   (n,) eigenvalues of the blocks [1/s]; of oscillating ones real and imaginary part
    """
    matrices = np.zeros((len(pieces), 2, first.size, 2, 2))
    for p in range(len(pieces)):
        for part in range(2):
            duration = pieces[p, 3] * (0.5 if part == 0 else 1.0)
            for j in range(first.size):
                block, growth = matrices[p, part, j], exp(first[j] * duration)
                if oscillating[j]:
                    block[0, 0] = block[1, 1] = growth * cos(second[j] * duration)
                    block[1, 0] = growth * sin(second[j] * duration)
                    block[0, 1] = -block[1, 0]
                else:
                    block[0, 0], block[1, 1] = growth, exp(second[j] * duration)
    return matrices


class Meshes(NamedTuple):
    """Records with their starts, rows and shifts of all meshes, as `advance` takes them."""

    records: np.ndarray
    starts: np.ndarray
    rows: np.ndarray
    shifts: np.ndarray


class Moving(NamedTuple):
    """States and matrix that `advance` moves, and changes (5, c) by its columns: of impulses, deflection and phase."""

    states: np.ndarray
    matrix: np.ndarray
    changes: np.ndarray


class Middle(NamedTuple):
    """The middle of a step: its number, its time over the common period, step [s], common periods per time [1/s]."""

    number: int
    time: float
    step: float
    periods: float


@compiled(forceinline=True)
def mesh_impulse_step(meshes, moving, samples, middle, k):
    """Apply the impulse of mesh k in the middle of a step."""
    records, starts, rows, shifts = meshes
    states, matrix, changes = moving
    table, mesh = table_within(records, starts[k, 0]), mesh_within(records, starts[k, 1])
    measured, dte_row = (rows.shape[1] - 2) // 2, rows.shape[1] - 1
    rate, deflection, phase, misalignment = measures_at(rows, k, measured, states)
    deflection, misalignment = mesh.deflection + shifts[k, 0] + deflection, shifts[k, 2] + misalignment
    phase = mesh.phase + mesh.cycles * middle.time + shifts[k, 1] + phase
    yielding = rigid_ring()
    if mesh.ring != 0:
        side = flank_of(table, deflection + mesh.opening, mesh.opening, phase).side
        yielding = yielding_at(ring_of(mesh), side, phase, mesh.cycles * middle.periods, states)
    impulse = impulse_of(table, mesh, phase, deflection, misalignment, rate, yielding, middle.step)
    if samples.shape[2] > 0:
        samples[k, 0, middle.number] = mesh.deflection + shifts[k, 3] + dot(rows, k, dte_row, states)
        samples[k, 1, middle.number], samples[k, 2, middle.number] = impulse.force, impulse.static_force
    apply_impulse(states, rows, k, measured, impulse)
    if mesh.ring != 0:
        push_ring(ring_of(mesh), impulse.on_ring, states)
    if matrix.shape[1] > 0:
        impulse_changes(rows, k, measured, impulse, matrix, changes)
        if mesh.ring != 0:
            ring = ring_of(mesh)
            measure_changes(rows, k, measured, matrix, changes)
            ring_changes(ring, impulse, yielding, matrix, changes)
            push_ring_columns(ring, impulse, matrix, changes)
        push_columns(rows, k, measured, matrix, changes)


@kept
def advance(records, rows, shifts, pieces, propagators, states, matrix, samples):
    """Move states (2 n,) over the pieces of a common period, and the columns of a matrix (2 n, c; c = 0: none) as well.

    records       array with the records of all meshes, and starts there (m, 2) [bytes] of the head of the table and of
                  the `STEADY_MESH` of every one (`exugear.mesh_force.kernel_records.packed`)
    rows          (m, 2 k + 2, 2 n) of every mesh: rate of the deflection by the states; k measures by the states, k = 1
                  or 3; states by unit impulses on the measures; DTE by the states
    shifts        (m, 4) deflection, phase, misalignment and DTE of every mesh while the states are 0, less those of its
                  equilibrium
    pieces        (p, 4) beginning and length over the common period, number of steps, step [s]
    propagators   (p, 2, n, 2, 2) over half a step and over a step
    samples       (m, 3, s) DTE [m], force and static force [N] in the middle of each step; s = 0: none
    """
    number, meshes = 0, Meshes(records[0], records[1], rows, shifts)
    moving = Moving(states, matrix, np.zeros((MEASURES + 2, matrix.shape[1])))
    for p in range(len(pieces)):
        first, length, steps, step = pieces[p, 0], pieces[p, 1], int(pieces[p, 2]), pieces[p, 3]
        half, whole = propagators[p, 0], propagators[p, 1]
        periods = length / (steps * step) if step > 0.0 else 0.0
        propagate(half, states, matrix)
        for i in range(steps):
            middle = Middle(number, first + length * (i + 0.5) / steps, step, periods)
            for k in range(len(shifts)):
                in_turn = k if number % 2 == 0 else len(shifts) - 1 - k
                mesh_impulse_step(meshes, moving, samples, middle, in_turn)
            number += 1
            propagate(half if i == steps - 1 else whole, states, matrix)


NO_SAMPLES = np.zeros((0, 3, 0))
#: Number of samples that `fourier_sums` takes side by side.
SIDE_BY_SIDE = 64


class SampledMeasures(NamedTuple):
    """Mean, variance and peak to peak of the DTE, extremes of the force, share of the time without static force."""

    mean: float
    variance: float
    peak_to_peak: float
    smallest_force: float
    largest_force: float
    share_without_force: float


@fast
def sampled_measures(weight, dte, force, static_force):
    """`SampledMeasures` of samples with weights of the sum 1."""
    mean = variance = apart = 0.0
    lowest, highest, smallest, largest = dte[0], dte[0], force[0], force[0]
    for i in range(weight.size):
        mean += weight[i] * dte[i]
        apart += weight[i] if static_force[i] == 0.0 else 0.0
        lowest, highest = min(lowest, dte[i]), max(highest, dte[i])
        smallest, largest = min(smallest, force[i]), max(largest, force[i])
    for i in range(weight.size):
        variance += weight[i] * (dte[i] - mean) ** 2
    return SampledMeasures(mean, variance, highest - lowest, smallest, largest, apart)


@fast
def fourier_sums(weight, phase, values, number):
    """(number, 2) real and imaginary part of sum(weight values exp(-i pi k phase)), k = 1, 2, ... number.

    The processor turns samples side by side: two to three times as fast as in turn.
    """
    sums, turns, turned = np.zeros((number, 2)), np.empty((2, SIDE_BY_SIDE)), np.empty((2, SIDE_BY_SIDE))
    for first in range(0, phase.size, SIDE_BY_SIDE):
        size = min(SIDE_BY_SIDE, phase.size - first)
        for i in range(size):
            angle = pi * phase[first + i]
            turns[0, i], turns[1, i] = cos(angle), -sin(angle)
            turned[0, i], turned[1, i] = weight[first + i] * values[first + i], 0.0
        for k in range(number):
            real = imaginary = 0.0
            for i in range(size):
                a, b = turned[0, i], turned[1, i]
                turned[0, i] = a * turns[0, i] - b * turns[1, i]
                turned[1, i] = a * turns[1, i] + b * turns[0, i]
                real += turned[0, i]
                imaginary += turned[1, i]
            sums[k, 0] += real
            sums[k, 1] += imaginary
    return sums
