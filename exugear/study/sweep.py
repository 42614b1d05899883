"""Sweeps: a function over many cases, on any executor, with the finished cases kept in a folder."""

import pickle
import traceback
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, as_completed
from contextlib import closing
from copy import deepcopy
from dataclasses import dataclass
from inspect import Parameter, signature
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr

from exugear.study.case_results import CASE, FAILURE, alike, as_dataset, missing_names, parameters_of, stacked
from exugear.study.case_store import CaseStore
from exugear.study.fingerprint import installed
from fem.support.arguments import FilePath, checked
from fem.support.progress import moving
from fem.support.user_warning import warn_user
from fem.support.validation import require, text_of

#: Argument of a function that takes its random numbers.
RNG = "rng"
#: Failures of which a warning shows the reason.
SHOWN = 3
NOT_COMPUTED = "not computed"


class SweepStopped(RuntimeError):
    """A sweep ended before all of its cases were computed: its executor died, or every case failed.

    data   Dataset of the finished cases, as `sweep` returns it
    """

    @checked
    def __init__(self, message: str, data: xr.Dataset):
        super().__init__(message)
        self.data = data

    def __reduce__(self):
        return type(self), (self.args[0], self.data)


class _ExecutorDied(Exception):
    """An executor takes no more cases, or lost those that it had."""


def check_cases(name: str, value: Any) -> None:
    """ValueError unless the value holds cases: dictionaries of arguments, or the rows of a DataFrame."""
    if hasattr(value, "to_dict") and hasattr(value, "columns"):
        names = list(value.columns)
        twice = sorted({str(x) for x in names if names.count(x) > 1})
        require(not twice, f"{name} must have columns of different names, {twice} occur twice; rename them")
        value = value.to_dict("records")
    listed = isinstance(value, Sequence) and not isinstance(value, str | bytes) and len(value) > 0
    require(listed, f"{name} must be a list of dictionaries or a DataFrame with a row or more, got {text_of(value)}")
    for number, case in enumerate(value):
        named = isinstance(case, Mapping) and all(isinstance(key, str) for key in case)
        require(named, f"{name} must hold dictionaries of arguments by name, got {text_of(case)} as case {number}")


def check_seed(name: str, value: Any) -> None:
    """ValueError unless the value is a whole number in [0, 2^63)."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool) and 0 <= value < 2**63
    require(bool(whole), f"{name} must be a whole number in [0, 2^63), got {text_of(value)}")


@checked
def sweep(
    function: Callable,
    cases: Annotated[Any, check_cases],
    *,
    executor: Executor | None = None,
    store: FilePath | None = None,
    seed: Annotated[int, check_seed] | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Results of a function over many cases, in a Dataset over the dimension `case`.

    function    takes the values of a case by name; returns a number, a dictionary of numbers and of (dims, values), a
                DataArray, or a Dataset, of the same sizes in all cases
    cases       dictionaries of arguments, or the rows of a pandas DataFrame, whose index labels the cases
    executor    any `concurrent.futures.Executor`, also of Dask, over which the cases are spread; the function must be
                one that its processes can import
    store       folder that keeps every finished case: a sweep that was killed goes on from there, and one with further
                cases computes these alone. A changed case is computed anew; a changed function, or another version of
                this program, is refused
    seed        of random numbers: the function then takes an argument `rng`, a `numpy.random.Generator` of its own for
                each case, which depends on the seed and on the number of the case alone
    progress    show a bar with the time left

    The values of the cases are coordinates, `failure` holds the reason of each case that failed, else "". A case that
    failed is NaN; it warns, loses no other, and is tried again when the sweep is repeated with its store.

    Raises ValueError for bad input, and for a store that holds anything else; `exugear.SweepStopped` where the executor
    dies or all cases fail, with what was computed. Ctrl-C leaves the finished cases in the store.
    """
    labels, listed = _listed(cases)
    _check_arguments(function, listed, seed)
    if isinstance(executor, ProcessPoolExecutor):
        _check_importable(function)
    keep = None if store is None else CaseStore(Path(store), function)
    work = [_Case(function, case, None if seed is None else (seed, number)) for number, case in enumerate(listed)]
    outcomes: list[xr.Dataset | str] = [NOT_COMPUTED] * len(work)
    waiting = []
    for number, case in enumerate(work):
        kept = keep.load(case.key) if keep else None
        if kept is None:
            waiting.append(number)
        else:
            outcomes[number] = kept
    title, computing = _title(work, waiting), closing(_outcomes(work, waiting, executor))
    try:
        with moving(len(work), title, visible=progress) as bar, computing as computed:
            bar.update(len(work) - len(waiting))
            for number, outcome in computed:
                if keep and isinstance(outcome, xr.Dataset):
                    keep.keep(work[number].key, outcome)
                outcomes[number] = outcome
                bar.update(1)
    except KeyboardInterrupt as stop:
        stop.add_note(_how_far(outcomes, keep))
        raise
    except _ExecutorDied as error:
        message = f"executor died ({error}): {_how_far(outcomes, keep)}"
        raise SweepStopped(message, _labelled(listed, labels, outcomes)) from error
    return _told_failures(_labelled(listed, labels, outcomes))


