"""Strips along the profile on which the contact pressure is constant: equal ones, finer ones at a rounded tip edge."""

from math import asinh, copysign, hypot, log, sinh, sqrt
from typing import NamedTuple

import numpy as np

from fem.contact.closest_point import Closest
from fem.contact.contact_slices import ContactSlices
from fem.contact.flank_gap import (
    approach_at,
    arc_of_mate,
    between_normals,
    first_roll,
    material_along,
    opposing_roll,
    sections_of,
    write_gaps,
)
from fem.pair import hertz
from fem.support.numba_cache import kept_unchecked, unchecked

#: Strips of a slice: the largest pressure is within 1 % of Hertz's.
STRIPS = 21
#: Strips reach this many Hertzian half-widths to either side.
WINDOW = 1.5
#: Strips of a slice where an edge is rounded, and width of the narrowest over Hertz's half-width on the rounding: the
#: largest pressure is within 1 % of that on twice as many.
FINE, NARROW = 41, 0.35
#: Slices without a rounding have strips that grow by less than the inverse of this over their window.
EVEN = 1e6
#: Number of strips of a slice between which the smooth compliance is interpolated by parabolas; of equal strips the
#: outer ones keep a tenth of all from the ends: towards the tip corner of the mate it rises like a logarithm.
NODES, FROM_END = 3, 10


class Strips(NamedTuple):
    """m strips along the profile in each of n slices.

    arcs        (2, n, m) arc lengths of their middles on pinion and wheel [m]
    width       (n, m) their widths [m]
    gap         (n, m) mean normal gap, aligned [m]
    approach    (n, m) normal approach per transmission error
    tilts       (2, n, m) angles of the direction of contact from the normals of pinion and wheel [rad]
    open        (2, n) whether the flank goes on beyond the first, and the last strip
    expected    (n, m) pressure by Hertz's ellipse, up to a factor
    equal       whether the strips of each slice are equal
    """

    arcs: np.ndarray
    width: np.ndarray
    gap: np.ndarray
    approach: np.ndarray
    tilts: np.ndarray
    open: np.ndarray
    expected: np.ndarray
    equal: bool


_log_mean = unchecked(hertz.log_mean)


def strips_of(slices: ContactSlices, half_widths: np.ndarray) -> Strips:
    """Strips as far as WINDOW times half_widths (n,) [m] on either side of where the flanks are closest."""
    numbers = slices.number, slices.low, slices.high
    te, closest = float(slices.te), tuple(slices.closest)
    return Strips(*slices.mesh.call(strips_around, numbers, te, closest, half_widths, FINE))


@kept_unchecked
def strips_around(mesh, slices, te, closest, half_widths, fine):
    """Fields of `Strips` of slices with numbers and axial ends (n,).

    closest     fields of `Closest` of the slices
    fine        number of strips where an edge is rounded
    """
    closest = Closest(*closest)
    number, low, high = slices
    n, sections = number.size, sections_of(mesh, number, low, high, np.full(number.size, te))
    equal = not _any_rounding(mesh, sections)
    m = STRIPS if equal else fine
    rolls, width, is_open = np.empty((n, 2 * m + 1)), np.empty((n, m)), np.empty((2, n), np.bool_)
    for i in range(n):
        start, end, is_open[0, i], is_open[1, i] = _window(mesh, sections[i], closest.roll[i], half_widths[i])
        at_closest = closest.roll[i], closest.radius[i]
        _write_edges(mesh, sections[i], (start, end), at_closest, half_widths[i], equal, width[i], rolls[i])
    gap, slope, feet = _gaps_of(mesh, sections, rolls)
    arcs, tilts, approach, expected = np.empty((2, n, m)), np.empty((2, n, m)), np.empty((n, m)), np.empty((n, m))
    for i in range(n):
        at = sections[i]
        _write_expected_pressure(mesh, half_widths[i], closest.radius[i], gap[i], expected[i])
        _write_directions(mesh, at, (rolls[i], feet[i], slope[i]), expected[i], width[i], tilts, approach, i)
        for k in range(m):
            gap[i, k] += approach[i, k] * te
            arcs[at.host, i, k] = rolls[i, 2 * k + 1] ** 2 / (2 * at.r_host)
            arcs[1 - at.host, i, k] = arc_of_mate(at, feet[i, 2 * k + 1])
    return arcs, width, gap, approach, tilts, is_open, expected, equal


@unchecked
def _any_rounding(mesh, sections):
    """Whether the tip edge of the mate is rounded in any slice."""
    rounded = 0
    for i in range(sections.size):
        rounded += mesh.gears[1 - sections[i].host].rounding > 0
    return rounded > 0


@unchecked
def _window(mesh, at, closest, half_width):
    """Arc lengths of the host from the first to the last strip [m], and whether the flank goes on beyond them."""
    low, high = first_roll(mesh, at) ** 2 / (2 * at.r_host), at.tip**2 / (2 * at.r_host)
    centre = closest**2 / (2 * at.r_host)
    start, end = max(low, centre - WINDOW * half_width), min(high, centre + WINDOW * half_width)
    return start, end, start > low, end < high


@unchecked
def _write_edges(mesh, at, window, closest, half_width, equal, width, roll):
    """Write the widths (m,) of the strips of a slice, and the host's roll lengths (2 m + 1,) at edges and middles.

    closest     roll length where the flanks are closest, and relative radius of curvature there [m]
    """
    (start, end), m = window, width.size
    focus, scale, first, last = start, 1.0, 0.0, 0.0
    if not equal:
        focus, scale = _grading(mesh, at, window, closest, half_width)
        first, last = asinh((start - focus) / scale), asinh((end - focus) / scale)
    before = start
    for k in range(m):
        after = start + (end - start) / m * (k + 1)
        if not equal:
            after = focus + scale * sinh(first + (last - first) * ((k + 1) / m))
            before = focus + scale * sinh(first + (last - first) * (k / m))
        width[k] = (end - start) / m if equal else after - before
        roll[2 * k] = copysign(sqrt(2 * at.r_host * before), at.r_host)
        roll[2 * k + 1] = copysign(sqrt(at.r_host * (before + after)), at.r_host)
        before = after
    roll[2 * m] = copysign(sqrt(2 * at.r_host * before), at.r_host)


