"""Tolerances: random cases, and which of the tolerances matters."""

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from typing import Annotated, Any

import numpy as np
import scipy
import xarray as xr

from exugear.study.case_results import CASE
from exugear.study.sweep import check_seed, draws_random_numbers, sweep
from fem.support.arguments import FilePath, checked
from fem.support.validation import require, require_finite, text_of

#: Name of the dimension of the tolerances: xarray keeps "tolerance" for itself.
PARAMETER = "parameter"
#: Attribute that names the tolerances of the cases.
VARIED = "tolerances"
#: Cases without which a rank correlation says nothing.
LEAST_CASES = 10
#: Kinds of results that have a rank or a variance: truth values, whole and real numbers.
NUMBERS = "biuf"


def check_tolerances(name: str, value: Any) -> None:
    """ValueError unless the value maps names to distributions of scipy.stats with their parameters."""
    example = f"{name} must map names to distributions of scipy.stats, say {{'C_a': scipy.stats.norm(10e-6, 2e-6)}}"
    require(isinstance(value, Mapping) and len(value) > 0, f"{example}, got {text_of(value)}")
    for key, distribution in value.items():
        frozen = isinstance(key, str) and all(callable(getattr(distribution, x, None)) for x in ("ppf", "rvs"))
        require(frozen, f"{example}, got {text_of(distribution)} for {text_of(key)}")
        bare = isinstance(distribution, scipy.stats.rv_continuous | scipy.stats.rv_discrete)
        require(not bare, f"{name}: the distribution of {key} must have its parameters, say scipy.stats.norm(0, 2e-6)")
        with np.errstate(all="ignore"):
            median = distribution.ppf(0.5)
        require(np.ndim(median) == 0, f"{name}: the distribution of {key} must be of one number, got {text_of(median)}")
        require_finite(f"{name}: the median of {key}", median, "check its parameters")


def check_number(name: str, value: Any) -> None:
    """ValueError unless the value is a whole number of cases."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool) and 1 <= value <= 10**7
    require(bool(whole), f"{name} must be a whole number of cases in [1, 1e7], got {text_of(value)}")


def drawn(tolerances: Mapping[str, Any], number: int, seed: int) -> np.ndarray:
    """(number, n) values of independent tolerances: each case its own draw, which further cases do not change."""
    shares = np.random.default_rng(seed).random((number, len(tolerances)))
    columns = [distribution.ppf(share) for distribution, share in zip(tolerances.values(), shares.T, strict=True)]
    return np.stack(columns, axis=1)


@checked
def monte_carlo(
    function: Callable,
    tolerances: Annotated[Any, check_tolerances],
    *,
    number: Annotated[int, check_number] = 1000,
    seed: Annotated[int, check_seed] = 0,
    executor: Executor | None = None,
    store: FilePath | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Results of a function under tolerances drawn at random, over the dimension `case`, as of `exugear.sweep`.

    function    takes the drawn values by name, and returns what `exugear.sweep` takes; a function with an argument
                `rng` draws further deviations itself, say those of every tooth
    tolerances  name -> distribution of `scipy.stats` with its parameters: `scipy.stats.norm(10e-6, 2e-6)`,
                `scipy.stats.uniform(low, high - low)`, `scipy.stats.truncnorm(-3, 3, 0, sigma)`; independent
    number      of cases
    seed        of the draws: the first cases of a longer study are those of a shorter one
    executor, store, progress   as for `exugear.sweep`

    Percentiles are `data.quantile([0.05, 0.5, 0.95], "case")`; `exugear.rank_correlation` and `exugear.sobol_indices`
    say which tolerance matters. Raises ValueError for bad input, and as `exugear.sweep`.
    """
    values = drawn(tolerances, number, seed)
    cases = [dict(zip(tolerances, row, strict=True)) for row in values.tolist()]
    random = seed if draws_random_numbers(function) else None
    data = sweep(function, cases, executor=executor, store=store, seed=random, progress=progress)
    return data.assign_attrs({VARIED: list(tolerances), "seed": seed})


@checked
def rank_correlation(data: xr.Dataset) -> xr.Dataset:
    """Spearman's rank correlation of every result with every tolerance, over the dimension `parameter`.

    data    of `exugear.monte_carlo`, or of a sweep whose values differ: ten cases or more with a result

    Each variable lies in [-1, 1]: +-1 where the result rises or falls with this tolerance alone, about 0 where the
    tolerance does not matter, or acts in both directions; `<name>_p_value` is the probability of such a correlation by
    chance. Both are NaN for a result that does not vary. Failed cases are left out, as are results that are complex
    numbers or texts. Raises ValueError for fewer than ten cases with a result. Source: scipy.stats.spearmanr.
    """
    require(CASE in data.dims, f"data must have the dimension {CASE}, got {dict(data.sizes)}; pass that of a sweep")
    names = _varied(data)
    require(len(names) > 0, "data must hold values that differ from case to case as coordinates, got none")
    variables = {}
    for name, values in data.data_vars.items():
        if CASE in values.dims and values.dtype.kind in NUMBERS:
            values = values.astype(float)
            over = [dim for dim in values.dims if dim != CASE]
            pairs = np.array([_spearman(data[key].values, values.transpose(CASE, *over).values) for key in names])
            about = {"units": "1", "long_name": f"rank correlation of {values.attrs.get('long_name', name)}"}
            variables[name] = (PARAMETER, *over), pairs[:, 0], about
            variables[f"{name}_p_value"] = (PARAMETER, *over), pairs[:, 1], {"units": "1"}
    axes = {name: values for name, values in data.coords.items() if CASE not in values.dims}
    return xr.Dataset(variables, axes | {PARAMETER: names})


