"""The kernels of a mesh force: one block of bicubic Hermite patches for each place of the offsets, in one array.

At each phase the secant stiffness k stands over u = (penetration / largest penetration)^(1/4): F = k penetration, so
that the force is exactly 0 without contact and the low loads, where a Hertzian contact softens, keep their resolution.
Both directions carry values and slopes, which is once continuously differentiable. Between the places of the offsets
unloaded deflection, largest penetration, ln k and centroid follow polynomials through up to four of them; those over
the misalignment have a corner at 0, where the first contact leaves one end of the face for the other.

An array that conserves energy holds w = U / penetration^2 instead of k, U the potential; force and dU/dphase are its
derivatives.
"""

from math import exp, floor, log, nan, sqrt

import numpy as np

from fem.support.numba_cache import compiled, kept

HEADER = 16
PHASE_STEPS, PENETRATION_STEPS, BACKLASH, DAMPING, RAMP, BACK_PHASE, SIZE, BLOCK, AXES, CONSERVES = range(10)
#: Numbers of places of the offsets: centre distance, misalignment, axial offset.
N_A, N_MISALIGNMENT, N_AXIAL = 10, 11, 12
#: Force [N] and tangent stiffness [N/m] at the end of the table, mean over phase.
LAST_FORCE, LAST_STIFFNESS = 13, 14
OFFSETS = ("a", "misalignment", "axial")
MANY_PITCHES = 1e12
BEYOND = 1e-9


@compiled
def hermite(t, y0, m0, y1, m1):
    """Cubic through y0, y1 with slopes m0, m1 at t = 0, 1."""
    s = 1.0 - t
    return s * s * ((1.0 + 2.0 * t) * y0 + t * m0) + t * t * ((3.0 - 2.0 * t) * y1 - s * m1)


@compiled
def hermite_slope(t, y0, m0, y1, m1):
    """Its derivative by t."""
    s = 1.0 - t
    return 6.0 * s * t * (y1 - y0) + s * (1.0 - 3.0 * t) * m0 + t * (3.0 * t - 2.0) * m1


@compiled
def at_phase(patch, a, b, t):
    """Values and slopes along u at its lower and upper end, between the corners at a (phase i) and b (i + 1)."""
    low = hermite(t, patch[a], patch[a + 1], patch[b], patch[b + 1])
    low_u = hermite(t, patch[a + 2], patch[a + 3], patch[b + 2], patch[b + 3])
    high = hermite(t, patch[a + 4], patch[a + 5], patch[b + 4], patch[b + 5])
    high_u = hermite(t, patch[a + 6], patch[a + 7], patch[b + 6], patch[b + 7])
    return low, low_u, high, high_u


@compiled
def patched(patch, a, b, t, w):
    """Bicubic Hermite interpolation of (k, k_phase, k_u, k_phase_u) from the corners at a (phase i) and b (i + 1)."""
    low, low_u, high, high_u = at_phase(patch, a, b, t)
    return hermite(w, low, low_u, high, high_u)


@compiled
def phase_cell(law, phase):
    """Cell of the phase, the next one, and the place between them; ValueError for a phase that is none."""
    if not abs(phase) < MANY_PITCHES:
        raise ValueError(nan, nan)
    n = int(law[PHASE_STEPS])
    x = (phase - floor(phase)) * n
    i = min(int(x), n - 1)
    return i, (i + 1 if i + 1 < n else 0), x - i


@compiled
def edge(law, block, i, following, t):
    """Unloaded deflection and largest penetration [m] of a block."""
    a, b = block + 4 * i, block + 4 * following
    return hermite(t, law[a], law[a + 1], law[b], law[b + 1]), hermite(
        t, law[a + 2], law[a + 3], law[b + 2], law[b + 3]
    )


@compiled
def load_cell(law, penetration, largest, unloaded):
    """Cell and place in it along u; ValueError(deflection, largest) beyond the table."""
    share = penetration / largest
    if not share <= 1.0 + BEYOND:
        raise ValueError(unloaded + penetration, unloaded + largest)
    m = int(law[PENETRATION_STEPS])
    y = sqrt(sqrt(share)) * m
    j = min(int(y), m - 1)
    return j, y - j


