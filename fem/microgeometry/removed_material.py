"""The material removed from a flank, by compiled code, from the rows of its modifications."""

from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from fem.microgeometry.compiled_flank import (
    EDGE_BREAK,
    END_RELIEF,
    GRID,
    HELIX_SLOPE,
    LEAD_CROWNING,
    PROFILE_CROWNING,
    PROFILE_RELIEF,
    TURN,
    USERS,
)
from fem.support.numba_cache import unchecked


def _users_code(typing_context, address, row, number, roll, axial, tooth, removed):
    """Call the function of `UsersModifications` at an address."""

    def code(context, builder, signature, arguments):
        integer, void = ir.IntType(64), ir.VoidType()
        kind = ir.FunctionType(void, [integer, integer, integer, ir.DoubleType(), integer, integer])
        builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])
        return context.get_dummy_value()

    integer = types.int64
    return types.void(integer, integer, integer, integer, types.float64, integer, integer), code


_call_users: Any = intrinsic(_users_code)


@unchecked
def _power(base, exponent):
    """Positive part of a base to a power; without a logarithm for straight lines and parabolas."""
    base = max(base, 0.0)
    if exponent == 1.0:
        return base
    return base * base if exponent == 2.0 else base**exponent


@unchecked
def _rounded(numbers, roll, r_b):
    """Material removed [m] by the rounding of the tip edge."""
    begin, radius = numbers[0], numbers[1]
    arc = min(max((roll * roll - begin * begin) / (2 * r_b), 0.0), radius)
    return arc * arc / (radius + (radius * radius - arc * arc) ** 0.5)


@unchecked
def _interval(table, first, number, value):
    """Number of the grid line below a value, and the share of the distance to the next line."""
    low, high = 0, number - 1
    while high - low > 1:
        middle = (low + high) // 2
        if table[first + middle] <= value:
            low = middle
        else:
            high = middle
    start, end = table[first + low], table[first + low + 1]
    return low, min(max((value - start) / (end - start), 0.0), 1.0)


@unchecked
def _on_grid(row, table, roll, axial):
    """Material removed [m] by a grid at a roll length and an axial position."""
    n, m = int(row.numbers[0]), int(row.numbers[1])
    i, u = _interval(table, row.first, n, roll)
    j, v = _interval(table, row.first + n, m, axial)
    at = row.first + n + m + m * i + j
    low, high = table[at] * (1 - v) + table[at + 1] * v, table[at + m] * (1 - v) + table[at + m + 1] * v
    return low * (1 - u) + high * u


@unchecked
def _across_face(row, table, axial, tooth):
    """Material removed [m] by a row that is constant along the profile."""
    numbers = row.numbers
    if row.formula == LEAD_CROWNING:
        return numbers[0] * (2 * axial / numbers[1]) ** 2
    if row.formula == HELIX_SLOPE:
        return numbers[0] * axial / numbers[1]
    if row.formula == END_RELIEF:
        return numbers[0] * _power((abs(axial) - numbers[1]) / numbers[2], numbers[3])
    return table[row.first + tooth % int(numbers[0])]


@unchecked
def _along_profile(row, table, r_b, roll, axial):
    """Material removed [m] by a row that changes along the profile, other than a relief, at a roll length."""
    formula, numbers = row.formula, row.numbers
    if formula == PROFILE_CROWNING:
        return numbers[0] * ((roll - numbers[1]) / numbers[2]) ** 2
    if formula == EDGE_BREAK:
        return _rounded(numbers, roll, r_b)
    return _on_grid(row, table, roll, axial)


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

    extent      roll_form and roll_tip, base radius r_b [m]; address `users` of the function for their modifications

    Beyond root form and tip circle the values on these circles continue, as in `fem.microgeometry.flank.removed`.
    """
    on_flank = np.empty(roll.shape)
    for i in range(len(roll)):
        for k in range(roll.shape[1]):
            on_flank[i, k] = min(max(roll[i, k] + sections.shift[i], extent.roll_form), extent.roll_tip)
    for row in rows:
        if row.role == role and row.formula == USERS:
            _add_users(row.first, extent.users, factor, sections, on_flank, removed)
        elif row.role == role and row.formula == PROFILE_RELIEF:
            _add_relief(row.numbers, factor, on_flank, removed)
        elif row.role == role and row.formula <= GRID:
            _add_along_profile(row, table, extent.r_b, factor, sections.axial, on_flank, removed)
        elif row.role == role:
            _add_across_face(row, table, factor, sections, removed)


@unchecked
def _add_relief(numbers, factor, roll, removed):
    """Add the material [m] of a profile relief as `add_removed`, at roll lengths on the flank."""
    amount, begin, length, power = numbers[0], numbers[1], numbers[2], numbers[3]
    for i in range(len(roll)):
        for k in range(roll.shape[1]):
            removed[i, k] += factor * (amount * _power((roll[i, k] - begin) / length, power))


@unchecked
def _add_along_profile(row, table, r_b, factor, axial, roll, removed):
    """Add the material [m] of a row that changes along the profile, other than a relief, as `add_removed`."""
    for i in range(len(roll)):
        for k in range(roll.shape[1]):
            removed[i, k] += factor * _along_profile(row, table, r_b, roll[i, k], axial[i])


@unchecked
def _add_across_face(row, table, factor, sections, removed):
    """Add the material [m] of a row that is constant along the profile as `add_removed`."""
    for i in range(len(removed)):
        material = factor * _across_face(row, table, sections.axial[i], sections.tooth[i])
        for k in range(removed.shape[1]):
            removed[i, k] += material


@unchecked
def _add_users(row, users, factor, sections, roll, removed):
    """Add the material [m] of a modification that a user wrote, as `add_removed`, at roll lengths on the flank."""
    m = roll.shape[1]
    material = np.empty(m)
    for i in range(len(roll)):
        at = roll[i].ctypes.data, sections.axial[i], sections.tooth[i]
        _call_users(users, row, m, *at, material.ctypes.data)
        for k in range(m):
            removed[i, k] += factor * material[k]