def _title(work: list, waiting: list) -> str:
    kept = len(work) - len(waiting)
    return f"sweep: {len(work)} cases" + (f", {kept} from the store" if kept else "")


@dataclass(frozen=True)
class _Case:
    """A case that another process can compute."""

    function: Callable
    values: dict[str, Any]
    random: tuple[int, int] | None

    @property
    def key(self) -> Any:
        """What its result depends on beside the function."""
        return self.values if self.random is None else (self.values, *self.random)

    def __call__(self) -> xr.Dataset | str:
        """Its result; the reason where it fails."""
        values = deepcopy(self.values)  # a function that changes a list must not change the case
        if self.random is not None:
            seed, number = self.random
            values[RNG] = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
        try:
            returned = self.function(**values)
        except Exception as error:
            return _reason(error)
        try:
            return as_dataset(returned, apart_from=self.values)
        except ValueError as error:
            return f"{type(error).__name__}: {error}"


def _reason(error: BaseException) -> str:
    """Class, message and line of an error: the last line of the user, of this program where it has none."""
    frames = traceback.extract_tb(error.__traceback__)
    written = [frame for frame in frames if not frame.filename.startswith("<")]  # not made by dataclasses
    of_user = [frame for frame in written if not installed(Path(frame.filename))]
    last = [*frames, *of_user][-1:]
    at = f" ({Path(last[0].filename).name}, line {last[0].lineno})" if last else ""
    return f"{type(error).__name__}: {error}{at}"


def _computed(case: _Case) -> xr.Dataset | str:
    """A function that processes can import."""
    return case()


def _listed(cases: Any) -> tuple[np.ndarray, list[dict[str, Any]]]:
    """Labels and arguments of the cases."""
    if hasattr(cases, "to_dict") and hasattr(cases, "columns"):
        return _labels(cases.index), [dict(case) for case in cases.to_dict("records")]
    return np.arange(len(cases)), [dict(case) for case in cases]


def _labels(index: Any) -> np.ndarray:
    """Labels of the rows of a DataFrame; those of several levels as texts, which files can hold."""
    several = getattr(index, "nlevels", 1) > 1
    return np.array([", ".join(map(str, label)) for label in index]) if several else np.asarray(index)


def draws_random_numbers(function: Callable) -> bool:
    """Whether a function has an argument `rng`."""
    try:
        return RNG in signature(function).parameters
    except (TypeError, ValueError):  # built-in functions
        return False


