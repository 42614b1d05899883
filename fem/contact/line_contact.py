"""Contact with one line load in each slice and Hertz's flattening: the slice mode, and the first guess for strips.

The overlap of the flanks across a slice, at x from -1 to 1 between its ends, is

    approach te - gap(x) - w - t x,   (w, v) = (C0 + te C1) p,   t = S w,   p = (f + S^T m, M)

with the displacement w where the flanks are closest and its tilt t, from the slices beside it; with its slope v along
the profile; the compliance C0 between the slices and its change C1 per transmission error as the flanks touch nearer to
both tips. Force f and moments m of each slice across its width and M along its profile follow from its overlap
(`slice_load`); by virtual work the moments m act on the slices beside it as the tilt follows from them. Newton's method
solves for p and te such that approach . f = mesh force: a slice joins and leaves as its overlap does, so that no active
set is needed, and the last linearization is the tangent stiffness.

A section of a slice under a line load q flattens as half-planes do by Hertz, by factor q (constant - ln(q) / 2). Where
the tip corner of the mate ends the contact before the half-width a of Hertz, at a distance t a from where the gap is
smallest, t < 1, half-planes that touch from the corner to 2 p a, p = (t + sqrt(t^2 + 3)) / 3, flatten more, by factor q
`at_edge(t)`; the middle of the load lies a (p + p^3) / 2 from the corner. Where the overlap across a slice falls to 0,
only a part of it carries load: force, moments and their derivatives are integrals over that part. Source: Johnson,
Contact Mechanics, 2.7, 4.2 and 5.6 (line contact of bodies that act as half-planes, pressure singular at the corner and
0 at the other end).

At the tip corner of a gear in a ring pair the compliance rises like -ln(x + s) for loads at distances s and points at x
from the corner, as under an image of the load beyond it: a corner of less than 180 degrees yields more than a
half-plane. Between two points of a slice, that is not linear. This part, with the mean of the logarithm over the load
(`image_mean`), belongs to the flattening of the slice and not to the compliance between slices.

The slope v turns the flanks by -v in the transverse section, which moves the vertex of their gap, a parabola of the
relative radius R, by -R v: that is far in rings, whose flanks nest, and near a corner it changes how much of the
contact the corner ends. Distances along the profile are given over sqrt(2 R), v times sqrt(R / 2); the force acts
M / (2 f) from where the flanks are closest, and slices near corners or of a ring have such a slope: in the others the
load stays where the flanks are closest.
"""

from math import exp, inf, log, sqrt
from typing import NamedTuple

import numpy as np

from fem.contact.contact_slices import ContactSlices
from fem.contact.coupling import CompiledCompliance, smooth_compliance
from fem.elasticity.face_symmetry import Face
from fem.linalg import small_systems
from fem.linalg.small_systems import product
from fem.support.numba_cache import kept_unchecked, unchecked