def _varied(data: xr.Dataset) -> list[str]:
    """Names of the values that differ from case to case."""
    listed = [str(name) for name, values in data.coords.items() if values.dims == (CASE,) and name != CASE]
    chosen = np.atleast_1d(data.attrs.get(VARIED, listed)).tolist()
    return [name for name in chosen if data[name].dtype.kind in "fiu" and np.unique(data[name].values).size > 1]


def _spearman(given: np.ndarray, results: np.ndarray) -> np.ndarray:
    """(2, ...) correlation and p value of values (n,) with results (n, ...)."""
    flat = results.reshape(len(results), -1)
    pairs = np.full((2, flat.shape[1]), np.nan)
    for column, values in enumerate(flat.T):
        known = np.isfinite(values) & np.isfinite(given)
        few = f"data must have {LEAST_CASES} cases or more with a result for a rank correlation, got {known.sum()}"
        require(known.sum() >= LEAST_CASES, few)
        if np.ptp(values[known]) > 0 and np.ptp(given[known]) > 0:
            pairs[:, column] = scipy.stats.spearmanr(given[known], values[known])
    return pairs.reshape(2, *results.shape[1:])


def check_power_of_two(name: str, value: Any) -> None:
    """ValueError unless the value is a power of two."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool) and 2 <= value <= 2**20
    require(bool(whole and value & (value - 1) == 0), f"{name} must be a power of two, say 256, got {text_of(value)}")


@checked
def sobol_indices(
    function: Callable,
    tolerances: Annotated[Any, check_tolerances],
    *,
    number: Annotated[int, check_power_of_two] = 256,
    seed: Annotated[int, check_seed] = 0,
    executor: Executor | None = None,
    store: FilePath | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Sobol indices: which share of the variance of each result comes from which tolerance.

    number      of points, a power of two; number (n + 2) cases are computed for n tolerances
    seed        of the points; the other arguments as for `exugear.monte_carlo`

    Returns for each result over `parameter`: `<name>_first_order`, the share of the variance by this tolerance alone,
    and `<name>_total`, with all that it adds together with others; `<name>_variance`. Estimates scatter about their
    value by some 1 / sqrt(number); they are NaN for a result that does not vary. Raises ValueError for a single
    tolerance, and where a case fails or is not finite. Source: scipy.stats.sobol_indices (Saltelli).
    """
    draws = "function must not draw rng, as all of its variance must come from the tolerances"
    require(not draws_random_numbers(function), draws)
    names, n = list(tolerances), len(tolerances)
    require(n > 1, f"tolerances must be two or more, got {names}: a single one has all of the variance")
    points = scipy.stats.qmc.Sobol(2 * n, seed=seed).random(number)
    A, B = points[:, :n], points[:, n:]
    mixed = [np.where(np.arange(n) == i, B, A) for i in range(n)]
    shares = np.concatenate([A, B, *mixed])
    # ppf is infinite at 0 of unbounded distributions: Sobol points are scrambled, and miss it by rounding at least
    shares = np.clip(shares, 1e-12, 1 - 1e-12)
    columns = [distribution.ppf(column) for distribution, column in zip(tolerances.values(), shares.T, strict=True)]
    cases = [dict(zip(names, row, strict=True)) for row in np.stack(columns, axis=1).tolist()]
    data = sweep(function, cases, executor=executor, store=store, progress=progress)
    failed = np.flatnonzero(data["failure"].values != "")
    reason = data["failure"].values[failed[0]] if failed.size else ""
    require(not failed.size, f"function must have a result in all cases, {failed.size} failed, say: {reason}")
    variables: dict[str, Any] = {}
    for name, values in data.data_vars.items():
        if values.dtype.kind in NUMBERS:
            finite = np.isfinite(values.transpose(CASE, ...).values.reshape(len(cases), -1)).all(axis=1)
            at = f", say for {cases[int(finite.argmin())]}" if not finite.all() else ""
            require(not at, f"function must return finite numbers, {name} is not in {(~finite).sum()} cases{at}")
            _add_indices(variables, str(name), values, (number, n))
    axes = {name: values for name, values in data.coords.items() if CASE not in values.dims}
    return xr.Dataset(variables, axes | {PARAMETER: names}, {"seed": seed, "number": number})


def _add_indices(variables: dict[str, Any], name: str, values: xr.DataArray, shape: tuple[int, int]) -> None:
    """Add the indices of a result over all cases A, B and mixed ones."""
    over = [str(dim) for dim in values.dims if dim != CASE]
    results = values.transpose(CASE, *over).values.astype(float)
    (number, n), rest = shape, results.shape[1:]
    flat = results.reshape(n + 2, number, -1)
    first, total = np.full((2, n, flat.shape[2]), np.nan)
    variance = flat[:2].reshape(2 * number, -1).var(axis=0)
    for column in np.flatnonzero(variance > 0):
        parts = flat[..., column]
        given = {"f_A": parts[0][None], "f_B": parts[1][None], "f_AB": parts[2:][:, None]}
        indices = scipy.stats.sobol_indices(func=given, n=number)
        first[:, column], total[:, column] = indices.first_order.ravel(), indices.total_order.ravel()
    about = values.attrs.get("long_name", name)
    share = {"units": "1", "long_name": f"share of the variance of {about}"}
    variables[f"{name}_first_order"] = (PARAMETER, *over), first.reshape(n, *rest), share
    variables[f"{name}_total"] = (PARAMETER, *over), total.reshape(n, *rest), share
    variables[f"{name}_variance"] = tuple(over), variance.reshape(rest), {"long_name": f"variance of {about}"}
