"""The potential of a flank whose teeth differ, composed of those of single tooth pairs.

Tooth pair p carries the load f_p = F_p(x_p; s_p) of a single one at the deflection x_p, at the position s_p on the path
of contact, in pitches from the pitch point. Couplings c by the bodies of the gears, pitch deviations d and increments
i of single teeth lie between x and the deflection y of the mesh:

    x_p + i_p(f_p; s_p) + dE/df_p = y - d_p,    E = f^T c f / 2 + sum M_p(f_p; s_p) g_p

E couples the loads, and the moments M by which single teeth move their load along the face: g_p is the tilt of tooth
pair p by the loads of the others, the misalignment of the lever, and half of that by their moments, up to a limit that
grows with f_p (`write_turn`), with which the potential is convex. Newton's method solves for x. All forces derive from
one potential, that of the single tooth pairs U_p:

    V = sum f_p (y - d_p) - sum (f_p x_p - U_p) - sum of the work of i_p - E,   dV/dy = sum f_p

so that dF/dy = sum k_p r_p with (1 + (E'' + i') k) r = 1, and dV/dphase is the sum of derivatives at fixed f: sum
dU_p/ds - sum of the work of di_p/ds - dE/ds (`fem.ste.tooth_pairs`).

In a call s does not change: range, nodes and increments are interpolated over it once (`PAIR`), and Newton's method
evaluates polynomials over the load alone. That takes a third of the time of whole potentials in each iteration. Two
tooth pairs of spur gears without increments need only one iteration, of whole potentials (`of_two`).
"""

from math import ceil, inf, nan, sqrt

from numba import carray, from_dtype, types

from exugear.mesh_force.block_potential import (
    CONTINUED,
    MID_PLANE,
    Potential,
    centroid_of_block,
    derivatives,
)
from exugear.mesh_force.increments import (
    INTERVAL,
    beside_sum,
    increment,
    load_interval,
    unloaded_increment,
    write_interval,
)
from exugear.mesh_force.kernel_records import array_behind, behind, record_type, records_on_stack
from exugear.mesh_force.layout import FORCE_TABLE, TEETH, TOOTH_PAIR
from exugear.mesh_force.patches import (
    Cell,
    Jet,
    Patch,
    Range,
    along_phase,
    cell_of_root,
    load_cell,
    node,
    nodes_of,
    patch,
    quintic,
    range_of,
    table_behind,
)
from exugear.mesh_force.pchip import hermite, hermite_slope, hermite_slope_weights, hermite_weights
from fem.support.numba_cache import apart, fused, fused_unchecked
from fem.support.on_demand import on_demand

