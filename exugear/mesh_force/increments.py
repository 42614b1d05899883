"""What single teeth deflect more or less than the others, and how far they move their load along the face.

Over positions s and t = sqrt(load / largest load) increments are cubic Hermite polynomials between nodes. Those of both
teeth of a tooth pair, and what they have beside their sum, add up at the nodes; a call interpolates them over s once,
and over t as often as Newton's method changes the load.
"""

from math import sqrt
from typing import NamedTuple

from exugear.mesh_force.kernel_records import behind, floats_behind
from exugear.mesh_force.layout import INCREMENT
from exugear.mesh_force.patches import Patch
from exugear.mesh_force.pchip import hermite, hermite_bend_weights, hermite_slope, weighted
from fem.support.numba_cache import compiled

#: Least t, the root of the load, at which the bend of moments is taken.
LEAST_T = 1e-2
#: Gauss points and weights in [0, 1], exact for polynomials of the fifth degree.
GAUSS = ((0.1127016653792583, 5 / 18), (0.5, 8 / 18), (0.8872983346207417, 5 / 18))
#: Numbers of an interval of t at a position: deflection and moment with their slopes by t, s and both at its lower end,
#: the same at its upper end, then the work and its slope by s at the lower end.
INTERVAL = 18
NODE_SIZE = INCREMENT.itemsize
node_behind = behind(INCREMENT)


class Increment(NamedTuple):
    """Further deflection of a tooth pair [m], its slopes by load and position, its work [J] and the slope of that by s.

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


class PositionCell(NamedTuple):
    """Where increments are taken: number of the position below s, share of the way to the next; steps per pitch, 0
    beyond the first and the last position, where increments do not change.
    """

    number: int
    share: float
    steps: float


@compiled
def position_cell(teeth, s):
    """`PositionCell` of the increments at a position."""
    last = teeth.placed - 1.0
    at = min(max((s - teeth.placed_first) * teeth.placed_steps, 0.0), last)
    i = min(int(at), teeth.placed - 2)
    return PositionCell(i, at - i, teeth.placed_steps if 0.0 < at < last else 0.0)


@compiled
def node(teeth, variant, i, j):
    """Node of a variant at position i and load j."""
    number = (variant * teeth.placed + i) * teeth.loads + j
    return node_behind(teeth, teeth.increments_start + NODE_SIZE * number)


@compiled
def beside_sum(teeth, variant_1, variant_2):
    """Number of what the increments of both teeth have beside their sum; -1: nothing."""
    if variant_1 < 0 or variant_2 < 0:
        return -1
    block = variant_1 - variant_1 % teeth.in_block
    number = (variant_1 - block) * teeth.of_wheel + variant_2 - block - teeth.of_pinion
    beside = int(floats_behind(teeth, teeth.meeting_start)[number])
    return block + beside if beside >= 0 else -1


@compiled
def unloaded_increment(teeth, variants, s):
    """Further deflection of a tooth pair without load, and its slope by s; variants: (3,), -1: none."""
    at, value, slope = position_cell(teeth, s), 0.0, 0.0
    for k in range(3):
        variant = int(variants[k])
        if variant >= 0:
            a, b = node(teeth, variant, at.number, 0), node(teeth, variant, at.number + 1, 0)
            value += hermite(at.share, a.value, a.by_s, b.value, b.by_s)
            slope += at.steps * hermite_slope(at.share, a.value, a.by_s, b.value, b.by_s)
    return value, slope


@compiled
def write_interval(teeth, variants, s, j, interval):
    """Write the numbers of the interval of t from load j on, at a position, summed over the variants (3,)."""
    at = position_cell(teeth, s)
    t, steps = at.share, at.steps
    for k in range(INTERVAL):
        interval[k] = 0.0
    for k in range(3):
        variant = int(variants[k])
        if variant >= 0:
            for end in range(2):
                a, b = node(teeth, variant, at.number, j + end), node(teeth, variant, at.number + 1, j + end)
                first = 8 * end
                add_along(t, steps, a.value, a.by_s, b.value, b.by_s, interval, first)
                add_along(t, steps, a.by_t, a.by_t_s, b.by_t, b.by_t_s, interval, first + 1)
                add_along(t, steps, a.moment, a.moment_by_s, b.moment, b.moment_by_s, interval, first + 4)
                add_along(t, steps, a.moment_by_t, a.moment_by_t_s, b.moment_by_t, b.moment_by_t_s, interval, first + 5)
                if end == 0:
                    interval[16] += hermite(t, a.work, a.work_by_s, b.work, b.work_by_s)
                    interval[17] += steps * hermite_slope(t, a.work, a.work_by_s, b.work, b.work_by_s)


@compiled
def add_along(t, steps, y_0, m_0, y_1, m_1, interval, k):
    """Add the value of a cubic to the k-th number of an interval, and its slope by s to the second one after it."""
    interval[k] += hermite(t, y_0, m_0, y_1, m_1)
    interval[k + 2] += steps * hermite_slope(t, y_0, m_0, y_1, m_1)


@compiled
def over_t(w, interval, first):
    """`Patch` over t of the deflection (first 0) or the moment (4) of an interval; its phase is s."""
    p, p_t, p_s, p_ts = interval[first], interval[first + 1], interval[first + 2], interval[first + 3]
    q, q_t, q_s, q_ts = interval[first + 8], interval[first + 9], interval[first + 10], interval[first + 11]
    return Patch(
        hermite(w, p, p_t, q, q_t),
        hermite_slope(w, p, p_t, q, q_t),
        weighted(hermite_bend_weights(w), p, p_t, q, q_t),
        hermite(w, p_s, p_ts, q_s, q_ts),
        hermite_slope(w, p_s, p_ts, q_s, q_ts),
    )


@compiled
def load_interval(teeth, load):
    """Number of the interval of t in which a load lies."""
    u = min(sqrt(max(load, 0.0) / teeth.largest_load), 1.0) * (teeth.loads - 1)
    return min(int(u), teeth.loads - 2)


@compiled
def increment(teeth, interval, j, load):
    """`Increment` under a load [N] that lies in the interval j of t."""
    m, largest = teeth.loads - 1, teeth.largest_load
    within = min(sqrt(max(load, 0.0) / largest), 1.0)
    u = within * m
    w = u - j
    deflection, moment = over_t(w, interval, 0), over_t(w, interval, 4)
    work, work_by_s = interval[16], interval[17]
    for g in range(3):
        x, weight = w * GAUSS[g][0], w * GAUSS[g][1]
        scale = 2.0 * largest * weight * (j + x) / (m * m)
        inner = over_t(x, interval, 0)
        work, work_by_s = work + scale * inner.value, work_by_s + scale * inner.by_phase
    if within >= 1.0:
        beyond = load - largest
        work, work_by_s = work + beyond * deflection.value, work_by_s + beyond * deflection.by_phase
        return Increment(
            deflection.value, 0.0, deflection.by_phase, work, work_by_s, moment.value, 0.0, 0.0, moment.by_phase, 0.0
        )
    # slopes by t vanish at t = 0 as t does
    by_root = m / (2.0 * largest * max(within, 1e-6))
    bend = (moment.by_uu - moment.by_u / max(u, 1e-6)) * (m / (2.0 * largest * max(within, LEAST_T))) ** 2
    return Increment(
        deflection.value,
        by_root * deflection.by_u,
        deflection.by_phase,
        work,
        work_by_s,
        moment.value,
        by_root * moment.by_u,
        bend,
        moment.by_phase,
        by_root * moment.by_phase_u,
    )
