"""Exact slopes of a force law by its arguments: the second derivatives of the potential, which no run needs.

They are those of the side of a kink on which the arguments are: without contact all of them are 0.
"""

from math import isnan
from typing import NamedTuple

import numpy as np

from exugear.mesh_force.composition import composed_potential
from exugear.mesh_force.force_kernels import block_number, damping
from exugear.mesh_force.offset_interpolation import (
    MOST_VALUES,
    Pair,
    Weights,
    axis_of,
    interval,
    slope_weights_of,
    stencil,
    tilt_stencil,
    weights,
)
from exugear.mesh_force.patches import (
    along_phase,
    edge,
    load_cell,
    nodes_of,
    patch,
    phase_cell,
    quintic,
    range_of,
    table_of,
)
from exugear.mesh_force.pchip import hermite_bend_weights, weighted
from fem.support.numba_cache import compiled, kept

#: What a law gives: derivatives of the potential by deflection, phase, centre distance, misalignment and axial offset
#: (its arguments), and the damping coefficient.
FORCE, BY_PHASE, BY_A, BY_MISALIGNMENT, BY_AXIAL, DAMPING = range(6)
ARGUMENTS = 5
#: Steps of phase [pitches] and lever [rad] by which slopes of a law that is composed of tooth pairs are differences.
PHASE_STEP, LEVER_STEP = 1e-5, 1e-8


class SecondOrder(NamedTuple):
    """A function of two arguments, x and the phase, with its first and second derivatives."""

    value: float
    by_x: float
    by_phase: float
    by_xx: float
    by_x_phase: float
    by_phases: float


class BlockSlopes(NamedTuple):
    """Potential and penetration of a block with their derivatives by deflection, phase and lever."""

    energy: SecondOrder
    by_lever: float
    force_by_lever: float
    by_phase_lever: float
    by_levers: float
    penetration: SecondOrder
    penetration_by_lever: float