#: Most tooth pairs that may touch at a time.
MOST = 8
#: A tooth pair in a call: its position s, the deflection of the mesh at which it touches, and the actual one less its
#: pitch deviation; its own deflection x, and the largest x that Newton's method may take; cell of s in the single
#: table, and `Range` there; numbers of the increments of pinion, wheel and both beside the sum (-1: none), of the whole
#: block, whether there are any, and their value without load with its slope by s.
#: Over the load: number of the interval of the potential in which x lies (-1: none yet), and the jets at its ends;
#: number of the interval of the increments, and its numbers.
#: At x: load, stiffness, slope of the load by s; of the potential that is stationary at the solution the value, and its
#: slopes by s and lever; of the increment the value and its slope by the load; moment of the load with its derivatives,
#: the tilt and its slope by s; the turn, the limited tilt on which it works, with its first and second derivatives by
#: load and tilt. Rows of the matrix of Newton's method; couplings above the diagonal, and their slopes by s below;
#: tilts of this tooth pair by the loads of others, with slopes by s; tilts by moments above, and their slopes below
#: the diagonal; second derivatives by the loads of what moments work. Three right sides, and then their solutions: what
#: is not balanced, what the phase moves, and 1.
PAIR = record_type(
    *((name, "f8") for name in ("s", "touches", "free", "x", "largest_x")),
    *(("low", "i8"), ("high", "i8"), ("share", "f8")),
    *((name, "f8") for name in ("unloaded", "unloaded_slope", "largest", "largest_slope", "largest_force")),
    *(("variants", "i8", 3), ("varies", "i8"), ("further", "f8"), ("further_slope", "f8")),
    *(("load_cell", "i8"), ("jets", "f8", 6), ("interval", "i8"), ("increments", "f8", INTERVAL)),
    *((name, "f8") for name in ("load", "stiffness", "load_by_s", "energy", "by_s", "by_lever")),
    *((name, "f8") for name in ("increase", "increase_slope", "moment", "moment_by_load", "moment_bend")),
    *((name, "f8") for name in ("moment_by_s", "moment_by_load_s", "tilt", "tilt_by_s")),
    *((name, "f8") for name in ("turn", "turn_by_load", "turn_bend", "turn_by_tilt", "turn_by_both", "turn_tilt_bend")),
    *((name, "f8", MOST) for name in ("matrix", "coupling", "tilts", "tilts_by_s", "by_moments", "bends")),
    ("right", "f8", 3),
)
#: Newton's method ends where a step is this share of the deflection of each tooth pair, of which the square is left: a
#: last step then changes the loads linearly.
SMALL, STEPS = 0.1, 40
#: Share of the penetration over which loads of two tooth pairs without increments change linearly to 1e-9.
LINEAR = 3e-4
#: Change of the penetration by a step, over that before, up to which its fourth root is a series, to 3e-7.
NEAR = 0.1
#: Where it does not end, as where a tooth pair just touches, the deflection of each is found by halving, again and
#: again for all: as the potential is convex, they come nearer to the solution each time.
SWEEPS, HALVINGS = 40, 64
#: What to try where it does not end.
NOT_FOUND = "deflections of unlike tooth pairs were not found; map more torques, or the phases of all pitches instead"
#: Least penetration of which that share is taken, over the largest one.
LIGHT = 1e-3
#: A step of Newton's method that would part a tooth pair with increments leaves it the first share of its penetration,
#: until the penetration is below the second share of its range, where the pair may part. The compliance of a narrow
#: contact grows without bound as its load falls: full steps would go to no load and back for ever.
KEPT, PARTED = 0.1, 1e-6
#: Numba's types of a table's head, and of tuples: laws without composition compile nothing of this module.
HEAD = from_dtype(FORCE_TABLE)
CELL_TYPE = types.NamedTuple((types.int64, types.int64, types.float64), Cell)
RANGE_TYPE = types.NamedUniTuple(types.float64, len(Range._fields), Range)
POTENTIAL_TYPE = types.NamedUniTuple(types.float64, len(Potential._fields), Potential)
teeth_behind, row_behind, pairs_on_stack = behind(TEETH), behind(TOOTH_PAIR), records_on_stack(PAIR, MOST)
ROW_SIZE = TOOTH_PAIR.itemsize


@fused
def teeth_of(table):
    """What a table is composed of."""
    return teeth_behind(table, table.teeth)


@fused
def single_of(teeth):
    """The table of a single tooth pair."""
    return table_behind(teeth, teeth.single_start)


@fused
def row_of(teeth, number):
    """`TOOTH_PAIR` by its number: from numbers of teeth, which take divisions, a call would take 1.07 times as long."""
    return row_behind(teeth, teeth.pairs_start + ROW_SIZE * number)


@fused(forceinline=True)
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
    row = array_behind(teeth, teeth.coupling_start + 16 * number, 4)
    t, m = at - i, teeth.coupled_steps
    slope = 0.0 if at == 0.0 or at == n - 1.0 else m * hermite_slope(t, row[0], row[1], row[2], row[3])
    return hermite(t, row[0], row[1], row[2], row[3]), slope


@fused
def phase_of(table, cell: Cell):
    """Phase [pitches] of a cell of a table."""
    return (cell.low + cell.share) * (1.0 / table.steps_in_pitch)


@fused_unchecked(forceinline=True)
def place_pairs(teeth, single, block, phase, deflection, lever, pairs):
    """Write position, range and deflections of all tooth pairs that may touch at a deflection of the mesh.

    (number of them, deflection at which the first one touches; that of any that may touch)
    """
    whole = int(phase)
    ahead, first = phase - whole, inf
    k, n, pull = int(ceil(teeth.first)), 0, 0.0  # noqa: RUF046 (a float in compiled code)
    if ahead + (k - 1) >= teeth.first:
        k -= 1
    if teeth.pull > 0.0 and any_varies(teeth, whole - k, int(teeth.last - ahead) - k):
        pull = teeth.pull
    while ahead + k <= teeth.last and n < MOST:
        row = row_of(teeth, whole - k)
        s = ahead + k + row.moved
        if teeth.first <= s <= teeth.last:
            pair = pairs[n]
            pair.s, pair.free = s, deflection - row.pitch
            at = (s - teeth.first) * single.steps_in_pitch
            step = int(at)
            write_cell(single, block, Cell(step, step + 1, at - step), pair)
            pair.varies, pair.further, pair.further_slope = 0, 0.0, 0.0
            if teeth.in_block > 0:
                write_variants(teeth, block, row, pair)
            pair.touches = pair.unloaded + pair.further + row.pitch
            if lever != 0.0 and single.has_centroid != 0:
                centroid = centroid_of_block(single, block, cell_of(pair), range_of_pair(pair), 0.0)
                pair.touches += lever * centroid.value
            first = min(first, pair.touches)
            if pair.touches - pull < deflection:
                n += 1
        k += 1
    return n, first


