"""Records: named numbers that Python and the compiled kernels read alike, with further records and arrays behind them.

What lies behind the head of a record has a start there, in bytes from the head, so that the type of the head, by which
kernels are compiled, does not depend on how much that is.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, from_dtype, types
from numba.core import cgutils
from numba.extending import intrinsic

from fem.support.numba_cache import compiled


def record_type(*fields) -> np.dtype:
    """Type of a record with these fields, each (name, type) or (name, type, shape)."""
    return np.dtype((np.record, np.dtype(list(fields), align=True)))


def record_of(kind: np.dtype, **values) -> np.record:
    """A read-only record of a type; fields without a value are 0."""
    record = np.zeros(1, kind)
    for name, value in values.items():
        record[name] = value
    record.setflags(write=False)
    return record[0]


def changed(record: np.record, **values) -> np.record:
    """A read-only copy of a record with new values in some of its fields."""
    return record_of(record.dtype, **{name: record[name] for name in record.dtype.names or ()} | values)


def start_of_field(kind: np.dtype, name: str) -> int:
    """Bytes from the start of a record to a field."""
    return kind.fields[name][1]  # type: ignore[index]


def packed(records: Sequence[np.record]) -> tuple[np.ndarray, np.ndarray]:
    """Copies of records in one array of floats, and their starts there (number,) [bytes]: `within` finds them."""
    parts = [np.frombuffer(record, float) for record in records]
    return np.concatenate(parts), np.cumsum([0, *(part.nbytes for part in parts[:-1])])


def value_at(kind) -> Any:
    """The function for kernels: address -> what lies there, of a numba type of pointers or records."""

    def at_address(typing_context, address):
        def code(context, builder, signature, arguments):
            return builder.inttoptr(arguments[0], context.get_value_type(kind))

        return kind(address), code

    return intrinsic(at_address)


def pointer_to(kind) -> Any:
    """The function for kernels: address -> pointer to values of a numba type."""
    return value_at(types.CPointer(kind))


def _start_of(typing_context, record):
    """The function for kernels: record -> its address."""

    def code(context, builder, signature, arguments):
        return builder.ptrtoint(arguments[0], context.get_value_type(types.int64))

    return types.int64(record), code


start_of: Any = intrinsic(_start_of)
doubles_at = pointer_to(types.float64)


def behind(kind: np.dtype) -> Any:
    """The function for kernels: (record, start) -> the record of a type that begins there, in bytes from the first."""
    of_kind = from_dtype(kind)

    def record_behind(typing_context, record, start):
        def code(context, builder, signature, arguments):
            address = builder.ptrtoint(arguments[0], context.get_value_type(types.int64))
            return builder.inttoptr(builder.add(address, arguments[1]), context.get_value_type(of_kind))

        return of_kind(record, types.int64), code

    return intrinsic(record_behind)


@compiled
def floats_behind(record, start):
    """The floats that begin at a start, in bytes from a record: to be read by their number alone."""
    return doubles_at(start_of(record) + start)


@compiled
def array_behind(record, start, shape):
    """The array of floats of a shape that begins at a start, in bytes from a record."""
    return carray(doubles_at(start_of(record) + start), shape)


def within(kind: np.dtype) -> Any:
    """The function for kernels: (array of floats, start) -> the record of a type that begins there, in bytes."""
    record_at = value_at(from_dtype(kind))

    @compiled
    def record_within(values, start):
        return record_at(np.intp(values.ctypes.data) + start)

    return record_within


def records_on_stack(kind: np.dtype, number: int) -> Any:
    """The function for kernels: () -> pointer to so many records of a type that live as long as the call.

    They are not set. An array would be allocated and freed by each call, for a microsecond.
    """

    def on_stack(typing_context):
        pointer = types.CPointer(from_dtype(kind))

        def code(context, builder, signature, arguments):
            floats = cgutils.alloca_once(builder, ir.DoubleType(), size=number * kind.itemsize // 8)
            return builder.bitcast(floats, context.get_value_type(pointer))

        return pointer(), code

    return intrinsic(on_stack)
