"""The second derivative of the potential of a flank by the phase, which tangents of a contact need and no run does."""

from exugear.mesh_force.kernel_records import start_of
from exugear.mesh_force.patches import (
    EDGE_SIZE,
    NODE_SIZE,
    Jet,
    edge_at,
    load_cell,
    node_at,
    patch,
    phase_cell,
    quintic,
    range_of,
)
from exugear.mesh_force.pchip import hermite_bend
from exugear.mesh_force.potential import potential
from fem.support.numba_cache import compiled


@compiled
def bend_along_phase(t, a, b):
    """Second derivative of `patches.along_phase` per phase step."""
    return Jet(
        hermite_bend(t, a.value, a.by_phase, b.value, b.by_phase),
        hermite_bend(t, a.by_u, a.by_phase_u, b.by_u, b.by_phase_u),
        hermite_bend(t, a.by_uu, a.by_phase_uu, b.by_uu, b.by_phase_uu),
    )


@compiled
def phase_curvature(table, phase, deflection):
    """Second derivative of the potential by the phase [N m per square pitch], of a law without offsets.

    At a fixed penetration p the potential is p^2 w(phase, u) with u = (p / largest(phase))^(1/4); the penetration falls
    as the unloaded deflection rises.
    """
    cell, n = phase_cell(table, phase), table.steps_in_pitch
    static = potential(table, 0, cell, deflection, 0.0)
    if static.penetration <= 0.0:
        return 0.0
    extent = range_of(table, 0, cell)
    first = start_of(table) + table.edges_start
    a, b = edge_at(first + EDGE_SIZE * cell.low), edge_at(first + EDGE_SIZE * cell.high)
    unloaded_bend = n * n * hermite_bend(cell.share, a.unloaded, a.unloaded_slope, b.unloaded, b.unloaded_slope)
    largest_bend = n * n * hermite_bend(cell.share, a.largest, a.largest_slope, b.largest, b.largest_slope)
    load = load_cell(table, static.penetration / extent.largest)
    w, u = patch(table, table.potentials_start, 0, cell, load), (load.low + load.share) / table.penetration_steps
    nodes, number = start_of(table) + table.potentials_start, table.penetration_steps + 1
    low, high = number * cell.low + load.low, number * cell.high + load.low
    at_low = bend_along_phase(cell.share, node_at(nodes + NODE_SIZE * low), node_at(nodes + NODE_SIZE * high))
    low, high = low + 1, high + 1
    at_high = bend_along_phase(cell.share, node_at(nodes + NODE_SIZE * low), node_at(nodes + NODE_SIZE * high))
    bend = n * n * quintic(load.share, at_low, at_high)[0]
    growth = extent.largest_slope / extent.largest
    by_phase = 0.25 * u * growth
    by_phase_changes = 0.25 * u * (largest_bend / extent.largest - 1.25 * growth * growth)
    at_penetration = bend - 2.0 * by_phase * w.by_phase_u + by_phase * by_phase * w.by_uu - by_phase_changes * w.by_u
    slope = extent.unloaded_slope
    beside = slope * (2.0 * static.force_by_phase + slope * static.stiffness) + unloaded_bend * static.force
    return static.penetration * static.penetration * at_penetration - beside
