"""Functions that are compiled where a kernel first calls them."""

from math import nan
from typing import NamedTuple

import numpy as np
import pytest
from numba import types

from fem.support.numba_cache import kept
from fem.support.on_demand import on_demand


class Pair(NamedTuple):
    """Two numbers."""

    first: float
    second: float


PAIR = types.NamedUniTuple(types.float64, 2, Pair)


@on_demand(PAIR, PAIR, types.int64)
def raised(pair, power):
    if power < 0:
        raise ValueError(pair.first, power)
    return Pair(pair.first**power, pair.second**power)


@on_demand(types.float64, types.float64)
def never_called(x):
    return x.no_such_field


@kept
def raised_twice(first, second, power):
    once = raised(Pair(first, second), power)
    return raised(once, power).second if power != 7 else never_called(first)


def test_a_function_on_demand_returns_what_it_computes_and_converts_numbers():
    assert raised_twice(2.0, 3.0, 2) == 81.0
    assert raised_twice(2.0, 3.0, True) == 3.0


def test_its_errors_are_those_of_the_kernel():
    with pytest.raises(ValueError) as error:
        raised_twice(2.5, nan, -3)
    assert error.value.args == (2.5, -3)


@kept
def doubled(values):
    return 2 * values


doubled_in_kernels = on_demand(types.float64[::1], types.float64[::1])(doubled)


@on_demand(types.none, types.float64[::1])
def negate(values):
    for i in range(values.size):
        values[i] = -values[i]


@kept
def doubled_twice_and_negated(values):
    result = doubled_in_kernels(doubled_in_kernels(values))
    negate(result)
    return result


def test_kernels_and_python_call_the_same_code_of_a_kept_function():
    assert doubled_twice_and_negated(np.array([1.0, 2.0])).tolist() == [-4.0, -8.0]
    assert doubled(np.array([3.0])).tolist() == [6.0]
    assert len(doubled.overloads) == 1


def test_what_no_call_reaches_is_not_compiled_and_a_failed_compilation_is_an_error(capsys):
    assert raised_twice(2.0, 1.0, 1) == 1.0
    with pytest.raises(RuntimeError, match="never_called"):
        raised_twice(2.0, 1.0, 7)
    assert "no_such_field" in capsys.readouterr().err