#: Share of the mesh force by which loads may change in the last Newton step, and their sum differ: the tangent
#: stiffness is that before this step.
CONVERGED = 1e-8
#: Largest number of steps. They are halved until what is not balanced falls, at most to this share: full ones diverge
#: where slices whose flanks nest or that touch on a part of the face take up load.
STEPS, LEAST_SHARE = 200, 1 / 256
#: Half-planes under whole slices are clamped at this depth, in modules, or deeper: at this share of the half-width of
#: the contact under the largest force.
DEPTH, DEEPER = 1 / 5, 1.5
#: Distances along the profile of two points from where the flanks are closest, over the half-width of the contact under
#: the largest force: the displacement is linear between and beyond them, though near a corner, where loads lie between
#: them, it rises like a logarithm.
POINTS_ALONG = 0.05, 0.45
#: The same in ring pairs, where the logarithm towards the corner is left out.
POINTS_IN_RINGS = 0.1, 0.5
#: Factor of the logarithm at the corner over the flattening of both flanks, in ring pairs. In them the compliance by FE
#: gives 0.17 to 0.36 at distances of a tenth and half of the half-width; from 0.15 to 0.25 peak to peak of four ring
#: pairs is within 0.18 % of the mean of that by strips, without the logarithm within 0.23 %. It would change te of
#: external pairs by less than 0.1 %.
IMAGE = 0.2
#: Mean of the logarithm over a load that ends at the corner, without that of its width: polynomial in the square of
#: half of this width, within 0.003; and over a load of Hertz's half-width beside the corner: in 1 / t^2.
IMAGE_AT_EDGE, IMAGE_BESIDE = (-1.0812, 1.2718, -0.2180, -0.0502), (-0.0625, -0.0151)
#: The contact of a slice ends at a corner where this is nearer than that half-width times this factor.
NEAR_CORNER = 1.2
#: Overlap of the flanks, in modules, for the difference quotient of their compliance, and up to which this changes: far
#: beyond it the compliance would not be positive.
OVERLAP, LARGEST_OVERLAP = 1 / 250, 1 / 20
#: Overlap by which the search begins, over the flattening of equally loaded slices.
START = 2.0
#: Least flattening per force, over the factor of its logarithm: Hertz's formula becomes negative for slices whose
#: contact is too wide for half-planes.
LEAST_FLATTENING = 0.1
#: Gauss points and weights over slices whose least overlap exceeds this share of the largest; over the loaded parts of
#: others they lie closer together towards the ends, where the rate of the line load falls to 0 as 1/ln does.
EVEN, EVEN_POINTS, EVEN_WEIGHTS = 0.5, *np.polynomial.legendre.leggauss(2)
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)
POINTS, WEIGHTS = _POINTS * (3 - _POINTS**2) / 2, _WEIGHTS * 1.5 * (1 - _POINTS**2)
#: Width of the band of derivatives between the loads of slices beside one another, and where slices have slopes, too.
WIDTH, WIDTH_WITH_SLOPES = 3, 5
#: Newton steps to the logarithm in Hertz's formula, and their last, relative to it.
LOGARITHM_STEPS, SHORTEST = 30, 1e-13


class LineContact(NamedTuple):
    """Contact of n slices, each with one line load.

    number              (n,) tooth pairs of the slices
    row                 (n, 2) rows of the displacement of each slice and of its slope in the compliance; -1: no slope
    compliance          (k, k) between the slices before they deflect [m/N]; of slopes over sqrt(m)
    softening           (k, k) its change per transmission error [1/N], or (0, 0): none
    softest_te          transmission error up to which it changes [m]
    factor, constant    (n,) Hertz's flattening [m] under forces f: factor f (constant - ln(f) / 2)
    approach, bend      (n,) normal approach per transmission error, and bend of the gap across the slices [m]
    edge                (n,) distance of the smallest gap from the mate's tip corner over sqrt(2 R), with the relative
                        radius R of the flanks [m^0.5]
    image               (n,) factor of the logarithm at the corner over the flattening
    beside              (2, n) slices before and after each, or itself at the ends of the face
    tilt                (n,) tilt over half of the width per difference of the displacements of these two
    """

    number: np.ndarray
    row: np.ndarray
    compliance: np.ndarray
    softening: np.ndarray
    softest_te: float
    factor: np.ndarray
    constant: np.ndarray
    approach: np.ndarray
    bend: np.ndarray
    edge: np.ndarray
    image: np.ndarray
    beside: np.ndarray
    tilt: np.ndarray


class LineLoads(NamedTuple):
    """Transmission errors (m,) [m] and tangent stiffnesses (m,) [N/m]; on the slices (m, n) forces, moments over half
    of their widths, and largest line loads times their lengths [N]; transmission errors at which the slices touch under
    the loads on the other tooth pairs (m, n) [m]."""

    te: np.ndarray
    stiffness: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    largest: np.ndarray
    touches: np.ndarray


def compliance_at(
    slices: ContactSlices,
    depth: float,
    distance: np.ndarray,
    bodies: tuple[CompiledCompliance, CompiledCompliance],
    face: Face,
) -> np.ndarray:
    """(n m, n m) compliance between points of slices, beside half-planes clamped at a depth [m/N].

    distance    (n, m) distances of the points along the profile from where the flanks are closest [m]
    """
    numbers = slices.number, slices.low, slices.high
    return slices.mesh.call(smooth_compliance, bodies, face.share < 1, numbers, depth, *slices.arcs_at(distance))


def loaded_distance(slices: ContactSlices, line_load: float) -> np.ndarray:
    """(n,) distances of the middles of line loads [N/m] along the profile from where the flanks are closest [m]."""
    half_width = slices.half_width(np.array(line_load))
    t = slices.closest.from_edge / half_width
    half = np.array([half_contact(of_slice) for of_slice in t])
    return half_width * (half * (1 + half**2) / 2 - np.clip(t, 0.0, 1.0))


