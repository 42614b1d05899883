"""Bearings between shafts: the seat of such a bearing is a position on another shaft, coaxial with its own."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from exugear.gearbox.bearing import Bearing
from exugear.gearbox.drag import AnyDrag
from exugear.gearbox.gear_train import CLOSED
from exugear.gearbox.housing import Housing, Seat, bearing_on, seat_label, seat_number
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft import Shaft, parts_of, with_bearings
from exugear.gearbox.stage import Stage
from fem.support.validation import require, text_of

#: Distance of a seat from its bearing that is rounding [m].
NEAR = 1e-6


def checked_seats(
    between: Mapping[Seat, Seat],
    stages: Sequence[Stage],
    shafts: Mapping[str, Shaft],
    positions: Mapping[str, tuple[float, float]],
    housing: Housing | None,
) -> dict[Seat, Seat]:
    """The seats on shafts of a gearbox, with the positions of its bearings; ValueError for those that cannot be.

    positions   x, y of the shafts [m] by their names
    """
    pairs = isinstance(between, Mapping) and all(_is_seat(x) and _is_seat(y) for x, y in between.items())
    require(pairs, f"between must map ('idler', 10*mm) to ('main', 50*mm), got {text_of(between)}")
    seats: dict[Seat, Seat] = {}
    for (name, axial), (on, at) in between.items():
        unknown = [x for x in (name, on) if x not in shafts]
        require(not unknown, f"between: no shafts {unknown}; the shafts are {[*shafts]}")
        label, carrying = seat_label((name, axial)), seat_label((on, at))
        require(name != on, f"between: the bearing {label} would stand on its own shaft; name the other one")
        known = [x for x in shafts[name].bearings if abs(x - axial) < NEAR]
        listed = [seat_label((name, x)) for x in shafts[name].bearings]
        require(bool(known), f"between: no bearing is {label}; bearings of the shaft are {listed}")
        apart = float(np.hypot(*np.subtract(positions[name], positions[on])))
        away = f"between: shafts {name!r} and {on!r} lie {apart:.4g} m apart; a bearing between them needs one axis"
        require(apart < CLOSED * max(abs(stage.pair.a) for stage in stages), away)
        _check_kinds(stages, shafts, name, on)
        housed = seat_number(housing, name, known[0]) is not None
        require(not housed, f"between: the bearing {label} has a seat in the housing, too; name one of them")
        _check_node(shafts[on], at, carrying)
        seats[name, known[0]] = on, float(at)
    _check_carried(shafts, seats)
    return seats


def _is_seat(value: Any) -> bool:
    named = isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], str)
    return named and isinstance(value[1], int | float | np.floating) and bool(np.isfinite(value[1]))


def _check_kinds(stages: Sequence[Stage], shafts: Mapping[str, Shaft], name: str, on: str) -> None:
    """ValueError for shafts of planetary sets, whose axes orbit or whose frames turn."""
    of_sets = {shaft.name for stage in stages if stage.carrier for shaft in stage.shafts}
    members = [x for x in (name, on) if x in of_sets]
    require(not members, f"between: shafts {members} belong to planetary sets, where such bearings are not built")
    drags = [axial for axial, drag in shafts[name].drags if drag.needs_load]
    require(not drags, f"between: the BearingDrag of shaft {name!r} at {drags} m needs a load; pass load=... [N]")


def _check_node(shaft: Shaft, axial: float, label: str) -> None:
    """ValueError where an elastic shaft that carries a seat has no node there."""
    if shaft.sections:
        nodes = shaft.beam.axial
        none = f"between: shaft {shaft.name!r} has neither part nor end of a section {label}"
        require(bool(np.abs(nodes - axial).min() < NEAR), f"{none}; divide its section there")


def _check_carried(shafts: Mapping[str, Shaft], seats: Mapping[Seat, Seat]) -> None:
    """ValueError for shafts that carry one another in a circle, without a bearing in the housing or on ground."""
    carried = {name for name, shaft in shafts.items() if any((name, x) not in seats for x in shaft.bearings)}
    carried |= {name for name, shaft in shafts.items() if not shaft.bearings}
    for _ in shafts:
        carried |= {name for (name, _), (on, _) in seats.items() if on in carried}
    floating = sorted({*shafts} - carried)
    require(not floating, f"between: shafts {floating} carry one another alone; give one of them a bearing on ground")


def carrying_spin_factor(bearing: Bearing | RollingBearing) -> float:
    """Turns of the shaft in a bearing that turn its cage as much as a turn of the shaft that carries the seat.

    Elements roll on both rings: the cage turns by c phi + (1 - c) phi_carrying, c per turn of the shaft while the seat
    stands, which is c (phi + factor phi_carrying). 0 of bearings whose cage stands.
    """
    if not (isinstance(bearing, RollingBearing) and bearing.cage_rolls):
        return 0.0
    return 1 / bearing.rows[0].cage_ratio - 1


class DragBetween(NamedTuple):
    """A drag between two shafts, by name: of a bearing whose seat is on a shaft, or of a planet on its pin."""

    carried: str
    carrying: str
    drag: AnyDrag


def drags_between(between: Mapping[Seat, Seat], shafts: Mapping[str, Shaft]) -> tuple[DragBetween, ...]:
    """The drags of the bearings between shafts."""
    bearings = [(name, on, bearing_on(shafts, (name, axial))) for (name, axial), (on, _) in between.items()]
    return tuple(DragBetween(name, on, bearing.drag) for name, on, bearing in bearings if bearing.drag)


def drags_of_planets(planets: Mapping[str, Shaft], shafts: Mapping[str, Shaft]) -> tuple[DragBetween, ...]:
    """The drags of planets on the pins of their carriers; planets: carrier of each by its name."""
    drags = [(name, carrier.name, drag) for name, carrier in planets.items() for _, drag in shafts[name].drags]
    return tuple(DragBetween(*drag) for drag in drags)


def without_any_drag(shaft: Shaft) -> Shaft:
    """A shaft without drags among its parts and of its bearings."""
    if not shaft.drags:
        return shaft
    parts: dict[float, list] = {axial: [] for axial in shaft.parts}
    for axial, part in parts_of(without_drags(shaft, [*shaft.bearings])):
        parts[axial] += [part] * (not isinstance(part, AnyDrag))
    return replace(shaft, parts=parts)


def without_drags(shaft: Shaft, positions: Sequence[float]) -> Shaft:
    """A shaft whose bearings at axial positions [m] have no drag."""
    if not any(shaft.bearings[axial].drag for axial in positions):
        return shaft
    return with_bearings(shaft, lambda axial, x: replace(x, drag=None) if axial in positions else x)


def names_between(between: Mapping[Seat, Seat]) -> set[str]:
    """Names of the shafts with a bearing on another shaft, and of those that carry one."""
    return {name for pair in between.items() for name, _ in pair}
