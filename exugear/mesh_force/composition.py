"""The potential of a flank whose teeth differ, composed of those of single tooth pairs.

Tooth pair p carries the load f_p = F_p(x_p; s_p) of a single one at the deflection x_p, at the position s_p on the path
of contact, in pitches from the pitch point. Couplings c by the bodies of the gears, pitch deviations d and increments
i of single teeth lie between x and the deflection y of the mesh:

    x_p + i_p(f_p; s_p) + dE/df_p = y - d_p,    E = f^T c f / 2 + sum M_p(f_p; s_p) g_p

E couples the loads, and the moments M by which single teeth move their load along the face: g_p is the tilt of tooth
pair p by the loads of the others, the misalignment of the lever, and half of that by their moments. Newton's method
solves for x. All forces derive from one potential, that of the single tooth pairs U_p:

    V = sum f_p (y - d_p) - sum (f_p x_p - U_p) - sum of the work of i_p - E,   dV/dy = sum f_p

so that dF/dy = sum k_p r_p with (1 + (E'' + i') k) r = 1, and dV/dphase is the sum of derivatives at fixed f: sum
dU_p/ds - sum of the work of di_p/ds - dE/ds (`fem.ste.tooth_pairs`).
"""

from math import ceil, floor, inf, nan, sqrt
from typing import NamedTuple

from numba import carray

from exugear.mesh_force.block_potential import CONTINUED, Potential, block_potential, centroid_of_block
from exugear.mesh_force.kernel_records import doubles_at, reader, stack_of, start_of
from exugear.mesh_force.layout import INCREMENT, TEETH
from exugear.mesh_force.patches import Cell, Range, phase_cell, range_of, table_at
from exugear.mesh_force.pchip import hermite, hermite_bend_weights, hermite_slope, weighted
from fem.support.numba_cache import apart, compiled

#: Most tooth pairs that may touch at a time, and floats for each: its position, deflections, loads and their slopes.
MOST, ROWS = 8, 23
SPACE = MOST * (ROWS + 5 * MOST)
S, FREE, X, LOAD, STIFFNESS, LOAD_BY_S, ENERGY, BY_S, BY_LEVER, INCREASE, INCREASE_SLOPE = range(11)
RIGHT, FURTHER, VARIANT_1, VARIANT_2, LARGEST, UNLOADED = range(11, 17)
MOMENT, MOMENT_BY_LOAD, MOMENT_BEND, MOMENT_BY_S, MOMENT_BY_LOAD_S, TILT = range(17, ROWS)
MATRIX, COUPLINGS = ROWS, ROWS + MOST
#: Tilts of the tooth pair of a row by the load on that of a column, and their slopes by s; tilts by moments above, and
#: their slopes below the diagonal.
TILTS, TILTS_BY_S, BY_MOMENTS = (ROWS + i * MOST for i in (2, 3, 4))
#: Newton's method ends where a step is this share of the deflection; the last step then changes the loads linearly.
CONVERGED, STEPS = 1e-4, 40
#: Least slope of what a tooth pair deflects by what it would deflect alone, as of tooth pairs that hardly touch beside
#: heavily loaded ones; least t, the root of the load, at which the bend of moments is taken.
LEAST_SLOPE, LEAST_T = 0.1, 1e-2
#: Gauss points and weights in [0, 1], exact for polynomials of the fifth degree.
GAUSS = ((0.1127016653792583, 5 / 18), (0.5, 8 / 18), (0.8872983346207417, 5 / 18))
teeth_at, increment_at = reader(TEETH), reader(INCREMENT)
INCREMENT_SIZE = INCREMENT.itemsize


class Increment(NamedTuple):
    """Further deflection of a tooth [m], its slopes by load and position, its work [J] and the slope of that by s.

    Likewise the moment of its load [N m], its first and second derivative by the load, and the slopes by s of the
    moment and of its first derivative.
    """

    value: float
    by_load: float
    by_s: float
    work: float
    work_by_s: float
    moment: float
    moment_by_load: float
    moment_bend: float
    moment_by_s: float
    moment_by_load_s: float