def line_contact(
    slices: ContactSlices,
    bend: np.ndarray,
    bodies: tuple[CompiledCompliance, CompiledCompliance],
    face: Face,
    *,
    force: float,
    softens: bool,
) -> LineContact:
    """Contact of slices that adjoin within each tooth pair.

    bend        (n,) of the gap across the slices [m]
    force       the largest mesh force [N]
    softens     whether the compliance changes with the deflection, and the contact along the profile: not of a first
                guess
    """
    m_n, softening = slices.position.pair.pinion.m_n, np.zeros((0, 0))
    half_width = slices.half_width(np.array(force / slices.position.pair.b))
    depth = max(DEPTH * m_n, DEEPER * float(half_width.max()))
    edge = slices.closest.from_edge / np.sqrt(2 * slices.closest.radius)
    if softens:
        near_corner, in_ring = slices.closest.from_edge < NEAR_CORNER * half_width, slices.position.pair.wheel.internal
        slopes, image = in_ring | near_corner, np.where(in_ring & near_corner, IMAGE, 0.0)
        distance = np.multiply.outer(half_width, POINTS_IN_RINGS if in_ring else POINTS_ALONG)
        distance[~slopes, 0] = 0.0
        compliance, row = _with_slopes(slices, depth, distance, slopes, bodies, face)
        touching = slices.in_middle(OVERLAP * m_n)
        softer, _ = _with_slopes(touching, depth, distance, slopes, bodies, face)
        softening = (softer - compliance) / (OVERLAP * m_n)
        _leave_images_out(compliance, row, slices, distance, image, depth)
    else:
        edge, image = np.full(edge.size, inf), np.zeros(edge.size)
        compliance = compliance_at(slices, depth, np.zeros((edge.size, 1)), bodies, face)
        row = np.stack([np.arange(edge.size), np.full(edge.size, -1)], axis=1)
    constant = 0.5 + np.log(2 * depth / slices.half_width(1 / slices.width))
    beside, tilt = _tilts(slices, face)
    softened = compliance, softening, LARGEST_OVERLAP * m_n
    at_slices = slices.flattening, constant, slices.closest.approach, bend, edge, image, beside, tilt
    return LineContact(slices.number, row, *softened, *at_slices)


def _with_slopes(
    slices: ContactSlices,
    depth: float,
    distance: np.ndarray,
    slopes: np.ndarray,
    bodies: tuple[CompiledCompliance, CompiledCompliance],
    face: Face,
) -> tuple[np.ndarray, np.ndarray]:
    """`LineContact.compliance` and `row` of slices (n,) with slopes where `slopes` says so, by two points in each.

    distance    (n, 2) of the points from where the flanks are closest, first 0 in slices without a slope [m]
    """
    of_points = compliance_at(slices, depth, distance, bodies, face)
    n, (near, far) = slopes.size, (distance / np.sqrt(2 * slices.closest.radius)[:, None]).T
    row = np.full((n, 2), -1)
    order = np.cumsum(1 + slopes)
    row[:, 0], row[slopes, 1] = order - 1 - slopes, order[slopes] - 1
    transform, points = np.zeros((order[-1], 2 * n)), 2 * np.arange(n)
    transform[row[:, 0], points], transform[row[:, 0], points + 1] = far / (far - near), -near / (far - near)
    transform[row[slopes, 1], points[slopes]] = -0.5 / (far - near)[slopes]
    transform[row[slopes, 1], points[slopes] + 1] = 0.5 / (far - near)[slopes]
    return transform @ of_points @ transform.T, row


def _leave_images_out(
    compliance: np.ndarray,
    row: np.ndarray,
    slices: ContactSlices,
    distance: np.ndarray,
    image: np.ndarray,
    depth: float,
) -> None:
    """Subtract from the compliance of `_with_slopes` the logarithm at the corner within slices."""
    near_corner = np.flatnonzero(image)
    distance, rows, closest = distance[near_corner], row[near_corner], slices.closest
    near, far = (distance / np.sqrt(2 * closest.radius[near_corner])[:, None]).T
    to_rows = np.array([[far, -near], [-0.5 + 0 * far, 0.5 + 0 * far]]).transpose(2, 0, 1) / (far - near)[:, None, None]
    from_corner = distance + np.maximum(closest.from_edge[near_corner], 0.0)[:, None]
    rise = -np.log((from_corner[:, :, None] + from_corner[:, None, :]) / (2 * depth))
    factor = (image * slices.flattening)[near_corner, None, None]
    compliance[rows[:, :, None], rows[:, None, :]] -= factor * (to_rows @ rise @ to_rows.transpose(0, 2, 1))