@fused
def any_varies(teeth, number, further):
    """Whether the tooth pair of a number, or any of so many before it, has increments: moments may pull neighbours."""
    for before in range(further + 1):
        row = row_of(teeth, number - before)
        if row.variant_1 >= 0 or row.variant_2 >= 0:
            return True
    return False


@fused
def write_cell(single, block, cell: Cell, pair):
    """Write the cell of a tooth pair in the table of single tooth pairs, and the range there."""
    extent = range_of(single, block, cell)
    pair.low, pair.high, pair.share = cell.low, cell.high, cell.share
    pair.unloaded, pair.unloaded_slope = extent.unloaded, extent.unloaded_slope
    pair.largest, pair.largest_slope, pair.largest_force = extent.largest, extent.largest_slope, extent.largest_force


@fused
def write_variants(teeth, block, row, pair):
    """Write which increments a tooth pair has, and what they are without load."""
    first, variants = block * teeth.in_block, pair.variants
    variants[0] = first + row.variant_1 if row.variant_1 >= 0 else -1
    variants[1] = first + row.variant_2 if row.variant_2 >= 0 else -1
    variants[2] = beside_sum(teeth, variants[0], variants[1])
    if row.variant_1 >= 0 or row.variant_2 >= 0:
        pair.varies = 1
        pair.further, pair.further_slope = unloaded_increment(teeth, variants, pair.s)


@fused
def cell_of(pair):
    """`Cell` of a tooth pair in the table of single tooth pairs."""
    return Cell(pair.low, pair.high, pair.share)


@fused
def range_of_pair(pair):
    """`Range` of a tooth pair."""
    return Range(pair.unloaded, pair.unloaded_slope, pair.largest, pair.largest_slope, pair.largest_force)


@on_demand(RANGE_TYPE, HEAD, types.int64, CELL_TYPE)
def composed_range(table, block, cell: Cell):
    """`Range` of a composed law: where the first tooth pair touches, and up to where all reach."""
    teeth, pairs = teeth_of(table), carray(pairs_on_stack(), MOST)
    n, unloaded = place_pairs(teeth, single_of(teeth), block, phase_of(table, cell), inf, 0.0, pairs)
    unloaded_slope, end, end_slope, largest_force = 0.0, inf, 0.0, 0.0
    for p in range(n):
        pair = pairs[p]
        slope = pair.unloaded_slope + pair.further_slope
        if pair.touches == unloaded:
            unloaded_slope = slope
        if pair.touches + pair.largest < end:
            end, end_slope = pair.touches + pair.largest, slope + pair.largest_slope
            largest_force = pair.largest_force
    return Range(unloaded, unloaded_slope, end - unloaded, end_slope - unloaded_slope, largest_force)


@on_demand(POTENTIAL_TYPE, HEAD, types.int64, CELL_TYPE, types.float64, types.float64)
def composed_potential(table, block, cell: Cell, deflection, lever):
    """`Potential` of a composed law; ValueError(deflection, largest deflection, nan, nan, side) beyond it."""
    teeth, pairs = teeth_of(table), carray(pairs_on_stack(), MOST)
    single, largest_force, end = single_of(teeth), 0.0, inf
    n, first = place_pairs(teeth, single, block, phase_of(table, cell), deflection, lever, pairs)
    for p in range(n):
        pair = pairs[p]
        penetration, largest_force = deflection - pair.touches, max(largest_force, pair.largest_force)
        if penetration > (1.0 + CONTINUED) * pair.largest:
            end = min(end, pair.touches + pair.largest)
        begin(teeth, pair, penetration)
    penetration = deflection - first
    if penetration <= 0.0:
        return Potential(0.0, penetration, 0.0, 0.0, 0.0, 0.0, 0.0, largest_force)
    if end < inf:
        raise ValueError(deflection, end, nan, nan, table.side)
    if n == 1 and pairs[0].varies == 0:
        return alone(single, block, pairs[0], lever, penetration)
    if n == 2 and single.has_centroid == 0 and pairs[0].varies + pairs[1].varies == 0:
        return of_two(teeth, single, block, pairs[0], pairs[1], penetration, largest_force)
    solve(teeth, single, block, lever, n, pairs)
    return summed(teeth, single, block, lever, n, penetration, largest_force, pairs)


