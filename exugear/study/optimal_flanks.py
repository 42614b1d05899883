"""Optimal flanks: the modifications of a pair that make weighted goals small, on steps of manufacture."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from inspect import Parameter, signature
from typing import Annotated, Any

import numpy as np
import scipy
import xarray as xr

from exugear.study.flank_search import (
    GLOBAL,
    LOCAL,
    TRIED,
    Design,
    FlankObjective,
    Variable,
    apart,
    descended,
    designs_at,
    evolved,
    sampled,
    searched,
)
from exugear.study.goals import DYNAMIC, OVER, SHIFTS, Evaluation, Goal, check_goals, in_words
from exugear.study.sweep import check_seed
from exugear.study.tolerances import check_tolerances
from fem.contact.resolution import Resolution, Slices
from fem.pair.pair import GearPair
from fem.support.arguments import checked
from fem.support.progress import announced, shown
from fem.support.validation import require, require_within, text_of

#: Weights of a Pareto front that leave no goal out.
LEAST_WEIGHT = 0.02
#: Evaluations per variable of the search for a point of a Pareto front.
FRONT_MOST = 15


def check_variables(name: str, value: Any) -> None:
    """ValueError unless the value maps names to variables."""
    listed = isinstance(value, Mapping) and len(value) > 0
    example = f"{name} must map names to exugear.Variable, say {{'C_a': exugear.Variable(0, 40e-6, step=1e-6)}}"
    require(listed, f"{example}, got {text_of(value)}")
    for key, variable in value.items():
        fits = isinstance(key, str) and isinstance(variable, Variable)
        require(fits, f"{example}, got {text_of(variable)} for {text_of(key)}")


@checked
@dataclass(frozen=True, eq=False)
class OptimalFlanks:
    """The result of `exugear.optimize_flanks`; `print` shows it.

    values      name of a variable -> its best value
    pair        with the best flanks
    objective   its least value
    goals       label of a goal -> its value [SI] (the largest over its load cases and offsets) with the best flanks
    unmodified  the same without any modification
    finer       the same with the best flanks on finer elements and slices, with twice as many phases, nominal
    at_bounds   name of a variable -> the bound that its best value is at, in words
    evaluated   Dataset over `case` of all designs: variables, goals by their labels, objective, and the reason where a
                design has none
    """

    values: Mapping[str, float]
    pair: GearPair
    objective: float
    goals: Mapping[str, float]
    unmodified: Mapping[str, float]
    finer: Mapping[str, float]
    at_bounds: Mapping[str, str]
    evaluated: xr.Dataset
    search: FlankObjective = field(repr=False)

    def __str__(self) -> str:
        variables, goals = self.search.variables, self.search.evaluation.goals
        lines = [f"optimal flanks after {self.evaluated.sizes['case']} designs"]
        for name, value in self.values.items():
            bound = f", at its {self.at_bounds[name]}: widen it?" if name in self.at_bounds else ""
            lines.append(f"  {name} = {variables[name].text(value)}{bound}")
        for goal in goals:
            at = goal.label
            was, finer = in_words(goal, self.unmodified[at]), in_words(goal, self.finer[at])
            lines.append(f"  {at}: {in_words(goal, self.goals[at])}, unmodified {was}, on finer elements {finer}")
        failed = [reason for reason in self.evaluated["reason"].values if reason]
        if failed:
            lines.append(f"  {len(failed)} designs have no objective, say: {failed[0]}")
        return "\n".join(lines)

    @checked
    def landscape(
        self, first: str | None = None, second: str | None = None, *, points: int = 20, executor: Executor | None = None
    ) -> xr.DataArray:
        """Objective over a grid of one or two variables, all others at their optimum.

        first, second   names of variables; by default the first two, with the first name that variable alone
        points          of the grid along each, from bound to bound, on steps of manufacture
        executor        any `concurrent.futures.Executor`
        """
        search = self.search
        chosen = tuple(name for name in (first, second) if name is not None) or tuple(search.variables)[:2]
        known = set(chosen) <= set(search.variables) and len(set(chosen)) == len(chosen)
        require(known, f"first and second must be different ones of {[*search.variables]}, got {[*chosen]}")
        require_within("points", points, 1, 1000, remedy="of a grid along each variable")
        axes = [_grid(search.variables[name], points) for name in chosen]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(chosen))
        base = np.array([search.variables[name].share(value) for name, value in self.values.items()])
        order = [list(search.variables).index(name) for name in chosen]
        shares = [np.where(np.isin(np.arange(base.size), order), _put(base, order, row), base) for row in grid]
        designs = designs_at(search, shares, map if executor is None else executor.map)
        values = np.array([x.objective for x in designs]).reshape([axis.size for axis in axes])
        lines = {
            name: (name, [search.variables[name].at(share) for share in axis], {"unit": search.variables[name].unit})
            for name, axis in zip(chosen, axes, strict=True)
        }
        optimum = {f"optimum_{name}": self.values[name] for name in chosen}
        data = xr.DataArray(np.where(np.isfinite(values), values, np.nan), lines, chosen, "objective")
        return data.assign_attrs(long_name="objective", **optimum)

    @checked
    def pareto_front(
        self, first: int = 0, second: int = 1, *, points: int = 9, executor: Executor | None = None
    ) -> xr.Dataset:
        """Designs of which none is better in both of two goals, say of low and high torque, over `case`.

        first, second   numbers of the goals
        points          weights between the goals, for each of which a search makes the larger of both parts small
        executor        any `concurrent.futures.Executor`
        """
        search, n = self.search, len(self.search.evaluation.goals)
        valid = first != second and {first, second} <= set(range(n))
        require(valid, f"first and second must be different goals in [0, {n - 1}], got {first} and {second}")
        require_within("points", points, 1, 100, remedy="weights between two goals")
        scales = [max(abs(self.search.evaluation.goals[i].weight[0]) * self._least(i), 1e-300) for i in (first, second)]
        spread = map if executor is None else executor.map
        weights = np.linspace(LEAST_WEIGHT, 1 - LEAST_WEIGHT, points)
        tasks = [_front_search(search, (first, second), weight, scales) for weight in weights]
        for new in spread(_front_designs, tasks):
            search.known.update({values: design for values, design in new.items() if values not in search.known})
        designs = [x for x in search.known.values() if np.isfinite(x.objective) and search.on_steps(x)]
        both = np.array([x.parts[[first, second]] for x in designs])
        better = (both[:, None] <= both).all(axis=2) & (both[:, None] < both).any(axis=2)
        front = [designs[i] for i in np.flatnonzero(~better.any(axis=0))]
        front.sort(key=lambda design: design.goals[first])
        labels = [search.evaluation.goals[i].label for i in (first, second)]
        return _dataset(search, front).assign_attrs(first=labels[0], second=labels[1])

    def _least(self, goal: int) -> float:
        values = [x.goals[goal] for x in self.search.known.values() if np.isfinite(x.objective)]
        return float(np.median(values))


def _put(base: np.ndarray, order: list[int], row: np.ndarray) -> np.ndarray:
    values = base.copy()
    values[order] = row
    return values


def _grid(variable: Variable, points: int) -> np.ndarray:
    """Shares of the range from bound to bound, on different steps."""
    shares = np.linspace(0.0, 1.0, max(points, 2))
    return np.unique([round(variable.share(variable.at(share)), 12) for share in shares])


@dataclass(frozen=True)
class _Larger(Evaluation):
    """An evaluation whose objective is the larger one of two weighted goals."""

    pair_of_goals: tuple[int, int] = (0, 1)
    weights: tuple[float, float] = (0.5, 0.5)

    def objective(self, parts: np.ndarray) -> np.ndarray:
        return np.max(parts[..., list(self.pair_of_goals)] * self.weights, axis=-1)


def _front_search(search: FlankObjective, goals: tuple[int, int], weight: float, scales: list[float]) -> FlankObjective:
    """The objective of a point of a Pareto front, with the designs that are known."""
    whole = search.evaluation
    weights = weight / scales[0], (1 - weight) / scales[1]
    larger = _Larger(whole.goals, whole.combine, whole.phases, whole.resolution, whole.gearbox, goals, weights)
    known = {
        values: replace(x, objective=float(larger.objective(x.parts))) if np.isfinite(x.objective) else x
        for values, x in search.known.items()
    }
    return replace(search, evaluation=larger, known=known)


def _front_designs(objective: FlankObjective) -> dict[tuple[float, ...], Design]:
    """New designs of the search for a point of a Pareto front; with the objective of the whole."""
    before = set(objective.known)
    best = min((x for x in objective.known.values() if objective.on_steps(x)), key=lambda design: design.objective)
    searched(objective, LOCAL[0], objective.shares(best), FRONT_MOST)
    whole = objective.evaluation
    plain = Evaluation(whole.goals, whole.combine, whole.phases, whole.resolution, whole.gearbox)
    new = {values: x for values, x in objective.known.items() if values not in before}
    return {
        values: replace(x, objective=float(plain.objective(x.parts))) if np.isfinite(x.objective) else x
        for values, x in new.items()
    }


@checked
def optimize_flanks(
    flanks: Callable,
    variables: Annotated[Any, check_variables],
    goals: Annotated[Any, check_goals],
    *,
    combine: str = "sum",
    phases: int = 30,
    resolution: Resolution | Slices | None = None,
    gearbox: Callable | None = None,
    tolerances: Annotated[Any, check_tolerances] | None = None,
    draws: int = 20,
    percentile: float = 90.0,
    method: str = "COBYQA",
    starts: int = 3,
    seed: Annotated[int, check_seed] = 0,
    executor: Executor | None = None,
    progress: bool = True,
) -> OptimalFlanks:
    """The flanks of a pair that make goals small: any fields of any modifications, within bounds, on steps.

    flanks      function of the variables by name that returns a `fem.GearPair`, say with
                `fem.TipRelief(C_a, length)` on both gears
    variables   name -> `exugear.Variable(low, high, step)`
    goals       `exugear.Goal`, or several: measures with their load cases, offsets and weights
    combine     "sum" or "max" of the weighted goals
    phases      in a mesh cycle; as for `fem.flank_measures`
    resolution  of the contact, as for a map: `fem.Resolution()` by default, `fem.Slices()` twice as fast; the result is
                evaluated anew on a finer one
    gearbox     function of an STE map that returns the `exugear.Gearbox` of "dte" and "bearing_force"
    tolerances  name -> distribution of `scipy.stats` of the deviation from nominal: of a variable, of an offset
                ("misalignment", "a", "axial", ...) or of a further argument of flanks, 0 without deviation. The
                objective is then a percentile over the draws
    draws       number of draws of the tolerances, the same for all designs
    percentile  of the objective over them
    method      of scipy.optimize: "COBYQA", "Nelder-Mead" or "Powell" from several starts, or "differential_evolution"
    starts      number of local searches, from the best of points that fill the space of the variables
    seed        of these points and draws
    executor    any `concurrent.futures.Executor`, over which designs and searches are spread

    Finite elements are solved once: of all flanks only contacts are. Designs that cannot be solved, or whose goals are
    not numbers, have no objective; the result counts them and says why.

    Raises ValueError for bad input, and where no design has an objective.
    """
    goals = (goals,) if isinstance(goals, Goal) else tuple(goals)
    require(combine in OVER, f"combine must be one of {list(OVER)}, got {text_of(combine)}")
    methods = (*LOCAL, GLOBAL)
    require(method in methods, f"method must be one of {methods}, got {text_of(method)}")
    require(1 <= starts <= 100, f"starts must lie in [1, 100], got {starts}")
    require(1 <= draws <= 10_000, f"draws must lie in [1, 10000], got {draws}")
    require(0 <= percentile <= 100, f"percentile must lie in [0, 100], got {percentile}")
    require(4 <= phases <= 10_000, f"phases must lie in [4, 10000], got {phases}")
    needs = [goal.measure for goal in goals if goal.measure in DYNAMIC]
    require(not needs or gearbox is not None, f"gearbox must be given for {needs}, a function of the STE map")
    labels = [goal.label for goal in goals]
    require(len(set(labels)) == len(labels), f"goals must differ, got {labels}; add the weights of equal ones")
    _check_names(flanks, variables, tolerances)
    evaluation = Evaluation(goals, combine, phases, resolution or Resolution(), gearbox)
    deviations = _drawn(tolerances, draws, seed) if tolerances else ({},)
    objective = FlankObjective(flanks, dict(variables), evaluation, deviations, percentile)
    spread = map if executor is None else executor.map
    with shown(progress), announced("optimal flanks"):
        _search(objective, method, starts, seed, spread)
        best = _best(objective)
        return _result(objective, best)


def _check_names(flanks: Callable, variables: Mapping[str, Variable], tolerances: Mapping[str, Any] | None) -> None:
    """ValueError unless the function takes the variables, and the tolerances that are neither variables nor offsets."""
    further = [name for name in tolerances or {} if name not in variables and name not in SHIFTS]
    takes = signature(flanks)
    try:
        takes.bind(**dict.fromkeys([*variables, *further]))
    except TypeError as error:
        raise ValueError(f"flanks must take the variables by name, {[*variables, *further]}: {error}") from None
    needed = [x.name for x in takes.parameters.values() if x.default is Parameter.empty and x.name in further]
    remedy = f"give {needed} the default 0, the value without deviation"
    require(not needed, f"flanks must have defaults of what only tolerances vary; {remedy}")


def _drawn(tolerances: Mapping[str, Any], number: int, seed: int) -> tuple[dict[str, float], ...]:
    """Deviations of all tolerances that fill their space evenly, a dictionary each."""
    shares = scipy.stats.qmc.LatinHypercube(len(tolerances), seed=seed).random(number)
    columns = [distribution.ppf(share) for distribution, share in zip(tolerances.values(), shares.T, strict=True)]
    return tuple(dict(zip(tolerances, map(float, row), strict=True)) for row in zip(*columns, strict=True))


def _search(objective: FlankObjective, method: str, starts: int, seed: int, spread: Callable) -> None:
    """Evaluate designs by the method; all of them are remembered."""
    if method == GLOBAL:
        evolved(objective, spread, seed)
        _refuse_hopeless(objective)
        descended(objective, _best(objective))
        return
    number = 2 ** int(np.ceil(np.log2(TRIED * len(objective.variables))))
    designs = designs_at(objective, sampled(objective, number, seed), spread)
    _refuse_hopeless(objective)
    for evaluated in spread(partial(searched, objective, method), apart(objective, designs, starts)):
        objective.known.update(evaluated)


def _refuse_hopeless(objective: FlankObjective) -> None:
    """ValueError where no design has an objective."""
    if not any(np.isfinite(design.objective) for design in objective.known.values()):
        reason = next(iter(objective.known.values())).reason
        raise ValueError(f"flanks have no objective within the bounds of the variables: {reason}")


def _best(objective: FlankObjective) -> Design:
    """The best design that can be made."""
    return min((x for x in objective.known.values() if objective.on_steps(x)), key=lambda design: design.objective)


def _result(objective: FlankObjective, best: Design) -> OptimalFlanks:
    """The result of the search: the best design, beside unmodified flanks and on a finer resolution."""
    names, evaluation = list(objective.variables), objective.evaluation
    labels = [goal.label for goal in evaluation.goals]
    values = dict(zip(names, best.values, strict=True))
    pair = objective.flanks(**values)
    plain = GearPair(replace(pair.pinion, flank=()), replace(pair.wheel, flank=()), a=pair.a)
    finer = replace(evaluation, resolution=Resolution.like(evaluation.resolution).finer(), phases=2 * evaluation.phases)
    bounds = {name: objective.variables[name].bound_at(value) for name, value in values.items()}
    return OptimalFlanks(
        values,
        pair,
        best.objective,
        dict(zip(labels, best.goals.tolist(), strict=True)),
        dict(zip(labels, evaluation.of_pair(plain, {})[0].tolist(), strict=True)),
        dict(zip(labels, finer.of_pair(pair, {})[0].tolist(), strict=True)),
        {name: bound for name, bound in bounds.items() if bound},
        _dataset(objective, list(objective.known.values())),
        objective,
    )


def _dataset(objective: FlankObjective, designs: Sequence[Design]) -> xr.Dataset:
    """Designs over `case`."""
    variables: dict[str, Any] = {}
    for i, (name, variable) in enumerate(objective.variables.items()):
        variables[name] = "case", [design.values[i] for design in designs], {"unit": variable.unit}
    for i, goal in enumerate(objective.evaluation.goals):
        variables[goal.label] = "case", [design.goals[i] for design in designs], {"units": goal.unit}
    variables["objective"] = "case", [x.objective if np.isfinite(x.objective) else np.nan for x in designs]
    variables["reason"] = "case", np.array([design.reason for design in designs], str)
    return xr.Dataset(variables, {"case": np.arange(len(designs))})