@unchecked
def _grading(mesh, at, window, closest, half_width):
    """Arc length around which strips are graded, and their scale there [m].

    Beside a rounding of the mate's edge they are narrowest where it begins, or where it is closest.
    """
    (start, end), mate = window, mesh.gears[1 - at.host]
    focus = min(opposing_roll(mesh, at, mate.edge), closest[0]) ** 2 / (2 * at.r_host)
    if mate.rounding <= 0:
        return focus, EVEN * (end - start)
    outside = max(0.0, start - focus, focus - end)
    return focus, hypot(NARROW * half_width * sqrt(min(mate.rounding / closest[1], 1.0)), outside)


@unchecked
def _gaps_of(mesh, sections, rolls):
    """Mean gaps of strips (n, m) by Simpson, slopes of the material removed from the host, the mate's roll lengths.

    rolls   (n, 2 m + 1) of the host at edges and middles of the strips, as those of the mate [m]
    """
    n, m = len(rolls), rolls.shape[1] // 2
    values, feet, gap, slope = np.empty(rolls.shape), np.empty(rolls.shape), np.empty((n, m)), np.empty((n, m))
    write_gaps(mesh, sections, rolls, values, feet)
    material = material_along(mesh, sections, rolls)
    for i in range(n):
        host, r_host = sections[i].host, sections[i].r_host
        for k in range(m):
            change = (rolls[i, 2 * k + 2] ** 2 - rolls[i, 2 * k] ** 2) / (2 * r_host)
            slope[i, k] = (material[host, i, 2 * k + 2] - material[host, i, 2 * k]) / change
            gap[i, k] = (values[i, 2 * k] + 4 * values[i, 2 * k + 1] + values[i, 2 * k + 2]) / 6
    return gap, slope, feet


@unchecked
def _write_expected_pressure(mesh, half_width, radius, gap, expected):
    """Write the pressure by Hertz's ellipse at gaps (m,), up to a factor."""
    closing, least = mesh.position.inclined * half_width**2 / (2 * radius), gap[0]
    for k in range(1, gap.size):
        least = min(least, gap[k])
    for k in range(gap.size):
        expected[k] = sqrt(max(closing - (gap[k] - least), 0.0))


@unchecked
def _write_directions(mesh, at, profile, expected, width, tilts, approach, i):
    """Write the tilts (2, n, m) of pinion and wheel and the approaches (n, m) in slice i under an expected pressure.

    profile     roll lengths of host and mate (2 m + 1,) at edges and middles of the strips, slopes of the host (m,)

    Half-planes do not turn one another: under pressure p on flanks with a difference of slopes h' the integral of
    p h' vanishes. The mean normals of both flanks are then the direction of the force; about its mean the direction
    lies half-way between the normals.
    """
    (rolls, feet, slope), mean, total = profile, 0.0, 0.0
    for k in range(width.size):
        between = between_normals(at, rolls[2 * k + 1], feet[2 * k + 1])
        mean += expected[k] * width[k] * (slope[k] + between / 2)
        total += expected[k] * width[k]
    for k in range(width.size):
        roll, foot = rolls[2 * k + 1], feet[2 * k + 1]
        between = between_normals(at, roll, foot)
        from_host, inclined = mean / total - between / 2, mesh.position.inclined
        tilts[at.host, i, k], tilts[1 - at.host, i, k] = inclined * from_host, inclined * (from_host + between)
        approach[i, k] = approach_at(mesh, at, roll, foot, from_host)


@unchecked
def interpolated_strips(m, equal):
    """Numbers of the NODES strips of m between which the smooth compliance is interpolated."""
    first = m // FROM_END if equal else 0
    return first, m // 2, m - 1 - first


@unchecked
def write_shapes(width, equal, sides):
    """Write the NODES quadratic shape functions at the middles of strips of widths (m,) into the last rows of sides."""
    middle, m, shapes = np.empty(width.size), width.size, sides[len(sides) - NODES :]
    before = 0.0
    for k in range(m):
        middle[k], before = before + width[k] / 2, before + width[k]
    first, centre, last = interpolated_strips(m, equal)
    nodes = middle[first], middle[centre], middle[last]
    for i in range(NODES):
        for k in range(m):
            shapes[i, k] = 1.0
            for j in range(NODES):
                if i != j:
                    shapes[i, k] *= (middle[k] - nodes[j]) / (nodes[i] - nodes[j])


@unchecked
def write_half_planes(width, equal, depth, factor, between):
    """Write the displacements (m, m) per force between strips of widths (m,) of half-planes clamped at a depth [m].

    factor      flattening of the slice per force [m/N]
    """
    m, middle, before = width.size, np.empty(width.size), 0.0
    for i in range(m):
        middle[i], before = before + width[i] / 2, before + width[i]
        for j in range(i + 1):
            if equal and j > 0:
                between[i, j] = between[i - 1, j - 1]
            elif equal:
                between[i, j] = factor * (_log_mean(i, 1.0, 1.0) - log(width[0] / depth))
            else:
                between[i, j] = factor * (_log_mean(middle[i] - middle[j], width[i], width[j]) + log(depth))
            between[j, i] = between[i, j]