NONE = Increment(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@compiled
def teeth_of(table):
    """What a table is composed of."""
    return teeth_at(start_of(table) + table.teeth)


@compiled
def single_of(teeth):
    """The table of a single tooth pair."""
    return table_at(start_of(teeth) + teeth.single_start)


@compiled
def pitch_of(teeth, start, tooth):
    """Pitch deviation of a tooth [m], of those that begin at a start [bytes from the head]."""
    return carray(doubles_at(start_of(teeth) + start + 8 * tooth), 1)[0]


@compiled
def coupling(teeth, kind, distance, s):
    """Coupling of the tooth pair at s with that at s + distance, and its slope by s.

    kind   0: of loads [m/N], 1: of the moment of that at s with the load ahead, 2: of its load with the moment ahead
           [1/N], 3: of moments [rad/(N m)]
    """
    if distance > teeth.distances:
        return 0.0, 0.0
    n = teeth.coupled
    at = min(max((s - teeth.coupled_first) * teeth.coupled_steps, 0.0), n - 1.0)
    i = min(int(at), n - 2)
    number = (kind * teeth.distances + distance - 1) * n + i
    row = carray(doubles_at(start_of(teeth) + teeth.coupling_start + 16 * number), 4)
    t, m = at - i, teeth.coupled_steps
    slope = 0.0 if at == 0.0 or at == n - 1.0 else m * hermite_slope(t, row[0], row[1], row[2], row[3])
    return hermite(t, row[0], row[1], row[2], row[3]), slope


@compiled
def increment(teeth, variant, s, load):
    """`Increment` of a variant (>= 0) at a position under a load [N]."""
    n, m = teeth.placed, teeth.loads
    at = min(max((s - teeth.placed_first) * teeth.placed_steps, 0.0), n - 1.0)
    i = min(int(at), n - 2)
    t = at - i
    within = min(sqrt(max(load, 0.0) / teeth.largest_load), 1.0)
    u = within * (m - 1)
    j = min(int(u), m - 2)
    w, first = u - j, start_of(teeth) + teeth.increments_start
    low, high = (
        first + INCREMENT_SIZE * ((variant * n + i) * m + j),
        first + INCREMENT_SIZE * ((variant * n + i + 1) * m + j),
    )
    a, b = increment_at(low), increment_at(high)
    c, d = increment_at(low + INCREMENT_SIZE), increment_at(high + INCREMENT_SIZE)
    p, q = hermite(t, a.value, a.by_s, b.value, b.by_s), hermite(t, c.value, c.by_s, d.value, d.by_s)
    p_t, q_t = hermite(t, a.by_t, a.by_t_s, b.by_t, b.by_t_s), hermite(t, c.by_t, c.by_t_s, d.by_t, d.by_t_s)
    p_s, q_s = hermite_slope(t, a.value, a.by_s, b.value, b.by_s), hermite_slope(t, c.value, c.by_s, d.value, d.by_s)
    p_ts = hermite_slope(t, a.by_t, a.by_t_s, b.by_t, b.by_t_s)
    q_ts = hermite_slope(t, c.by_t, c.by_t_s, d.by_t, d.by_t_s)
    work = hermite(t, a.work, a.work_by_s, b.work, b.work_by_s)
    work_by_s = hermite_slope(t, a.work, a.work_by_s, b.work, b.work_by_s)
    for g in range(3):
        x, weight = w * GAUSS[g][0], w * GAUSS[g][1] / (m - 1)
        scale = 2.0 * teeth.largest_load * weight * (j + x) / (m - 1)
        work += scale * hermite(x, p, p_t, q, q_t)
        work_by_s += scale * hermite(x, p_s, p_ts, q_s, q_ts)
    value, by_s = hermite(w, p, p_t, q, q_t), hermite(w, p_s, p_ts, q_s, q_ts)
    p_of, q_of = p, q
    p, q = (
        hermite(t, a.moment, a.moment_by_s, b.moment, b.moment_by_s),
        hermite(t, c.moment, c.moment_by_s, d.moment, d.moment_by_s),
    )
    m_0, m_1 = (
        hermite(t, a.moment_by_t, a.moment_by_t_s, b.moment_by_t, b.moment_by_t_s),
        hermite(t, c.moment_by_t, c.moment_by_t_s, d.moment_by_t, d.moment_by_t_s),
    )
    p_s, q_s = (
        hermite_slope(t, a.moment, a.moment_by_s, b.moment, b.moment_by_s),
        hermite_slope(t, c.moment, c.moment_by_s, d.moment, d.moment_by_s),
    )
    m_0s, m_1s = (
        hermite_slope(t, a.moment_by_t, a.moment_by_t_s, b.moment_by_t, b.moment_by_t_s),
        hermite_slope(t, c.moment_by_t, c.moment_by_t_s, d.moment_by_t, d.moment_by_t_s),
    )
    moment, moment_by_s = hermite(w, p, m_0, q, m_1), hermite(w, p_s, m_0s, q_s, m_1s)
    by_load = moment_by_load = moment_bend = moment_by_load_s = 0.0
    steps = teeth.placed_steps if 0.0 < at < n - 1.0 else 0.0
    if within < 1.0:
        # slopes by t vanish at t = 0 as t does
        by_root = (m - 1) / (2.0 * teeth.largest_load * max(within, 1e-6))
        by_load = by_root * hermite_slope(w, p_of, p_t, q_of, q_t)
        slope = hermite_slope(w, p, m_0, q, m_1)
        moment_by_load, moment_by_load_s = by_root * slope, by_root * hermite_slope(w, p_s, m_0s, q_s, m_1s)
        bend = weighted(hermite_bend_weights(w), p, m_0, q, m_1) - slope / max(u, 1e-6)
        moment_bend = bend * ((m - 1) / (2.0 * teeth.largest_load * max(within, LEAST_T))) ** 2
    else:
        beyond = load - teeth.largest_load
        work, work_by_s = work + beyond * value, work_by_s + beyond * by_s
    return Increment(
        value,
        by_load,
        steps * by_s,
        work,
        steps * work_by_s,
        moment,
        moment_by_load,
        moment_bend,
        steps * moment_by_s,
        steps * moment_by_load_s,
    )


@compiled
def variant_of(teeth, start, tooth):
    """Number of the increment of a tooth; -1: none."""
    return int(carray(doubles_at(start_of(teeth) + start + 8 * tooth), 1)[0])


@compiled
def increments_of(teeth, variant_1, variant_2, s, load):
    """`Increment` of both teeth of a tooth pair, and what they have beside the sum."""
    if variant_1 < 0 and variant_2 < 0:
        return NONE
    a = increment(teeth, variant_1, s, load) if variant_1 >= 0 else NONE
    b = increment(teeth, variant_2, s, load) if variant_2 >= 0 else NONE
    if variant_1 < 0 or variant_2 < 0:
        return sum_of(a, b)
    block = variant_1 - variant_1 % teeth.in_block
    number = (variant_1 - block) * teeth.of_wheel + variant_2 - block - teeth.of_pinion
    beside = int(carray(doubles_at(start_of(teeth) + teeth.meeting_start + 8 * number), 1)[0])
    both = sum_of(a, b)
    return sum_of(both, increment(teeth, block + beside, s, load)) if beside >= 0 else both


@compiled
def sum_of(a, b):
    """Sum of two `Increment`."""
    return Increment(
        a.value + b.value,
        a.by_load + b.by_load,
        a.by_s + b.by_s,
        a.work + b.work,
        a.work_by_s + b.work_by_s,
        a.moment + b.moment,
        a.moment_by_load + b.moment_by_load,
        a.moment_bend + b.moment_bend,
        a.moment_by_s + b.moment_by_s,
        a.moment_by_load_s + b.moment_by_load_s,
    )


@compiled
def phase_of(table, cell: Cell):
    """Phase [pitches] of a cell of a table."""
    return (cell.low + cell.share) / table.steps_in_pitch


@compiled
def place_pairs(teeth, block, phase, space):
    """Write position, pitch deviation and increments of all tooth pairs that may touch; the number of them."""
    whole = int(floor(phase))  # noqa: RUF046 (a float in compiled code)
    ahead = phase - whole
    k, n = int(ceil(teeth.first - ahead)), 0  # noqa: RUF046
    while ahead + k <= teeth.last and n < MOST:
        tooth_1, tooth_2 = (k - whole) % teeth.z_1, (whole - k) % teeth.z_2
        d_1, d_2 = pitch_of(teeth, teeth.pitch_1_start, tooth_1), pitch_of(teeth, teeth.pitch_2_start, tooth_2)
        s = ahead + k + min(max((d_2 - d_1) * teeth.turn, -0.05), 0.05)
        if teeth.first <= s <= teeth.last:
            space[S * MOST + n], space[FREE * MOST + n] = s, d_1 + d_2
            variant_1 = variant_of(teeth, teeth.variant_1_start, tooth_1)
            variant_2 = variant_of(teeth, teeth.variant_2_start, tooth_2)
            first = block * teeth.in_block
            space[VARIANT_1 * MOST + n] = first + variant_1 if variant_1 >= 0 else -1
            space[VARIANT_2 * MOST + n] = first + variant_2 if variant_2 >= 0 else -1
            n += 1
        k += 1
    return n


@compiled
def solve_in_place(space, n, columns):
    """Replace n values from RIGHT on, and from FURTHER on where there are two columns, by the solution of MATRIX."""
    for i in range(n):
        pivot = space[(MATRIX + i) * MOST + i]
        for j in range(i + 1, n):
            factor = space[(MATRIX + j) * MOST + i] / pivot
            for k in range(i + 1, n):
                space[(MATRIX + j) * MOST + k] -= factor * space[(MATRIX + i) * MOST + k]
            for c in range(columns):
                space[(RIGHT + c) * MOST + j] -= factor * space[(RIGHT + c) * MOST + i]
    for c in range(columns):
        for i in range(n - 1, -1, -1):
            value = space[(RIGHT + c) * MOST + i]
            for k in range(i + 1, n):
                value -= space[(MATRIX + i) * MOST + k] * space[(RIGHT + c) * MOST + k]
            space[(RIGHT + c) * MOST + i] = value / space[(MATRIX + i) * MOST + i]


@apart
def composed_range(table, block, cell: Cell):
    """`Range` of a composed law: where the first tooth pair touches, and up to where all reach."""
    teeth, space = teeth_of(table), carray(stack_of(SPACE), SPACE)
    single, n = single_of(teeth), place_pairs(teeth, block, phase_of(table, cell), space)
    unloaded, unloaded_slope, end, end_slope, largest_force = inf, 0.0, inf, 0.0, 0.0
    for p in range(n):
        s = space[S * MOST + p]
        extent = range_of(single, block, phase_cell(single, s - teeth.first))
        further = increments_of(teeth, int(space[VARIANT_1 * MOST + p]), int(space[VARIANT_2 * MOST + p]), s, 0.0)
        touches = extent.unloaded + space[FREE * MOST + p] + further.value
        if touches < unloaded:
            unloaded, unloaded_slope = touches, extent.unloaded_slope + further.by_s
        if touches + extent.largest < end:
            end, end_slope = touches + extent.largest, extent.unloaded_slope + further.by_s + extent.largest_slope
            largest_force = extent.largest_force
    return Range(unloaded, unloaded_slope, end - unloaded, end_slope - unloaded_slope, largest_force)


@apart
def composed_potential(table, block, cell: Cell, deflection, lever):
    """`Potential` of a composed law; ValueError(deflection, largest deflection, nan, nan, side) beyond it."""
    teeth, space = teeth_of(table), carray(stack_of(SPACE), SPACE)
    single = single_of(teeth)
    n, least, largest_force, end = begin_pairs(teeth, single, block, phase_of(table, cell), deflection, lever, space)
    if n == 0:
        return Potential(0.0, -least, 0.0, 0.0, 0.0, 0.0, 0.0, largest_force)
    if end < inf:
        raise ValueError(deflection, end, nan, nan, table.side)
    return solved_potential(teeth, single, block, lever, n, -least, largest_force, space)


@compiled
def begin_pairs(teeth, single, block, phase, deflection, lever, space):
    """Write the tooth pairs that would touch alone: (number, least distance to contact, largest force, end).

    end   deflection at which the first of them leaves its table, inf where none does
    """
    n, least, largest_force, end = 0, inf, 0.0, inf
    for p in range(place_pairs(teeth, block, phase, space)):
        s, free = space[S * MOST + p], deflection - space[FREE * MOST + p]
        variant_1, variant_2 = space[VARIANT_1 * MOST + p], space[VARIANT_2 * MOST + p]
        at = phase_cell(single, s - teeth.first)
        extent = range_of(single, block, at)
        free -= increments_of(teeth, int(variant_1), int(variant_2), s, 0.0).value
        touches = extent.unloaded
        if lever != 0.0 and single.has_centroid != 0:
            touches += lever * centroid_of_block(single, block, at, extent, 0.0).value
        least = min(least, touches - free)
        if free > touches:
            space[S * MOST + n], space[FREE * MOST + n] = s, deflection - space[FREE * MOST + p]
            # couplings only add to deflections
            space[X * MOST + n] = free
            space[UNLOADED * MOST + n], space[STIFFNESS * MOST + n] = touches, extent.largest_force / extent.largest
            space[INCREASE * MOST + n], space[INCREASE_SLOPE * MOST + n] = space[FREE * MOST + n] - free, 0.0
            for k in range(MOMENT, ROWS):
                space[k * MOST + n] = 0.0
            space[LARGEST * MOST + n] = (
                free if variant_1 < 0.0 and variant_2 < 0.0 else extent.unloaded + extent.largest
            )
            space[VARIANT_1 * MOST + n], space[VARIANT_2 * MOST + n] = variant_1, variant_2
            largest_force = max(largest_force, extent.largest_force)
            if free - touches > (1.0 + CONTINUED) * extent.largest:
                end = min(end, deflection - (free - touches) + extent.largest)
            n += 1
    return n, least, largest_force, end


@compiled
def solved_potential(teeth, single, block, lever, n, penetration, largest_force, space):
    """`Potential` of n tooth pairs that touch where no other does."""
    if n > 1:
        write_couplings(teeth, n, space)
        begin(teeth, lever, n, space)
    for _ in range(STEPS):
        varies, largest = write_loads(teeth, single, block, lever, n, space), 0.0
        if n == 1 and not varies:
            break
        write_system(teeth, lever, n, space)
        solve_in_place(space, n, 1)
        for p in range(n):
            largest = max(largest, abs(space[RIGHT * MOST + p]))
        if largest <= CONVERGED * penetration:
            apply_last_step(n, space)
            break
        for p in range(n):
            space[X * MOST + p] = min(space[X * MOST + p] - space[RIGHT * MOST + p], space[LARGEST * MOST + p])
    return summed(teeth, lever, n, penetration, largest_force, space)


@compiled
def write_loads(teeth, single, block, lever, n, space):
    """Write the potentials of single tooth pairs at the deflections X, and increments; whether there are any."""
    varies = False
    for p in range(n):
        s, variant_1, variant_2 = (
            space[S * MOST + p],
            int(space[VARIANT_1 * MOST + p]),
            int(space[VARIANT_2 * MOST + p]),
        )
        u = potential_of_single(single, block, phase_cell(single, s - teeth.first), space[X * MOST + p], lever)
        space[LOAD * MOST + p], space[STIFFNESS * MOST + p], space[LOAD_BY_S * MOST + p] = (
            u.force,
            u.stiffness,
            u.force_by_phase,
        )
        # the part of the potential that is stationary at the solution
        space[ENERGY * MOST + p] = u.energy + u.force * (space[FREE * MOST + p] - space[X * MOST + p])
        space[BY_S * MOST + p], space[BY_LEVER * MOST + p] = u.by_phase, u.by_lever
        space[INCREASE * MOST + p], space[INCREASE_SLOPE * MOST + p] = 0.0, 0.0
        if variant_1 >= 0 or variant_2 >= 0:
            varies = True
            further = increments_of(teeth, variant_1, variant_2, s, u.force)
            space[INCREASE * MOST + p], space[INCREASE_SLOPE * MOST + p] = further.value, further.by_load
            space[ENERGY * MOST + p] -= further.work
            space[BY_S * MOST + p] -= further.work_by_s
            write_moment(p, further, space)
    return varies


@apart
def potential_of_single(single, block, at: Cell, deflection, lever):
    """`Potential` of a single tooth pair."""
    return block_potential(single, block, at, deflection, lever)


@compiled
def write_moment(p, further: Increment, space):
    """Write the moment of the load of a tooth pair, and its derivatives."""
    space[MOMENT * MOST + p], space[MOMENT_BY_LOAD * MOST + p] = further.moment, further.moment_by_load
    space[MOMENT_BEND * MOST + p], space[MOMENT_BY_S * MOST + p] = further.moment_bend, further.moment_by_s
    space[MOMENT_BY_LOAD_S * MOST + p] = further.moment_by_load_s


@compiled
def apply_last_step(n, space):
    """Change loads and their slopes linearly by the last step of Newton's method."""
    for p in range(n):
        step, load = -space[RIGHT * MOST + p], space[LOAD * MOST + p]
        further = space[STIFFNESS * MOST + p] * step
        space[LOAD * MOST + p] = load + further
        space[BY_S * MOST + p] += space[LOAD_BY_S * MOST + p] * step
        if load > 0.0:
            space[BY_LEVER * MOST + p] *= 1.0 + further / load


@compiled
def write_couplings(teeth, n, space):
    """Write couplings above, and their slopes by the position below the diagonal of COUPLINGS; likewise tilts."""
    for p in range(n):
        for q in range(p + 1, n):
            s = space[S * MOST + p]
            distance = int(space[S * MOST + q] - s + 0.5)
            c, c_s = coupling(teeth, 0, distance, s)
            space[(COUPLINGS + p) * MOST + q], space[(COUPLINGS + q) * MOST + p] = c, c_s
            if teeth.in_block > 0:
                c, c_s = coupling(teeth, 1, distance, s)
                space[(TILTS + p) * MOST + q], space[(TILTS_BY_S + p) * MOST + q] = c, c_s
                c, c_s = coupling(teeth, 2, distance, s)
                space[(TILTS + q) * MOST + p], space[(TILTS_BY_S + q) * MOST + p] = c, c_s
                c, c_s = coupling(teeth, 3, distance, s)
                space[(BY_MOMENTS + p) * MOST + q], space[(BY_MOMENTS + q) * MOST + p] = c, c_s


@compiled
def begin(teeth, lever, n, space):
    """Write deflections X from secant stiffnesses, from which Newton's method begins."""
    for p in range(n):
        space[LOAD * MOST + p] = space[STIFFNESS * MOST + p] * (space[X * MOST + p] - space[UNLOADED * MOST + p])
    write_system(teeth, lever, n, space)
    solve_in_place(space, n, 1)
    for p in range(n):
        space[X * MOST + p] = min(space[X * MOST + p] - space[RIGHT * MOST + p], space[LARGEST * MOST + p])


@compiled
def write_system(teeth, lever, n, space):
    """Write the matrix 1 + (E'' + i') k, and what is not balanced into RIGHT."""
    for p in range(n):
        space[RIGHT * MOST + p] = space[X * MOST + p] + space[INCREASE * MOST + p] - space[FREE * MOST + p]
        space[(MATRIX + p) * MOST + p] = 1.0 + space[INCREASE_SLOPE * MOST + p] * space[STIFFNESS * MOST + p]
    for p in range(n):
        for q in range(p + 1, n):
            c = space[(COUPLINGS + p) * MOST + q]
            space[(MATRIX + p) * MOST + q] = c * space[STIFFNESS * MOST + q]
            space[(MATRIX + q) * MOST + p] = c * space[STIFFNESS * MOST + p]
            space[RIGHT * MOST + p] += c * space[LOAD * MOST + q]
            space[RIGHT * MOST + q] += c * space[LOAD * MOST + p]
    if teeth.in_block > 0:
        add_moments(lever, n, space)


@compiled
def add_moments(lever, n, space):
    """Add what moments of the loads couple to the matrix and to RIGHT, and write TILT."""
    for p in range(n):
        tilt, slope = lever, space[MOMENT_BY_LOAD * MOST + p]
        for q in range(n):
            if q != p:
                tilted, further = space[(TILTS + p) * MOST + q], space[(TILTS + q) * MOST + p]
                by_moment = space[(BY_MOMENTS + min(p, q)) * MOST + max(p, q)]
                moment, slope_q = space[MOMENT * MOST + q], space[MOMENT_BY_LOAD * MOST + q]
                tilt += tilted * space[LOAD * MOST + q] + by_moment * moment
                space[RIGHT * MOST + p] += further * moment
                space[(MATRIX + p) * MOST + q] += (further * slope_q + slope * (tilted + by_moment * slope_q)) * (
                    space[STIFFNESS * MOST + q]
                )
        space[TILT * MOST + p] = tilt
        space[RIGHT * MOST + p] += slope * tilt
        diagonal = space[(MATRIX + p) * MOST + p] + space[MOMENT_BEND * MOST + p] * tilt * space[STIFFNESS * MOST + p]
        space[(MATRIX + p) * MOST + p] = max(diagonal, LEAST_SLOPE)


@compiled
def summed(teeth, lever, n, penetration, largest_force, space):
    """`Potential` from the loads of n tooth pairs."""
    energy, force, by_phase, by_lever, force_by_s = 0.0, 0.0, 0.0, 0.0, 0.0
    for p in range(n):
        energy, force = energy + space[ENERGY * MOST + p], force + space[LOAD * MOST + p]
        by_phase, by_lever = by_phase + space[BY_S * MOST + p], by_lever + space[BY_LEVER * MOST + p]
        force_by_s += space[LOAD_BY_S * MOST + p]
    variant_1, variant_2 = int(space[VARIANT_1 * MOST]), int(space[VARIANT_2 * MOST])
    if n == 1 and variant_1 < 0 and variant_2 < 0:
        stiffness = space[STIFFNESS * MOST]
        return Potential(energy, penetration, force, stiffness, force_by_s, by_phase, by_lever, largest_force)
    for p in range(n):
        s, load, by_s = space[S * MOST + p], space[LOAD * MOST + p], space[LOAD_BY_S * MOST + p]
        variant_1, variant_2 = int(space[VARIANT_1 * MOST + p]), int(space[VARIANT_2 * MOST + p])
        space[FURTHER * MOST + p] = 0.0
        if variant_1 >= 0 or variant_2 >= 0:
            further = increments_of(teeth, variant_1, variant_2, s, load)
            space[FURTHER * MOST + p] = -further.by_s - further.by_load * by_s
            write_moment(p, further, space)
    write_system(teeth, lever, n, space)
    for p in range(n):
        space[RIGHT * MOST + p] = 1.0
    for p in range(n):
        for q in range(p + 1, n):
            c, c_s = space[(COUPLINGS + p) * MOST + q], space[(COUPLINGS + q) * MOST + p]
            load_p, load_q = space[LOAD * MOST + p], space[LOAD * MOST + q]
            energy -= c * load_p * load_q
            by_phase -= c_s * load_p * load_q
            space[FURTHER * MOST + p] -= c_s * load_q + c * space[LOAD_BY_S * MOST + q]
            space[FURTHER * MOST + q] -= c_s * load_p + c * space[LOAD_BY_S * MOST + p]
    if teeth.in_block > 0:
        of_energy, of_phase, moments = sum_moments(lever, n, space)
        energy, by_phase, by_lever = energy - of_energy, by_phase - of_phase, by_lever - moments
    solve_in_place(space, n, 2)
    stiffness = 0.0
    for p in range(n):
        stiffness += space[STIFFNESS * MOST + p] * space[RIGHT * MOST + p]
        force_by_s += space[STIFFNESS * MOST + p] * space[FURTHER * MOST + p]
    return Potential(energy, penetration, force, stiffness, force_by_s, by_phase, by_lever, largest_force)


@compiled
def sum_moments(lever, n, space):
    """(energy, its slope by s at given loads, sum of moments); subtracts what moves with s from FURTHER."""
    energy, by_s, moments = 0.0, 0.0, 0.0
    for p in range(n):
        moment, slope = space[MOMENT * MOST + p], space[MOMENT_BY_LOAD * MOST + p]
        moments += moment
        energy += lever * moment
        by_s += space[MOMENT_BY_S * MOST + p] * space[TILT * MOST + p]
        bend = space[MOMENT_BY_LOAD_S * MOST + p] + space[MOMENT_BEND * MOST + p] * space[LOAD_BY_S * MOST + p]
        moved = bend * space[TILT * MOST + p]
        for q in range(n):
            if q != p:
                low, high = min(p, q), max(p, q)
                tilted, tilted_s = space[(TILTS + p) * MOST + q], space[(TILTS_BY_S + p) * MOST + q]
                further, further_s = space[(TILTS + q) * MOST + p], space[(TILTS_BY_S + q) * MOST + p]
                by_moment, by_moment_s = (
                    space[(BY_MOMENTS + low) * MOST + high],
                    space[(BY_MOMENTS + high) * MOST + low],
                )
                moment_q, load_q, load_s = space[MOMENT * MOST + q], space[LOAD * MOST + q], space[LOAD_BY_S * MOST + q]
                moment_s = space[MOMENT_BY_S * MOST + q] + space[MOMENT_BY_LOAD * MOST + q] * load_s
                energy += moment * (tilted * load_q + 0.5 * by_moment * moment_q)
                by_s += moment * (tilted_s * load_q + 0.5 * by_moment_s * moment_q)
                moved += further_s * moment_q + further * moment_s
                moved += slope * (tilted_s * load_q + tilted * load_s + by_moment_s * moment_q + by_moment * moment_s)
        space[FURTHER * MOST + p] -= moved
    return energy, by_s, moments
