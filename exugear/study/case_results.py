"""Results of the cases of a sweep: what a function returned as a Dataset, and the Datasets of all cases as a whole."""

from collections.abc import Iterable, Mapping, Sequence
from numbers import Number
from typing import Any

import numpy as np
import xarray as xr

from fem.support.validation import require, text_of

CASE, FAILURE = "case", "failure"
#: Name of a result without a name.
RESULT = "result"
KINDS = "a number, a dictionary of numbers and of (dims, values), a DataArray or a Dataset"


def as_dataset(returned: Any, apart_from: Iterable[str] = ()) -> xr.Dataset:
    """What the function of a sweep returned as a Dataset; ValueError for what has no labels, or names of the case."""
    if isinstance(returned, xr.DataArray):
        returned = returned.to_dataset(name=returned.name or RESULT)
    elif isinstance(returned, Number | np.generic) or (isinstance(returned, np.ndarray) and returned.ndim == 0):
        returned = {RESULT: returned}
    wanted = isinstance(returned, Mapping | xr.Dataset) and len(returned) > 0
    require(wanted, f"the function must return {KINDS}, got {text_of(returned)}")
    items = returned.items() if isinstance(returned, Mapping) and not isinstance(returned, xr.Dataset) else ()
    bare = [name for name, values in items if not isinstance(values, tuple | xr.DataArray) and np.ndim(values)]
    require(not bare, f"the function must return {KINDS}; name the dims of arrays, as in ('phase', values), of {bare}")
    try:
        data = returned.copy() if isinstance(returned, xr.Dataset) else xr.Dataset(returned)
    except Exception as error:
        raise ValueError(f"the function must return {KINDS}, got {error}") from None
    twice = [name for name in (*apart_from, CASE, FAILURE) if name in data.variables or name in data.dims]
    require(not twice, f"the function must not return {twice}, which are names of the case; rename them")
    unknown = [str(name) for name, values in data.variables.items() if values.dtype.kind not in "bifcuSU"]
    require(not unknown, f"the function must return numbers and texts, {unknown} are none")
    return data.load()


def alike(outcomes: Sequence[xr.Dataset | str]) -> tuple[list[xr.Dataset | None], list[str]]:
    """Results that are like the first one, None elsewhere; reasons of the cases without result, "" of the others."""
    results: list[xr.Dataset | None] = []
    reasons: list[str] = []
    first: tuple[int, xr.Dataset] | None = None
    for number, outcome in enumerate(outcomes):
        reason = outcome if isinstance(outcome, str) else ""
        if isinstance(outcome, xr.Dataset):
            first = first or (number, outcome)
            reason = _difference(*first, outcome)
        results.append(outcome if isinstance(outcome, xr.Dataset) and not reason else None)
        reasons.append(reason)
    return results, reasons


def _difference(number: int, first: xr.Dataset, result: xr.Dataset) -> str:
    """In what a result differs from the first one that forbids to stack them; "" if in nothing."""
    for name in result.variables.keys() & first.variables.keys():
        expected, values = first.variables[name], result.variables[name]
        if expected.sizes != values.sizes:
            sizes = f"{dict(expected.sizes)} in case {number} and {dict(values.sizes)} here"
            return f"{name} must have the same size in all cases, it has {sizes}; return means, or the largest value"
        if name in first.coords and not expected.equals(values):
            return f"{name} must be the same in all cases, it differs from that of case {number}; leave it out"
    return ""


def missing_names(results: Sequence[xr.Dataset | None]) -> dict[str, int]:
    """Names that results of some cases have and others have not, and the first case without each."""
    known = {number: data for number, data in enumerate(results) if data is not None}
    names = dict.fromkeys(name for data in known.values() for name in data.data_vars)
    without = {str(name): [number for number, data in known.items() if name not in data] for name in names}
    return {name: numbers[0] for name, numbers in without.items() if numbers}


def stacked(results: Sequence[xr.Dataset | None]) -> xr.Dataset:
    """Results that are `alike` over the dimension `case`: NaN, or an empty text, where there is none."""
    known = [data for data in results if data is not None]
    variables = {name: values for data in known for name, values in data.data_vars.items()}
    coordinates = {name: values.variable for data in known for name, values in data.coords.items()}
    whole = {name: _over_cases(name, values.variable, results) for name, values in variables.items()}
    attributes = known[0].attrs if known else {}
    common = {key: x for key, x in attributes.items() if all(_equal(data.attrs.get(key), x) for data in known)}
    return xr.Dataset(whole, coordinates, common)


def _equal(first: Any, second: Any) -> bool:
    return type(first) is type(second) and bool(np.array_equal(first, second))


def _over_cases(name: Any, example: xr.Variable, results: Sequence[xr.Dataset | None]) -> tuple:
    """Dims, values and attributes of a variable over all cases."""
    gaps = any(data is None or name not in data for data in results)
    kind = np.result_type(example.dtype, float) if gaps and example.dtype.kind in "biu" else example.dtype
    empty = np.full(example.shape, "" if example.dtype.kind in "SU" else np.nan, kind) if gaps else None
    columns: list[Any] = [empty if data is None or name not in data else data[name].values for data in results]
    return (CASE, *example.dims), np.stack(columns), example.attrs


def parameters_of(cases: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The values of the cases as coordinates over `case`: numbers, arrays of equal shape, else texts."""
    names = list(dict.fromkeys(name for case in cases for name in case))
    return {name: _column(name, [case.get(name) for case in cases]) for name in names}


def _column(name: str, values: list[Any]) -> tuple:
    if all(value is None or isinstance(value, Number | np.generic) for value in values):
        numbers = np.array([np.nan if value is None else value for value in values])
        if numbers.dtype.kind in "biufc":
            return (CASE,), numbers
    arrays = [np.asarray(value) if isinstance(value, tuple | list | np.ndarray) else None for value in values]
    shapes = {None if array is None or array.dtype.kind not in "biuf" else array.shape for array in arrays}
    if len(shapes) == 1 and None not in shapes:
        stack = np.stack([array for array in arrays if array is not None])
        return (CASE, *(f"{name}_{axis}" for axis in range(stack.ndim - 1))), stack
    return (CASE,), np.array(["" if value is None else str(value) for value in values])
