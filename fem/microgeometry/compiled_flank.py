"""The material removed from a flank, in compiled code: a row of numbers for each modification.

Formulas are those of `fem.microgeometry.modification` and `deviation`, compiled. A modification without a formula in
`FORMULAS`, that of a user, is called back in Python, for an array of roll lengths at a time.
"""

from collections.abc import Callable
from ctypes import CFUNCTYPE, c_double, c_int64, c_void_p, cast
from math import inf
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from fem.microgeometry import modification
from fem.microgeometry.deviation import Grid, PitchDeviation, bilinear, of_tooth
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
from fem.support.numba_cache import unchecked

#: Formulas that change along the profile, then those that are constant along it, then that of a user's modification.
PROFILE_RELIEF, PROFILE_CROWNING, ROUNDED_EDGE, GRID = range(4)
LEAD_CROWNING, HELIX_SLOPE, END_RELIEF, PITCH, USERS = range(GRID + 1, GRID + 6)
FORMULAS: dict[type, int] = {
    TipRelief: PROFILE_RELIEF,
    RootRelief: PROFILE_RELIEF,
    ProfileCrowning: PROFILE_CROWNING,
    EdgeBreak: ROUNDED_EDGE,
    Grid: GRID,
    LeadCrowning: LEAD_CROWNING,
    HelixSlope: HELIX_SLOPE,
    EndRelief: END_RELIEF,
    PitchDeviation: PITCH,
}
#: What a row describes: the shape of the flank, the rounding of its tip edge, or the turn of the whole flank.
SHAPE, ROUNDING, TURN = range(3)
#: Numbers in a row: the first arguments of its formula.
NUMBERS = 4
#: A row: its formula and role, its numbers, and where its table begins in the table of all rows; of a user's
#: modification its number.
ROW = np.dtype([("formula", "i8"), ("role", "i8"), ("numbers", "f8", NUMBERS), ("first", "i8")])


class CompiledFlank(NamedTuple):
    """Modifications of a flank: rows (n,) of type ROW, table (m,) of all rows, and the function that users wrote."""

    rows: np.ndarray
    table: np.ndarray
    users: "UsersModifications"


def compiled_flank(flank: Flank, face: FlankExtent, first: int = 0) -> CompiledFlank:
    """The modifications of a flank as rows, whose tables begin at a position of a larger one."""
    rows, tables = np.zeros(len(flank), ROW), [np.zeros(0)]
    for i, (row, part) in enumerate(zip(rows, flank, strict=True)):
        formula, table = FORMULAS.get(type(part), USERS), np.zeros(0)
        numbers: tuple[float, ...] = ()
        if isinstance(part, PitchDeviation):
            numbers, table = (len(part.values),), np.array(part.values)
        elif isinstance(part, Grid):
            numbers, table = (len(part.roll), len(part.axial)), np.concatenate(part.arrays)
        elif formula != USERS:
            numbers = part.numbers(face)  # type: ignore[attr-defined]
        row["formula"], row["first"], row["numbers"][: len(numbers)] = (
            formula,
            i if formula == USERS else first,
            numbers,
        )
        row["role"] = TURN if formula == PITCH else ROUNDING if hasattr(part, "rounding") else SHAPE
        tables.append(table)
        first += table.size
    return CompiledFlank(rows, np.concatenate(tables), UsersModifications(flank, face))


class UsersModifications:
    """A C function that calls modifications in Python.

    An exception cannot pass through compiled code: the material is then infinite, and `error` holds the exception,
    which `fem.contact.mesh_geometry.PairGeometry.call` raises.
    """

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


def _users_code(typing_context, address, row, number, roll, axial, tooth, removed):
    """Call the function of `UsersModifications` at an address.

    The address is a number of the gear's record, so that pairs with and without such modifications run the same
    compiled code, which lies on disk; a function that numba is given as a global or an argument would be compiled in.
    """

    def code(context, builder, signature, arguments):
        integer, void = ir.IntType(64), ir.VoidType()
        kind = ir.FunctionType(void, [integer, integer, integer, ir.DoubleType(), integer, integer])
        builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])
        return context.get_dummy_value()

    integer = types.int64
    return types.void(integer, integer, integer, integer, types.float64, integer, integer), code


