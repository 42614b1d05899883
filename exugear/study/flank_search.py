"""The search for the best flanks: variables with bounds and steps of manufacture, the objective, and the search."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy

from exugear.study.goals import SHIFTS, Evaluation
from fem.support.arguments import Finite, checked
from fem.support.representation import quantity, short
from fem.support.validation import as_floats, require, text_of

#: Methods of scipy.optimize: local ones from several starts, or a global one.
LOCAL, GLOBAL = ("COBYQA", "Nelder-Mead", "Powell"), "differential_evolution"
#: First and last trust region, or size of the simplex, over the range of a variable.
FIRST, LAST = 0.15, 2e-3
#: Evaluations of a local search per variable at most; starting points tried per variable.
MOST, TRIED = 40, 8
#: Distance of starts, over the diagonal of all ranges.
APART = 0.15
#: Longest bound of a variable in um or mm [m].
LONGEST = 1.0
#: Share of the range within which a variable without steps counts as at its bound.
AT_BOUND = 1e-3


@short()
@checked
@dataclass(frozen=True)
class Variable:
    """A number that an optimization may choose.

    low, high   bounds, low < high
    step        of manufacture: values are low, low + step, ...; None: any value
    unit        in which it is printed: "um", "mm", "mrad", "deg" or ""

    Raises ValueError for bounds that are reversed, and for steps beyond the range.
    """

    low: float
    high: float
    step: float | None = None
    unit: str = ""

    def __post_init__(self):
        as_floats(self)
        finite = bool(np.isfinite([self.low, self.high]).all())
        require(finite and self.low < self.high, f"low must be below high, both finite, got {self.low} and {self.high}")
        units = "", "um", "mm", "mrad", "deg", "GPa"
        require(self.unit in units, f"unit must be one of {units}, got {text_of(self.unit)}")
        farthest = max(abs(self.low), abs(self.high))
        metres = f"bounds must lie within {LONGEST:g} m with unit={self.unit!r}, got {self.low} and {self.high}"
        require(self.unit not in ("um", "mm") or farthest <= LONGEST, f"{metres}; pass metres: 40*um")
        if self.step is not None:
            within = f"step must lie in (0, high - low] = (0, {self.high - self.low:g}], got {self.step}"
            require(0 < self.step <= (self.high - self.low) * (1 + 1e-9), within)

    @property
    def steps(self) -> int | None:
        """Number of steps from the lower bound to the last value; None without steps."""
        return None if self.step is None else int((self.high - self.low) / self.step * (1 + 1e-9))

    @checked
    def at(self, share: Finite) -> float:
        """The value at a share in [0, 1] of the range, on a step where there are steps."""
        require(-1e-9 <= share <= 1 + 1e-9, f"share must lie in [0, 1] of the range, got {share:g}")
        if self.step is None:
            return self.low + share * (self.high - self.low)
        number = round(share * (self.high - self.low) / self.step)
        return self.low + min(max(number, 0), self.steps or 0) * self.step

    @checked
    def share(self, value: Finite) -> float:
        """The share of the range of a value."""
        return (value - self.low) / (self.high - self.low)

    @checked
    def text(self, value: Finite) -> str:
        """A value in its unit."""
        return quantity(value, self.unit)

    @checked
    def bound_at(self, value: Finite) -> str:
        """Which bound a value is at, in words; "" inside."""
        near = AT_BOUND * (self.high - self.low) if self.step is None else self.step / 2
        last = self.high if self.step is None else self.at(1.0)
        if value < self.low + near:
            return f"lower bound {self.text(self.low)}"
        return f"upper bound {self.text(last)}" if value > last - near else ""


@dataclass(frozen=True)
class Design:
    """An evaluated design: values of the variables (n,), of the goals (m,), the objective; why it has none."""

    values: tuple[float, ...]
    goals: np.ndarray
    parts: np.ndarray
    objective: float
    reason: str = ""


@dataclass(frozen=True)
class FlankObjective:
    """The objective as a function of the variables, with all designs evaluated so far.

    draws       deviations of the tolerances, a dictionary each; none: the nominal design alone
    percentile  of the objective over the draws
    """

    flanks: Callable
    variables: Mapping[str, Variable]
    evaluation: Evaluation
    draws: tuple[Mapping[str, float], ...] = ({},)
    percentile: float = 90.0
    known: dict[tuple[float, ...], Design] = field(default_factory=dict, repr=False, compare=False)

    def design(self, values: tuple[float, ...]) -> Design:
        """The design with these values of the variables; its objective is infinite where the pair cannot be solved."""
        if values not in self.known:
            self.known[values] = self._evaluated(values)
        return self.known[values]

    def snapped(self, shares: np.ndarray) -> Design:
        """The design at shares (n,) of the ranges, on the steps of manufacture."""
        pairs = zip(self.variables.values(), np.clip(shares, 0.0, 1.0), strict=True)
        return self.design(tuple(variable.at(float(share)) for variable, share in pairs))

    def between(self, shares: np.ndarray) -> Design:
        """The design at shares (n,) of the ranges, whatever the steps."""
        pairs = zip(self.variables.values(), np.clip(shares, 0.0, 1.0), strict=True)
        return self.design(tuple(x.low + float(share) * (x.high - x.low) for x, share in pairs))

    def shares(self, design: Design) -> np.ndarray:
        """(n,) shares of the ranges of a design."""
        return np.array([x.share(value) for x, value in zip(self.variables.values(), design.values, strict=True)])

    def on_steps(self, design: Design) -> bool:
        """Whether a design can be made: its values are on the steps of manufacture."""
        pairs = zip(self.variables.values(), design.values, strict=True)
        return all(x.step is None or abs(x.at(x.share(v)) - v) < 1e-9 * x.step for x, v in pairs)

    def _evaluated(self, values: tuple[float, ...]) -> Design:
        nominal, count = dict(zip(self.variables, values, strict=True)), len(self.evaluation.goals)
        try:
            both = [self._at(nominal, deviations) for deviations in self.draws]
        except (ValueError, RuntimeError) as error:
            return Design(values, np.full(count, np.nan), np.full(count, np.nan), np.inf, str(error))
        goals, parts = (np.array(rows) for rows in zip(*both, strict=True))
        objectives = self.evaluation.objective(parts)
        share = self.percentile / 100
        if not np.isfinite(objectives).all():
            labels = [
                goal.label for goal, x in zip(self.evaluation.goals, parts.T, strict=True) if not np.isfinite(x).all()
            ]
            return Design(values, goals[0], parts[0], np.inf, f"{', '.join(labels)} is not a number")
        if len(self.draws) == 1:
            return Design(values, goals[0], parts[0], float(objectives[0]))
        over = np.quantile(goals, share, axis=0), np.quantile(parts, share, axis=0)
        return Design(values, *over, float(np.quantile(objectives, share)))

    def _at(self, nominal: Mapping[str, float], deviations: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Goals and parts of the objective of a design with deviations of its tolerances."""
        shift = {name: x for name, x in deviations.items() if name in SHIFTS and name not in self.variables}
        added = {name: x for name, x in deviations.items() if name not in shift}
        values = dict(nominal) | {name: nominal.get(name, 0.0) + x for name, x in added.items()}
        return self.evaluation.of_pair(self.flanks(**values), shift)


