"""The lag of the velocities of the fourth-order rule, and true rates of what has been recorded.

Newmark's rule with beta = 1/12 is of fourth order in the coordinates, but its velocities are trapezoidal sums of the
accelerations: v + lag v'' instead of v, with lag = step^2 / 12 (`exugear.multibody.integrator_steps`).
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from exugear.planning.integrator_and_step import BETA, Rule

#: Second derivative over the squared spacing: in the middle of five values, and of the first two of six values.
MIDDLE = np.array([-1, 16, -30, 16, -1]) / 12
FIRST_TWO = np.array([[45, -154, 214, -156, 61, -10], [10, -15, -4, 14, -6, 1]]) / 12


def lag_of(rule: Rule | None) -> float:
    """step^2 / 12 [s^2] for the fourth-order rule, whose q_t - lag d2(q_t)/dt2 is of fourth order, too; else 0."""
    if rule is None or rule.beta != BETA or rule.spectral_radius is not None:
        return 0.0
    return rule.step**2 / 12


def true_rates_by(rule: Rule, time: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """The function of rates (n, ...) that a rule gave at times (n,) [s], or at the first of them -> true rates."""
    return partial(_less_curvature, factor=lag_of(rule) / (time[1] - time[0]) ** 2 if time.size > 1 else 0.0)


def _less_curvature(rates: np.ndarray, factor: float) -> np.ndarray:
    """Rates (n, ...) less the factor times their second derivative over the squared spacing."""
    if factor == 0.0 or len(rates) < FIRST_TWO.shape[1]:
        return rates
    curvature = np.empty_like(rates)
    curvature[2:-2] = sum(c * rates[i : len(rates) - 4 + i] for i, c in enumerate(MIDDLE))
    curvature[:2] = np.tensordot(FIRST_TWO, rates[:6], 1)
    curvature[-2:] = np.tensordot(FIRST_TWO[::-1, ::-1], rates[-6:], 1)
    return rates - factor * curvature
