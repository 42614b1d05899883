"""Functions that compiled code calls become machine code together with the function that Python calls."""

import numpy as np
import pytest
from numba import njit
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import cpu_target

from fem.support.call_tree import KNOWN, TreeLibrary, callee, whole_call_tree

whole_trees = pytest.mark.skipif(not KNOWN, reason="this version of numba compiles every function alone")


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


@whole_trees
def test_only_the_root_of_a_call_tree_becomes_machine_code():
    root = compiled_root()
    assert root(np.array([0.5, 1.0])) == 1.5
    assert isinstance(root.overloads[root.signatures[0]].library, TreeLibrary)
    for function in (doubled, inverse):
        (overload,) = function.overloads.values()
        assert not overload.library._finalized
        assert root.overloads[root.signatures[0]].library._finalized


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