def _tilts(slices: ContactSlices, face: Face) -> tuple[np.ndarray, np.ndarray]:
    """`LineContact.beside` and `tilt`: differences between the slices beside each, one-sided at the ends."""
    index, inner = np.arange(slices.number.size), np.diff(slices.number) == 0
    before = np.where(np.append(False, inner), index - 1, index)
    after = np.where(np.append(inner, False), index + 1, index)
    distance = slices.middle[after] - slices.middle[before]
    if face.share < 1:
        at_mid_plane = slices.low <= 0
        distance[at_mid_plane] += 2 * slices.middle[at_mid_plane]
    tilt = np.where(after > before, slices.width / 2 / np.where(after > before, distance, 1.0), 0.0)
    return np.stack([before, after]), tilt


@unchecked
def _add(band, i, j, value):
    """Add a value to the places (i, j) and (j, i) of a symmetric band matrix, by diagonal."""
    band[max(i, j), abs(i - j)] += 2 * value if i == j else value


@unchecked
def _band_factors(band):
    """(n, width) lower triangular L with L L^T = G by column from the diagonal on; G by row to the left of it.

    Columns of L are 0 where G is singular.
    """
    n, width = band.shape
    lower = np.zeros((n, width))
    for i in range(n):
        pivot = band[i, 0]
        for k in range(min(width - 1, i), 0, -1):
            column = i - k
            if lower[column, 0] > 0:
                value = band[i, k]
                for d in range(1, min(width - k, column + 1)):
                    value -= lower[column - d, k + d] * lower[column - d, d]
                lower[column, k] = value / lower[column, 0]
                pivot -= lower[column, k] ** 2
        lower[i, 0] = np.sqrt(pivot) if pivot > 1e-13 * band[i, 0] else 0.0
    return lower


@unchecked
def _left(lower, columns, vector):
    """L^T times a vector, at columns of L."""
    n, values = len(lower), np.zeros((1, columns.size))
    for a, j in enumerate(columns):
        for k in range(min(lower.shape[1], n - j)):
            values[0, a] += lower[j, k] * vector[0, j + k]
    return values


@unchecked
def _system(lower, columns, compliance):
    """Lower triangle of 1 + L^T C L at columns of L."""
    n, width = lower.shape
    matrix, column = np.empty((columns.size, columns.size)), np.zeros(n + width)
    for b, j in enumerate(columns):
        for r in range(j, n):
            column[r] = 0.0
            for k in range(min(width, n - j)):
                column[r] += lower[j, k] * compliance[j + k, r]
        for a in range(b, columns.size):
            i = columns[a]
            matrix[a, b] = 0.0
            for k in range(width):
                matrix[a, b] += lower[i, k] * column[i + k]
        matrix[b, b] += 1.0
    return matrix


@unchecked
def _times(matrix, vector):
    """Symmetric matrix (n, n) times a vector (1, n)."""
    values = np.empty(vector.shape)
    for i in range(len(matrix)):
        values[0, i] = product(matrix, i, vector, 0, len(matrix))
    return values


@unchecked
def _begin(contact, force, touches):
    """Least transmission error at which slices touch, and one at which equally loaded slices flatten enough [m]."""
    n, first = touches.size, 0
    for i in range(n):
        first = i if touches[i] < touches[first] else first
    factor, constant = contact.factor[first], contact.constant[first]
    flattened = factor * force / n * max(constant - log(force / n) / 2, LEAST_FLATTENING)
    return touches[first], touches[first] + START * flattened / contact.approach[first]