@fused
def begin(teeth, pair, penetration):
    """Let a tooth pair deflect by its secant stiffness, from which Newton's method begins."""
    pair.x = pair.free - pair.further
    # couplings of loads only add to deflections
    pair.largest_x = pair.x if teeth.in_block == 0 else pair.unloaded + pair.largest
    pair.load_cell, pair.interval = -1, -1
    pair.stiffness = pair.largest_force / pair.largest
    pair.load = pair.stiffness * max(penetration, 0.0)
    pair.increase, pair.increase_slope = pair.further, 0.0
    pair.moment = pair.moment_by_load = pair.moment_bend = pair.moment_by_s = pair.moment_by_load_s = 0.0


@fused
def alone(single, block, pair, lever, penetration):
    """`Potential` of a tooth pair that touches where no other does, without increments."""
    u = single_potential(single, block, lever, pair, True)
    return Potential(
        u.energy, penetration, u.force, u.stiffness, u.force_by_phase, u.by_phase, u.by_lever, u.largest_force
    )


@fused(forceinline=True)
def of_two(teeth, single, block, a, b, penetration, largest_force):
    """`Potential` of two tooth pairs without increments or centroids, most states of spur gears.

    From loads by the nearest nodes a step of Newton's method ends so near to the solution that whole potentials there,
    and their slopes, are mostly evaluated once: the law takes 0.57 times the time of `solve` and `summed`.
    """
    c, c_s = coupling(teeth, 0, int(b.s - a.s + 0.5), a.s)
    step = step_of_two(a.stiffness, b.stiffness, c, (c * b.load, c * a.load))
    a.x, b.x = after(a, step[0]), after(b, step[1])
    root_a, root_b = root_of(a), root_of(b)
    (f_a, k_a), (f_b, k_b) = nearest_load(single, block, a, root_a), nearest_load(single, block, b, root_b)
    for _ in range(STEPS):
        step = step_of_two(k_a, k_b, c, (a.x + c * f_b - a.free, b.x + c * f_a - b.free))
        root_a, root_b = advance(a, root_a, step[0]), advance(b, root_b, step[1])
        u, v = mid_plane_potential(single, block, a, root_a), mid_plane_potential(single, block, b, root_b)
        f_a, k_a, f_b, k_b = u.force, u.stiffness, v.force, v.stiffness
        step = step_of_two(k_a, k_b, c, (a.x + c * f_b - a.free, b.x + c * f_a - b.free))
        if hardly_moves(step[0], a) and hardly_moves(step[1], b):
            break
    energy = u.energy + f_a * (a.free - a.x) + v.energy + f_b * (b.free - b.x) - c * f_a * f_b
    f_a, f_b = f_a - k_a * step[0], f_b - k_b * step[1]
    moved = step_of_two(k_a, k_b, c, (-c_s * f_b - c * v.force_by_phase, -c_s * f_a - c * u.force_by_phase))
    shares = step_of_two(k_a, k_b, c, (1.0, 1.0))
    return Potential(
        energy,
        penetration,
        f_a + f_b,
        k_a * shares[0] + k_b * shares[1],
        u.force_by_phase + k_a * moved[0] + v.force_by_phase + k_b * moved[1],
        u.by_phase + v.by_phase - c_s * f_a * f_b - u.force_by_phase * step[0] - v.force_by_phase * step[1],
        0.0,
        largest_force,
    )


@fused(forceinline=True)
def after(pair, step):
    """Deflection of a tooth pair after a step of Newton's method; couplings only add to deflections."""
    return min(pair.x - step, pair.free)


@fused_unchecked(forceinline=True)
def root_of(pair):
    """Fourth root of the penetration of a tooth pair over the largest one; 0 without contact."""
    return sqrt(sqrt(max(pair.x - pair.unloaded, 0.0) * (1.0 / pair.largest)))


@fused_unchecked(forceinline=True)
def advance(pair, root, step):
    """Take a step of Newton's method of a tooth pair with a `root_of`; returns the new one.

    The new one is mostly a series, of which the deflection follows: what comes next would wait for square roots and a
    division else. With reciprocals, which are ready before the step is, the law takes 0.93 times the time.
    """
    penetration, x = pair.x - pair.unloaded, after(pair, step)
    change = (x - pair.x) * (1.0 / penetration)
    if penetration > 0.0 and abs(change) < NEAR:
        root *= 1.0 + change * (1 / 4 - change * (3 / 32 - change * (7 / 128 - change * 77 / 2048)))
        pair.x = pair.unloaded + pair.largest * (root * root) ** 2
        return root
    pair.x = x
    return root_of(pair)


