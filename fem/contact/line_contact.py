"""Contact with one line load in each slice and Hertz's flattening: the slice mode, and the first guess for strips.

The overlap of the flanks across a slice, at x from -1 to 1 between its ends, is

    approach te - gap(x) - w - t x,   w = (C0 + te C1) p,   t = S w,   p = f + S^T m

with the displacement w in the middle of the slice and its tilt t, from the slices beside it; the compliance C0 between
the slices and its change C1 per transmission error as the flanks touch nearer to both tips. Force f and moment m of
each slice follow from its overlap (`fem.contact.slice_pressure`); by virtual work the moments act on the slices beside
it as the tilt follows from them. Newton's method solves for p and te such that approach . f = mesh force: a slice joins
and leaves as its overlap does, so that no active set is needed, and the last linearization is the tangent stiffness.
"""

from math import log
from typing import NamedTuple

import numpy as np

from fem.contact.coupling import CompiledCompliance, smooth_compliance
from fem.contact.slice_pressure import slice_load
from fem.elasticity.face_symmetry import Face
from fem.gap.contact_slices import ContactSlices
from fem.linalg import small_systems
from fem.linalg.small_systems import product
from fem.support.numba_cache import kept_unchecked, unchecked

#: Shares of the mesh force by which loads may change in the last Newton step, after which they are exact to the square
#: of this share, and by which their sum may differ; number of steps before they are halved, and at most.
CONVERGED, BALANCED, DAMPED, STEPS = 1e-5, 1e-7, 20, 80
#: Half-planes under whole slices are clamped at this depth, in modules.
DEPTH = 1 / 5
#: Overlap of the flanks, in modules, for the difference quotient of their compliance.
OVERLAP = 1 / 250
#: Overlap by which the search begins, over the flattening of equally loaded slices.
START = 2.0


class LineContact(NamedTuple):
    """Contact of n slices, each with one line load.

    compliance          (n, n) between the slices before they deflect [m/N]
    softening           (n, n) its change per transmission error [1/N], or (0, 0): none
    factor, constant    (n,) Hertz's flattening [m] under forces f: factor f (constant - ln(f) / 2)
    approach, bend      (n,) normal approach per transmission error, and bend of the gap across the slices [m]
    beside              (2, n) slices before and after each, or itself at the ends of the face
    tilt                (n,) tilt over half of the width per difference of the displacements of these two
    """

    compliance: np.ndarray
    softening: np.ndarray
    factor: np.ndarray
    constant: np.ndarray
    approach: np.ndarray
    bend: np.ndarray
    beside: np.ndarray
    tilt: np.ndarray


class LineLoads(NamedTuple):
    """Transmission errors (m,) [m] and tangent stiffnesses (m,) [N/m]; on the slices (m, n) forces, moments over half
    of their widths, and largest line loads times their lengths [N]."""

    te: np.ndarray
    stiffness: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    largest: np.ndarray


def compliance_at(
    slices: ContactSlices, bodies: tuple[CompiledCompliance, CompiledCompliance], face: Face
) -> np.ndarray:
    """(n, n) compliance between slices where they are closest, beside their half-planes [m/N]."""
    depth, numbers = DEPTH * slices.position.pair.pinion.m_n, (slices.number, slices.low, slices.high)
    arcs = slices.closest_arcs[..., None]
    return slices.mesh.call(smooth_compliance, bodies, face.share < 1, numbers, depth, arcs, np.zeros(arcs.shape))