@unchecked
def _write_loads(contact, te, u, gap, loads, rest, rise, band):
    """Write the loads under displacements u (1, k), and how the loads p that balance them depend on overlaps.

    gap     gaps in the middle and slopes across the slices (2, n) [m]
    loads   (3, n) forces, moments across the slices, largest line loads
    rest    (1, k) loads p by the slices
    rise    (1, k) its derivative by te with u held
    band    (k, width) rows, to the left of the diagonal, of minus its derivative by u

    Returns the mesh force, and its derivative by te with u held.
    """
    mesh_force, stiffness = 0.0, 0.0
    for i in range(len(contact.row)):
        row, turn, tilt = contact.row[i, 0], contact.row[i, 1], contact.tilt[i]
        before, after = contact.row[contact.beside[0, i], 0], contact.row[contact.beside[1, i], 0]
        approach = contact.approach[i]
        overlap, slope = approach * te - gap[0, i] - u[0, row], -gap[1, i] - tilt * (u[0, after] - u[0, before])
        local = contact.factor[i], contact.constant[i], contact.edge[i], contact.image[i]
        load, change = slice_load(local, overlap, slope, contact.bend[i], -u[0, turn] if turn >= 0 else 0.0)
        loads[0, i], loads[1, i], loads[2, i] = load[0], load[1], load[3]
        by_middle, mixed, by_slope = change[0], change[1], change[2]
        mesh_force, stiffness = mesh_force + approach * load[0], stiffness + approach**2 * by_middle
        rest[0, row] += load[0]
        rest[0, after] += tilt * load[1]
        rest[0, before] -= tilt * load[1]
        rise[0, row] += approach * by_middle
        rise[0, after] += approach * tilt * mixed
        rise[0, before] -= approach * tilt * mixed
        _add(band, row, row, by_middle / 2)
        _add(band, row, after, tilt * mixed)
        _add(band, row, before, -tilt * mixed)
        _add(band, after, after, tilt**2 * by_slope / 2)
        _add(band, before, before, tilt**2 * by_slope / 2)
        _add(band, after, before, -(tilt**2) * by_slope)
        if turn >= 0:
            middle_by_turn, slope_by_turn, by_turn = change[3], change[4], change[5]
            rest[0, turn] += load[2]
            rise[0, turn] += approach * middle_by_turn
            _add(band, turn, turn, by_turn / 2)
            _add(band, turn, row, middle_by_turn)
            _add(band, turn, after, tilt * slope_by_turn)
            _add(band, turn, before, -tilt * slope_by_turn)
    return mesh_force, stiffness


@unchecked
def _equilibrium(contact, mesh_force, gap, touches):
    """Transmission error and stiffness under a mesh force, loads (3, n) as in `_write_loads`, and (n,) displacements by
    the loads on the other tooth pairs [m]; gap (2, n).

    With G = L L^T, minus the derivative of the slices' loads P by u, and their derivative h by te, a Newton step is

        dp = r + h' dte - L y,   (1 + L^T C L) y = L^T C (r + h' dte),   r = P - p,   h' = h - G C1 p
    """
    n, softens, (least, te) = len(contact.compliance), contact.softening.size > 0, _begin(contact, mesh_force, touches)
    p, loads, softer = np.zeros((1, n)), np.empty((3, touches.size)), np.zeros((1, n))
    width = WIDTH_WITH_SLOPES if n > touches.size else WIDTH
    compliance, stiffness, change = contact.compliance.copy(), 0.0, inf
    last_p, last_te, moved, te_step, share, last_unbalanced = p, te, p, 0.0, 1.0, inf
    for _ in range(STEPS):
        if softens:
            softer = _times(contact.softening, p) if te < contact.softest_te else np.zeros((1, n))
            for i in range(n):
                for j in range(n):
                    change_to = min(te, contact.softest_te) * contact.softening[i, j]
                    compliance[i, j] = contact.compliance[i, j] + change_to
        rest, rise, band = np.zeros((1, n)), np.zeros((1, n)), np.zeros((n, width))
        total, stiffness_held = _write_loads(contact, te, _times(compliance, p), gap, loads, rest, rise, band)
        if change < CONVERGED * mesh_force and abs(total - mesh_force) < CONVERGED * mesh_force:
            for i in range(touches.size):
                loads[0, i], loads[1, i] = loads[0, i] * (mesh_force / total), loads[1, i] * (mesh_force / total)
            return te, stiffness, loads, _displaced_by_others(contact, compliance, p)
        if not stiffness_held > 0:
            te, p = least + 2 * (te - least), np.zeros((1, n))
            continue
        unbalanced = (total - mesh_force) ** 2
        for i in range(n):
            rest[0, i] -= p[0, i]
            unbalanced += rest[0, i] ** 2
        if unbalanced > last_unbalanced and share > LEAST_SHARE:
            share /= 2
            p, te = last_p + share * moved, last_te + share * te_step
            continue
        displaced, rising = _times(compliance, rise), rise.copy()
        for i in range(n):
            for k in range(min(width, i + 1)):
                rising[0, i] -= band[i, k] * softer[0, i - k]
                if k:
                    rising[0, i - k] -= band[i, k] * softer[0, i]
        _yield_to(compliance, _band_factors(band), rest, rising)
        stiffness = stiffness_held - product(displaced, 0, rising, 0, n) - product(rise, 0, softer, 0, n)
        te_step = (mesh_force - total + product(displaced, 0, rest, 0, n)) / stiffness
        moved, change = rest + rising * te_step, 0.0
        for i in range(n):
            change = max(change, abs(moved[0, i]))
        last_p, last_te, last_unbalanced, share = p, te, unbalanced, 1.0
        p, te = p + moved, te + te_step
    raise RuntimeError("contact did not converge; try a neighbouring phase, less load or a finer resolution")


