"""Patches of a table: cubic Hermite polynomials over phase, quintic ones over u, between the nodes of a block.

They interpolate the potential and the force centroid. Twice continuously differentiable over u, a potential gives a
force whose slope over the deflection is continuous.
"""

from math import floor, nan, sqrt
from typing import NamedTuple

from exugear.mesh_force.kernel_records import behind
from exugear.mesh_force.layout import EDGE, FORCE_TABLE, NODE
from exugear.mesh_force.pchip import hermite, hermite_slope, hermite_slope_weights, hermite_weights, weighted
from fem.support.numba_cache import fused

#: Phase from which on rounding leaves too little of its fractional part.
LARGEST_PHASE = 1e12
#: Sizes of the entries of a table [bytes].
EDGE_SIZE, NODE_SIZE = EDGE.itemsize, NODE.itemsize
table_behind, edge_behind, node_behind = behind(FORCE_TABLE), behind(EDGE), behind(NODE)


class Cell(NamedTuple):
    """An interval of the table: number of its lower and upper node, position between them in [0, 1)."""

    low: int
    high: int
    share: float


class Range(NamedTuple):
    """Unloaded deflection, largest penetration [m] and largest force [N] at a phase; slopes of the first two by it."""

    unloaded: float
    unloaded_slope: float
    largest: float
    largest_slope: float
    largest_force: float


class Patch(NamedTuple):
    """An interpolated value with its derivatives by u and by phase."""

    value: float
    by_u: float
    by_uu: float
    by_phase: float
    by_phase_u: float


class Jet(NamedTuple):
    """A value with its first and second derivative by u."""

    value: float
    first: float
    second: float


@fused
def table_of(table, side):
    """The table of the driving (side 1) or coast flank (-1): the same where the latter is the mirror image."""
    return table if side > 0.0 else table_behind(table, table.coast)


@fused
def phase_cell(table, phase):
    """Cell of the phase; ValueError for a phase that is not finite."""
    if not abs(phase) < LARGEST_PHASE:
        raise ValueError(nan, nan)
    n = table.phase_steps
    x = phase * table.steps_in_pitch - floor(phase * table.per_pitches) * n
    i = min(int(x), n - 1)
    return Cell(i, i + 1 if i + 1 < n else 0, x - i)


@fused
def load_cell(table, share):
    """Cell along u at a share of the largest penetration."""
    return cell_of_root(table, sqrt(sqrt(share)))


@fused
def cell_of_root(table, u):
    """Cell along u."""
    m = table.penetration_steps
    y = u * m
    j = min(int(y), m - 1)
    return Cell(j, j + 1, y - j)


@fused
def edge(table, block, i):
    """The edge of a block at a phase step."""
    return edge_behind(table, table.edges_start + EDGE_SIZE * (block * table.phase_steps + i))


@fused(forceinline=True)
def range_of(table, block, phase):
    """`Range` of a block in a phase cell."""
    a, b, t, n = edge(table, block, phase.low), edge(table, block, phase.high), phase.share, table.steps_in_pitch
    return Range(
        hermite(t, a.unloaded, a.unloaded_slope, b.unloaded, b.unloaded_slope),
        n * hermite_slope(t, a.unloaded, a.unloaded_slope, b.unloaded, b.unloaded_slope),
        hermite(t, a.largest, a.largest_slope, b.largest, b.largest_slope),
        n * hermite_slope(t, a.largest, a.largest_slope, b.largest, b.largest_slope),
        (1.0 - t) * a.largest_force + t * b.largest_force,
    )


@fused(forceinline=True)
def node(table, start, block, i, j):
    """Node of a block at a phase step i and a load step j."""
    number = (table.penetration_steps + 1) * (block * table.phase_steps + i) + j
    return node_behind(table, start + NODE_SIZE * number)


@fused(forceinline=True)
def nodes_of(table, start, block, phase, j):
    """Nodes of a block at a load step j, at the lower and upper phase of a cell, and the same at the next load step."""
    a, b = node(table, start, block, phase.low, j), node(table, start, block, phase.high, j)
    c, d = node(table, start, block, phase.low, j + 1), node(table, start, block, phase.high, j + 1)
    return a, b, c, d


@fused(forceinline=True)
def patch(table, start, block, phase, load):
    """`Patch` of a block of the nodes that begin at start [bytes from the head]."""
    a, b, c, d = nodes_of(table, start, block, phase, load.low)
    w, n, m = load.share, table.steps_in_pitch, table.penetration_steps
    weights, slope_weights = hermite_weights(phase.share), hermite_slope_weights(phase.share)
    value, first_u, second_u = quintic(w, along_phase(weights, a, b), along_phase(weights, c, d))
    by_phase, by_phase_u, _ = quintic(w, along_phase(slope_weights, a, b), along_phase(slope_weights, c, d))
    return Patch(value, m * first_u, m * m * second_u, n * by_phase, n * m * by_phase_u)


@fused(forceinline=True)
def along_phase(weights, a, b):
    """`Jet` between two nodes of neighbouring phases, or its derivatives per phase step.

    weights   (4) of the cubic over phase, or their derivatives (`exugear.mesh_force.pchip`)
    """
    return Jet(
        weighted(weights, a.value, a.by_phase, b.value, b.by_phase),
        weighted(weights, a.by_u, a.by_phase_u, b.by_u, b.by_phase_u),
        weighted(weights, a.by_uu, a.by_phase_uu, b.by_uu, b.by_phase_uu),
    )


@fused(forceinline=True)
def quintic(x, low, high):
    """`Jet` at x of the quintic polynomial with given jets at 0 and 1."""
    half = 0.5 * low.second
    rise = high.value - low.value - low.first - half
    steepening = high.first - low.first - low.second
    bend = 0.5 * (high.second - low.second)
    c_3 = 10.0 * rise - 4.0 * steepening + bend
    c_4 = -15.0 * rise + 7.0 * steepening - 2.0 * bend
    c_5 = 6.0 * rise - 3.0 * steepening + bend
    return Jet(
        low.value + x * (low.first + x * (half + x * (c_3 + x * (c_4 + x * c_5)))),
        low.first + x * (low.second + x * (3.0 * c_3 + x * (4.0 * c_4 + x * 5.0 * c_5))),
        low.second + x * (6.0 * c_3 + x * (12.0 * c_4 + x * 20.0 * c_5)),
    )