def line_contact(
    slices: ContactSlices,
    bend: np.ndarray,
    bodies: tuple[CompiledCompliance, CompiledCompliance],
    face: Face,
    *,
    softens: bool,
) -> LineContact:
    """Contact of slices that adjoin within each tooth pair.

    bend        (n,) of the gap across the slices [m]
    softens     whether the compliance changes with the deflection
    """
    compliance, softening = compliance_at(slices, bodies, face), np.zeros((0, 0))
    m_n = slices.position.pair.pinion.m_n
    if softens:
        touching = slices.in_middle(OVERLAP * m_n)
        softening = (compliance_at(touching, bodies, face) - compliance) / (OVERLAP * m_n)
    constant = 0.5 + np.log(2 * DEPTH * m_n / slices.half_width(1 / slices.width))
    beside, tilt = _tilts(slices, face)
    approach = slices.closest.approach
    return LineContact(compliance, softening, slices.flattening, constant, approach, bend, beside, tilt)


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
def _start(contact, force, touches):
    """Transmission error at which equally loaded slices carry the mesh force alone [m]."""
    n, te = contact.approach.size, 0.0
    least, factor, constant = touches[0], 0.0, 0.0
    for i in range(n):
        least = min(least, touches[i])
        factor, constant = factor + contact.factor[i] / n, constant + contact.constant[i] / n
    return least, least + START * factor * force / n * max(constant - log(force / n) / 2, 0.1) / contact.approach[0]


@unchecked
def _add(band, i, j, value):
    """Add a value to the places (i, j) and (j, i) of a symmetric band matrix, by diagonal."""
    band[max(i, j), abs(i - j)] += 2 * value if i == j else value


@unchecked
def _band_factors(band):
    """(n, 3) lower triangular L with L L^T = G by column from the diagonal on; G (n, 3) by row to the left of it."""
    n, lower = len(band), np.zeros((len(band), 3))
    for i in range(n):
        pivot = band[i, 0]
        for k in (2, 1):
            if i >= k and lower[i - k, 0] > 0:
                value = band[i, k]
                if k == 1 and i >= 2:
                    value -= lower[i - 2, 2] * lower[i - 2, 1]
                lower[i - k, k] = value / lower[i - k, 0]
                pivot -= lower[i - k, k] ** 2
        lower[i, 0] = np.sqrt(pivot) if pivot > 1e-13 * band[i, 0] else 0.0
    return lower


@unchecked
def _left(lower, columns, vector):
    """L^T times a vector, at columns of L."""
    n, values = len(lower), np.zeros((1, columns.size))
    for a, j in enumerate(columns):
        for k in range(min(3, n - j)):
            values[0, a] += lower[j, k] * vector[0, j + k]
    return values


