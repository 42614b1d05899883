"""Two gears at one mesh position as compiled code takes them: records of numbers for position and gears."""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, tan
from typing import Any, NamedTuple

import numpy as np
from numba import from_dtype, types

from fem.gear.gear import Gear
from fem.microgeometry.compiled_flank import ROW, CompiledFlank, UsersModifications, compiled_flank
from fem.microgeometry.flank import rounding
from fem.pair.hertz import flattening
from fem.pair.mesh_position import MeshPosition
from fem.pair.path_of_contact import PathOfContact

#: Working centre distance [m] and transverse pressure angle [rad], cosine and tangent of the base helix angle, roll
#: length of the pinion at the pitch point [m], length of the line of action between the base circles [m], position in
#: the mesh cycle, base pitch [m], module [m], flattening of both flanks (`fem.pair.hertz.flattening`) [m^2/N], roll
#: length of the pinion from which on the wheel is the host [m].
POSITION = np.dtype(
    [(name, "f8") for name in ("a", "alpha", "inclined", "slope", "pitch", "length", "phase", "p_bt", "m_n")]
    + [("flattening", "f8"), ("modified", "i8"), ("host_changes_at", "f8")]
)
#: Base radius, roll lengths at root form and tip circle and where the tip edge begins, radius to which this is rounded,
#: axial position of mid-plane [m]; key of the user's modifications; flattening of the flank [m^2/N].
GEAR = np.dtype(
    [(name, "f8") for name in ("r_b", "roll_form", "roll_tip", "edge", "rounding", "axial", "flattening")]
    + [("users", "i8")]
)


class PairRecords(NamedTuple):
    """Two gears at one mesh position.

    position            record of type POSITION
    gears               (2,) records of type GEAR: pinion and wheel
    pinion, wheel       rows of `fem.microgeometry.compiled_flank.ROW`, and the table of both
    """

    position: Any
    gears: np.ndarray
    pinion: np.ndarray
    wheel: np.ndarray
    table: np.ndarray


#: Numba's type of two gears at a mesh position.
PAIR_RECORDS = types.NamedTuple(
    (from_dtype(POSITION), from_dtype(GEAR)[::1], from_dtype(ROW)[::1], from_dtype(ROW)[::1], types.float64[::1]),
    PairRecords,
)


@dataclass(frozen=True)
class PairGeometry:
    """Geometry of two gears at one mesh position, with the modifications that users wrote."""

    geometry: PairRecords
    users: tuple[UsersModifications, UsersModifications]

    def call(self, function: Callable, *arguments):
        """Result of a compiled function of the geometry."""
        return function(self.geometry, *arguments)


def pair_geometry(position: MeshPosition) -> PairGeometry:
    """The two gears at a mesh position."""
    pair, path = position.pair, position.path
    gears = pair.pinion, pair.wheel
    pinion = compiled_flank(gears[0].drive_flank, gears[0].face)
    wheel = compiled_flank(gears[1].drive_flank, gears[1].face, pinion.table.size)
    of_gears = zip(gears, (0.0, position.axial), (pinion, wheel), strict=True)
    records = np.array([_record(*of_gear) for of_gear in of_gears], GEAR)
    numbers = position.a, position.alpha, cos(pair.beta_b), tan(pair.beta_b), path.pitch, path.length, position.phase
    further = pair.p_bt, pair.pinion.m_n, records["flattening"].sum(), any(gear.drive_flank for gear in gears)
    table = np.concatenate([pinion.table, wheel.table])
    at = np.array([(*numbers, *further, host_changes_at(path))], POSITION)[0]
    return PairGeometry(PairRecords(at, records, pinion.rows, wheel.rows, table), (pinion.users, wheel.users))


def host_changes_at(path: PathOfContact) -> float:
    """Roll length of the pinion from which on the wheel carries the strips [m]: at the pitch point.

    That of a ring may lie outside the path of contact, or at its end: the host changes in the middle half of the path,
    far from the tips of both gears.
    """
    quarter = (path.end - path.start) / 4
    return min(max(path.pitch, path.start + quarter), path.end - quarter)


def _record(gear: Gear, axial: float, flank: CompiledFlank) -> tuple:
    """A gear as a record of type GEAR."""
    rolls = gear.roll_form, gear.roll_tip, *rounding(gear.drive_flank, gear.face)
    return gear.r_b, *rolls, axial, flattening(gear.material), flank.users.key
