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
from exugear.steady_state.orbits.flank_means import flank_means
from fem.support.numba_cache import compiled, kept

#: A mesh about its equilibrium: force [N], deflection [m] and mean stiffness [N/m], which the linear system contains;
#: slopes of the potential by phase [N m per pitch] and misalignment [N m]; opening of the flanks by the displaced
#: bearings [m]; mobility [1/kg] along the line of action; side of the loaded flank, +1 or -1.
STEADY_MESH = record_type(
    *((name, "f8") for name in ("force", "deflection", "stiffness", "by_phase", "by_misalignment")),
    *((name, "f8") for name in ("opening", "mobility", "side")),
)
steady_mesh_at = reader(STEADY_MESH)
#: Number of measures of a mesh: deflection [m], phase, misalignment [rad], less those of the equilibrium.
MEASURES = 3


class Impulse(NamedTuple):
    """Impulses of the mesh in a step on deflection [N s], phase and misalignment, beside those of the linear system.

    by_deflection, by_rate, by_phase, by_misalignment   slopes of the first of them
    moment_slope                                        of the third by the misalignment
    force, static_force                                 meanwhile [N]
    """

    value: float
    on_phase: float
    on_misalignment: float
    by_deflection: float
    by_rate: float
    by_phase: float
    by_misalignment: float
    moment_slope: float
    force: float
    static_force: float


@compiled
def impulse_of(table, mesh, phase, deflection, misalignment, rate, step):
    """`Impulse` at a phase, a deflection [m], a misalignment [rad] and a rate [m/s] before it; step [s].

    The misalignment, less that of the equilibrium, acts on the loaded flank alone.
    """
    flank = flank_of(table, deflection + mesh.opening, mesh.opening, phase)
    side, travel = flank.side, flank.side * rate * step
    lever = misalignment if side == mesh.side else 0.0
    static, c, slopes = flank_means(table, phase_cell(table, flank.phase), flank.deflection, lever, travel)
    yielding = 1.0 + 0.5 * mesh.mobility * c.value * step
    excess = side * static.value - mesh.force - mesh.stiffness * (deflection - mesh.deflection)
    impulse = step * (excess + c.value * rate) / yielding
    mean_rate = rate - 0.5 * mesh.mobility * impulse
    by_deflection = static.by_penetration - mesh.stiffness + side * c.by_penetration * mean_rate
    by_rate = c.value + step * (static.by_travel + side * c.by_travel * mean_rate)
    loaded = 1.0 if side == mesh.side else 0.0
    return Impulse(
        impulse,
        step * (side * slopes.by_phase - mesh.by_phase),
        step * (loaded * slopes.by_lever - mesh.by_misalignment),
        step * by_deflection / yielding,
        step * by_rate / yielding,
        step * slopes.force_by_phase,
        step * loaded * side * slopes.force_by_lever,
        step * loaded * slopes.moment_by_lever,
        side * static.value + c.value * mean_rate,
        side * static.value,
    )


@compiled
def dot(row, states):
    """Sum of products."""
    total = 0.0
    for j in range(states.size):
        total += row[j] * states[j]
    return total


@compiled
def strike(states, by_impulses, impulse):
    """Change states by the impulses of the mesh."""
    for j in range(states.size):
        states[j] += impulse.value * by_impulses[0, j]
    if len(by_impulses) > 1:
        for j in range(states.size):
            states[j] += impulse.on_phase * by_impulses[1, j] + impulse.on_misalignment * by_impulses[2, j]


@compiled
def keep(samples, number, deflection, impulse):
    """Write a sample, unless there are none to write; the number of the next one."""
    if len(samples) > 0:
        samples[number, 0], samples[number, 1], samples[number, 2] = deflection, impulse.force, impulse.static_force
    return number + 1


@compiled
def drift(propagators, states, matrix):
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
def push(measures, rate_row, by_impulses, impulse, matrix, changes):
    """Change the columns of a matrix (2 n, m) by the slopes of an impulse; changes (3, m): those of the impulses."""
    number = len(measures)
    changes[:] = 0.0
    for j in range(matrix.shape[0]):
        row = matrix[j]
        slope = impulse.by_deflection * measures[0, j] + impulse.by_rate * rate_row[j]
        if number > 1:
            slope += impulse.by_phase * measures[1, j] + impulse.by_misalignment * measures[2, j]
            on_phase = impulse.by_phase * measures[0, j]
            on_misalignment = impulse.by_misalignment * measures[0, j] + impulse.moment_slope * measures[2, j]
            for i in range(matrix.shape[1]):
                changes[1, i] += on_phase * row[i]
                changes[2, i] += on_misalignment * row[i]
        for i in range(matrix.shape[1]):
            changes[0, i] += slope * row[i]
    for j in range(matrix.shape[0]):
        row = matrix[j]
        for k in range(number):
            yielding = by_impulses[k, j]
            for i in range(matrix.shape[1]):
                row[i] += yielding * changes[k, i]


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
    rows          (2 k + 1, 2 n): rate of the deflection by the states; k measures by the states, k = 1 or 3; states by
                  unit impulses on the measures
    pieces        (p, 4) first phase, length in phase, number of steps, step [s]
    propagators   (p, 2, n, 2, 2) over half a step and over a step
    samples       (s, 3) deflection [m], force and static force [N] in the middle of each step; s = 0: none
    """
    table, mesh = table_at(addresses[0]), steady_mesh_at(addresses[1])
    number = (len(rows) - 1) // 2
    rate_row, measures, by_impulses = rows[0], rows[1 : 1 + number], rows[1 + number :]
    sample, changes, values = 0, np.zeros((MEASURES, matrix.shape[1])), np.zeros(MEASURES)
    for p in range(len(pieces)):
        first, length, steps, step = pieces[p, 0], pieces[p, 1], int(pieces[p, 2]), pieces[p, 3]
        half, whole = propagators[p, 0], propagators[p, 1]
        drift(half, states, matrix)
        for i in range(steps):
            rate = dot(rate_row, states)
            for k in range(number):
                values[k] = dot(measures[k], states)
            deflection, phase = mesh.deflection + values[0], first + length * (i + 0.5) / steps + values[1]
            impulse = impulse_of(table, mesh, phase, deflection, values[2], rate, step)
            strike(states, by_impulses, impulse)
            if matrix.shape[1] > 0:
                push(measures, rate_row, by_impulses, impulse, matrix, changes)
            sample = keep(samples, sample, deflection, impulse)
            drift(half if i == steps - 1 else whole, states, matrix)


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