@unchecked
def _system(lower, columns, compliance):
    """Lower triangle of 1 + L^T C L at columns of L."""
    n, matrix, column = len(lower), np.empty((columns.size, columns.size)), np.zeros(len(lower) + 2)
    for b, j in enumerate(columns):
        below, next_below = min(j + 1, n - 1), min(j + 2, n - 1)
        for r in range(j, n):
            column[r] = lower[j, 0] * compliance[j, r] + lower[j, 1] * compliance[below, r]
            column[r] += lower[j, 2] * compliance[next_below, r]
        for a in range(b, columns.size):
            i = columns[a]
            matrix[a, b] = lower[i, 0] * column[i] + lower[i, 1] * column[i + 1] + lower[i, 2] * column[i + 2]
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
def _equilibrium(contact, mesh_force, middle, slope, least, te):
    """Transmission error, stiffness, forces, moments and largest line loads under a force; te to begin with."""
    n, approach, softens = contact.approach.size, contact.approach, contact.softening.size > 0
    p, force, moment, largest = np.zeros((1, n)), np.empty(n), np.empty(n), np.empty(n)
    compliance, softer, stiffness, change = contact.compliance.copy(), np.zeros((1, n)), 0.0, mesh_force
    for step in range(STEPS):
        if softens:
            softer = _times(contact.softening, p)
            for i in range(n):
                for j in range(n):
                    compliance[i, j] = contact.compliance[i, j] + te * contact.softening[i, j]
        w = _times(compliance, p)
        band, rest, rise, total, own = np.zeros((n, 3)), np.zeros((1, n)), np.zeros((1, n)), 0.0, 0.0
        for i in range(n):
            before, after, tilt = contact.beside[0, i], contact.beside[1, i], contact.tilt[i]
            overlap = approach[i] * te - middle[i] - w[0, i]
            inclined = -slope[i] - tilt * (w[0, after] - w[0, before])
            load = slice_load(contact.factor[i], contact.constant[i], overlap, inclined, contact.bend[i])
            force[i], moment[i], largest[i], by_middle, mixed, by_slope = load
            total, own = total + approach[i] * force[i], own + approach[i] ** 2 * by_middle
            rest[0, i] += force[i] - p[0, i]
            rest[0, after] += tilt * moment[i]
            rest[0, before] -= tilt * moment[i]
            rise[0, i] += approach[i] * by_middle
            rise[0, after] += approach[i] * tilt * mixed
            rise[0, before] -= approach[i] * tilt * mixed
            _add(band, i, i, by_middle / 2)
            _add(band, i, after, tilt * mixed)
            _add(band, i, before, -tilt * mixed)
            _add(band, after, after, tilt**2 * by_slope / 2)
            _add(band, before, before, tilt**2 * by_slope / 2)
            _add(band, after, before, -(tilt**2) * by_slope)
        if change < CONVERGED * mesh_force and abs(total - mesh_force) < BALANCED * mesh_force:
            return te, stiffness, force * (mesh_force / total), moment * (mesh_force / total), largest, step
        lower = _band_factors(band)
        columns = small_systems.true_in(lower[:, 0] > 0)
        matrix = _system(lower, columns, compliance)
        right = np.empty((2, columns.size))
        displaced, faster = _times(compliance, rise), rise.copy()
        if softens:
            for i in range(n):
                for k in range(min(3, i + 1)):
                    faster[0, i] -= band[i, k] * softer[0, i - k]
                    if k:
                        faster[0, i - k] -= band[i, k] * softer[0, i]
        right[0] = _left(lower, columns, _times(compliance, rest))[0]
        right[1] = _left(lower, columns, _times(compliance, faster))[0]
        small_systems.factorize(matrix)
        small_systems.solve(matrix, right)
        for a, j in enumerate(columns):
            for k in range(min(3, n - j)):
                rest[0, j + k] -= lower[j, k] * right[0, a]
                faster[0, j + k] -= lower[j, k] * right[1, a]
        stiffness = own - product(displaced, 0, faster, 0, n)
        if softens:
            stiffness -= product(rise, 0, softer, 0, n)
        rise_of_te = (mesh_force - total + product(displaced, 0, rest, 0, n)) / stiffness
        if not own > 0:
            te, change = least + 2 * (te - least), mesh_force
            for i in range(n):
                p[0, i] = 0.0
            continue
        share, change = 1.0 if step < DAMPED else 0.5, 0.0
        for i in range(n):
            moved = rest[0, i] + faster[0, i] * rise_of_te
            p[0, i] += share * moved
            change = max(change, abs(moved))
        te += share * rise_of_te
    raise RuntimeError("contact did not converge; try a neighbouring phase, less load or a finer resolution")


@kept_unchecked
def solve_lines(contact, force, middle, slope, touches):
    """Fields of `LineLoads` under forces on the modelled face (m,) > 0 [N].

    middle, slope, touches      (m, n) gaps in the middle of the slices, their slopes, transmission errors at which
                                the slices touch [m]
    """
    te, stiffness, loads = np.empty(force.size), np.empty(force.size), np.empty((3, *middle.shape))
    steps = np.empty(force.size, np.int64)
    for k in range(force.size):
        least, start = _start(contact, force[k], touches[k])
        state = _equilibrium(contact, force[k], middle[k], slope[k], least, start)
        te[k], stiffness[k], steps[k] = state[0], state[1], state[5]
        for i in range(middle.shape[1]):
            loads[0, k, i], loads[1, k, i], loads[2, k, i] = state[2][i], state[3][i], state[4][i]
    return te, stiffness, loads[0], loads[1], loads[2], steps