@fused_unchecked(forceinline=True)
def nearest_load(single, block, pair, root):
    """Load and stiffness of a tooth pair at x, by the slopes at the node nearest to its `root_of`."""
    penetration, m = pair.x - pair.unloaded, single.penetration_steps
    if penetration <= 0.0:
        return 0.0, 0.0
    u = root * m
    j, i, ahead = min(int(u + 0.5), m), pair.low, pair.share
    if ahead > 0.5:
        i, ahead = pair.high, ahead - 1.0
    at, t = node(single, single.potentials_start, block, i, j), u - j
    by_u = at.by_u + ahead * at.by_phase_u + t * at.by_uu
    secant = 2.0 * (at.value + ahead * at.by_phase + t * (by_u - 0.5 * t * at.by_uu)) + 0.25 * u * by_u
    return secant * penetration, secant + 0.0625 * u * (9.0 * by_u + u * at.by_uu)


@fused_unchecked(forceinline=True)
def mid_plane_potential(single, block, pair, root):
    """`Potential` of a tooth pair without centroid at x, with its `root_of`."""
    extent, penetration = range_of_pair(pair), pair.x - pair.unloaded
    if penetration <= 0.0:
        return Potential(0.0, penetration, 0.0, 0.0, 0.0, 0.0, 0.0, extent.largest_force)
    w = patch(single, single.potentials_start, block, cell_of(pair), cell_of_root(single, root))
    return derivatives(extent, MID_PLANE, penetration, 0.0, w, root)


@fused(forceinline=True)
def step_of_two(k_a, k_b, c, right):
    """Solution (2,) of Newton's method for two tooth pairs of these stiffnesses that couple, by right sides (2,)."""
    inverse = 1.0 / (1.0 - c * c * k_a * k_b)
    return inverse * (right[0] - c * k_b * right[1]), inverse * (right[1] - c * k_a * right[0])


@fused(forceinline=True)
def hardly_moves(step, pair):
    """Whether loads change linearly over a step of a tooth pair."""
    return abs(step) <= LINEAR * max(pair.x - pair.unloaded, LIGHT * pair.largest)


@fused
def solve(teeth, single, block, lever, n, pairs):
    """Find deflections of n tooth pairs that touch, by Newton's method; RuntimeError where they are not found."""
    write_couplings(teeth, n, pairs)
    step(teeth, lever, n, 1.0, pairs)
    for _ in range(STEPS):
        for p in range(n):
            write_load(teeth, single, block, lever, pairs[p])
        if step(teeth, lever, n, 1.0, pairs):
            return
    for _ in range(SWEEPS):
        for p in range(n):
            halve(teeth, single, block, lever, n, pairs, p)
        if step(teeth, lever, n, 0.0, pairs):
            return
    raise RuntimeError(NOT_FOUND)


@apart
def halve(teeth, single, block, lever, n, pairs, p):
    """Find the deflection of tooth pair p under the loads of the others, by halving its range."""
    pair = pairs[p]
    low, high = pair.unloaded - pair.largest, pair.largest_x
    for _ in range(HALVINGS):
        pair.x = 0.5 * (low + high)
        write_load(teeth, single, block, lever, pair)
        write_system(teeth, lever, n, pairs)
        if pair.right[0] > 0.0:
            high = pair.x
        else:
            low = pair.x
    if pair.load == 0.0:
        pair.x -= pair.right[0]


@fused
def step(teeth, lever, n, share, pairs):
    """Take a share of a step of Newton's method; whether the whole is small for each tooth pair."""
    write_system(teeth, lever, n, pairs)
    solve_in_place(n, 1, pairs)
    small = True
    for p in range(n):
        pair = pairs[p]
        penetration, next_x = pair.x - pair.unloaded, min(pair.x - share * pair.right[0], pair.largest_x)
        least = (LIGHT if pair.varies == 0 else PARTED) * pair.largest
        small = small and abs(pair.right[0]) <= SMALL * max(abs(penetration), least)
        if pair.varies != 0 and next_x < pair.unloaded and penetration > PARTED * pair.largest:
            next_x, small = pair.unloaded + KEPT * penetration, False
        pair.x = next_x
    return small


@fused
def write_load(teeth, single, block, lever, pair):
    """Write load, stiffness and increment of a tooth pair at its deflection x."""
    u = single_potential(single, block, lever, pair, False)
    pair.load, pair.stiffness = u.force, u.stiffness
    if pair.varies != 0:
        write_increase(teeth, pair)


