"""Compiled motion over mesh cycles: the linear system moves exactly, the mesh force acts in the middle of each step.

Splitting after Strang: half a step of the linear part with the mean mesh stiffness, an impulse of the remaining mesh
force, half a step of the linear part. Second order, stable for all modes that the mesh hardly moves. Steps meet the
phases at which the force jumps.
"""

from math import cos, exp, pi, sin
from typing import NamedTuple

import numpy as np

from exugear.contact_geometry.relative_position import flank_of
from exugear.force_table.kernel_records import reader, record_type
from exugear.force_table.patches import phase_cell, table_at
from exugear.steady_state.flank_means import flank_means
from fem.support.numba_cache import compiled, kept

#: A mesh about its equilibrium: force [N], deflection [m] and mean stiffness [N/m], which the linear system contains;
#: opening of the flanks by the displaced bearings [m]; mobility [1/kg] along the line of action.
STEADY_MESH = record_type(*((name, "f8") for name in ("force", "deflection", "stiffness", "opening", "mobility")))
steady_mesh_at = reader(STEADY_MESH)

class Impulse(NamedTuple):
    """Impulse of the mesh in a step [N s] and its slopes by deflection and rate; force and static force [N] meanwhile."""

    value: float
    by_deflection: float
    by_rate: float
    force: float
    static_force: float


@compiled
def impulse_of(table, mesh, phase, deflection, rate, step):
    """`Impulse` beside that of the mean stiffness, at a deflection [m] and a rate [m/s] before it; step [s]."""
    flank = flank_of(table, deflection + mesh.opening, mesh.opening, phase)
    side, travel = flank.side, flank.side * rate * step
    static, c = flank_means(table, phase_cell(table, flank.phase), flank.deflection, travel)
    yielding = 1.0 + 0.5 * mesh.mobility * c.value * step
    excess = side * static.value - mesh.force - mesh.stiffness * (deflection - mesh.deflection)
    impulse = step * (excess + c.value * rate) / yielding
    mean_rate = rate - 0.5 * mesh.mobility * impulse
    by_deflection = static.by_penetration - mesh.stiffness + side * c.by_penetration * mean_rate
    by_rate = c.value + step * (static.by_travel + side * c.by_travel * mean_rate)
    return Impulse(
        impulse,
        step * by_deflection / yielding,
        step * by_rate / yielding,
        side * static.value + c.value * mean_rate,
        side * static.value,
    )


@compiled
def drift(propagators, states):
    """Move states (2 n,) over a step by the propagators (n, 2, 2) of their blocks."""
    for j in range(len(propagators)):
        a, b = states[2 * j], states[2 * j + 1]
        states[2 * j] = propagators[j, 0, 0] * a + propagators[j, 0, 1] * b
        states[2 * j + 1] = propagators[j, 1, 0] * a + propagators[j, 1, 1] * b


@compiled
def drift_all(propagators, matrix):
    """Move the columns of a matrix (2 n, m) as `drift` moves states."""
    for j in range(len(propagators)):
        p, upper, lower = propagators[j], matrix[2 * j], matrix[2 * j + 1]
        for i in range(matrix.shape[1]):
            a, b = upper[i], lower[i]
            upper[i] = p[0, 0] * a + p[0, 1] * b
            lower[i] = p[1, 0] * a + p[1, 1] * b


@compiled
def push(rows, impulse, matrix, changes):
    """Change the columns of a matrix (2 n, m) by the slopes of an impulse; changes (m,) holds those of the impulse."""
    changes[:] = 0.0
    for j in range(matrix.shape[0]):
        slope, row = impulse.by_deflection * rows[0, j] + impulse.by_rate * rows[1, j], matrix[j]
        for i in range(changes.size):
            changes[i] += slope * row[i]
    for j in range(matrix.shape[0]):
        yielding, row = rows[2, j], matrix[j]
        for i in range(changes.size):
            row[i] += yielding * changes[i]


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


@kept
def advance(addresses, rows, pieces, propagators, states, matrix, samples):
    """Move states (2 n,) over the pieces of a cycle, and the columns of a matrix (2 n, m; m = 0: none) with them.

    addresses     (2,) of the head of a table and of a `STEADY_MESH`
    rows          (3, 2 n) deflection and rate by the states, states by a unit impulse
    pieces        (p, 4) first phase, length in phase, number of steps, step [s]
    propagators   (p, 2, n, 2, 2) over half a step and over a step
    samples       (s, 3) deflection [m], force and static force [N] in the middle of each step; s = 0: none
    """
    table, mesh = table_at(addresses[0]), steady_mesh_at(addresses[1])
    sample, changes = 0, np.zeros(matrix.shape[1])
    for p in range(len(pieces)):
        first, length, number, step = pieces[p, 0], pieces[p, 1], int(pieces[p, 2]), pieces[p, 3]
        half, whole = propagators[p, 0], propagators[p, 1]
        drift(half, states)
        drift_all(half, matrix)
        for i in range(number):
            deflection, rate = mesh.deflection, 0.0
            for j in range(states.size):
                deflection += rows[0, j] * states[j]
                rate += rows[1, j] * states[j]
            phase = first + length * (i + 0.5) / number
            impulse = impulse_of(table, mesh, phase, deflection, rate, step)
            for j in range(states.size):
                states[j] += rows[2, j] * impulse.value
            if matrix.shape[1] > 0:
                push(rows, impulse, matrix, changes)
            if len(samples) > 0:
                samples[sample, 0], samples[sample, 1] = deflection, impulse.force
                samples[sample, 2] = impulse.static_force
                sample += 1
            last = half if i == number - 1 else whole
            drift(last, states)
            drift_all(last, matrix)


NO_SAMPLES = np.zeros((0, 3))


@kept
def fourier_sums(weight, phase, values, number):
    """(number, 2) real and imaginary part of sum(weight values exp(-i pi k phase)), k = 1, 2, ... number."""
    sums = np.zeros((number, 2))
    for i in range(phase.size):
        turn, amplitude = complex(cos(pi * phase[i]), -sin(pi * phase[i])), weight[i] * values[i]
        rotated = complex(amplitude, 0.0)
        for k in range(number):
            rotated *= turn
            sums[k, 0] += rotated.real
            sums[k, 1] += rotated.imag
    return sums
