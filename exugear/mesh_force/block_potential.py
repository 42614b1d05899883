"""The potential of a block of the table: U = w(phase, u) penetration^2, with its derivatives.

The penetration is the deflection minus the unloaded deflection and minus lever times force centroid: a misalignment by
the lever [rad] moves the flanks at the force centroid. Force = dU/d deflection, moment = dU/d lever.
"""

from math import nan
from typing import NamedTuple

from exugear.mesh_force.patches import Cell, Patch, Range, load_cell, patch, range_of
from fem.support.numba_cache import apart, fused

#: Share of the largest penetration, and of the largest force, by which a block continues smoothly beyond its end. The
#: equilibrium under the largest torque of a map lies there by interpolation and rounding, as do differences about it.
CONTINUED = 1e-3


class Potential(NamedTuple):
    """Potential [J] of a block with its derivatives, at a phase, a deflection and a lever.

    penetration      of the flanks [m]
    force            by the deflection [N], and its slopes by deflection and phase, the lever left out
    by_phase         [N m per pitch]
    by_lever         [N m]
    largest_force    of the block at this phase [N]
    """

    energy: float
    penetration: float
    force: float
    stiffness: float
    force_by_phase: float
    by_phase: float
    by_lever: float
    largest_force: float


class Centroid(NamedTuple):
    """Force centroid [m] with its slopes by deflection and phase."""

    value: float
    by_deflection: float
    by_phase: float


MID_PLANE = Centroid(0.0, 0.0, 0.0)


@fused(forceinline=True)
def block_potential(table, block, phase: Cell, deflection, lever):
    """`Potential` of a block; ValueError(deflection, largest deflection, nan, nan, side) beyond it.

    lever   None of gears that cannot tilt: the derivative by it is 0
    """
    extent = range_of(table, block, phase)
    penetration, centroid, tilt = deflection - extent.unloaded, MID_PLANE, 0.0
    if lever is not None:
        tilt = lever
        if table.has_centroid != 0:
            centroid = centroid_of_block(table, block, phase, extent, penetration)
            penetration -= tilt * centroid.value
    if penetration <= 0.0:
        return Potential(0.0, penetration, 0.0, 0.0, 0.0, 0.0, 0.0, extent.largest_force)
    share = penetration / extent.largest
    if not share <= 1.0 + CONTINUED:
        raise ValueError(deflection, extent.unloaded + extent.largest, nan, nan, table.side)
    load = load_cell(table, share)
    w = patch(table, table.potentials_start, block, phase, load)
    u = (load.low + load.share) / table.penetration_steps
    return derivatives(extent, centroid, penetration, tilt, w, u)


@fused(forceinline=True)
def derivatives(extent: Range, centroid: Centroid, penetration, lever, w: Patch, u):
    """`Potential` from the patch w at u; ValueError(lever, low, high, 1) where the force would fall.

    g: force / penetration; growth: change of u per phase as the largest penetration changes, negative.
    """
    growth = 0.25 * u * extent.largest_slope / extent.largest
    g, g_u = 2.0 * w.value + 0.25 * u * w.by_u, 2.25 * w.by_u + 0.25 * u * w.by_uu
    g_phase = 2.0 * w.by_phase + 0.25 * u * w.by_phase_u - growth * g_u
    force, stiffness = penetration * g, g + 0.25 * u * g_u
    transmission = 1.0 - lever * centroid.by_deflection
    if transmission <= 0.0:
        raise ValueError(lever, -abs(1.0 / centroid.by_deflection), abs(1.0 / centroid.by_deflection), 1)
    recession = extent.unloaded_slope + lever * centroid.by_phase
    by_phase = penetration * penetration * (w.by_phase - growth * w.by_u) - recession * force
    return Potential(
        penetration * penetration * w.value,
        penetration,
        force * transmission,
        stiffness,
        penetration * g_phase - recession * stiffness,
        by_phase,
        -force * centroid.value,
        extent.largest_force,
    )


@apart
def centroid_of_block(table, block, phase: Cell, extent: Range, raw):
    """`Centroid` of a block at a deflection above the unloaded one; it does not change beyond the ends of the table."""
    share = min(max(raw / extent.largest, 0.0), 1.0)
    load = load_cell(table, share)
    c = patch(table, table.centroids_start, block, phase, load)
    if not 0.0 < share < 1.0:
        return Centroid(c.value, 0.0, c.by_phase)
    by_share = 0.25 * (load.low + load.share) / table.penetration_steps * c.by_u / share
    by_deflection = by_share / extent.largest
    return Centroid(
        c.value, by_deflection, c.by_phase - by_deflection * (extent.unloaded_slope + share * extent.largest_slope)
    )
