"""Addresses of records and arrays: the integers by which Exudyn's user functions pass them to kernels.

An integer argument costs a call from Python a tenth of an array argument, and the direct call by Exudyn can pass it. A
kernel finds its records again by `reader`; what it calls takes records, arrays and named tuples of these.
"""

from ctypes import c_double
from typing import Any

import numpy as np
from llvmlite import ir
from numba import from_dtype, types
from numba.extending import intrinsic
from numba.np.unsafe import ndarray

from exugear.mesh_force.kernel_records import pointer_to, value_at

#: The function for kernels: (array, n) -> its n floats as a tuple.
as_tuple: Any = ndarray.to_fixed_tuple
floats_at, integers_at = pointer_to(types.float32), pointer_to(types.int64)


def address_of(record: np.record | None) -> int:
    """Address of a record, valid as long as the record lives; 0 for none."""
    return 0 if record is None else np.frombuffer(record, np.uint8).ctypes.data


def floats_of(record: np.record) -> np.ndarray:
    """The memory of a record as floats; it must live as long as they are used.

    Numpy reads or writes an entry in a tenth of the time that a field of a record takes.
    """
    return np.ctypeslib.as_array((c_double * (record.dtype.itemsize // 8)).from_address(address_of(record)))


def reader(kind: np.dtype) -> Any:
    """The function for kernels: address -> the record of a type that begins there."""
    return value_at(from_dtype(kind))


def _double_at(context, builder, address):
    """The function (i) -> value of the float number i behind an address, for the code of an intrinsic."""
    first = builder.inttoptr(address, context.get_value_type(types.CPointer(types.float64)))
    return lambda i: builder.load(builder.gep(first, [ir.IntType(32)(i)]))


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


put_all: Any = intrinsic(_put_all)


def _moved(typing_context, x, address, displacement, rate):
    """The function for kernels: (x, address, displacement, rate) -> coordinates and velocities x (2 n) moved ahead.

    Coordinates by displacement times the n floats at the address, velocities by rate times these.
    """
    half = len(x) // 2

    def code(context, builder, signature, arguments):
        values, address, *factors = arguments
        float_at = _double_at(context, builder, address)
        entries = [float_at(i) for i in range(half)]
        moved = [
            builder.fadd(builder.extract_value(values, i), builder.fmul(factors[i >= half], entries[i % half]))
            for i in range(2 * half)
        ]
        return context.make_tuple(builder, signature.return_type, moved)

    return types.UniTuple(types.float64, len(x))(x, types.int64, types.float64, types.float64), code


moved: Any = intrinsic(_moved)


def _plus_product(typing_context, x, matrix, vector):
    """The function for kernels: (x, matrix, vector) -> x (n) plus a matrix (n, n), by columns, times a vector (n).

    matrix, vector   addresses
    """
    n = len(x)

    def code(context, builder, signature, arguments):
        values, matrix, vector = arguments
        entry_at, factor_at = _double_at(context, builder, matrix), _double_at(context, builder, vector)
        total = [builder.extract_value(values, i) for i in range(n)]
        for j in range(n):
            factor = factor_at(j)
            total = [builder.fadd(total[i], builder.fmul(entry_at(n * j + i), factor)) for i in range(n)]
        return context.make_tuple(builder, signature.return_type, total)

    return types.UniTuple(types.float64, n)(x, types.int64, types.int64), code


plus_product: Any = intrinsic(_plus_product)
