"""The material removed from a flank, in compiled code: a row of numbers for each modification.

Formulas are those of `fem.microgeometry.modification` and `deviation`, compiled. A modification without a formula in
`FORMULAS`, that of a user, is called back in Python, for an array of roll lengths at a time.
"""

from itertools import count
from typing import Any, NamedTuple
from weakref import WeakValueDictionary

import numpy as np
from numba import objmode

from fem.microgeometry import modification
from fem.microgeometry.deviation import (
    Crack,
    Grid,
    OnTooth,
    PitchDeviation,
    Spall,
    Waviness,
    bilinear,
    lever_of,
    of_tooth,
    waviness,
)
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
PROFILE_RELIEF, PROFILE_CROWNING, ROUNDED_EDGE, WAVINESS, GRID = range(5)
LEAD_CROWNING, HELIX_SLOPE, END_RELIEF, PITCH, CRACK, USERS = range(GRID + 1, GRID + 7)
FORMULAS: dict[type, int] = {
    TipRelief: PROFILE_RELIEF,
    RootRelief: PROFILE_RELIEF,
    ProfileCrowning: PROFILE_CROWNING,
    EdgeBreak: ROUNDED_EDGE,
    Grid: GRID,
    Waviness: WAVINESS,
    LeadCrowning: LEAD_CROWNING,
    HelixSlope: HELIX_SLOPE,
    EndRelief: END_RELIEF,
    PitchDeviation: PITCH,
    Crack: CRACK,
}
#: What a row describes: the shape of the flank, the rounding of its tip edge, the turn of the whole flank, or a hinge
#: in the root of the tooth.
SHAPE, ROUNDING, TURN, HINGE = range(4)
#: Numbers in a row: the first arguments of its formula.
NUMBERS = 6
#: A row: its formula and role, its numbers, and where its table begins in the table of all rows; of a user's
#: modification its number; the tooth that it is of, and the number of teeth, 0: of all teeth.
ROW = np.dtype(
    [("formula", "i8"), ("role", "i8"), ("numbers", "f8", NUMBERS), ("first", "i8"), ("tooth", "i8"), ("teeth", "i8")]
)


class CompiledFlank(NamedTuple):
    """Modifications of a flank: rows (n,) of type ROW, table (m,) of all rows, and what users wrote."""

    rows: np.ndarray
    table: np.ndarray
    users: "UsersModifications"


def compiled_flank(flank: Flank, face: FlankExtent, first: int = 0) -> CompiledFlank:
    """The modifications of a flank as rows, whose tables begin at a position of a larger one."""
    listed: list[tuple[Any, int | None]] = [(part, None) for part in flank if not isinstance(part, OnTooth)]
    listed += [(part, of.tooth) for of in flank if isinstance(of, OnTooth) for part in of.flank]
    parts = [(part.grid(face) if isinstance(part, Spall) else part, tooth) for part, tooth in listed]
    rows, tables = np.zeros(len(parts), ROW), [np.zeros(0)]
    for i, (row, (part, tooth)) in enumerate(zip(rows, parts, strict=True)):
        formula, table = FORMULAS.get(type(part), USERS), np.zeros(0)
        if tooth is not None:
            row["teeth"], row["tooth"] = abs(face.z), tooth % abs(face.z)
        numbers: tuple[float, ...] = ()
        if isinstance(part, PitchDeviation):
            numbers, table = (len(part.values),), np.array(part.values)
        elif isinstance(part, Grid):
            numbers, table = (len(part.roll), len(part.axial)), np.concatenate(part.arrays)
        elif formula != USERS:
            numbers = part.numbers(face)
        row["formula"], row["first"], row["numbers"][: len(numbers)] = (
            formula,
            i if formula == USERS else first,
            numbers,
        )
        row["role"] = TURN if formula == PITCH else ROUNDING if hasattr(part, "rounding") else SHAPE
        if formula == CRACK:
            row["role"] = HINGE
        tables.append(table)
        first += table.size
    return CompiledFlank(rows, np.concatenate(tables), UsersModifications(tuple(part for part, _ in parts), face))


class UsersModifications:
    """A flank whose modifications compiled code calls back in Python, as long as this object lives, by its `key`."""

    def __init__(self, flank: Flank, face: FlankExtent):
        self.flank, self.face, self.key = flank, face, next(KEYS)
        CALLED_BACK[self.key] = self


KEYS = count()
CALLED_BACK: WeakValueDictionary[int, UsersModifications] = WeakValueDictionary()


def _removed_in_python(key: int, row: int, roll: np.ndarray, axial: float, tooth: int) -> np.ndarray:
    """(m,) material removed [m] by a modification at roll lengths (m,)."""
    users = CALLED_BACK[key]
    material = users.flank[row].removed(users.face._replace(tooth=tooth), roll.copy(), np.array(axial))
    return np.array(np.broadcast_to(material, roll.shape), float)


@unchecked
def _removed_by_user(key, row, roll, axial, tooth):
    """The same from compiled code; what the modification raises reaches the caller."""
    with objmode(material="float64[::1]"):
        material = _removed_in_python(key, row, roll, axial, tooth)
    return material  # noqa: RET504 (no return out of the block)


_relief, _rounded_edge = unchecked(modification.relief), unchecked(modification.rounded_edge)
_profile_crowning, _lead_crowning = unchecked(modification.profile_crowning), unchecked(modification.lead_crowning)
_helix_slope, _of_tooth, _bilinear = unchecked(modification.helix_slope), unchecked(of_tooth), unchecked(bilinear)
_waviness, lever = unchecked(waviness), unchecked(lever_of)


@unchecked
def is_of(row, tooth):
    """Whether a row is of a tooth."""
    return row.teeth == 0 or tooth % row.teeth == row.tooth


@unchecked
def _along_profile(row, table, roll, axial, tooth):
    """Material removed [m] by a row that changes along the profile, at a roll length of a tooth."""
    formula, numbers = row.formula, row.numbers
    if formula == WAVINESS:
        values = numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5]
        return _waviness(values, roll, axial, tooth)
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

    extent      roll_form and roll_tip [m]; key `users` of `UsersModifications`

    Beyond root form and tip circle the values on these circles continue, as in `fem.microgeometry.flank.removed`.
    """
    n, m = roll.shape
    on_flank = np.empty((n, m))
    for i in range(n):
        for k in range(m):
            on_flank[i, k] = min(max(roll[i, k] + sections.shift[i], extent.roll_form), extent.roll_tip)
    for row in rows:
        if row.role != role:
            continue
        if (
            row.formula == PROFILE_RELIEF and row.teeth == 0
        ):  # of most flanks: a loop of its own is a tenth of the time of a map
            amount, begin, length, power = row.numbers[0], row.numbers[1], row.numbers[2], row.numbers[3]
            for i in range(n):
                for k in range(m):
                    removed[i, k] += factor * _relief(amount, begin, length, power, on_flank[i, k])
            continue
        for i in range(n):
            axial, tooth = sections.axial[i], sections.tooth[i]
            if not is_of(row, tooth):
                continue
            if row.formula == USERS:
                material = _removed_by_user(extent.users, row.first, on_flank[i], axial, tooth)
                for k in range(m):
                    removed[i, k] += factor * material[k]
            elif row.formula <= GRID:
                for k in range(m):
                    removed[i, k] += factor * _along_profile(row, table, on_flank[i, k], axial, tooth)
            else:
                constant = factor * _across_face(row, table, axial, tooth)
                for k in range(m):
                    removed[i, k] += constant