def sampled(objective: FlankObjective, number: int, seed: int) -> list[np.ndarray]:
    """Shares of the ranges at points that fill the space of the variables."""
    points = scipy.stats.qmc.Sobol(len(objective.variables), seed=seed).random(number)
    return list(points)


def designs_at(objective: FlankObjective, shares: list[np.ndarray], spread: Callable) -> list[Design]:
    """Designs on the steps of manufacture at shares, spread by a function like `map`; they are remembered."""
    designs = list(spread(objective.snapped, shares))
    objective.known.update({design.values: design for design in designs})
    return designs


def apart(objective: FlankObjective, designs: list[Design], number: int) -> list[np.ndarray]:
    """Shares of the best designs that lie apart from each other, at most a number."""
    starts: list[np.ndarray] = []
    for design in sorted(designs, key=lambda design: design.objective):
        shares = objective.shares(design)
        far = all(np.linalg.norm(shares - start) > APART * np.sqrt(shares.size) for start in starts)
        if np.isfinite(design.objective) and far:
            starts.append(shares)
        if len(starts) == number:
            break
    return starts


def searched(
    objective: FlankObjective, method: str, start: np.ndarray, most: int = MOST
) -> dict[tuple[float, ...], Design]:
    """All designs that a local search from shares (n,) evaluates, the neighbours of its end on the steps among them."""
    n = start.size
    worst = max((x.objective for x in objective.known.values() if np.isfinite(x.objective)), default=1.0)
    before = set(objective.known)

    def value(shares: np.ndarray) -> float:
        return min(objective.between(shares).objective, 2 * abs(worst) + 1e-300)  # searches want finite values

    options: dict[str, Any] = {"maxfev": most * n}
    if method == "COBYQA":
        options |= {"initial_tr_radius": FIRST, "final_tr_radius": LAST}
    elif method == "Nelder-Mead":
        # the simplex grows towards the inside of the ranges
        corners = [np.where(np.arange(n) == i, start + np.where(start > 0.5, -FIRST, FIRST), start) for i in range(n)]
        options |= {"initial_simplex": np.array([start, *corners]), "xatol": LAST, "fatol": 1e-4 * abs(value(start))}
    else:
        options |= {"xtol": LAST, "ftol": 1e-4}
    scipy.optimize.minimize(value, start, method=method, bounds=[(0.0, 1.0)] * n, options=options)
    new = [design for values, design in objective.known.items() if values not in before]
    best = min([*new, objective.between(start)], key=lambda design: design.objective)
    descended(objective, objective.snapped(objective.shares(best)))
    return {values: design for values, design in objective.known.items() if values not in before}


