"""Compliance between the slices of all tooth pairs: of the solid gears, and of half-spaces less their half-planes.

The compliance of a gear is tabulated at the tops of hat functions. A load at a point is a sum of the four hats around
it, and its mean over a slice, of those that the slice overlaps: products are summed over these alone.
"""

from typing import NamedTuple

import numpy as np
from numba import types

from fem.contact.mesh_geometry import PAIR_RECORDS
from fem.elasticity.flank_compliance import Compliance
from fem.elasticity.half_space import between_in_kernels
from fem.elasticity.rim_bending import RimModes
from fem.microgeometry.compiled_flank import HINGE, is_of, lever
from fem.support.numba_cache import kept_unchecked, unchecked
from fem.support.on_demand import on_demand


class CompiledCompliance(NamedTuple):
    """`Compliance` of a gear for compiled code, without its symmetry; of a rim that is clamped without modes."""

    arcs: np.ndarray
    axial: np.ndarray
    end: float
    blocks: np.ndarray
    slide: np.ndarray
    pitches: float
    rim: RimModes


class Weights(NamedTuple):
    """Values of hat functions at n points on a flank.

    bounds  (n, 3) first of the hats across the width, how many there are, and first of the two hats along the profile
    across  (n, n_axial) values of the hats across the width, from the first on
    along   (n, 2) values of the hats along the profile
    """

    bounds: np.ndarray
    across: np.ndarray
    along: np.ndarray


#: Numba's types.
WEIGHTS = types.NamedTuple((types.int64[:, ::1], types.float64[:, ::1], types.float64[:, ::1]), Weights)
RIM_MODES = types.NamedTuple((types.int64, types.float64[:, :, :, ::1], types.float64[:, :, :, ::1]), RimModes)
#: Modes of a rim that is clamped: none.
CLAMPED = RimModes(0, np.zeros((0, 1, 1, 1)), np.zeros((0, 1, 1, 1)))


def compiled_compliance(compliance: Compliance, angle: float, teeth: range) -> CompiledCompliance:
    """The compliance of teeth as contiguous arrays; tooth 0 of a ring is at an angle on its supports [rad]."""
    arrays = (np.ascontiguousarray(getattr(compliance, name)) for name in ("arcs", "axial", "blocks", "slide"))
    arcs, axial, blocks, slide = arrays
    rim = CLAMPED if compliance.rim is None else compliance.rim.modes(angle, teeth)
    return CompiledCompliance(arcs, axial, float(compliance.end), blocks, slide, float(compliance.pitches), rim)


@unchecked
def _interval(tops, position):
    """Number of the interval between tops, the outer ones without end, that holds a position."""
    k = 0
    while k < tops.size - 2 and tops[k + 1] <= position:
        k += 1
    return k


@unchecked
def _mean_across(tops, low, high, values):
    """Write the means of hats (n,) over a slice from low to high; the number of the first, and how many there are.

    The hats are linear beyond the outer tops.
    """
    first, last = _interval(tops, low), _interval(tops, high)
    for k in range(first, last + 1):
        start, end = low if k == first else tops[k], high if k == last else tops[k + 1]
        share, part = ((start + end) / 2 - tops[k]) / (tops[k + 1] - tops[k]), (end - start) / (high - low)
        values[k - first] += part * (1 - share)
        values[k - first + 1] += part * share
    return first, last - first + 2


@unchecked
def _weights_of(body, low, high, arcs):
    """`Weights` of n slices from low to high (n,), each at m arc lengths (n, m) [m]: point i m + a."""
    n, m = arcs.shape
    bounds, across, along = np.empty((n * m, 3), np.int64), np.zeros((n * m, body.axial.size)), np.empty((n * m, 2))
    for i in range(n):
        for a in range(m):
            p, hat = i * m + a, _interval(body.arcs, arcs[i, a])
            bounds[p, 0], bounds[p, 1] = _mean_across(body.axial, low[i], high[i], across[p])
            share = (arcs[i, a] - body.arcs[hat]) / (body.arcs[hat + 1] - body.arcs[hat])
            bounds[p, 2], along[p, 0], along[p, 1] = hat, 1 - share, share
    return Weights(bounds, across, along)