@unchecked
def _displaced_by_others(contact, compliance, p):
    """(n,) displacements of slices by the loads p (1, k) on the slices of other tooth pairs [m]."""
    number, displaced = contact.number, np.zeros(contact.number.size)
    for i in range(number.size):
        for j in range(number.size):
            if number[j] != number[i]:
                for row in contact.row[j]:
                    displaced[i] += compliance[contact.row[i, 0], row] * p[0, row] if row >= 0 else 0.0
    return displaced


@unchecked
def _yield_to(compliance, lower, rest, rising):
    """Replace loads x by x - L y with (1 + L^T C L) y = L^T C x: what is left of them as the slices yield."""
    n, columns = len(lower), small_systems.indices_of_true(lower[:, 0] > 0)
    right = np.empty((2, columns.size))
    of_rest = _left(lower, columns, _times(compliance, rest))
    of_rising = _left(lower, columns, _times(compliance, rising))
    # assigned as arrays, numba would compile functions of text for the message about their shapes
    for a in range(columns.size):
        right[0, a], right[1, a] = of_rest[0, a], of_rising[0, a]
    matrix = _system(lower, columns, compliance)
    small_systems.factorize(matrix)
    small_systems.solve(matrix, right)
    for a, j in enumerate(columns):
        for k in range(min(lower.shape[1], n - j)):
            rest[0, j + k] -= lower[j, k] * right[0, a]
            rising[0, j + k] -= lower[j, k] * right[1, a]


@kept_unchecked
def solve_lines(contact, force, middle, slope, touches):
    """Fields of `LineLoads` under forces on the modelled face (m,) > 0 [N].

    middle, slope, touches      (m, n) gaps in the middle of the slices, their slopes, transmission errors at which
                                the slices touch [m]
    """
    te, stiffness, loads = np.empty(force.size), np.empty(force.size), np.empty((3, *middle.shape))
    gap, touches_loaded = np.empty((2, middle.shape[1])), np.empty(middle.shape)
    for k in range(force.size):
        for i in range(middle.shape[1]):
            gap[0, i], gap[1, i] = middle[k, i], slope[k, i]
        te[k], stiffness[k], of_slices, displaced = _equilibrium(contact, force[k], gap, touches[k])
        for a in range(3):
            for i in range(middle.shape[1]):
                loads[a, k, i] = of_slices[a, i]
        for i in range(middle.shape[1]):
            touches_loaded[k, i] = touches[k, i] + displaced[i] / contact.approach[i]
    return te, stiffness, loads[0], loads[1], loads[2], touches_loaded


@unchecked
def at_edge(t):
    """Further flattening of a contact that ends at a corner, over factor times load, and its derivative; 0 from t = 1.

    t       distance of the smallest gap from the corner over the half-width of Hertz
    """
    if t >= 1:
        return 0.0, 0.0
    part, beyond = half_contact(t), min(t, 0.0)
    load = part * (1.5 * part - t)  # 1/2
    logarithm = log(part)
    flattened = load * logarithm + part * part / 4 + part * (part - t)
    gap = 2 * part * (part - t) + (t * t - beyond * beyond) / 2
    return 2 * (gap - flattened - 0.25), 2 * (t - beyond - part)