@fused
def single_potential(single, block, lever, pair, moves):
    """`Potential` of a tooth pair alone at x; ValueError beyond its range.

    moves   whether slopes by the phase are wanted, else 0
    """
    raw, centroid, extent = pair.x - pair.unloaded, MID_PLANE, range_of_pair(pair)
    if single.has_centroid != 0 and (moves or lever != 0.0):
        centroid = centroid_of_block(single, block, cell_of(pair), extent, raw)
    penetration = raw - lever * centroid.value
    if penetration <= 0.0:
        return Potential(0.0, penetration, 0.0, 0.0, 0.0, 0.0, 0.0, extent.largest_force)
    share, m, n = penetration / extent.largest, single.penetration_steps, single.steps_in_pitch
    if not share <= 1.0 + CONTINUED:
        raise ValueError(pair.x, extent.unloaded + extent.largest, nan, nan, single.side)
    load = load_cell(single, share)
    if load.low != pair.load_cell:
        write_jets(single, block, load.low, pair)
    jets, by_phase, by_phase_u = pair.jets, 0.0, 0.0
    value, first, second = quintic(load.share, Jet(jets[0], jets[1], jets[2]), Jet(jets[3], jets[4], jets[5]))
    if moves:
        a, b, c, d = nodes_of(single, single.potentials_start, block, cell_of(pair), load.low)
        weights = hermite_slope_weights(pair.share)
        low, high = along_phase(weights, a, b), along_phase(weights, c, d)
        by_phase, by_phase_u, _ = quintic(load.share, low, high)
    w = Patch(value, m * first, m * m * second, n * by_phase, n * m * by_phase_u)
    return derivatives(extent, centroid, penetration, lever, w, (load.low + load.share) / m)


@fused
def write_jets(single, block, j, pair):
    """Write the jets over the load, at the ends of its interval j."""
    a, b, c, d = nodes_of(single, single.potentials_start, block, cell_of(pair), j)
    jets, weights, pair.load_cell = pair.jets, hermite_weights(pair.share), j
    jets[0], jets[1], jets[2] = along_phase(weights, a, b)
    jets[3], jets[4], jets[5] = along_phase(weights, c, d)


@fused
def write_increase(teeth, pair):
    """Write the increment of a tooth pair at its load; returned whole."""
    j, numbers = load_interval(teeth, pair.load), pair.increments
    if j != pair.interval:
        pair.interval = j
        write_interval(teeth, pair.variants, pair.s, j, numbers)
    further = increment(teeth, numbers, j, pair.load)
    pair.increase, pair.increase_slope = further.value, further.by_load
    pair.moment, pair.moment_by_load, pair.moment_bend = further.moment, further.moment_by_load, further.moment_bend
    pair.moment_by_s, pair.moment_by_load_s = further.moment_by_s, further.moment_by_load_s
    return further


@fused
def write_couplings(teeth, n, pairs):
    """Write couplings above, and their slopes by the position below the diagonal; likewise tilts."""
    for p in range(n):
        for q in range(p + 1, n):
            a, b = pairs[p], pairs[q]
            distance = int(b.s - a.s + 0.5)
            a.coupling[q], b.coupling[p] = coupling(teeth, 0, distance, a.s)
            if teeth.in_block > 0:
                a.tilts[q], a.tilts_by_s[q] = coupling(teeth, 1, distance, a.s)
                b.tilts[p], b.tilts_by_s[p] = coupling(teeth, 2, distance, a.s)
                a.by_moments[q], b.by_moments[p] = coupling(teeth, 3, distance, a.s)


@fused
def write_system(teeth, lever, n, pairs):
    """Write the matrix 1 + (E'' + i') k, and what is not balanced as the first right side."""
    for p in range(n):
        a = pairs[p]
        a.right[0] = a.x + a.increase - a.free
        a.matrix[p] = 1.0 + a.increase_slope * a.stiffness
    for p in range(n):
        a = pairs[p]
        for q in range(p + 1, n):
            b, c = pairs[q], a.coupling[q]
            a.matrix[q], b.matrix[p] = c * b.stiffness, c * a.stiffness
            a.right[0] += c * b.load
            b.right[0] += c * a.load
    if teeth.tilt_by_load > 0.0:
        add_moments(teeth, lever, n, pairs)


@fused
def add_moments(teeth, lever, n, pairs):
    """Add what moments of the loads couple to the matrix and to the first right side; write tilts and turns."""
    for p in range(n):
        pairs[p].tilt = lever
    for p in range(n):
        a = pairs[p]
        for q in range(p + 1, n):
            b, half = pairs[q], 0.5 * a.by_moments[q]
            a.tilt += a.tilts[q] * b.load + half * b.moment
            b.tilt += b.tilts[p] * a.load + half * a.moment
    limited = False
    for p in range(n):
        a = pairs[p]
        limited = write_turn(teeth, a) or limited
        a.right[0] += a.moment_by_load * a.turn + a.moment * a.turn_by_load
        a.bends[p] = a.moment_bend * a.turn + 2.0 * a.moment_by_load * a.turn_by_load + a.moment * a.turn_bend
    for p in range(n):
        a = pairs[p]
        for q in range(p + 1, n):
            b, half = pairs[q], 0.5 * a.by_moments[q]
            tilt_a, tilt_b = a.tilts[q] + half * b.moment_by_load, b.tilts[p] + half * a.moment_by_load
            of_a, of_b = a.moment * a.turn_by_tilt, b.moment * b.turn_by_tilt
            a.right[0] += of_b * tilt_b
            b.right[0] += of_a * tilt_a
            a.bends[p] += of_b * half * a.moment_bend
            b.bends[q] += of_a * half * b.moment_bend
            a.bends[q] = b.bends[p] = work_bend(a) * tilt_a + work_bend(b) * tilt_b
    if limited:
        add_limits(n, pairs)
    for p in range(n):
        a = pairs[p]
        for q in range(n):
            a.matrix[q] += a.bends[q] * pairs[q].stiffness