def descended(objective: FlankObjective, design: Design) -> Design:
    """The best design by steps of manufacture of one and two variables at a time, from a design on."""
    sizes = [x.step / (x.high - x.low) if x.step else LAST for x in objective.variables.values()]
    moves = _moves(len(sizes))
    while True:
        here = objective.shares(design)
        near = [objective.snapped(here + move * sizes) for move in moves]
        best = min(near, key=lambda neighbour: neighbour.objective)
        if not best.objective < design.objective:
            return design
        design = best


def _moves(n: int) -> list[np.ndarray]:
    """Steps of one variable, and of two at a time."""
    unit = np.eye(n)
    single = [sign * row for row in unit for sign in (1, -1)]
    double = [s * unit[i] + r * unit[j] for i in range(n) for j in range(i) for s in (1, -1) for r in (1, -1)]
    return single + double


def evolved(objective: FlankObjective, spread: Callable, seed: int) -> dict[tuple[float, ...], Design]:
    """All designs that differential evolution evaluates."""
    evaluated: dict[tuple[float, ...], Design] = {}

    def mapped(_, population) -> list[float]:
        designs = designs_at(objective, [np.asarray(shares) for shares in population], spread)
        evaluated.update({design.values: design for design in designs})
        return [min(design.objective, 1e300) for design in designs]

    n = len(objective.variables)
    scipy.optimize.differential_evolution(
        lambda shares: objective.snapped(shares).objective, [(0.0, 1.0)] * n, workers=mapped, updating="deferred",
        popsize=max(TRIED, 5), maxiter=15, polish=False, tol=1e-3, seed=seed,
    )  # fmt: skip
    return evaluated
