"""Where the flanks of each tooth pair are closest: a search along the profile, and across the face without load."""

from math import copysign, inf, sqrt
from typing import NamedTuple

import numpy as np
from numba import types

from fem.contact.flank_gap import approach_at, first_roll, sections_of, turn_to_contact, write_gaps
from fem.contact.mesh_geometry import PAIR_RECORDS
from fem.gear.tooth_profile import LEAST_ROLL
from fem.support.numba_cache import kept_unchecked, unchecked
from fem.support.on_demand import on_demand

#: Number of positions on a modified profile, with steps shorter than reliefs; number of rounds of the search around the
#: closest position, and positions in a round: steps shrink by 8 in each round, to 1e-5 of a flank.
SAMPLES, ROUNDS, AROUND = 41, 3, 17
#: Step along the profile from the mate's tip corner to the slope of the gap there [modules].
EDGE_STEP = 0.01


class Closest(NamedTuple):
    """Where the flanks of n slices are closest.

    roll, foot  (n,) roll lengths of host and mate [m]
    gap         (n,) smallest normal gap, aligned [m]
    approach    (n,) normal approach per transmission error
    radius      (n,) relative transverse radius of curvature of the involutes [m]
    from_edge   (n,) distance along the profile from the mate's tip corner to where the gap is smallest [m]; < 0 where
                that would lie beyond the corner
    """

    roll: np.ndarray
    foot: np.ndarray
    gap: np.ndarray
    approach: np.ndarray
    radius: np.ndarray
    from_edge: np.ndarray


@kept_unchecked
def closest_points(mesh, number, low, high, te):
    """(6, n) `Closest` of slices (n,) of tooth pairs, linearized about transmission errors (n,) [m]."""
    sections = sections_of(mesh, number, low, high, te)
    closest = _smallest_gaps(mesh, sections)
    for i in range(number.size):
        closest[4, i] = _radius(mesh, sections[i], closest[0, i])
    _write_distances_from_edge(mesh, sections, closest)
    for i in range(number.size):
        at, roll, foot = sections[i], closest[0, i], closest[1, i]
        approach = mesh.position.inclined if at.out_of_reach else approach_at(mesh, at, roll, foot, 0.0)
        closest[2, i] += approach * at.te
        closest[3, i] = approach
    return closest


#: `closest_points` where a kernel calls it: the code that Python calls, instead of a copy in each kernel.
closest_in_kernels = on_demand(
    types.float64[:, ::1], PAIR_RECORDS, types.int64[::1], types.float64[::1], types.float64[::1], types.float64[::1]
)(closest_points)


@unchecked
def _smallest_gaps(mesh, sections):
    """(6, n) `Closest` of sections (n,) whose gap is that under te, without approach, radius and distance from edge."""
    n, modified = sections.size, mesh.position.modified
    closest, first, step = np.empty((6, n)), np.empty(n), np.empty(n)
    for i in range(n):
        first[i] = first_roll(mesh, sections[i])
        step[i] = (sections[i].tip - first[i]) / (SAMPLES - 1)
        closest[0, i], closest[1, i], closest[2, i] = first[i], 0.0, inf
    for search in range(1 + ROUNDS if modified else 1):
        m = AROUND if search else SAMPLES + 1 if modified else 1
        rolls = np.empty((n, m))
        for i in range(n):
            low, high = first[i], sections[i].tip
            for k in range(m):
                roll = closest[0, i] + step[i] * (2 * k / (AROUND - 1) - 1) if search else low + step[i] * k
                rolls[i, k] = min(max(roll, low), high)
            if search == 0:
                rolls[i, m - 1] = min(max(sections[i].nominal, low), high)
            else:
                step[i] *= 2 / (AROUND - 1)
        _take_smallest(mesh, sections, rolls, closest)
    return closest


@unchecked
def _take_smallest(mesh, sections, rolls, closest):
    """Write the smallest gap of each section among those at roll lengths (n, m) where it is smaller than `closest`."""
    gaps, feet = np.empty(rolls.shape), np.empty(rolls.shape)
    write_gaps(mesh, sections, rolls, gaps, feet)
    for i in range(sections.size):
        for k in range(rolls.shape[1]):
            if gaps[i, k] < closest[2, i]:
                closest[0, i], closest[1, i], closest[2, i] = rolls[i, k], feet[i, k], gaps[i, k]


@unchecked
def _write_distances_from_edge(mesh, sections, closest):
    """Write `Closest.from_edge`; where the corner is closest, from the slope of the gap there, a parabola."""
    n = sections.size
    rolls, gaps, feet = np.empty((n, 2)), np.empty((n, 2)), np.empty((n, 2))
    for i in range(n):
        at = sections[i]
        rolls[i, 0] = first_roll(mesh, at)
        arc = rolls[i, 0] ** 2 / (2 * at.r_host) + EDGE_STEP * mesh.position.m_n
        rolls[i, 1] = min(copysign(sqrt(max(2 * at.r_host * arc, 0.0)), at.r_host), at.tip)
    write_gaps(mesh, sections, rolls, gaps, feet)
    for i in range(n):
        at, radius = sections[i], closest[4, i]
        step = (rolls[i, 1] ** 2 - rolls[i, 0] ** 2) / (2 * at.r_host)
        closest[5, i] = (closest[0, i] ** 2 - rolls[i, 0] ** 2) / (2 * at.r_host)
        if closest[5, i] < step and step > 0:
            slope = (gaps[i, 1] - gaps[i, 0]) / step / mesh.position.inclined
            closest[5, i] = step / 2 - slope * radius


@unchecked
def _radius(mesh, at, roll):
    """Relative transverse radius of curvature of the involutes [m] at a roll length of the host."""
    host = copysign(max(abs(roll), LEAST_ROLL * abs(at.tip)), at.r_host)
    mate = turn_to_contact(mesh, at, roll)[1]
    # Beyond the tip of a ring, on its base circle, the pinion would be less curved than the ring.
    mate = max(mate, LEAST_ROLL * at.mate_tip) if at.r_mate > 0 else min(mate, at.mate_tip)
    radius = host * mate / (host + mate)
    return radius if radius > 0 else min(abs(host), abs(mate))