@unchecked
def line_load(factor, constant, overlap, edge, image):
    """Line load under an overlap > 0 [m] and its derivatives by overlap and edge, and t as in `at_edge`; load and
    derivatives times the length of the slice [N], [N/m], [N/m^0.5].

    edge    distance of the smallest gap from the mate's tip corner over sqrt(2 R) [m^0.5]
    image   factor of the logarithm at the corner over the flattening
    """
    largest, rate = _hertz_load(factor, constant, overlap)
    if edge >= sqrt(factor * largest) and image == 0:
        return largest, rate, 0.0, edge / sqrt(factor * largest)
    load, t, slope = largest, 0.0, 0.0
    for _ in range(LOGARITHM_STEPS):
        t = edge / sqrt(factor * load)
        further, slope = at_edge(t)
        logarithm = constant - log(load) / 2
        if image > 0:
            mean, by_t, by_t_twice = image_mean(t)
            further += image * (logarithm - 0.75 - mean + t * by_t / 4)
            slope += image * (t * by_t_twice - 3 * by_t) / 4
        logarithm += further
        rate = 1 / (factor * max(logarithm - (1 + image) / 2 - t * slope / 2, LEAST_FLATTENING))
        last, load = load, min(max(load + (overlap - factor * load * logarithm) * rate, load / 4), largest)
        if abs(load - last) < SHORTEST * load:
            break
    return load, rate, -sqrt(factor * load) * slope * rate, t


@unchecked
def turned_flanks(edge, turn):
    """Distance of the smallest gap from the corner, how far it moved, and how much the overlap grew as flanks turned.

    edge    distance before [m^0.5]; < 0 where the corner is closest
    turn    angle away from the corner times sqrt(R / 2) [m^0.5]
    """
    turned_edge = edge + turn
    if edge > 0 and turned_edge > 0:
        return turned_edge, turn, turn * turn
    if edge > 0:
        return turned_edge, -edge, -edge * edge - 2 * turn * edge
    if turned_edge > 0:
        return turned_edge, turned_edge, turned_edge * turned_edge
    return turned_edge, 0.0, 0.0


@unchecked
def load_and_moment(factor, constant, overlap, edge, moved, image):
    """Line load under an overlap > 0 [m], its moment along the profile, and derivatives.

    edge, moved     of `turned_flanks`, which move the load
    image           as in `line_load`

    Returns the load [N] and its moment [N m^0.5], both times the length of the slice, the derivatives of the load by
    overlap, of the load by turn or moment by overlap, and of the moment by turn.
    """
    load, rate, by_edge, t = line_load(factor, constant, overlap, edge, image)
    half = half_contact(t)
    from_closest, bend = half * (1 + half * half) / 2 - max(t, 0.0) if t < 1 else 0.0, half * half
    if image > 0:
        _, by_t, by_t_twice = image_mean(t)
        from_closest, bend = from_closest + image * by_t / 4, bend + image * by_t_twice / 4
    mixed = 2 * moved * rate + by_edge
    moment = 2 * load * (moved + sqrt(factor * load) * from_closest)
    return load, moment, rate, mixed, mixed * mixed / rate + 2 * load * bend


@unchecked
def image_mean(t):
    """Mean of ln((x + s) / half-width of Hertz) over the load at x and over that at s from the corner, and its first
    and second derivative; t as in `at_edge`."""
    if t >= 1:
        a, b = IMAGE_BESIDE
        square = 1 / (t * t)
        mean = log(2 * t) + square * (a + square * b)
        return mean, (1 - 2 * square * (a + 2 * square * b)) / t, square * (-1 + square * (6 * a + 20 * square * b))
    a, b, c, d = IMAGE_AT_EDGE
    half = half_contact(t)
    square = half * half
    by_half = 1 / half + 2 * half * (b + square * (2 * c + 3 * square * d))
    by_half_twice = -1 / square + 2 * (b + square * (6 * c + 15 * square * d))
    rate = 2 * square / (3 * square + 1)
    rate_by_half = 4 * half / (3 * square + 1) ** 2
    mean = log(2 * half) + a + square * (b + square * (c + square * d))
    return mean, by_half * rate, rate * (by_half_twice * rate + by_half * rate_by_half)


