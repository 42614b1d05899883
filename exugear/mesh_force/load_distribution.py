"""How the load of a mesh is distributed over the path of contact, over the mesh cycle: pieces of the contact lines."""

from math import ceil, floor
from typing import NamedTuple

import numpy as np
import xarray as xr

from fem.pair.pair import GearPair
from fem.ste.map_sides import left_torques
from fem.ste.ste_map import PHASE, TORQUE, check, check_period, over_torque_and_pitches, pair_of, pitches_of
from fem.support.intervals import interval_of
from fem.support.validation import require

#: Steps over a pitch.
STEPS = 512
SHARE, PAIR = "load_share", "pair"
#: Least part of the width by which the load of a tooth pair is divided: maps load tooth pairs beyond the path, too.
LEAST_WIDTH = 0.1


class LoadDistribution(NamedTuple):
    """Pieces of contact lines, each array (n_piece, n) over phases i / STEPS of a pitch, or of several.

    start, end   in pitches beyond the pitch point along the line of action
    share        of the mesh force, evenly spread from start to end; the shares add up to 1
    line_load    over the mesh force per face width
    """

    start: np.ndarray
    end: np.ndarray
    share: np.ndarray
    line_load: np.ndarray


def even_distribution(pair: GearPair) -> LoadDistribution:
    """The load spread evenly over the width and, in each section, over the tooth pairs in contact."""
    first, last = _ends(_tooth_positions(pair), pair)
    pieces = [(first.clip(low, high), last.clip(low, high), number) for low, high, number in _sections(pair)]
    start, end = (np.concatenate([piece[i] for piece in pieces]) for i in range(2))
    line_load = np.concatenate([np.full_like(p, 1 / number) for p, _, number in pieces])
    width = (end - start) * line_load
    return LoadDistribution(start, end, width / width.sum(axis=0), line_load)


def mapped_distribution(ste: xr.Dataset, torque: float) -> LoadDistribution:
    """The load by the load shares of an STE map at a pinion torque [N m], even over the width of each tooth pair.

    A tooth pair that carries load before the path of contact begins or after it ends, because teeth deflect, counts as
    in contact at that end of the path. ValueError for a map without load_share or with further axes, and for a torque
    outside the map.
    """
    ste = left_torques(check(ste))
    over_torque_and_pitches(ste)
    check_period(ste)
    pair = pair_of(ste)
    position = _tooth_positions(pair, pitches_of(ste))
    share = _shares(ste, torque, position)
    first, last = _ends(position, pair)
    start, end = (x.clip(*_path(pair)) for x in (first, last))
    touching = end > start
    start, end = (np.where(touching, x, position.clip(*_path(pair))) for x in (start, end))
    width = ((end - start) / (last - first)).clip(LEAST_WIDTH, 1.0) if pair.eps_beta > 1 / STEPS else 1.0
    share = share / share.sum(axis=0)
    return LoadDistribution(start, end, share, share / width)


def sign_and_distance(distribution: LoadDistribution) -> tuple[np.ndarray, np.ndarray]:
    """(n,) means of sign(x) and |x| over the load, x the distance from the pitch point in pitches."""
    start, end, share, _ = distribution
    width = end - start
    long = width > 0
    divisor = np.where(long, width, 1.0)
    sign = np.where(long, (np.abs(end) - np.abs(start)) / divisor, np.sign(end))
    distance = np.where(long, (end * np.abs(end) - start * np.abs(start)) / 2 / divisor, np.abs(end))
    return (share * sign).sum(axis=0), (share * distance).sum(axis=0)


def _path(pair: GearPair) -> tuple[float, float]:
    """Ends of the path of contact, in pitches beyond the pitch point."""
    return (pair.roll_start - pair.roll_pitch) / pair.p_bt, (pair.roll_end - pair.roll_pitch) / pair.p_bt


def _tooth_positions(pair: GearPair, pitches: int = 1) -> np.ndarray:
    """(n_pair, n) positions of the tooth pairs in mid-plane, in pitches beyond the pitch point."""
    low, high = _path(pair)
    number = np.arange(floor(low - pair.eps_beta) - 1, ceil(high + pair.eps_beta) + 2)
    return number[:, None] + np.tile(np.arange(STEPS) / STEPS, pitches)


def _ends(position: np.ndarray, pair: GearPair) -> tuple[np.ndarray, np.ndarray]:
    """Positions of tooth pairs at both ends of the width; those of spur gears are a step of the table apart."""
    half = max(pair.eps_beta, 1 / STEPS) / 2
    return position - half, position + half


def _sections(pair: GearPair) -> list[tuple[float, float, float]]:
    """Sections of the path of contact, as (start, end, number of tooth pairs in contact)."""
    low, high = _path(pair)
    pitches = np.arange(ceil(high - low) + 1)
    ends = np.unique(np.r_[low + pitches, high - pitches].clip(low, high))
    middle = (ends[:-1] + ends[1:]) / 2
    number = np.floor(high - middle) + np.floor(middle - low) + 1
    return list(zip(ends[:-1], ends[1:], number, strict=True))


def _shares(ste, torque: float, position: np.ndarray) -> np.ndarray:
    """Load shares of tooth pairs at positions in mid-plane, in pitches beyond the pitch point, linear in the map."""
    require(SHARE in ste, f"the map must have {SHARE}; make it with fem.static_transmission_error, or use of_pair")
    given, phase = ste[TORQUE].values, ste[PHASE].values
    within = f"torque must lie in ({max(0.0, given[0]):g}, {given[-1]:g}] N m of the map, got {torque}"
    require(torque > 0 and given[0] <= torque <= given[-1], f"{within}; extend the map")
    near = np.array([np.interp(torque, given, hat) for hat in np.eye(given.size)])
    known = np.tensordot(near, ste[SHARE].transpose(TORQUE, PHASE, PAIR).values, 1)
    pairs, pitches = ste[PAIR].values, pitches_of(ste)
    first = pairs.min() - pitches - 1
    by_number = np.zeros((phase.size + 2, pairs.max() + pitches + 2 - first))
    # A pitch cycle later the teeth that meet are those of tooth pairs with smaller numbers.
    by_number[1:-1, pairs - first] = known
    by_number[0, pairs + pitches - first] = known[-1]
    by_number[-1, pairs - pitches - first] = known[0]
    closed = np.r_[phase[-1] - pitches, phase, phase[0] + pitches]
    pitch, at = np.divmod(np.arange(position.shape[1]), STEPS)
    at = pitch + at / STEPS
    low = interval_of(closed, at)
    ahead = (at - closed[low]) / (closed[low + 1] - closed[low])
    number = np.clip(np.floor(position).astype(int) - pitch - first, 0, by_number.shape[1] - 1)
    return (1 - ahead) * by_number[low, number] + ahead * by_number[low + 1, number]
