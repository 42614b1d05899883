"""Records: named numbers that Python and the compiled kernels read alike; kernels get the address of a record.

An integer argument costs a call from Python a tenth of an array argument, and the direct call by Exudyn can pass it.
"""

from ctypes import c_double
from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, from_dtype, types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.unsafe import ndarray

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


def address_of(record: np.record | None) -> int:
    """Address of a record, valid as long as the record lives; 0 for none."""
    return 0 if record is None else np.frombuffer(record, np.uint8).ctypes.data


def floats_of(record: np.record) -> np.ndarray:
    """The memory of a record as floats; it must live as long as they are used.

    Numpy reads or writes an entry in a tenth of the time that a field of a record takes.
    """
    return np.ctypeslib.as_array((c_double * (record.dtype.itemsize // 8)).from_address(address_of(record)))


def pointer_to(kind) -> Any:
    """The function for kernels: address -> pointer to values of a numba type."""

    def to_pointer(typing_context, address):
        pointer = types.CPointer(kind)

        def code(context, builder, signature, arguments):
            return builder.inttoptr(arguments[0], context.get_value_type(pointer))

        return pointer(address), code

    return intrinsic(to_pointer)


def reader(kind: np.dtype) -> Any:
    """The function for kernels: address -> the record of a type that begins there."""
    pointer = pointer_to(from_dtype(kind))

    @compiled
    def record_at(address):
        return carray(pointer(address), 1)[0]

    return record_at


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


def _start_of(typing_context, record):
    """The function for kernels: record -> its address."""

    def code(context, builder, signature, arguments):
        return builder.ptrtoint(arguments[0], context.get_value_type(types.int64))

    return types.int64(record), code


def _put_all(typing_context, address, values):
    """The function for kernels: (address, floats) -> None; it writes the floats of a tuple one after the other.

    Numba reads the element of a tuple by a branch for each: loops over many take half a microsecond.
    """

    def code(context, builder, signature, arguments):
        first = builder.inttoptr(arguments[0], context.get_value_type(types.CPointer(types.float64)))
        for i in range(len(signature.args[1])):
            builder.store(builder.extract_value(arguments[1], i), builder.gep(first, [ir.IntType(32)(i)]))
        return context.get_dummy_value()

    return types.none(types.int64, values), code


start_of: Any = intrinsic(_start_of)
put_all: Any = intrinsic(_put_all)
#: The function for kernels: (array, n) -> its n floats as a tuple.
as_tuple: Any = ndarray.to_fixed_tuple
doubles_at, floats_at, integers_at = (pointer_to(kind) for kind in (types.float64, types.float32, types.int64))