_call_users: Any = intrinsic(_users_code)
_relief, _rounded_edge = unchecked(modification.relief), unchecked(modification.rounded_edge)
_profile_crowning, _lead_crowning = unchecked(modification.profile_crowning), unchecked(modification.lead_crowning)
_helix_slope, _of_tooth, _bilinear = unchecked(modification.helix_slope), unchecked(of_tooth), unchecked(bilinear)


@unchecked
def _along_profile(row, table, roll, axial):
    """Material removed [m] by a row that changes along the profile, at a roll length."""
    formula, numbers = row.formula, row.numbers
    if formula == PROFILE_RELIEF:
        return _relief(numbers[0], numbers[1], numbers[2], numbers[3], roll)
    if formula == PROFILE_CROWNING:
        return _profile_crowning(numbers[0], numbers[1], numbers[2], roll)
    if formula == ROUNDED_EDGE:
        return _rounded_edge(numbers[0], numbers[1], numbers[2], roll)
    first, n, m = row.first, int(numbers[0]), int(numbers[1])
    values = table[first + n + m : first + n + m + n * m]
    return _bilinear(table[first : first + n], table[first + n : first + n + m], values, roll, axial)


@unchecked
def _across_face(row, table, axial, tooth):
    """Material removed [m] by a row that is constant along the profile."""
    formula, numbers = row.formula, row.numbers
    if formula == LEAD_CROWNING:
        return _lead_crowning(numbers[0], numbers[1], axial)
    if formula == HELIX_SLOPE:
        return _helix_slope(numbers[0], numbers[1], axial)
    if formula == END_RELIEF:
        return _relief(numbers[0], numbers[1], numbers[2], numbers[3], abs(axial))
    return _of_tooth(table[row.first : row.first + int(numbers[0])], tooth)


@unchecked
def turned(rows, table, tooth):
    """Material [m] that rows of the role TURN, which are constant on a tooth, remove from it."""
    material = 0.0
    for row in rows:
        if row.role == TURN:
            material += _across_face(row, table, 0.0, tooth)
    return material


class FlankSections(NamedTuple):
    """Sections of the flanks of a gear: numbers of the teeth, axial positions [m], shifts of roll lengths [m], (n,)."""

    tooth: np.ndarray
    axial: np.ndarray
    shift: np.ndarray


@unchecked
def add_removed(rows, table, extent, role, factor, sections, roll, removed):
    """Add the material [m] that rows of a role remove, times a factor, at roll lengths (n, m) of `FlankSections`.

    extent      roll_form and roll_tip [m]; address `users` of the function for their modifications

    Beyond root form and tip circle the values on these circles continue, as in `fem.microgeometry.flank.removed`.
    """
    n, m = roll.shape
    on_flank, material = np.empty((n, m)), np.empty(m)
    for i in range(n):
        for k in range(m):
            on_flank[i, k] = min(max(roll[i, k] + sections.shift[i], extent.roll_form), extent.roll_tip)
    for row in rows:
        if row.role != role:
            continue
        if row.formula == PROFILE_RELIEF:  # of most flanks: a loop of its own is a tenth of the time of a map
            amount, begin, length, power = row.numbers[0], row.numbers[1], row.numbers[2], row.numbers[3]
            for i in range(n):
                for k in range(m):
                    removed[i, k] += factor * _relief(amount, begin, length, power, on_flank[i, k])
            continue
        for i in range(n):
            axial, tooth = sections.axial[i], sections.tooth[i]
            if row.formula == USERS:
                _call_users(extent.users, row.first, m, on_flank[i].ctypes.data, axial, tooth, material.ctypes.data)
                for k in range(m):
                    removed[i, k] += factor * material[k]
            elif row.formula <= GRID:
                for k in range(m):
                    removed[i, k] += factor * _along_profile(row, table, on_flank[i, k], axial)
            else:
                constant = factor * _across_face(row, table, axial, tooth)
                for k in range(m):
                    removed[i, k] += constant