@fused
def work_bend(pair):
    """Second derivative by load and tilt of the work of the moment of a tooth pair [m]."""
    return pair.moment_by_load * pair.turn_by_tilt + pair.moment * pair.turn_by_both


@apart
def add_limits(n, pairs):
    """Add to the bends what limited turns couple."""
    for r in range(n):
        limiting = pairs[r]
        bend = limiting.moment * limiting.turn_tilt_bend
        if bend != 0.0:
            for p in range(n):
                for q in range(n):
                    if p != r and q != r:
                        pairs[p].bends[q] += bend * tilt_by_load(r, p, pairs) * tilt_by_load(r, q, pairs)


@fused
def tilt_by_load(p, q, pairs):
    """Slope of the tilt of tooth pair p by the load of q [rad/N]."""
    by_moment = pairs[p].by_moments[q] if p < q else pairs[q].by_moments[p]
    return pairs[p].tilts[q] + 0.5 * by_moment * pairs[q].moment_by_load


@fused
def write_turn(teeth, pair):
    """Write the turn by which the moment of a tooth pair works, with its derivatives; whether it is limited.

    It is the tilt, up to half of a limit that grows with the load, and comes near to the limit beyond.
    """
    limit, tilt = teeth.tilt_by_load * pair.load, pair.tilt
    if abs(tilt) <= 0.5 * limit:
        pair.turn, pair.turn_by_tilt = tilt, 1.0
        pair.turn_by_load = pair.turn_bend = pair.turn_by_both = pair.turn_tilt_bend = 0.0
        return False
    pair.turn = pair.turn_by_tilt = pair.turn_by_load = pair.turn_bend = pair.turn_by_both = pair.turn_tilt_bend = 0.0
    if limit > 0.0:
        u = abs(tilt) / limit
        v = u - 0.5
        root = 1.0 / sqrt(1.0 + 4.0 * v * v)
        share, slope, bend = 0.5 + v * root, root**3, -12.0 * v * root**5
        sign = 1.0 if tilt > 0.0 else -1.0
        pair.turn, pair.turn_by_tilt = sign * limit * share, slope
        pair.turn_by_load = sign * teeth.tilt_by_load * (share - u * slope)
        pair.turn_tilt_bend = sign * bend / limit
        pair.turn_by_both = -u * bend / pair.load
        pair.turn_bend = sign * teeth.tilt_by_load * u * u * bend / pair.load
    return True


@fused
def solve_in_place(n, columns, pairs):
    """Replace the right sides, as many as there are columns, by their solutions."""
    if n == 2:
        a, b = pairs[0], pairs[1]
        inverse = 1.0 / (a.matrix[0] * b.matrix[1] - a.matrix[1] * b.matrix[0])
        for c in range(columns):
            u, v = a.right[c], b.right[c]
            a.right[c], b.right[c] = (
                inverse * (b.matrix[1] * u - a.matrix[1] * v),
                inverse * (a.matrix[0] * v - b.matrix[0] * u),
            )
    else:
        eliminate(n, columns, pairs)


@fused
def eliminate(n, columns, pairs):
    """`solve_in_place` by Gauss."""
    for i in range(n):
        pivot = pairs[i]
        for j in range(i + 1, n):
            below = pairs[j]
            factor = below.matrix[i] / pivot.matrix[i]
            for k in range(i + 1, n):
                below.matrix[k] -= factor * pivot.matrix[k]
            for c in range(columns):
                below.right[c] -= factor * pivot.right[c]
    for c in range(columns):
        for i in range(n - 1, -1, -1):
            row = pairs[i]
            value = row.right[c]
            for k in range(i + 1, n):
                value -= row.matrix[k] * pairs[k].right[c]
            row.right[c] = value / row.matrix[i]