@unchecked
def _write_displacements(tables, weights, p, factors, hats, u):
    """Write the displacements u (n_axial, n_hat) at hats, (first, last) along the profile, per force at point p.

    tables      those of the displacements normal to the flank and along the profile, which count times two factors
    """
    (block, slide), (first, number, hat) = tables, weights.bounds[p]
    before, after = weights.along[p, 0], weights.along[p, 1]
    for z in range(u.shape[0]):
        for k in range(hats[0], hats[1]):
            u[z, k] = 0.0
    for y in range(number):
        of_block, of_slide = factors[0] * weights.across[p, y], factors[1] * weights.across[p, y]
        for z in range(u.shape[0]):
            for k in range(hats[0], hats[1]):
                normal = before * block[first + y, hat, z, k] + after * block[first + y, hat + 1, z, k]
                along = before * slide[first + y, hat, z, k] + after * slide[first + y, hat + 1, z, k]
                u[z, k] += of_block * normal + of_slide * along


@unchecked
def _add_products(u, weights, columns, total):
    """Add the sums of hats with values u (n_axial, n_hat) at points in columns (first, last) to a row of the total."""
    for q in range(columns[0], columns[1]):
        first, number, hat = weights.bounds[q]
        before, after, at_point = weights.along[q, 0], weights.along[q, 1], 0.0
        for z in range(number):
            at_point += weights.across[q, z] * (before * u[first + z, hat] + after * u[first + z, hat + 1])
        total[q] += at_point


