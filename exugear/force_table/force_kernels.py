"""The kernels of a mesh force: bicubic Hermite patches over phase and penetration for each value of the offsets.

At each phase the table holds the secant stiffness k over u = (penetration / largest penetration)^(1/4). The force is
F = k penetration: it is exactly 0 without contact, and low loads, where a Hertzian contact softens, are resolved.
Values and slopes along phase and u make the law once continuously differentiable. Unloaded deflection, largest
penetration, ln k and force centroid are interpolated between the offset values by polynomials through up to four of
them; those over the misalignment have a corner at 0, where the first contact moves from one end of the face to the
other.

A table that conserves energy holds w = W / penetration^2 instead of k, W the potential; force and dW/dphase are its
derivatives. Kernels take the head of a table (`FORCE_TABLE` in `exugear.force_table.layout`) and read the arrays that
lie behind it.
"""

from math import exp, floor, log, nan, sqrt
from typing import NamedTuple

from numba import carray

from exugear.force_table.kernel_records import doubles_at, reader, start_of
from exugear.force_table.layout import EDGE, FORCE_TABLE, NODE
from exugear.force_table.offset_interpolation import BEYOND, stencil
from exugear.force_table.pchip import hermite, hermite_slope
from fem.support.numba_cache import compiled, kept

#: Phase from which on rounding leaves too little of its fractional part.
LARGEST_PHASE = 1e12
#: Sizes of the entries of a table [bytes].
EDGE_SIZE, NODE_SIZE, DOUBLE = EDGE.itemsize, NODE.itemsize, 8
table_at, edge_at, node_at = reader(FORCE_TABLE), reader(EDGE), reader(NODE)


class StaticForce(NamedTuple):
    """One flank without damping: penetration [m], force [N], axial force centroid [m], dW/dphase [N m]."""

    penetration: float
    force: float
    centroid: float
    phase_moment: float


NO_CONTACT = StaticForce(0.0, 0.0, 0.0, 0.0)


class Cell(NamedTuple):
    """An interval of the table: number of its lower and upper node, position between them in [0, 1)."""

    low: int
    high: int
    share: float


@compiled
def edge(table, block, i):
    """The edge of a block at a phase step."""
    return edge_at(start_of(table) + table.edges_start + EDGE_SIZE * (block * table.phase_steps + i))


@compiled
def node_number(table, block, i, j):
    """Number of the node of a block at a phase step and a step of u."""
    return (block * table.phase_steps + i) * (table.penetration_steps + 1) + j


@compiled
def node(table, number):
    """The node with a number."""
    return node_at(start_of(table) + table.nodes_start + NODE_SIZE * number)


@compiled
def phase_cell(table, phase):
    """Cell of the phase; ValueError for a phase that is not finite."""
    if not abs(phase) < LARGEST_PHASE:
        raise ValueError(nan, nan)
    n = table.phase_steps
    x = (phase - floor(phase)) * n
    i = min(int(x), n - 1)
    return Cell(i, i + 1 if i + 1 < n else 0, x - i)


@compiled
def load_cell(table, penetration, largest, unloaded):
    """Cell along u; ValueError(deflection, largest deflection) beyond the table."""
    share = penetration / largest
    if not share <= 1.0 + BEYOND:
        raise ValueError(unloaded + penetration, unloaded + largest)
    m = table.penetration_steps
    y = sqrt(sqrt(share)) * m
    j = min(int(y), m - 1)
    return Cell(j, j + 1, y - j)


@compiled
def contact_range(table, block, phase):
    """Unloaded deflection and largest penetration [m] of a block in a phase cell."""
    a, b, t = edge(table, block, phase.low), edge(table, block, phase.high), phase.share
    unloaded = hermite(t, a.unloaded, a.unloaded_slope, b.unloaded, b.unloaded_slope)
    return unloaded, hermite(t, a.largest, a.largest_slope, b.largest, b.largest_slope)


@compiled
def corners(table, block, phase, load):
    """The nodes of a patch: (lower, upper phase) at the lower end of u, then at the upper one."""
    a = node_number(table, block, phase.low, load.low)
    b = node_number(table, block, phase.high, load.low)
    return node(table, a), node(table, b), node(table, a + 1), node(table, b + 1)


@compiled
def along_phase(a, b, t):
    """Value, and slope along u, interpolated between two nodes of neighbouring phases."""
    return hermite(t, a.value, a.by_phase, b.value, b.by_phase), hermite(t, a.by_u, a.by_phase_u, b.by_u, b.by_phase_u)


@compiled
def patch_value(table, block, phase, load):
    """Secant stiffness [N/m] of a block, bicubic."""
    a, b, c, d = corners(table, block, phase, load)
    low, low_u = along_phase(a, b, phase.share)
    high, high_u = along_phase(c, d, phase.share)
    return hermite(load.share, low, low_u, high, high_u)


@compiled
def centroid_at(table, block, phase, load):
    """Axial force centroid [m] of a block, bilinear."""
    start = start_of(table) + table.centroids_start
    a = carray(doubles_at(start + DOUBLE * node_number(table, block, phase.low, load.low)), 2)
    b = carray(doubles_at(start + DOUBLE * node_number(table, block, phase.high, load.low)), 2)
    t, w = phase.share, load.share
    return (1.0 - w) * ((1.0 - t) * a[0] + t * b[0]) + w * ((1.0 - t) * a[1] + t * b[1])


@compiled
def damping(table, penetration):
    """Damping coefficient [N s/m], which ramps in with the penetration; 0 without contact."""
    if penetration <= 0.0:
        return 0.0
    r = min(penetration / table.damping_ramp, 1.0)
    return table.damping * r * r * (3.0 - 2.0 * r)


