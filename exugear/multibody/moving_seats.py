"""Bearings on seats that move: those of a housing with coordinates of its own, and positions on other shafts.

One object in Exudyn has the matrices of the housing and of these bearings over the coordinates of all shafts involved
and of the housing. Bearings act on the motion of the shaft against its seat; a compiled kernel evaluates nonlinear ones
(`exugear.multibody.elastic_shafts`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from exugear.gearbox.bearing import Bearing
from exugear.gearbox.bearing_law import linear_part
from exugear.gearbox.elastic_housing import ElasticHousing
from exugear.gearbox.elastic_shaft import rigid_motion
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.housing import PER_SEAT, Seat, bearing_on, seat_label, seat_number
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.seats_on_shafts import carrying_spin_factor
from exugear.gearbox.shaft import Shaft
from exugear.multibody.elastic_shafts import BuiltShaft, CageSpin, add_matrices, further_node, nonlinear_bearings
from exugear.multibody.exudyn_objects import node_of
from exugear.multibody.recorder import BodyRecorder
from exugear.planning.plan import Plan
from fem.support.validation import require


@dataclass(frozen=True, eq=False)
class BuiltSeat:
    """A bearing on a seat that moves.

    seat       name of the shaft and axial position of the bearing [m]
    bearing    between them
    rows       (6, k) motion of the shaft against its seat by the coordinates of the object
    """

    seat: Seat
    bearing: Bearing | RollingBearing
    rows: np.ndarray


@dataclass(frozen=True, eq=False)
class MovingSeats:
    """The bearings on moving seats in a built system, and the housing.

    seats        the bearings
    housing      the housing with its coordinates, if any
    number       of the object with the matrices
    recorder     samples of the coordinates of the housing and their rates
    indices      (k,) of the coordinates of the object among those of the system, those of the housing last
    """

    seats: tuple[BuiltSeat, ...]
    housing: ElasticHousing | None
    number: int
    recorder: BodyRecorder
    indices: np.ndarray

    @property
    def of_housing(self) -> np.ndarray:
        """(m,) indices of the coordinates of the housing."""
        return self.indices[self.indices.size - (self.housing.size if self.housing else 0) :]

    def motion(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """(number, m) first recorded coordinates of the housing and their rates."""
        if self.housing is None:
            return np.zeros((number, 0)), np.zeros((number, 0))
        motion, rates = (self.recorder[name][:number].astype(float) for name in self.recorder.names)
        return motion, rates


class SeatMotion(NamedTuple):
    """Motion of a seat (n, 6) [m, rad] and its rate."""

    q: np.ndarray
    q_t: np.ndarray


def moving_seats(gearbox: Gearbox, scene: Plan) -> list[Seat]:
    """Bearings of a gearbox whose seats move in a run by a plan, beside those that static stiffness lets yield.

    ValueError for a cage that rolls on a shaft that only spins, whose turns the kernels do not count.
    """
    moves = {name for name, kind in scene.shafts.items() if kind.on_bearings}
    for seat, (on, _) in gearbox.between.items():
        follows = on in moves or on in gearbox.held or not carrying_spin_factor(bearing_on(gearbox.ends, seat))
        rolls = f"between: the cage of the bearing {seat_label(seat)} rolls on shaft {on!r}, too, which only spins"
        require(follows or seat[0] not in moves, f"{rolls}; give {on!r} bearings, or leave rolling() out")
    on_shafts = [seat for seat, (on, _) in gearbox.between.items() if seat[0] in moves and on in moves]
    if scene.elastic_housing is None:
        return on_shafts
    in_housing = [
        (shaft.name, axial)
        for shaft in gearbox.shafts
        for axial in shaft.bearings
        if shaft.name in moves and seat_number(gearbox.housing, shaft.name, axial) is not None
    ]
    return [*in_housing, *on_shafts]


def positions_on(seats: Sequence[Seat], shaft: Shaft) -> list[float]:
    """Axial positions [m] of the bearings of a shaft among seats."""
    return [axial for name, axial in seats if name == shaft.name]


def add_moving_seats(
    mbs, gearbox: Gearbox, scene: Plan, bodies: Mapping[str, int], elastics: Mapping[str, BuiltShaft]
) -> MovingSeats | None:
    """Add housing and bearings on moving seats, if there are any."""
    listed = moving_seats(gearbox, scene)
    if not listed:
        return None
    outer_shafts = [gearbox.between[seat][0] for seat in listed if seat in gearbox.between]
    nodes: list[int] = []
    first, n = {}, 0
    for name in dict.fromkeys([*(name for name, _ in listed), *outer_shafts]):
        first[name] = n
        if name in elastics:
            nodes += mbs.GetObject(elastics[name].number)["nodeNumbers"]
            n += elastics[name].elastic.size
        else:
            nodes.append(node_of(mbs, bodies[name]))
            n += len(scene.shafts[name].components)
    housing = scene.elastic_housing
    m = housing.size if housing else 0
    if housing:
        nodes.append(further_node(mbs, "housing shapes", m))
    seats = []
    for name, axial in listed:
        rows = np.zeros((PER_SEAT, n + m))
        _add_at(rows, first[name], _motion_at(gearbox.ends[name], axial, scene))
        if (name, axial) in gearbox.between:
            on, at = gearbox.between[name, axial]
            _add_at(rows, first[on], -_motion_at(gearbox.ends[on], at, scene))
        else:
            _add_at(rows, n, -_at_seat(gearbox, housing, (name, axial)))
        seats.append(BuiltSeat((name, axial), bearing_on(gearbox.ends, (name, axial)), rows))
    matrices = np.zeros((3, n + m, n + m))
    if housing:
        matrices[:, n:, n:] = housing.mass, housing.stiffness, housing.damping
    for seat in seats:
        k = seat.rows.T @ linear_part(seat.bearing, 0.0) @ seat.rows
        matrices[1:] += k, seat.bearing.damping_time * k
    spins = {name: at + _spin_of(name, scene) for name, at in first.items()}
    nonlinear = nonlinear_bearings([(x.rows, x.bearing, _cage_spin(gearbox, x, spins)) for x in seats])
    recorder, measuring = BodyRecorder(("amplitudes", "rates"), vector_size=m), np.eye(n + m)[n:]
    mass, stiffness, damping = matrices
    of_object = mass, stiffness, damping, None
    number = add_matrices(mbs, "moving seats", nodes, of_object, (0, measuring), recorder, nonlinear=nonlinear)
    return MovingSeats(tuple(seats), housing, number, recorder, np.zeros(0, int))


def located_seats(mbs, built: MovingSeats | None) -> MovingSeats | None:
    """The seats with the indices of their coordinates in the assembled system."""
    if built is None:
        return None
    return replace(built, indices=np.array(mbs.systemData.GetObjectLTGODE2(built.number), int))


def motions_of_seats(
    gearbox: Gearbox,
    scene: Plan,
    built: MovingSeats | None,
    motions: Mapping[str, tuple[Shaft, np.ndarray, np.ndarray]],
    of_housing: tuple[np.ndarray, np.ndarray],
) -> dict[Seat, SeatMotion]:
    """Motion of all moving seats; motions: of the shafts, as in `motions_on_bearings`; of_housing: (n, m) and rates."""
    seats = {}
    for name, axial in [] if built is None else [x.seat for x in built.seats]:
        if (name, axial) in gearbox.between:
            on, at = gearbox.between[name, axial]
            shaft, *moved = motions[on]
            elastic = scene.elastic.get(on)
            rows = elastic.motion_at(at) if elastic else rigid_motion(at - shaft.centre)[:, : moved[0].shape[1]]
        else:
            rows, moved = _at_seat(gearbox, scene.elastic_housing, (name, axial)), [*of_housing]
        seats[name, axial] = SeatMotion(*(x @ rows.T for x in moved))
    return seats


def _motion_at(shaft: Shaft, axial: float, scene: Plan) -> np.ndarray:
    """(6, m) motion of a shaft at an axial position by its coordinates in the system."""
    if elastic := scene.elastic.get(shaft.name):
        return elastic.at_bearing(axial)
    return rigid_motion(axial - shaft.centre)[:, scene.shafts[shaft.name].components]


def _spin_of(name: str, scene: Plan) -> int:
    """Index of the spin of a shaft among its coordinates."""
    elastic = scene.elastic.get(name)
    return int(elastic.turning[0]) if elastic else scene.shafts[name].spin_index


def _cage_spin(gearbox: Gearbox, seat: BuiltSeat, spins: Mapping[str, int]) -> CageSpin:
    """The spin of the cage of a bearing; spins: indices of those of the shafts."""
    spin = spins[seat.seat[0]]
    if seat.seat not in gearbox.between:
        return CageSpin(spin, spin, 0.0)
    return CageSpin(spin, spins[gearbox.between[seat.seat][0]], carrying_spin_factor(seat.bearing))


def _at_seat(gearbox: Gearbox, housing: ElasticHousing | None, seat: Seat) -> np.ndarray:
    """(6, m) motion of a seat by the coordinates of the housing."""
    number = seat_number(gearbox.housing, *seat)
    if housing is None or number is None:
        raise LookupError(f"{seat} is no seat of a housing with coordinates")
    return housing.at_seats[PER_SEAT * number : PER_SEAT * (number + 1)]


def _add_at(rows: np.ndarray, first: int, part: np.ndarray) -> None:
    rows[:, first : first + part.shape[1]] += part