@fused
def summed(teeth, single, block, lever, n, penetration, largest_force, pairs):
    """`Potential` of n tooth pairs at their deflections x, and a last step from there."""
    for p in range(n):
        write_potential(teeth, single, block, lever, pairs[p])
    write_system(teeth, lever, n, pairs)
    for p in range(n):
        pairs[p].right[2] = 1.0
    energy = force = by_phase = by_lever = force_by_s = stiffness = 0.0
    for p in range(n):
        a = pairs[p]
        energy, by_phase = energy + a.energy, by_phase + a.by_s
        for q in range(p + 1, n):
            b, c = pairs[q], a.coupling[q]
            c_s = b.coupling[p]
            energy -= c * a.load * b.load
            by_phase -= c_s * a.load * b.load
            a.right[1] -= c_s * b.load + c * b.load_by_s
            b.right[1] -= c_s * a.load + c * a.load_by_s
    if teeth.tilt_by_load > 0.0:
        of_energy, of_phase, moments = sum_moments(n, pairs)
        energy, by_phase, by_lever = energy - of_energy, by_phase - of_phase, by_lever - moments
    solve_in_place(n, 3, pairs)
    for p in range(n):
        a = pairs[p]
        further = -a.stiffness * a.right[0]
        force += a.load + further
        by_phase -= a.load_by_s * a.right[0]
        by_lever += a.by_lever * (1.0 + further / a.load) if a.load > 0.0 else 0.0
        stiffness += a.stiffness * a.right[2]
        force_by_s += a.load_by_s + a.stiffness * a.right[1]
    return Potential(energy, penetration, force, stiffness, force_by_s, by_phase, by_lever, largest_force)


@fused
def write_potential(teeth, single, block, lever, pair):
    """Write load and potential of a tooth pair with their slopes, and how far it moves at given loads of the others."""
    u = single_potential(single, block, lever, pair, True)
    pair.load, pair.stiffness, pair.load_by_s = u.force, u.stiffness, u.force_by_phase
    # the part of the potential that is stationary at the solution
    pair.energy = u.energy + u.force * (pair.free - pair.x)
    pair.by_s, pair.by_lever, pair.right[1] = u.by_phase, u.by_lever, 0.0
    if pair.varies != 0:
        further = write_increase(teeth, pair)
        pair.energy -= further.work
        pair.by_s -= further.work_by_s
        pair.right[1] = -further.by_s - further.by_load * u.force_by_phase


@fused
def sum_moments(n, pairs):
    """(energy, its slope by s at given loads, by the lever); takes what moves with s from the second right side."""
    for p in range(n):
        pairs[p].tilt_by_s = 0.0
    for p in range(n):
        a = pairs[p]
        for q in range(p + 1, n):
            b, half, half_s = pairs[q], 0.5 * a.by_moments[q], 0.5 * pairs[q].by_moments[p]
            a.tilt_by_s += a.tilts_by_s[q] * b.load + half_s * b.moment + half * b.moment_by_s
            b.tilt_by_s += b.tilts_by_s[p] * a.load + half_s * a.moment + half * a.moment_by_s
    energy, by_s, by_lever = 0.0, 0.0, 0.0
    for p in range(n):
        a = pairs[p]
        of_a = a.moment * a.turn_by_tilt
        energy, by_lever = energy + a.moment * a.turn, by_lever + of_a
        by_s += a.moment_by_s * a.turn + of_a * a.tilt_by_s
        a.right[1] -= a.moment_by_load_s * a.turn + a.moment_by_s * a.turn_by_load + work_bend(a) * a.tilt_by_s
        a.right[1] -= a.bends[p] * a.load_by_s
    for p in range(n):
        a = pairs[p]
        for q in range(p + 1, n):
            b, half, half_s = pairs[q], 0.5 * a.by_moments[q], 0.5 * pairs[q].by_moments[p]
            tilt_a, tilt_b = a.tilts[q] + half * b.moment_by_load, b.tilts[p] + half * a.moment_by_load
            tilt_a_s = a.tilts_by_s[q] + half_s * b.moment_by_load + half * b.moment_by_load_s
            tilt_b_s = b.tilts_by_s[p] + half_s * a.moment_by_load + half * a.moment_by_load_s
            of_a, of_b = a.moment * a.turn_by_tilt, b.moment * b.turn_by_tilt
            a.right[1] -= a.bends[q] * b.load_by_s + work_by_tilt_s(b) * tilt_b + of_b * tilt_b_s
            b.right[1] -= b.bends[p] * a.load_by_s + work_by_tilt_s(a) * tilt_a + of_a * tilt_a_s
    return energy, by_s, by_lever


@fused
def work_by_tilt_s(pair):
    """Slope by s of the derivative by the tilt of the work of the moment of a tooth pair, at given loads."""
    return pair.moment_by_s * pair.turn_by_tilt + pair.moment * pair.turn_tilt_bend * pair.tilt_by_s