@compiled
def corrected_rate(rate, lag, mobility, rise, excess, coefficient):
    """The rate [m/s] corrected for the lag of the integrator's velocities: rate + lag d(force)/dt.

    The force contains the damping force at the corrected rate, for which the equation is solved.

    lag           by how much the rate is too small, per time derivative of the force [m/N]
    mobility      acceleration of the bodies per force [1/kg]; 0: unknown
    rise          time derivative of the static force [N/s]
    excess        static force minus the force that balances the load [N]
    coefficient   of the damping [N s/m]
    """
    c = coefficient
    return (rate + lag * (rise - c * mobility * excess)) / (1.0 + lag * mobility * c * c)


@compiled
def spinning_force(table, phase, deflection):
    """`StaticForce` of one flank, of a law without offsets; ValueError(deflection, largest) beyond the table."""
    if table.conserves != 0:
        return conserving(table, phase, deflection)
    cell = phase_cell(table, phase)
    unloaded, largest = contact_range(table, 0, cell)
    penetration = deflection - unloaded
    if penetration <= 0.0:
        return NO_CONTACT
    load = load_cell(table, penetration, largest, unloaded)
    return StaticForce(penetration, patch_value(table, 0, cell, load) * penetration, 0.0, 0.0)


@compiled
def block_number(table, a, misalignment, axial):
    """Number of the block at an index along each of the three offset axes."""
    return (a * table.offset_counts[1] + misalignment) * table.offset_counts[2] + axial


@compiled
def blended_range(table, stencils, phase):
    """Unloaded deflection and largest penetration [m], interpolated between the offset values."""
    a, misalignment, axial = stencils
    unloaded = largest = 0.0
    for p in range(4):
        for q in range(4):
            for r in range(4):
                weight = a.weights[p] * misalignment.weights[q] * axial.weights[r]
                if weight != 0.0:
                    block = block_number(table, a.first + p, misalignment.first + q, axial.first + r)
                    block_unloaded, block_largest = contact_range(table, block, phase)
                    unloaded, largest = unloaded + weight * block_unloaded, largest + weight * block_largest
    return unloaded, largest


@compiled
def blended_force(table, stencils, phase, load):
    """ln of the secant stiffness and force centroid [m], interpolated between the offset values."""
    a, misalignment, axial = stencils
    log_stiffness = centroid = 0.0
    for p in range(4):
        for q in range(4):
            for r in range(4):
                weight = a.weights[p] * misalignment.weights[q] * axial.weights[r]
                if weight != 0.0:
                    block = block_number(table, a.first + p, misalignment.first + q, axial.first + r)
                    log_stiffness += weight * log(patch_value(table, block, phase, load))
                    centroid += weight * centroid_at(table, block, phase, load)
    return log_stiffness, centroid


@compiled
def conserving(table, phase, deflection):
    """`StaticForce` of one flank, derived from the potential; no force without contact."""
    cell = phase_cell(table, phase)
    unloaded, largest = contact_range(table, 0, cell)
    penetration = deflection - unloaded
    if penetration <= 0.0:
        return NO_CONTACT
    load = load_cell(table, penetration, largest, unloaded)
    n, m, t = table.phase_steps, table.penetration_steps, cell.share
    low, high = edge(table, 0, cell.low), edge(table, 0, cell.high)
    unloaded_slope = n * hermite_slope(t, low.unloaded, low.unloaded_slope, high.unloaded, high.unloaded_slope)
    largest_slope = n * hermite_slope(t, low.largest, low.largest_slope, high.largest, high.largest_slope)
    value, by_phase, by_u = patch_slopes(table, cell, load)
    u, by_phase, by_u = (load.low + load.share) / m, n * by_phase, m * by_u
    force = penetration * (2.0 * value + 0.25 * u * by_u)
    value_slope = penetration * penetration * (by_phase - 0.25 * u * by_u * largest_slope / largest)
    return StaticForce(penetration, force, 0.0, value_slope - unloaded_slope * force)


@compiled
def patch_slopes(table, phase, load):
    """`patch_value` of the first block and its derivatives per phase step and per step of u."""
    a, b, c, d = corners(table, 0, phase, load)
    t, w = phase.share, load.share
    low, low_u = along_phase(a, b, t)
    high, high_u = along_phase(c, d, t)
    low_t = hermite_slope(t, a.value, a.by_phase, b.value, b.by_phase)
    low_ut = hermite_slope(t, a.by_u, a.by_phase_u, b.by_u, b.by_phase_u)
    high_t = hermite_slope(t, c.value, c.by_phase, d.value, d.by_phase)
    high_ut = hermite_slope(t, c.by_u, c.by_phase_u, d.by_u, d.by_phase_u)
    by_t = hermite(w, low_t, low_ut, high_t, high_ut)
    return hermite(w, low, low_u, high, high_u), by_t, hermite_slope(w, low, low_u, high, high_u)


@compiled
def static_force(table, phase, deflection, a, misalignment, axial):
    """`StaticForce` of one flank at offsets; no force without contact."""
    if table.conserves != 0:
        return conserving(table, phase, deflection)
    cell = phase_cell(table, phase)
    stencils = stencil(table, 0, a), stencil(table, 1, misalignment), stencil(table, 2, axial)
    unloaded, largest = blended_range(table, stencils, cell)
    penetration = deflection - unloaded
    if penetration <= 0.0:
        return NO_CONTACT
    load = load_cell(table, penetration, largest, unloaded)
    log_stiffness, centroid = blended_force(table, stencils, cell, load)
    return StaticForce(penetration, exp(log_stiffness) * penetration, centroid, 0.0)


@kept
def range_at(table, phase):
    """Deflections at loss of contact and at the end of the table [m], of a law without offsets."""
    unloaded, largest = contact_range(table, 0, phase_cell(table, phase))
    return unloaded, unloaded + largest
