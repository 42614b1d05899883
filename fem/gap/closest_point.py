"""Where the flanks of each tooth pair are closest: a search along the profile, and across the face without load."""

from typing import NamedTuple

import numpy as np

from fem.gap.flank_gap import approach_at, first_roll, free_turn, gaps_along, sections_of
from fem.gear.tooth_profile import LEAST_ROLL
from fem.support.numba_cache import kept_unchecked, unchecked

#: Number of positions on a modified profile, with steps shorter than reliefs; number of rounds of the search around the
#: closest position, and positions in a round: steps shrink by 8 in each round, to 1e-5 of a flank.
SAMPLES, ROUNDS, AROUND = 41, 3, 17


class Closest(NamedTuple):
    """Where the flanks of n slices are closest.

    roll, foot  (n,) roll lengths of host and mate [m]
    gap         (n,) smallest normal gap, aligned [m]
    approach    (n,) normal approach per transmission error
    radius      (n,) relative transverse radius of curvature of the involutes [m]
    """

    roll: np.ndarray
    foot: np.ndarray
    gap: np.ndarray
    approach: np.ndarray
    radius: np.ndarray


@kept_unchecked
def closest_points(mesh, number, low, high, te):
    """(5, n) `Closest` of slices (n,) of tooth pairs, linearized about transmission errors (n,) [m]."""
    closest, sections = np.empty((5, number.size)), sections_of(mesh, number, low, high, te)
    rolls, gaps, feet = np.empty(SAMPLES + 1), np.empty(SAMPLES + 1), np.empty(SAMPLES + 1)
    for i in range(number.size):
        at = sections[i]
        roll, gap, foot = _closest_of(mesh, at, rolls, gaps, feet)
        approach = approach_at(mesh, at, roll, foot, 0.0)
        closest[0, i], closest[1, i], closest[2, i] = roll, foot, gap + approach * at.te
        closest[3, i], closest[4, i] = approach, _radius(mesh, at, roll)
    return closest


@unchecked
def _closest_of(mesh, at, rolls, gaps, feet):
    """Roll length of the host, gap and roll length of the mate where the flanks are closest; arrays to work in."""
    low, high = first_roll(mesh, at), at.tip
    rolls[0] = min(max(at.nominal, low), high)
    if not mesh.position.modified:
        return _smallest(mesh, at, rolls[:1].size, rolls, gaps, feet)
    step, rolls[SAMPLES] = (high - low) / (SAMPLES - 1), rolls[0]
    for k in range(SAMPLES):
        rolls[k] = low + step * k
    closest = _smallest(mesh, at, rolls.size, rolls, gaps, feet)
    for _ in range(ROUNDS):
        write_around(closest[0], step, AROUND, low, high, rolls)
        closest, step = _smallest(mesh, at, rolls[:AROUND].size, rolls, gaps, feet), step * 2 / (AROUND - 1)
    return closest


@unchecked
def _smallest(mesh, at, n, rolls, gaps, feet):
    """Roll length, gap and roll length of the mate where the gap is smallest among n roll lengths."""
    gaps_along(mesh, at, n, rolls, gaps, feet)
    smallest = 0
    for k in range(1, n):
        if gaps[k] < gaps[smallest]:
            smallest = k
    return rolls[smallest], gaps[smallest], feet[smallest]


@unchecked
def write_around(middle, step, number, low, high, positions):
    """Write a number of positions within a step around the middle, and within limits."""
    for k in range(number):
        positions[k] = min(max(middle + step * (2 * k / (number - 1) - 1), low), high)


@unchecked
def _radius(mesh, at, roll):
    """Relative transverse radius of curvature of the involutes [m] at a roll length of the host."""
    host = max(roll, LEAST_ROLL * at.tip)
    mate = max(free_turn(mesh, at, roll)[1], LEAST_ROLL * at.mate_tip)
    return host * mate / (host + mate)
