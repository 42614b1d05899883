"""Position of the mesh on a ring between the bolts of its rim: the angles of a map, and the map over all pitches.

The ring angle is 2 pi p / |z| where tooth p of the ring touches at the pitch point at phase 0, and grows by a pitch
with each pitch of the phase. It changes slowly: a map holds states at some angles over the period of the support, and a
periodic cubic spline gives those between.
"""

from math import gcd, pi

import numpy as np
import xarray as xr

from fem.gear.gear import Gear
from fem.gear.rim_support import Bolts, period
from fem.microgeometry.flank import names_teeth
from fem.pair.pair import GearPair
from fem.ste.ste_map import (
    CENTROID,
    LOAD_SHARE,
    PAIR,
    PHASE,
    RING_ANGLE,
    ROUNDING,
    STIFFNESS,
    TE,
    UNLOADED_RIGHT,
    check,
    check_whole_cycle,
    pair_of,
    periodic_spline,
)
from fem.support.arguments import checked
from fem.support.intervals import interval_of
from fem.support.validation import increasing, numbers, require
from fem.units import deg

#: Angles over the distance of two bolts: on rims as thick as this [modules] or thicker, and on thinner ones. Between
#: them the mean of te over the mesh cycle is within 0.3 %, its peak to peak within 1.5 % (rims of 2.25, 3 and 5
#: modules on twelve stiff bolts).
THICK, ANGLES_OF_THICK, ANGLES_OF_THIN = 4.0, 8, 12
#: Variables that may have both signs, or vary smoothly: a periodic cubic spline gives them between the angles.
SIGNED = TE, STIFFNESS, CENTROID, UNLOADED_RIGHT
#: Largest distance of angles in a map that becomes one over all pitches, as a share of the period.
LARGEST_GAP = 1 / 4


def checked_ring_angles(pair: GearPair, ring_angles) -> tuple[np.ndarray, bool]:
    """Ring angles (n,) of a map [rad], and whether they are an axis of it.

    ring_angles     number of angles over the period of the support, or increasing values; None: as many as needed
    """
    turn = period(pair.wheel.support)
    if turn is None or counts_pitches(pair):
        even = "the rim of the wheel is clamped, or its support is even" if turn is None else "its teeth differ"
        require(ring_angles is None, f"ring_angles belong to a ring on bolts, but {even}; leave them out")
        return np.zeros(1), False
    values = numbers("ring_angles", number_of_angles(pair.wheel) if ring_angles is None else ring_angles)
    if values.ndim == 0:
        whole = f"ring_angles must be a whole number in [4, 10000], or a list of values [rad], got {ring_angles}"
        require(bool(4 <= values <= 10_000 and values % 1 == 0), whole)
        return turn * np.arange(int(values)) / int(values), True
    within = f"ring_angles must increase over less than the period of the support, {turn / deg:.6g} deg (pass radians)"
    rising = bool(increasing("ring_angles", values)[-1] - values[0] < turn - ROUNDING)
    require(rising and bool(np.isfinite(values).all()), f"{within}, got {ring_angles}")
    return values, True


def number_of_angles(ring: Gear) -> int:
    """Number of ring angles of a map by default: more the thinner the rim, and for each bolt in the period."""
    rim = (abs(ring.r_clamp) - abs(ring.r_f)) / ring.m_n
    bolts = min(len(support.angles) for support in ring.support if isinstance(support, Bolts))
    in_period = max(1, round(bolts * (period(ring.support) or 0.0) / (2 * pi)))
    return (ANGLES_OF_THICK if rim >= THICK else ANGLES_OF_THIN) * in_period


def counts_pitches(pair: GearPair) -> bool:
    """Whether teeth differ: the phase counts all pitches, and the ring angle follows from it."""
    return names_teeth((*pair.pinion.drive_flank, *pair.wheel.drive_flank))


def softest(ring: Gear, angles: np.ndarray) -> int:
    """Number of the angle (n,) furthest from all bolts, where a ring is about softest."""
    bolts = [angle for support in ring.support if isinstance(support, Bolts) for angle in support.angles]
    apart = np.abs((np.subtract.outer(angles, bolts) + pi) % (2 * pi) - pi)
    return int(np.argmax(apart.min(axis=1, initial=pi)))