ZEROS = SecondOrder(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
NO_SLOPES = BlockSlopes(ZEROS, 0.0, 0.0, 0.0, 0.0, ZEROS, 0.0)


@compiled
def bends_of_edge(table, block, cell):
    """Second derivatives by the phase of unloaded deflection and largest penetration [m per square pitch]."""
    square, bend = table.steps_in_pitch * table.steps_in_pitch, hermite_bend_weights(cell.share)
    a, b = edge(table, block, cell.low), edge(table, block, cell.high)
    return (
        square * weighted(bend, a.unloaded, a.unloaded_slope, b.unloaded, b.unloaded_slope),
        square * weighted(bend, a.largest, a.largest_slope, b.largest, b.largest_slope),
    )


@compiled
def over_u(table, start, block, cell, load):
    """`SecondOrder` over u and the phase of a patch of the nodes that begin at start [bytes from the head]."""
    w = patch(table, start, block, cell, load)
    a, b, c, d = nodes_of(table, start, block, cell, load.low)
    bend = hermite_bend_weights(cell.share)
    at_low, at_high = along_phase(bend, a, b), along_phase(bend, c, d)
    by_phases = table.steps_in_pitch * table.steps_in_pitch * quintic(load.share, at_low, at_high)[0]
    return SecondOrder(w.value, w.by_u, w.by_phase, w.by_uu, w.by_phase_u, by_phases)


@compiled
def over_depth(f, u, depth, depth_slope, depth_bend, extent, largest_bend):
    """`SecondOrder` over a depth x and the phase of f(u, phase), u = (depth / largest(phase))^(1/4).

    f             over u and the phase
    depth_slope   of the depth by the phase at fixed x, depth_bend its second derivative; the slope by x is 1
    """
    growth, bend = extent.largest_slope / extent.largest, largest_bend / extent.largest
    by_x, by_xx = 0.25 * u / depth, -0.1875 * u / (depth * depth)
    of_logarithm = 0.25 * (depth_slope / depth - growth)
    change = 0.25 * (depth_bend / depth - (depth_slope / depth) ** 2 - bend + growth * growth)
    by_phase, by_phases = u * of_logarithm, u * (of_logarithm * of_logarithm + change)
    by_x_phase = 0.25 * (by_phase - u * depth_slope / depth) / depth
    return SecondOrder(
        f.value,
        f.by_x * by_x,
        f.by_phase + f.by_x * by_phase,
        f.by_xx * by_x * by_x + f.by_x * by_xx,
        f.by_xx * by_x * by_phase + f.by_x_phase * by_x + f.by_x * by_x_phase,
        f.by_phases + 2.0 * f.by_x_phase * by_phase + f.by_xx * by_phase * by_phase + f.by_x * by_phases,
    )


@compiled
def centroid_slopes(table, block, cell, extent, bends, raw):
    """`SecondOrder` of the force centroid over deflection and phase, as `potential.centroid_at`."""
    if table.has_centroid == 0:
        return ZEROS
    share = min(max(raw / extent.largest, 0.0), 1.0)
    load = load_cell(table, share)
    c = over_u(table, table.centroids_start, block, cell, load)
    if not 0.0 < share < 1.0:
        return SecondOrder(c.value, 0.0, c.by_phase, 0.0, 0.0, c.by_phases)
    u = (load.low + load.share) / table.penetration_steps
    return over_depth(c, u, raw, -extent.unloaded_slope, -bends[0], extent, bends[1])


@compiled
def block_slopes(table, block, cell, deflection, lever):
    """`BlockSlopes`: the potential is p^2 w at the penetration p = deflection - unloaded - lever times centroid."""
    if table.teeth != 0:
        return composed_slopes(table, block, cell, deflection, lever)
    extent, bends = range_of(table, block, cell), bends_of_edge(table, block, cell)
    raw = deflection - extent.unloaded
    c = centroid_slopes(table, block, cell, extent, bends, raw)
    p = raw - lever * c.value
    if p <= 0.0:
        return NO_SLOPES
    load = load_cell(table, p / extent.largest)
    u = (load.low + load.share) / table.penetration_steps
    w = over_depth(over_u(table, table.potentials_start, block, cell, load), u, p, 0.0, 0.0, extent, bends[1])
    by_p, by_phase = p * (2.0 * w.value + p * w.by_x), p * p * w.by_phase
    by_pp, by_p_phase = 2.0 * w.value + p * (4.0 * w.by_x + p * w.by_xx), p * (2.0 * w.by_phase + p * w.by_x_phase)
    p_x, p_phase, p_lever = 1.0 - lever * c.by_x, -extent.unloaded_slope - lever * c.by_phase, -c.value
    p_xx, p_x_phase, p_phases = -lever * c.by_xx, -lever * c.by_x_phase, -bends[0] - lever * c.by_phases
    energy = SecondOrder(
        p * p * w.value,
        by_p * p_x,
        by_phase + by_p * p_phase,
        by_pp * p_x * p_x + by_p * p_xx,
        (by_pp * p_phase + by_p_phase) * p_x + by_p * p_x_phase,
        p * p * w.by_phases + (2.0 * by_p_phase + by_pp * p_phase) * p_phase + by_p * p_phases,
    )
    return BlockSlopes(
        energy,
        by_p * p_lever,
        by_pp * p_x * p_lever - by_p * c.by_x,
        (by_pp * p_phase + by_p_phase) * p_lever - by_p * c.by_phase,
        by_pp * p_lever * p_lever,
        SecondOrder(p, p_x, p_phase, 0.0, 0.0, 0.0),
        p_lever,
    )


@compiled
def composed_slopes(table, block, cell, deflection, lever):
    """`BlockSlopes` of a law that is composed of tooth pairs: second derivatives are differences of the first."""
    u, step, lever_step = composed_potential(table, block, cell, deflection, lever), PHASE_STEP, LEVER_STEP
    if u.penetration <= 0.0:
        return NO_SLOPES
    phase = (cell.low + cell.share) / table.steps_in_pitch
    before = composed_potential(table, block, phase_cell(table, phase - step), deflection, lever)
    after = composed_potential(table, block, phase_cell(table, phase + step), deflection, lever)
    low = composed_potential(table, block, cell, deflection, lever - lever_step)
    high = composed_potential(table, block, cell, deflection, lever + lever_step)
    by_phases, by_levers = (after.by_phase - before.by_phase) / (2 * step), (high.by_lever - low.by_lever)
    slope = (after.penetration - before.penetration) / (2 * step)
    return BlockSlopes(
        SecondOrder(u.energy, u.force, u.by_phase, u.stiffness, u.force_by_phase, by_phases),
        u.by_lever,
        (high.force - low.force) / (2 * lever_step),
        (after.by_lever - before.by_lever) / (2 * step),
        by_levers / (2 * lever_step),
        SecondOrder(u.penetration, 1.0, slope, 0.0, 0.0, 0.0),
        (high.penetration - low.penetration) / (2 * lever_step),
    )


@compiled
def stencil_bends(table, offset, x) -> Weights:
    """Second derivatives of the weights of a `Stencil`."""
    count = table.offset_counts[offset]
    if count == 1:
        return 0.0, 0.0, 0.0, 0.0
    j, low, length = interval(table, offset, x)
    t, first = (x - low) / length, max(0, min(j - 1, count - MOST_VALUES))
    at_low, at_high = slope_weights_of(table, offset, j, first), slope_weights_of(table, offset, j + 1, first)
    bend = (12.0 * t - 6.0) / (length * length)
    return weights((bend, (6.0 * t - 4.0) / length, -bend, (6.0 * t - 2.0) / length), j - first, at_low, at_high)


@compiled
def tilt_bends(table, x) -> tuple[Pair, Pair]:
    """Second derivatives of weights and levers of a `TiltStencil`."""
    if table.offset_counts[1] == 1:
        return (0.0, 0.0), (0.0, 0.0)
    _, low, length = interval(table, 1, x)
    t = (x - low) / length
    bend, a, b = (12.0 * t - 6.0) / (length * length), 1.0 + 2.0 * t, 3.0 - 2.0 * t
    return (bend, -bend), (-4.0 / (length * a * a * a), 4.0 / (length * b * b * b))


@compiled
def add_block(values, slopes, block, of_a, of_axial, tilt):
    """Add the potential of a block, by its weights, to values (6,) and slopes (6, 5), penetrations in the last row.

    of_a, of_axial   weight of the block over centre distance and axial offset, its first and second derivative
    tilt             weight over the misalignment, lever, and their first and second derivatives
    """
    (a, a_1, a_2), (x, x_1, x_2), (t, t_1, t_2, lever_1, lever_2), u = of_a, of_axial, tilt, block.energy
    by_tilt = t_1 * u.value + t * lever_1 * block.by_lever
    force_by_tilt = t_1 * u.by_x + t * lever_1 * block.force_by_lever
    by_phase_tilt = t_1 * u.by_phase + t * lever_1 * block.by_phase_lever
    by_tilts = t_2 * u.value + (2.0 * t_1 * lever_1 + t * lever_2) * block.by_lever
    by_tilts += t * lever_1 * lever_1 * block.by_levers
    p = block.penetration
    first = a * x * t * u.by_x, a * x * t * u.by_phase, a_1 * x * t * u.value, a * x * by_tilt, a * x_1 * t * u.value
    for i in range(5):
        values[i] += first[i]
    values[5] += a * x * t * p.value
    slopes[0, 0] += a * x * t * u.by_xx
    slopes[0, 1] += a * x * t * u.by_x_phase
    slopes[0, 2] += a_1 * x * t * u.by_x
    slopes[0, 3] += a * x * force_by_tilt
    slopes[0, 4] += a * x_1 * t * u.by_x
    slopes[1, 1] += a * x * t * u.by_phases
    slopes[1, 2] += a_1 * x * t * u.by_phase
    slopes[1, 3] += a * x * by_phase_tilt
    slopes[1, 4] += a * x_1 * t * u.by_phase
    slopes[2, 2] += a_2 * x * t * u.value
    slopes[2, 3] += a_1 * x * by_tilt
    slopes[2, 4] += a_1 * x_1 * t * u.value
    slopes[3, 3] += a * x * by_tilts
    slopes[3, 4] += a * x_1 * by_tilt
    slopes[4, 4] += a * x_2 * t * u.value
    slopes[5, 0] += a * x * t * p.by_x
    slopes[5, 1] += a * x * t * p.by_phase
    slopes[5, 2] += a_1 * x * t * p.value
    slopes[5, 3] += a * x * (t_1 * p.value + t * lever_1 * block.penetration_by_lever)
    slopes[5, 4] += a * x_1 * t * p.value


@kept
def law_slopes(law, side, arguments):
    """(values (6,), slopes (6, 5)) of a law: `FORCE` ... `DAMPING`, and their slopes by the arguments (5) of a flank.

    side        +1 driving, -1 back flank
    arguments   deflection [m], phase, centre distance, misalignment (NaN: that of the law) and axial offset
    """
    deflection, phase, distance, misalignment, axial = arguments
    table, values, slopes = table_of(law, side), np.zeros(6), np.zeros((6, 5))
    if isnan(misalignment):
        misalignment = axis_of(table, 1)[0]
    cell = phase_cell(table, phase)
    along, tilt, across = stencil(table, 0, distance), tilt_stencil(table, misalignment), stencil(table, 2, axial)
    along_bends, across_bends = stencil_bends(table, 0, distance), stencil_bends(table, 2, axial)
    weight_bends, lever_bends = tilt_bends(table, misalignment)
    for p in range(min(MOST_VALUES, table.offset_counts[0])):
        for r in range(min(MOST_VALUES, table.offset_counts[2])):
            for q in range(min(2, table.offset_counts[1])):
                block = block_number(table, along.first + p, tilt.first + q, across.first + r)
                of_block = block_slopes(table, block, cell, deflection, tilt.levers[q])
                of_a = along.weights[p], along.slopes[p], along_bends[p]
                of_axial = across.weights[r], across.slopes[r], across_bends[r]
                of_tilt = tilt.weights[q], tilt.slopes[q], weight_bends[q], tilt.lever_slopes[q], lever_bends[q]
                add_block(values, slopes, of_block, of_a, of_axial, of_tilt)
    for i in range(5):
        for j in range(i):
            slopes[i, j] = slopes[j, i]
    if table.conserves == 0:
        for i in (1, 2, 4):
            values[i] = 0.0
            slopes[i] = 0.0
    penetration = values[5]
    r = min(penetration / law.damping_ramp, 1.0)
    slopes[5] *= law.damping * 6.0 * r * (1.0 - r) / law.damping_ramp
    values[5] = damping(law, penetration)
    return values, slopes
