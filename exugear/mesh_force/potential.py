"""The potential of a flank at given offsets: of a block of the table, or composed of those of single tooth pairs."""

from exugear.mesh_force.block_potential import (
    CONTINUED,
    MID_PLANE,
    Centroid,
    Potential,
    block_potential,
    centroid_of_block,
)
from exugear.mesh_force.composition import composed_potential, composed_range
from exugear.mesh_force.patches import Cell, range_of
from fem.support.numba_cache import apart, compiled

__all__ = [
    "CONTINUED",
    "MID_PLANE",
    "Centroid",
    "Potential",
    "centroid_at",
    "extent_of",
    "potential",
    "potential_apart",
]

#: Step of the deflection by which the slope of a composed law's centroid is a difference, over the penetration.
STEP = 1e-4


@compiled(forceinline=True)
def potential(table, block, phase: Cell, deflection, lever):
    """`Potential` of a block; lever None of gears that cannot tilt.

    Raises ValueError(deflection, largest deflection, nan, nan, side) beyond it.
    """
    if table.teeth != 0:
        return composed_potential(table, block, phase, deflection, 0.0 if lever is None else lever)
    return block_potential(table, block, phase, deflection, lever)


@apart
def potential_apart(table, block, phase: Cell, deflection, lever):
    """`potential` for loops over blocks."""
    return potential(table, block, phase, deflection, lever)


@compiled
def extent_of(table, block, phase: Cell):
    """`Range` of a block in a phase cell."""
    return composed_range(table, block, phase) if table.teeth != 0 else range_of(table, block, phase)


@compiled
def centroid_at(table, block, phase: Cell, extent, raw):
    """`Centroid` of a block at a deflection above the unloaded one; it does not change beyond the ends of the table."""
    if table.teeth == 0:
        return centroid_of_block(table, block, phase, extent, raw)
    least = STEP * extent.largest
    depth = min(max(raw, 2.0 * least), extent.largest)
    at = composed_potential(table, block, phase, extent.unloaded + depth, 0.0)
    before = composed_potential(table, block, phase, extent.unloaded + depth - least, 0.0)
    value = -at.by_lever / at.force
    slope = (value + before.by_lever / before.force) / least if raw == depth else 0.0
    return Centroid(value, slope, 0.0)