@checked
def over_pitches(ste: xr.Dataset) -> xr.Dataset:
    """A map over `ring_angle` as one over the phases of all pitches in the period of the ring's support.

    At phase p, counted from where tooth 0 of the ring touches at the pitch point, the ring angle is 2 pi p / |z|;
    values between the angles are those of a periodic cubic spline. The result has the form of a map of teeth that
    differ: its phases run over `pitches` pitches, after which it repeats, and what tooth pair k is at a phase, tooth
    pair k - 1 is a pitch later. Its contact ratios are means over the angles.

    ste     map of a ring on `fem.Bolts` with 4 angles or more, none further apart than a quarter of the period

    Raises ValueError for a map without the axis, and for angles that leave larger gaps.
    """
    pair, data = pair_of(ste), check_whole_cycle(check(ste))
    require(
        RING_ANGLE in data[TE].dims, f"ste must have the axis {RING_ANGLE}, got {data[TE].dims}; map a ring on bolts"
    )
    turn, z = period(pair.wheel.support) or 0.0, abs(pair.wheel.z)
    require(turn > 0, "ste must be the map of a ring on fem.Bolts, got one whose support is even")
    angle = data[RING_ANGLE].values
    gap = float(np.diff(angle, append=angle[0] + turn).max())
    dense = (
        f"ring_angle must cover the period of the support, {turn / deg:.6g} deg, without gaps of more than a quarter"
    )
    require(
        gap <= LARGEST_GAP * turn + ROUNDING, f"{dense}, got one of {gap / deg:.6g} deg; keep all angles of the map"
    )
    pitches = z // gcd(z, round(2 * pi / turn))
    phase = data[PHASE].values
    at = (2 * pi / z * (np.arange(pitches)[:, None] + phase) - angle[0]) / turn
    shares = (angle - angle[0]) / turn
    variables = {}
    for name, values in data.items():
        if PHASE in values.dims and RING_ANGLE in values.dims:
            variables[name] = _over_pitches(values, shares, at)
        elif RING_ANGLE in values.dims:
            variables[name] = values.mean(RING_ANGLE, keep_attrs=True)
        else:
            variables[name] = values
    if "pairs_in_contact" in variables:
        loaded = (variables[LOAD_SHARE] > 0).sum(PAIR).assign_attrs(data["pairs_in_contact"].attrs)
        variables["pairs_in_contact"] = loaded
    variables[TE].attrs = data[TE].attrs
    result = xr.Dataset(variables, attrs=data.attrs | {"pitches": pitches})
    for name in result.coords:
        result[name].attrs = data[name].attrs
    return result


def _over_pitches(values: xr.DataArray, angles: np.ndarray, at: np.ndarray) -> xr.DataArray:
    """A variable over the phases of all pitches.

    angles      (n_angle,) ring angles of its values, as shares of the period from the first one on
    at          (pitches, n_phase) the same of the phases

    A periodic cubic spline over the angles; of what cannot be < 0 straight lines.
    """
    further = [name for name in values.dims if name not in (RING_ANGLE, PHASE)]
    table = values.transpose(RING_ANGLE, PHASE, *further).values
    if values.name in SIGNED:
        columns = [periodic_spline(angles, table[:, i])(at[:, i] % 1.0) for i in range(at.shape[1])]
    else:
        columns = [_on_lines(angles, table[:, i], at[:, i] % 1.0) for i in range(at.shape[1])]
    over = np.stack(columns, axis=1)
    pitches, n_phase = at.shape
    phase = np.arange(pitches)[:, None] + values[PHASE].values
    coords = {name: values[name] for name in further if name != PAIR} | {PHASE: phase.ravel()}
    if PAIR in further:
        row = further.index(PAIR) + 2
        first, count = int(values[PAIR].values[0]), values.sizes[PAIR]
        spread = np.zeros((*over.shape[:row], count + pitches - 1, *over.shape[row + 1 :]))
        for pitch in range(pitches):
            rows = np.arange(count) + pitches - 1 - pitch
            np.moveaxis(spread[pitch], row - 1, 0)[rows] = np.moveaxis(over[pitch], row - 1, 0)
        over = spread
        coords[PAIR] = np.arange(over.shape[row]) + first - (pitches - 1)
    over = over.reshape(pitches * n_phase, *over.shape[2:])
    order = [name for name in values.dims if name != RING_ANGLE]
    result = xr.DataArray(over, coords, [PHASE, *further], attrs=values.attrs, name=values.name)
    return result.transpose(*order)


def _on_lines(angles: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(n, ...) values (n_angle, ...) at shares (n,) of the period, by straight lines."""
    closed, edges = np.concatenate([values, values[:1]]), np.append(angles, 1.0)
    row = interval_of(edges, at)
    share = ((at - edges[row]) / (edges[row + 1] - edges[row])).reshape(-1, *[1] * (values.ndim - 1))
    return (1 - share) * closed[row] + share * closed[row + 1]
