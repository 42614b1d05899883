"""The modifications of a flank for compiled code: a row of numbers for each.

A modification that a user writes is called back in Python, for an array of roll lengths at a time.
"""

from collections.abc import Callable
from ctypes import CFUNCTYPE, c_double, c_int64, c_void_p, cast
from functools import singledispatch
from math import inf
from typing import NamedTuple

import numpy as np

from fem.microgeometry.deviation import Grid, PitchDeviation
from fem.microgeometry.flank import Flank
from fem.microgeometry.modification import (
    EdgeBreak,
    EndRelief,
    FlankExtent,
    HelixSlope,
    LeadCrowning,
    ProfileCrowning,
    RootRelief,
    TipRelief,
)

#: Formulas of rows that change along the profile; of rows that are constant along it; of modifications in Python.
PROFILE_RELIEF, PROFILE_CROWNING, EDGE_BREAK, GRID = range(4)
LEAD_CROWNING, HELIX_SLOPE, END_RELIEF, PITCH, USERS = range(GRID + 1, GRID + 6)
#: What a row describes: the shape of the flank, the rounding of its tip edge, or the turn of the whole flank.
SHAPE, ROUNDING, TURN = range(3)
#: Numbers in a row; what they are depends on the formula.
NUMBERS = 4
#: A row: its formula and role, its lengths and amounts, and where its table begins in the table of all rows;
#: of a user's modification its number.
ROW = np.dtype([("formula", "i8"), ("role", "i8"), ("numbers", "f8", NUMBERS), ("first", "i8")])


class CompiledFlank(NamedTuple):
    """Modifications of a flank: rows (n,) of type ROW, table (m,) of all rows, and the function that users wrote."""

    rows: np.ndarray
    table: np.ndarray
    users: "UsersModifications"


class Row(NamedTuple):
    """A modification as a row of `CompiledFlank`."""

    formula: int
    numbers: tuple[float, ...] = ()
    table: np.ndarray = np.zeros(0)
    role: int = SHAPE


@singledispatch
def row_of(part, face: FlankExtent) -> Row:
    """Row of a modification, that of a user's unless it is registered here."""
    return Row(USERS, role=ROUNDING if hasattr(part, "rounding") else SHAPE)


@row_of.register
def _(part: TipRelief, face: FlankExtent) -> Row:
    length = part.reach(face)
    return Row(PROFILE_RELIEF, (part.C_a, face.roll_tip - length, length, part.power))


@row_of.register
def _(part: RootRelief, face: FlankExtent) -> Row:
    length = part.reach(face)
    return Row(PROFILE_RELIEF, (part.C_f, face.roll_form + length, -length, part.power))


@row_of.register
def _(part: EdgeBreak, face: FlankExtent) -> Row:
    return Row(EDGE_BREAK, part.rounding(face), role=ROUNDING)


@row_of.register
def _(part: ProfileCrowning, face: FlankExtent) -> Row:
    middle, half = (face.roll_tip + face.roll_form) / 2, (face.roll_tip - face.roll_form) / 2
    return Row(PROFILE_CROWNING, (part.C_alpha, middle, half))


@row_of.register
def _(part: LeadCrowning, face: FlankExtent) -> Row:
    return Row(LEAD_CROWNING, (part.C_beta, face.width))


@row_of.register
def _(part: HelixSlope, face: FlankExtent) -> Row:
    return Row(HELIX_SLOPE, (part.C_Hbeta, face.width))


@row_of.register
def _(part: EndRelief, face: FlankExtent) -> Row:
    return Row(END_RELIEF, (part.C_e, face.width / 2 - part.length, part.length, part.power))


@row_of.register
def _(part: PitchDeviation, face: FlankExtent) -> Row:
    return Row(PITCH, (float(len(part.values)),), np.array(part.values), TURN)


@row_of.register
def _(part: Grid, face: FlankExtent) -> Row:
    sizes = float(len(part.roll)), float(len(part.axial))
    return Row(GRID, sizes, np.concatenate([part.roll, part.axial, np.ravel(part.values)]))


def compiled_flank(flank: Flank, face: FlankExtent, first: int = 0) -> CompiledFlank:
    """The modifications of a flank as rows, whose tables begin at a position of a larger one."""
    rows, tables = np.zeros(len(flank), ROW), [np.zeros(0)]
    for i, (line, row) in enumerate(zip(rows, (row_of(part, face) for part in flank), strict=True)):
        line["formula"], line["role"], line["first"] = row.formula, row.role, i if row.formula == USERS else first
        line["numbers"][: len(row.numbers)] = row.numbers
        tables.append(row.table)
        first += row.table.size
    return CompiledFlank(rows, np.concatenate(tables), UsersModifications(flank, face))


class UsersModifications:
    """A C function that calls modifications in Python; `error` is the exception of the last call."""

    def __init__(self, flank: Flank, face: FlankExtent):
        self.flank, self.face = flank, face
        self.error: Exception | None = None
        self.function = REMOVED_BY(self._removed)

    @property
    def address(self) -> int:
        """Address of the function."""
        return cast(self.function, c_void_p).value or 0

    def _removed(self, row: int, number: int, roll: int, axial: float, tooth: int, removed: int) -> None:
        """Write the material removed by a row at roll lengths; arrays of `number` values by their addresses."""
        rolls, material = (np.frombuffer(memoryview((c_double * number).from_address(at))) for at in (roll, removed))
        try:
            material[:] = self.flank[row].removed(self.face._replace(tooth=tooth), rolls, np.array(axial))
        except Exception as error:
            self.error, material[:] = error, inf


REMOVED_BY: Callable = CFUNCTYPE(None, c_int64, c_int64, c_int64, c_double, c_int64, c_int64)
