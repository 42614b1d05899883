"""Functions that compiled code calls become machine code together with the function that Python calls."""

from contextlib import contextmanager
from math import inf, nan

import numpy as np
import pytest
from numba import njit
from numba.core.analysis import compute_live_variables
from numba.core.codegen import JITCodeLibrary
from numba.core.errors import TypingError
from numba.core.postproc import PostProcessor
from numba.core.registry import cpu_target
from numba.core.types import BaseFunction

from fem.support.numba_private import (
    SIGNATURES,
    TreeLibrary,
    callee,
    types_inferred_once,
    whole_call_tree,
    without_idle_work,
)


@callee
def doubled(x):
    return 2.0 * x


@callee(error_model="numpy")
def inverse(values):
    inverses = np.empty(values.size)
    for k in range(values.size):
        if values[k] < 0:
            raise ValueError(f"value {k} is negative")
        inverses[k] = 1.0 / doubled(values[k])
    return inverses


def compiled_root():
    """A function of compiled functions, compiled with them as a whole."""
    root = njit(lambda values: inverse(values).sum())
    with whole_call_tree():
        root(np.ones(2))
    return root


@callee(apart=True)
def tripled(x):
    return 3.0 * x


@callee
def halved(x):
    return 0.5 * x


@callee(forceinline=True)
def halved_and_tripled(x):
    return halved(x) + tripled(x)


def test_functions_are_inlined_as_they_ask_whoever_calls_them_first():
    """Numba alone passes on what the first caller asks."""
    root = njit(lambda x: halved_and_tripled(x))
    with whole_call_tree():
        assert root(2.0) == 7.0
    wanted = {halved_and_tripled: {b"alwaysinline"}, halved: set(), tripled: {b"noinline"}}
    names = {}
    for function, attributes in wanted.items():
        (overload,) = function.overloads.values()
        names[function] = overload.fndesc.llvm_func_name
        in_library = set(overload.library.get_function(names[function]).attributes)
        assert in_library & {b"alwaysinline", b"noinline"} == attributes
    (overload,) = root.overloads.values()
    left = {function.name for function in overload.library.get_defined_functions()}
    assert names[tripled] in left and names[halved_and_tripled] not in left


@callee
def entry_of(values, number):
    return values[number]


def test_whole_numbers_that_a_caller_knows_make_no_versions():
    """But where the number tells the type, as of an entry of a tuple of unlike entries."""
    assert njit(lambda x: entry_of(x, 0) - entry_of(x, 1))((3.0, 1.0)) == 2.0
    assert len(entry_of.overloads) == 1
    assert njit(lambda x: entry_of(x, 0) - entry_of(x, 1)[0])((3.0, (1.0, 2.0))) == 2.0
    assert len(entry_of.overloads) == 3


def test_only_the_root_of_a_call_tree_becomes_machine_code():
    root = compiled_root()
    assert root(np.array([0.5, 1.0])) == 1.5
    assert isinstance(root.overloads[root.signatures[0]].library, TreeLibrary)
    for function in (doubled, inverse):
        (overload,) = function.overloads.values()
        assert not overload.library._finalized
        assert root.overloads[root.signatures[0]].library._finalized


def test_a_callee_that_became_machine_code_brings_its_callees_into_further_trees():
    largest = callee(lambda x: max(doubled(x), 1.0))
    first, second = njit(lambda x: largest(x)), njit(lambda x: largest(x) + 1.0)
    with whole_call_tree():
        assert first(2.0) == 4.0
    (overload,) = largest.overloads.values()
    assert overload.library.get_pointer_to_function(overload.fndesc.llvm_func_name)
    with whole_call_tree():
        assert second(2.0) == 5.0


def test_divisions_by_zero_follow_each_functions_own_rule():
    assert compiled_root()(np.zeros(1)) == np.inf
    with pytest.raises(ZeroDivisionError):
        njit(lambda x: 1.0 / doubled(x))(0.0)


def test_an_error_in_a_callee_names_its_values():
    with pytest.raises(ValueError, match="value 1 is negative"):
        compiled_root()(np.array([1.0, -1.0]))