@compiled
def secant(law, block, i, following, t, j, w):
    """Secant stiffness [N/m] of a block."""
    n, row = int(law[PHASE_STEPS]), 4 * (int(law[PENETRATION_STEPS]) + 1)
    patches = block + 4 * n + 4 * j
    return patched(law, patches + i * row, patches + following * row, t, w)


@compiled
def centroid_at(law, block, i, following, t, j, w):
    """Axial centroid [m] of a block, bilinear."""
    n, row = int(law[PHASE_STEPS]), int(law[PENETRATION_STEPS]) + 1
    start = block + 4 * n + 4 * n * row + j
    a, b = start + i * row, start + following * row
    return (1.0 - w) * ((1.0 - t) * law[a] + t * law[b]) + w * ((1.0 - t) * law[a + 1] + t * law[b + 1])


@compiled
def damping(law, penetration):
    """Coefficient [N s/m], which ramps in with the penetration; 0 without contact."""
    if penetration <= 0.0:
        return 0.0
    r = min(penetration / law[RAMP], 1.0)
    return law[DAMPING] * r * r * (3.0 - 2.0 * r)


@compiled
def caught_up(rate, lag, mobility, rise, excess, c):
    """The rate [m/s] that the integrator's velocities lag behind: rate + lag d(force)/dt, where c damps that rate.

    lag         share by which the rate is too small, per rise of the force [m/N]
    mobility    acceleration of the bodies per force [1/kg]; 0: unknown
    rise        of the static force over time [N/s]
    excess      static force above what holds the load [N]
    c           damping coefficient [N s/m]
    """
    return (rate + lag * (rise - c * mobility * excess)) / (1.0 + lag * mobility * c * c)


@compiled
def spinning_force(law, phase, deflection):
    """`conserving`'s, or those of a law without offsets; ValueError(deflection, largest) beyond."""
    if law[CONSERVES] != 0.0:
        return conserving(law, phase, deflection)
    i, following, t = phase_cell(law, phase)
    unloaded, largest = edge(law, HEADER, i, following, t)
    penetration = deflection - unloaded
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    j, w = load_cell(law, penetration, largest, unloaded)
    return penetration, secant(law, HEADER, i, following, t, j, w) * penetration, 0.0


@compiled
def stencil(law, start, count, x, axis):
    """Number of the first place and four weights of the polynomial about x; ValueError(x, low, high, axis) beyond."""
    if count == 1:
        return 0, (1.0, 0.0, 0.0, 0.0)
    low, high = law[start], law[start + count - 1]
    margin = BEYOND * (high - low)
    if not low - margin <= x <= high + margin:
        raise ValueError(x, low, high, axis)
    cell, least, most = 0, 0, count - 1
    for k in range(1, count - 1):
        if law[start + k] <= x:
            cell = k
        if axis == 1 and law[start + k] == 0.0:
            least, most = (k, most) if x >= 0.0 else (least, k)
    first = max(least, min(cell - 1, most - 3))
    return first, lagrange(law, start + first, min(most - first, 3) + 1, x)


@compiled
def lagrange(law, start, count, x):
    """Weights (4) of the polynomial through count places, at x."""
    weights = (0.0, 0.0, 0.0, 0.0)
    for k in range(count):
        weight = 1.0
        for other in range(count):
            if other != k:
                weight *= (x - law[start + other]) / (law[start + k] - law[start + other])
        weights = (
            weight if k == 0 else weights[0],
            weight if k == 1 else weights[1],
            weight if k == 2 else weights[2],
            weight if k == 3 else weights[3],
        )
    return weights


@compiled
def stencils(law, a, misalignment, axial):
    """The stencils of the three offsets."""
    n_a, n_m, n_x = int(law[N_A]), int(law[N_MISALIGNMENT]), int(law[N_AXIAL])
    start = int(law[AXES])
    one = stencil(law, start, n_a, a, 0)
    two = stencil(law, start + n_a, n_m, misalignment, 1)
    return one, two, stencil(law, start + n_a + n_m, n_x, axial, 2)


