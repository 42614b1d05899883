"""The kernels of a mesh force: the potential of a flank over phase, deflection and offsets, with its derivatives.

U is the weighted sum of the potentials of up to 32 blocks, the values of the offsets next to the actual ones. Kernels
take the head of a table (`FORCE_TABLE` in `exugear.mesh_force.layout`) and read the arrays that lie behind it.
"""

from math import inf, nan
from typing import NamedTuple

from exugear.mesh_force.offset_interpolation import MOST_VALUES, stencil, tilt_stencil
from exugear.mesh_force.patches import phase_cell, table_of
from exugear.mesh_force.potential import CONTINUED, centroid_at, extent_of, potential, potential_apart
from fem.support.numba_cache import apart, compiled, kept

#: Share of the way to the end of the shortest table up to which all tables surely reach.
REACH = 0.8


class StaticForce(NamedTuple):
    """A flank without damping: its potential [J], whose derivatives are force and generalized forces.

    penetration        of the flanks [m]; 0 without contact
    force              by the deflection [N]
    stiffness          of the force by the deflection [N/m]
    force_by_phase     slope of the force by the phase [N per pitch]
    by_phase           of the potential by the phase [N m per pitch]
    by_a, by_axial     by centre distance and axial offset [N]
    by_misalignment    [N m]; the force centroid is -by_misalignment / force
    """

    energy: float
    penetration: float
    force: float
    stiffness: float
    force_by_phase: float
    by_phase: float
    by_a: float
    by_misalignment: float
    by_axial: float


NO_CONTACT = StaticForce(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@compiled
def damping(table, penetration):
    """Damping coefficient [N s/m], which ramps in with the penetration; 0 without contact."""
    if penetration <= 0.0:
        return 0.0
    r = min(penetration / table.damping_ramp, 1.0)
    return table.damping * r * r * (3.0 - 2.0 * r)


@compiled(forceinline=True)
def spinning_force(table, phase, deflection):
    """`StaticForce` of a flank by its table, of a law without offsets between gears that cannot tilt.

    Raises ValueError as `potential` beyond the table.
    """
    u = potential(table, block_number(table, 0, 0, 0), phase_cell(table, phase), deflection, None)
    by_phase = u.by_phase if table.conserves != 0 else 0.0
    return StaticForce(
        u.energy, max(u.penetration, 0.0), u.force, u.stiffness, u.force_by_phase, by_phase, 0.0, u.by_lever, 0.0
    )


@compiled(forceinline=True)
def static_force(table, phase, deflection, a, misalignment, axial):
    """`StaticForce` of a flank by its table, at offsets; ValueError beyond the table.

    A law that does not conserve energy keeps the derivatives by deflection and misalignment alone.
    """
    if table.has_centroid == 0 and table.offset_counts[0] * table.offset_counts[1] * table.offset_counts[2] == 1:
        return spinning_force(table, phase, deflection)
    static, limit = blended(table, phase, deflection, a, misalignment, axial)
    if static.force > limit * (1.0 + CONTINUED):
        raise ValueError(deflection, deflection - (static.force - limit) / static.stiffness, nan, nan, table.side)
    return static if table.conserves != 0 else without_further_torques(static)


@apart
def blended(table, phase, deflection, a, misalignment, axial):
    """(`StaticForce` at offsets, largest force [N] of the law there)."""
    cell = phase_cell(table, phase)
    distance, tilt, shift = stencil(table, 0, a), tilt_stencil(table, misalignment), stencil(table, 2, axial)
    total, limit = NO_CONTACT, 0.0
    for p in range(min(MOST_VALUES, table.offset_counts[0])):
        for r in range(min(MOST_VALUES, table.offset_counts[2])):
            weight = distance.weights[p] * shift.weights[r]
            by_a, by_axial = distance.slopes[p] * shift.weights[r], distance.weights[p] * shift.slopes[r]
            if weight != 0.0 or by_a != 0.0 or by_axial != 0.0:
                for q in range(2):
                    share, slope = tilt.weights[q], tilt.slopes[q]
                    if share != 0.0 or slope != 0.0:
                        block = block_number(table, distance.first + p, tilt.first + q, shift.first + r)
                        u = potential_apart(table, block, cell, deflection, tilt.levers[q])
                        by_tilt = slope * u.energy + share * tilt.lever_slopes[q] * u.by_lever
                        total = added(total, u, weight * share, (by_a * share, weight * by_tilt, by_axial * share))
                        limit += weight * share * u.largest_force
    return total, limit


@compiled
def block_number(table, a, misalignment, axial):
    """Number of the block at an index along each of the three offset axes."""
    return (a * table.offset_counts[1] + misalignment) * table.offset_counts[2] + axial


@compiled
def added(total, u, weight, by_offsets):
    """The sum with the potential of a block added by its weight.

    by_offsets   slopes of the weight by centre distance and axial offset, and the derivative by the misalignment
    """
    return StaticForce(
        total.energy + weight * u.energy,
        total.penetration + weight * max(u.penetration, 0.0),
        total.force + weight * u.force,
        total.stiffness + weight * u.stiffness,
        total.force_by_phase + weight * u.force_by_phase,
        total.by_phase + weight * u.by_phase,
        total.by_a + by_offsets[0] * u.energy,
        total.by_misalignment + by_offsets[1],
        total.by_axial + by_offsets[2] * u.energy,
    )


@compiled
def without_further_torques(static):
    """Force and moment of the force centroid alone, as of the former law."""
    return StaticForce(
        static.energy,
        static.penetration,
        static.force,
        static.stiffness,
        static.force_by_phase,
        0.0,
        0.0,
        static.by_misalignment,
        0.0,
    )


@compiled
def centroid_of(static):
    """Axial force centroid [m], with the signs of the map; 0 without contact."""
    return -static.by_misalignment / static.force if static.force != 0.0 else 0.0


@kept
def ends_of(table, side):
    """Means over phase of force [N] and tangent stiffness [N/m] at the end of the table of a flank (side 1 or -1)."""
    of_flank = table_of(table, side)
    return of_flank.last_force, of_flank.last_stiffness


@kept
def range_at(table, phase):
    """Deflections at loss of contact and at the end of the table [m], of a law without offsets."""
    extent = extent_of(table, block_number(table, 0, 0, 0), phase_cell(table, phase))
    return extent.unloaded, extent.unloaded + extent.largest


@compiled
def contact_at(table, phase, a, misalignment, axial):
    """Deflections [m] at which contact begins, and up to which all blocks reach, at offsets."""
    cell = phase_cell(table, phase)
    distance, tilt, shift = stencil(table, 0, a), tilt_stencil(table, misalignment), stencil(table, 2, axial)
    contact = end = inf
    for p in range(min(MOST_VALUES, table.offset_counts[0])):
        for r in range(min(MOST_VALUES, table.offset_counts[2])):
            if distance.weights[p] * shift.weights[r] != 0.0:
                for q in range(2):
                    if tilt.weights[q] != 0.0:
                        block = block_number(table, distance.first + p, tilt.first + q, shift.first + r)
                        extent = extent_of(table, block, cell)
                        moved = extent.unloaded
                        if table.has_centroid != 0:
                            moved += tilt.levers[q] * centroid_at(table, block, cell, extent, 0.0).value
                        contact, end = min(contact, moved), min(end, extent.unloaded + extent.largest)
    return contact, contact + REACH * (end - contact)