def _check_arguments(function: Callable, cases: list[dict[str, Any]], seed: int | None) -> None:
    """ValueError unless the function takes the values of each case, and random numbers where there is a seed."""
    try:
        takes = signature(function)
    except (TypeError, ValueError):  # built-in functions
        return
    parameters = takes.parameters.values()
    further = any(part.kind is Parameter.VAR_KEYWORD for part in parameters)
    random = draws_random_numbers(function)
    require(seed is None or random or further, f"function must take an argument {RNG} where a seed is given")
    given = [number for number, case in enumerate(cases) if seed is not None and RNG in case]
    require(not given, f"cases must not hold {RNG} beside a seed, case {given[:1]} does; leave out one of them")
    reserved = sorted({name for case in cases for name in case} & {CASE, FAILURE})
    require(not reserved, f"cases must not have values called {reserved}, which are names of the result; rename them")
    needs = random and takes.parameters[RNG].default is Parameter.empty
    require(seed is not None or not needs or all(RNG in case for case in cases), "seed must be given, say seed=1, "
            f"as the function takes {RNG}")  # fmt: skip
    for number, case in enumerate(cases):
        try:
            takes.bind(**case | ({} if seed is None else {RNG: None}))
        except TypeError as error:
            raise ValueError(
                f"cases must hold the arguments of the function, case {number} does not: {error}"
            ) from None


def _check_importable(function: Callable) -> None:
    """ValueError unless the processes of a pool can import the function; Dask sends any function."""
    try:
        pickle.dumps(function)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        remedy = "define it at the top of a module or script, not inside a function and not as a lambda"
        raise ValueError(f"function must be one that processes can import ({error}); {remedy}") from None


def _outcomes(
    work: list[_Case], waiting: list[int], executor: Executor | None
) -> Generator[tuple[int, xr.Dataset | str], None, None]:
    """Number and outcome of each case as it is computed; _ExecutorDied where the executor did."""
    if executor is None:
        yield from ((number, work[number]()) for number in waiting)
        return
    futures: dict[Future, int] = {}
    try:
        try:
            for number in waiting:
                futures[executor.submit(_computed, work[number])] = number
        except RuntimeError as error:  # broken or shut down
            raise _ExecutorDied(_reason(error)) from error
        for future in as_completed(futures):
            if future.cancelled():
                raise _ExecutorDied("it cancelled a case")
            failed = future.exception()
            if isinstance(failed, BrokenExecutor):
                raise _ExecutorDied(_reason(failed)) from failed
            if isinstance(failed, KeyboardInterrupt):
                raise failed
            yield futures[future], future.result() if failed is None else _reason(failed)
    finally:
        for future in futures:
            future.cancel()


def _how_far(outcomes: list[xr.Dataset | str], keep: CaseStore | None) -> str:
    """Number of finished cases, and where they are."""
    done = sum(isinstance(outcome, xr.Dataset) for outcome in outcomes)
    kept = f"kept in {keep.folder}; repeat the sweep to go on" if keep else "not kept; pass store=folder to go on later"
    return f"{done} of {len(outcomes)} cases are finished and {kept}"


def _labelled(listed: list[dict[str, Any]], labels: np.ndarray, outcomes: list[xr.Dataset | str]) -> xr.Dataset:
    """Dataset of all outcomes over the cases."""
    results, reasons = alike(outcomes)
    lacking = missing_names(results)
    if lacking:
        said = "; ".join(f"{name} in case {labels[case]}" for name, case in lacking.items())
        warn_user(f"results have different names, and NaN where one is missing: {said}; return the same in all cases")
    data, parameters = stacked(results), parameters_of(listed)
    failures = np.array(reasons)
    failure = (CASE,), failures, {"long_name": "reason why the case has no result"}
    return data.assign({FAILURE: failure}).assign_coords({CASE: labels} | parameters)


def _told_failures(data: xr.Dataset) -> xr.Dataset:
    """The Dataset; a warning for cases that failed, SweepStopped where all did."""
    failed = np.flatnonzero(data[FAILURE].values != "")
    reasons = [f"case {data[CASE].values[i]}: {data[FAILURE].values[i]}" for i in failed[:SHOWN]]
    told = f"{failed.size} of {data.sizes[CASE]} cases failed; {'; '.join(reasons)}"
    if failed.size == data.sizes[CASE]:
        raise SweepStopped(told, data)
    if failed.size:
        warn_user(f"{told}{'; ...' if failed.size > SHOWN else ''}")
    return data