@unchecked
def _add_body(body, side, number, m, weights, tilts, total):
    """Add twice the displacement of a gear, 0 or 1, per force between m points in each slice of tooth pairs (n,).

    tilts       (n m,) angles of the direction of contact from the gear's normal [rad]

    By Maxwell and Betti the displacement of a tooth further behind is that of the one ahead in the transposed matrix.
    """
    teeth, u = len(body.blocks) - 1, np.empty(body.blocks.shape[3:])
    for first, last in _runs(number):
        loaded = _hats_between(weights, first * m, last * m)
        for p in range(len(total)):
            ahead = (number[p // m] - number[first]) * (1 - 2 * side)
            if abs(ahead) > body.pitches or (ahead < 0 and tilts[p] == 0):
                continue
            if abs(ahead) > teeth:
                raise RuntimeError("teeth in contact are too far apart for the mesh; take a density of more teeth")
            tables = body.blocks[max(0, ahead)], body.slide[max(0, ahead + len(body.slide) - teeth - 1)]
            factors = 0.0 if ahead < 0 else 1.0 if ahead == 0 else 2.0, -2 * tilts[p]
            _write_displacements(tables, weights, p, factors, loaded, u)
            _add_products(u, weights, (first * m, last * m), total[p])


@on_demand(
    *(types.none, RIM_MODES, types.int64, types.int64[:], types.int64),
    *(WEIGHTS, types.float64[::1], types.float64[:, ::1]),
)
def _add_rim(rim, side, number, m, weights, tilts, total):
    """Add the lower triangle of the displacement by the bending of a rim, as `_add_body` that of the clamped gear."""
    moved = np.zeros((len(total), len(rim.normal)))
    for p in range(len(total)):
        first, n, hat = weights.bounds[p]
        tooth = number[p // m] * (1 - 2 * side) - rim.first
        for y in range(n):
            for h in range(2):
                weight = weights.across[p, y] * weights.along[p, h]
                for k in range(len(rim.normal)):
                    normal, along = rim.normal[k, tooth, first + y, hat + h], rim.along[k, tooth, first + y, hat + h]
                    moved[p, k] += weight * (normal - tilts[p] * along)
    for p in range(len(total)):
        for q in range(p + 1):
            for k in range(len(rim.normal)):
                total[p, q] += moved[p, k] * moved[q, k]


@unchecked
def _hats_between(weights, first, last):
    """First of the hats along the profile at points from the first to the last, and the one after the last hat."""
    low, high = weights.bounds[first, 2], weights.bounds[first, 2]
    for p in range(first + 1, last):
        low, high = min(low, weights.bounds[p, 2]), max(high, weights.bounds[p, 2])
    return low, high + 2


@unchecked
def _runs(number):
    """(k, 2) first slice, and the one after the last, of each tooth pair."""
    runs, n = np.empty((number.size, 2), np.int64), 0
    for i in range(number.size):
        if i == 0 or number[i] != number[i - 1]:
            runs[n, 0], n = i, n + 1
        runs[n - 1, 1] = i + 1
    return runs[:n]


@kept_unchecked
def smooth_compliance(mesh, bodies, mirrored, slices, depth, arcs, tilts):
    """(n m, n m) displacement between the flanks per force at arcs (2, n, m) [m], beside half-planes [m/N].

    That by the bending of a rim is always between all teeth.

    mirrored    whether the other half of the face carries the mirror image
    slices      number, low and high (n,): those of a tooth pair adjoin, from low to high
    depth       depth at which the half-planes are clamped [m]
    tilts       (2, n, m) of the direction of contact from the normals of pinion and wheel [rad]
    """
    number, low, high = slices
    n, m = arcs.shape[1:]
    total, bending = np.zeros((n * m, n * m)), np.zeros((n * m, n * m))
    for side in range(2):
        shift, tilt = mesh.gears[side].axial, tilts[side].copy().reshape(n * m)
        weights = _weights_of(bodies[side], low - shift, high - shift, arcs[side])
        _add_body(bodies[side], side, number, m, weights, tilt, total)
        if len(bodies[side].rim.normal):
            _add_rim(bodies[side].rim, side, number, m, weights, tilt, bending)
    for i in range(n * m):
        for j in range(i + 1):
            total[i, j] = (total[i, j] + total[j, i]) / 2 + bending[i, j]
            total[j, i] = total[i, j]
    _add_half_planes(mesh, bodies, mirrored, slices, depth, total)
    for side in range(2):
        cracked = 0
        for row in mesh.wheel if side else mesh.pinion:
            cracked += row.role == HINGE
        if cracked:
            _add_cracks(mesh, side, mirrored, number, arcs[side], total)
    return total


@on_demand(
    *(types.none, PAIR_RECORDS, types.int64, types.boolean),
    *(types.int64[:], types.float64[:, :], types.float64[:, ::1]),
)
def _add_cracks(mesh, side, mirrored, number, arcs, total):
    """Add the displacement per force on the flanks of a gear, 0 or 1, whose teeth turn about hinges in their roots."""
    n, m = arcs.shape
    for row in mesh.wheel if side else mesh.pinion:
        if row.role != HINGE:
            continue
        turn, radius, half_angle, r_b = row.numbers[0], row.numbers[1], row.numbers[2], row.numbers[3]
        factor = turn * mesh.position.inclined**2 * (2.0 if mirrored else 1.0)
        for p in range(n * m):
            tooth = number[p // m] * (1 - 2 * side)
            if not is_of(row, tooth):
                continue
            lever_p = lever(radius, half_angle, r_b, np.sqrt(2 * r_b * max(arcs[p // m, p % m], 0.0)))
            for q in range(n * m):
                if number[q // m] == number[p // m]:
                    lever_q = lever(radius, half_angle, r_b, np.sqrt(2 * r_b * max(arcs[q // m, q % m], 0.0)))
                    total[p, q] += factor * lever_p * lever_q


@unchecked
def _add_half_planes(mesh, bodies, mirrored, slices, depth, total):
    """Add the displacement per force in slices of half-spaces less their half-planes."""
    number, low, high = slices
    m, inclined = len(total) // number.size, mesh.position.inclined
    same = bodies[0].end == bodies[1].end and mesh.gears[1].axial == 0
    for first, last in _runs(number):
        for side in range(1 if same else 2):
            edges, end, gear = np.empty(last - first + 1), bodies[side].end / inclined, mesh.gears[side]
            for i in range(first, last):
                edges[i - first], edges[i - first + 1] = (
                    (low[i] - gear.axial) / inclined,
                    (high[i] - gear.axial) / inclined,
                )
            between = between_in_kernels(edges, end, depth, mirrored)
            factor = mesh.position.flattening if same else gear.flattening
            for i in range(last - first):
                for j in range(last - first):
                    for a in range(m):
                        for b in range(m):
                            total[(first + i) * m + a, (first + j) * m + b] += factor * between[i, j]