@unchecked
def half_contact(t):
    """Half of the width of a contact that ends at a corner, over the half-width of Hertz, at t as in `at_edge`."""
    if t >= 1:
        return 1.0
    return (t + sqrt(t * t + 3)) / 3 if t > -1 else 1 / (sqrt(t * t + 3) - t)


@unchecked
def _hertz_load(factor, constant, overlap):
    """`line_load` of a contact far from corners."""
    least = 0.5 + LEAST_FLATTENING
    widest = exp(2 * (constant - least))
    if overlap >= factor * widest * least:
        rate = 1 / (factor * LEAST_FLATTENING)
        return widest + (overlap - factor * widest * least) * rate, rate
    sought = constant - log(overlap / factor) / 2
    logarithm = max(sought + log(1 + abs(sought)) / 2, least)
    for _ in range(LOGARITHM_STEPS):
        change = (logarithm - log(logarithm) / 2 - sought) / (1 - 0.5 / logarithm)
        logarithm = max(logarithm - change, least)
        if abs(change) < SHORTEST * logarithm:
            break
    return overlap / factor / logarithm, 1 / (factor * (logarithm - 0.5))


@unchecked
def loaded_parts(middle, slope, bend):
    """Ends of the two parts of a slice in which the overlap middle + slope x - bend x^2 is positive; |x| <= 1."""
    if bend == 0 and slope == 0:
        return -1.0, 1.0 if middle > 0 else -1.0, 1.0, 1.0
    square = slope * slope + 4 * bend * middle
    if square <= 0:
        return -1.0, 1.0 if bend < 0 else -1.0, 1.0, 1.0
    twice = slope + (sqrt(square) if slope >= 0 else -sqrt(square))
    first, second = twice / (2 * bend), -2 * middle / twice
    low, high = max(min(first, second), -1.0), min(max(first, second), 1.0)
    if bend >= 0:
        return low, max(high, low), 1.0, 1.0
    return -1.0, max(min(low, 1.0), -1.0), min(max(high, -1.0), 1.0), 1.0


@unchecked
def slice_load(local, middle, slope, bend, turn):
    """Loads of an overlap middle + slope x - bend x^2 [m] across a slice, and their derivatives.

    local   factor, constant, edge and image of `LineContact`
    turn    of the flanks along the profile, as in `turned_flanks` [m^0.5]

    Returns force, moment over half of the width [N], moment along the profile [N m^0.5] and the largest line load times
    the length of the slice [N]; the derivatives of force by middle, of force by slope or moment by middle, of moment by
    slope, of force by turn, of moment by turn and of the moment along the profile by turn.
    """
    force, moment, along, largest = 0.0, 0.0, 0.0, 0.0
    by_middle, mixed, by_slope, by_turn, moment_by_turn, along_by_turn = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    edge, moved, grown = turned_flanks(local[2], turn)
    middle += grown
    even = middle - abs(slope) - abs(bend) > EVEN * (middle + abs(slope) + abs(bend))
    points, weights = (EVEN_POINTS, EVEN_WEIGHTS) if even else (POINTS, WEIGHTS)
    ends = (-1.0, 1.0, 1.0, 1.0) if even else loaded_parts(middle, slope, bend)
    for part in range(2):
        low, high = (ends[0], ends[1]) if part == 0 else (ends[2], ends[3])
        if high > low:
            for k in range(points.size):
                x, weight = (low + high + (high - low) * points[k]) / 2, (high - low) / 4 * weights[k]
                overlap = middle + slope * x - bend * x * x
                if overlap > 0:
                    load, beside, rate, turned, beside_turned = load_and_moment(
                        local[0], local[1], overlap, edge, moved, local[3]
                    )
                    force, moment, largest = force + weight * load, moment + weight * load * x, max(largest, load)
                    along, along_by_turn = along + weight * beside, along_by_turn + weight * beside_turned
                    by_middle, mixed = by_middle + weight * rate, mixed + weight * rate * x
                    by_slope += weight * rate * x * x
                    by_turn, moment_by_turn = by_turn + weight * turned, moment_by_turn + weight * turned * x
    loads = force, moment, along, largest
    return loads, (by_middle, mixed, by_slope, by_turn, moment_by_turn, along_by_turn)
