"""Parts of the face on which the pairs of teeth overlap, and so carry load."""

from math import sqrt, tan

import numpy as np

from fem.contact.flank_gap import ContactSlices
from fem.microgeometry.flank import edges, edges_across
from fem.pair.mesh_position import MeshPosition

#: A loaded width reaches beyond a station that touches by at least this share of the way to the next one.
BEYOND = 1e-3

#: Kinks keep this distance from one another and from the ends, even stops from kinks, as shares of an even slice.
NEAR, APART = 0.02, 0.2

#: Strips are as wide as for this share of the largest line load where there is less.
LEAST = 0.05

#: Axial ends [m] of the part of the face that counts, by number of the pair of teeth
Ranges = dict[int, tuple[float, float]]


def across(meeting: MeshPosition, places_of) -> np.ndarray:
    """(n,) axial places on the flanks of both gears [m]; places_of: a flank and a face, as `edges_across`."""
    pinion, wheel = ((gear.drive_flank, gear.face) for gear in (meeting.pair.pinion, meeting.pair.wheel))
    return np.array([*places_of(*pinion), *(meeting.axial + place for place in places_of(*wheel))])


def kinks(meeting: MeshPosition) -> np.ndarray:
    """(n_pair, n) axial places where the slope of a modification jumps along the line of contact of each pair [m]."""
    pair = meeting.pair
    pinion, wheel = ((gear.drive_flank, gear.face) for gear in (pair.pinion, pair.wheel))
    places = across(meeting, edges_across)
    rolls = np.array([*edges(*pinion), *map(meeting.path.on_wheel, edges(*wheel))])
    start = meeting.nominal(np.array(meeting.numbers())[:, None], 0.0)
    along = (rolls - start) / tan(pair.beta_b) if pair.beta_b else np.zeros((start.size, 0))
    return np.concatenate([np.tile(places, (start.size, 1)), along], axis=1)


def with_kinks(stops: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Equidistant stops (n,) and the places that lie among them.

    The first and the last stay, places not NEAR these and one another, and of the other stops those APART from places:
    beside a narrow slice the load on it would be off.
    """
    near, distance = (share * (stops[1] - stops[0]) for share in (NEAR, APART))
    among = np.unique(places[(places > stops[0] + near) & (places < stops[-1] - near)])
    if not among.size:
        return stops
    among = among[np.diff(among, prepend=stops[0]) > near]
    kept = np.abs(stops[:, None] - among).min(axis=1) > distance
    kept[[0, -1]] = True
    return np.sort(np.concatenate([stops[kept], among]))


def wider(one: Ranges, other: Ranges) -> Ranges:
    """Ranges that hold both."""
    ends = {k: np.array([ranges[k] for ranges in (one, other) if k in ranges]) for k in one.keys() | other.keys()}
    return {k: (float(both[:, 0].min()), float(both[:, 1].max())) for k, both in sorted(ends.items())}


def overlap(axial: np.ndarray, clear: np.ndarray) -> tuple[float, float]:
    """Ends of the range in which clear (n,) at places axial (n,), increasing, is positive."""
    inside = np.flatnonzero(clear > 0)
    first, last, end = int(inside[0]), int(inside[-1]), axial.size - 1
    low = axial[0] if first == 0 else _root(axial, clear, first + 1, first, first - 1)
    high = axial[end] if last == end else _root(axial, clear, last - 1, last, last + 1)
    return float(low), float(high)


def _root(x: np.ndarray, y: np.ndarray, before: int, inside: int, outside: int) -> float:
    """Where the parabola through three points, or the line through two, falls to 0 between the last two."""
    step, fall, bend = x[outside] - x[inside], y[outside] - y[inside], 0.0
    if 0 <= before < x.size:
        behind = (x[inside] - x[before]) / step
        bend = (y[before] - y[inside] + behind * fall) / (behind**2 + behind)
    slope = fall - bend
    share = 2 * y[inside] / (sqrt(max(slope**2 - 4 * bend * y[inside], 0.0)) - slope)
    return x[inside] + step * max(share, BEYOND)


def loads_at(cells: ContactSlices, guess: dict, force: float) -> np.ndarray:
    """(n,) line loads of cells out of those of other cells by pair, none below a share of the largest [N/m].

    They carry the force [N] together, at least, if they are fewer.
    """
    found = np.zeros(cells.low.size)
    for number, (axial, load) in guess.items():
        own = cells.number == number
        found[own] = np.interp(cells.middle[own], axial, load) if axial.size else 0.0
    least = LEAST * max(found.max(initial=0.0), max(load.max(initial=0.0) for _, load in guess.values()))
    found = np.maximum(found, least)
    return found * max(1.0, force / float(found @ (cells.high - cells.low)))