def test_python_and_numbas_own_functions_call_a_callee_as_well():
    compiled_root()
    assert inverse(np.array([0.5])) == np.array([1.0])
    assert njit(lambda x: doubled(x) + inverse(np.array([x]))[0])(0.5) == 2.0


def test_other_compilation_in_the_process_stays_numbas():
    compiled_root()
    assert cpu_target.target_context.codegen()._library_class is JITCodeLibrary
    function = njit(lambda x: np.full(3, x).max())
    assert function(2.0) == 2.0
    assert type(function.overloads[function.signatures[0]].library) is JITCodeLibrary


@contextmanager
def counted_inferences():
    """Context in which the functions whose types numba infers are listed."""
    infer, inferred = BaseFunction.get_call_type, []

    def listed(function, typing_context, arguments, keywords):
        inferred.append((function, tuple(arguments)))
        return infer(function, typing_context, arguments, keywords)

    BaseFunction.get_call_type = listed
    try:
        yield inferred
    finally:
        BaseFunction.get_call_type = infer


def polynomial(values):
    """Many operations of few kinds."""
    total = 0.0
    for k in range(values.size):
        total += values[k] * (1.5 + values[k] * (2.5 + values[k] * (3.5 + values[k] * 4.5)))
    return total


def test_each_operation_is_inferred_once():
    values = np.linspace(-1.0, 1.0, 7)
    with counted_inferences() as alone:
        expected = njit(polynomial)(values)
    with counted_inferences() as inferred, types_inferred_once():
        SIGNATURES.clear()
        assert njit(polynomial)(values) == expected
        assert len(inferred) == len(set(inferred)) < len(alone) / 2
        before = len(inferred)
        assert njit(polynomial)(values) == expected
        assert len(inferred) == before
    assert expected == pytest.approx(sum(x * (1.5 + x * (2.5 + x * (3.5 + x * 4.5))) for x in values))


def test_arguments_of_other_types_are_inferred_anew():
    with types_inferred_once():
        total = njit(lambda a, b: a + b)
        assert total(1, 2) == 3 and total(1.5, 2) == 3.5
        assert total(np.ones(2), 1.0).tolist() == [2.0, 2.0]
        assert total((1,), ("two",)) == (1, "two")


def test_functions_keep_their_own_arithmetic():
    """Divisions by zero, and the largest of values that are not numbers, side by side in one context."""
    with types_inferred_once():
        fast = njit(lambda a, b: max(a, b), fastmath=True)
        assert fast(1.0, 2.0) == 2.0
        exact = njit(lambda a, b: max(a, b))
        assert exact(2.0, nan) == 2.0 and np.isnan(exact(nan, 2.0))
        assert njit(lambda a: 1.0 / a, error_model="numpy")(0.0) == inf
        with pytest.raises(ZeroDivisionError):
            njit(lambda a: 1.0 / a)(0.0)


def test_an_error_is_numbas_own_each_time_and_ends_the_context():
    infer = BaseFunction.get_call_type
    for _ in range(2):
        with pytest.raises(TypingError, match="No implementation of function"), types_inferred_once():
            njit(lambda a, b: a + b)(1.0, "text")
        assert BaseFunction.get_call_type is infer


@njit
def odd_numbers(n):
    for k in range(n):
        if k % 2:
            yield k


def test_lifetimes_of_variables_are_computed_a_third_as_often(monkeypatch):
    """In generators as often as numba does."""
    computed, run = [], PostProcessor.run

    def counted(*arguments):
        computed.append(arguments)
        return compute_live_variables(*arguments)

    monkeypatch.setattr("numba.core.analysis.compute_live_variables", counted)
    values = np.linspace(-1.0, 1.0, 7)
    expected, by_numba = njit(polynomial)(values), len(computed)
    computed.clear()
    with without_idle_work():
        assert njit(polynomial)(values) == expected
        assert 0 < len(computed) <= by_numba / 3
        assert njit(lambda n: sum(list(odd_numbers(n))))(6) == 9
    assert PostProcessor.run is run