@compiled
def blended(law, where, i, following, t, j, w):
    """(unloaded, largest) for j < 0, else (ln of the secant stiffness, centroid), over the places of the offsets."""
    (first_a, w_a), (first_m, w_m), (first_x, w_x) = where
    n_m, n_x, block = int(law[N_MISALIGNMENT]), int(law[N_AXIAL]), int(law[BLOCK])
    one = other = 0.0
    for p in range(4):
        for q in range(4):
            for r in range(4):
                weight = w_a[p] * w_m[q] * w_x[r]
                if weight != 0.0:
                    place = HEADER + block * (((first_a + p) * n_m + first_m + q) * n_x + first_x + r)
                    if j < 0:
                        x, y = edge(law, place, i, following, t)
                    else:
                        x = log(secant(law, place, i, following, t, j, w))
                        y = centroid_at(law, place, i, following, t, j, w)
                    one, other = one + weight * x, other + weight * y
    return one, other


@compiled
def pressed(law, phase, deflection, a, misalignment, axial):
    """(penetration [m], secant stiffness [N/m], centroid [m]) of one flank at offsets; 0 without contact."""
    i, following, t = phase_cell(law, phase)
    where = stencils(law, a, misalignment, axial)
    unloaded, largest = blended(law, where, i, following, t, -1, 0.0)
    penetration = deflection - unloaded
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    j, w = load_cell(law, penetration, largest, unloaded)
    stiffness, centroid = blended(law, where, i, following, t, j, w)
    return penetration, exp(stiffness), centroid


@compiled
def conserving(law, phase, deflection):
    """(penetration [m], force [N], dU/dphase [N m]) of one flank out of the potential; 0 without contact."""
    i, following, t = phase_cell(law, phase)
    n, row = int(law[PHASE_STEPS]), 4 * (int(law[PENETRATION_STEPS]) + 1)
    unloaded, largest = edge(law, HEADER, i, following, t)
    penetration = deflection - unloaded
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    j, y = load_cell(law, penetration, largest, unloaded)
    m, a, b = law[PENETRATION_STEPS], HEADER + 4 * i, HEADER + 4 * following
    unloaded_by = n * hermite_slope(t, law[a], law[a + 1], law[b], law[b + 1])
    largest_by = n * hermite_slope(t, law[a + 2], law[a + 3], law[b + 2], law[b + 3])
    patches = HEADER + 4 * n + 4 * j
    value, by_phase, by_u = patch_slopes(law, patches + i * row, patches + following * row, t, y)
    u, by_phase, by_u = (j + y) / m, n * by_phase, m * by_u
    force = penetration * (2.0 * value + 0.25 * u * by_u)
    moved = penetration * penetration * (by_phase - 0.25 * u * by_u * largest_by / largest)
    return penetration, force, moved - unloaded_by * force


@compiled
def patch_slopes(patch, a, b, t, w):
    """Value of `patched` and its derivatives by t and w."""
    low, low_u, high, high_u = at_phase(patch, a, b, t)
    low_t = hermite_slope(t, patch[a], patch[a + 1], patch[b], patch[b + 1])
    low_ut = hermite_slope(t, patch[a + 2], patch[a + 3], patch[b + 2], patch[b + 3])
    high_t = hermite_slope(t, patch[a + 4], patch[a + 5], patch[b + 4], patch[b + 5])
    high_ut = hermite_slope(t, patch[a + 6], patch[a + 7], patch[b + 6], patch[b + 7])
    by_t = hermite(w, low_t, low_ut, high_t, high_ut)
    return hermite(w, low, low_u, high, high_u), by_t, hermite_slope(w, low, low_u, high, high_u)


@compiled
def static_force(law, phase, deflection, a, misalignment, axial):
    """(penetration [m], force [N], centroid [m], dU/dphase [N m]) of one flank at offsets; 0 without contact."""
    if law[CONSERVES] != 0.0:
        penetration, force, turning = conserving(law, phase, deflection)
        return penetration, force, 0.0, turning
    penetration, k, centroid = pressed(law, phase, deflection, a, misalignment, axial)
    return penetration, k * penetration, centroid, 0.0


@kept
def weights_along(law, axis, x):
    """(n,) weights of the places of one offset."""
    counts = int(law[N_A]), int(law[N_MISALIGNMENT]), int(law[N_AXIAL])
    start = int(law[AXES]) + (counts[0] if axis > 0 else 0) + (counts[1] if axis > 1 else 0)
    first, found = stencil(law, start, counts[axis], x, axis)
    weights = np.zeros(counts[axis])
    for k in range(min(4, counts[axis] - first)):
        weights[first + k] = found[k]
    return weights
