"""Static displacement under a load: the minimum of the convex potential U(q) - F q."""

from collections.abc import Callable

import numpy as np

#: Steps of the search along the ray, of Newton's iteration, and of the line search in it.
DOUBLINGS, HALVINGS, ITERATIONS, SHORTENINGS = 60, 60, 200, 40
#: Residual over the load that counts as 0, and that which rounding may leave.
TOLERANCE, ROUNDING = 1e-11, 1e-7
#: Share of the slope that a step must gain (Armijo).
LEAST_GAIN = 1e-4
#: First step along the ray, largest step and largest displacement [m].
FIRST, LARGEST_STEP, LARGEST = 1e-6, 1e-4, 5e-3
#: Load [N] up to which it is the rounding of forces that balance, such as those of planets on a sun.
BALANCED = 1e-6


class NotCarried(ValueError):
    """A load that the bearings do not carry."""


def equilibrium(
    potential: Callable[[np.ndarray], tuple[float, np.ndarray, np.ndarray]], force: np.ndarray, arm: float
) -> np.ndarray:
    """(n,) displacement at which the slope of a convex potential is the force (n,).

    potential   q -> energy, gradient (n,), Hessian (n, n)
    force       [N], moments [N m] behind the first three
    arm         length that makes tilts and displacements alike [m]

    Starts on the ray along the force, where the potential rises as the force works: nowhere else is its Hessian sure
    not to be 0. Raises NotCarried where the ray does not turn, or Newton's iteration with line search does not end.
    """
    scale = np.ones(force.size)
    scale[3:] = 1 / arm
    pushed = force * scale
    load = float(np.linalg.norm(pushed))
    if load <= BALANCED:
        return np.zeros(force.size)
    q = _start_on_ray(potential, force, scale * pushed / load)
    energy, gradient, hessian = potential(q)
    for _ in range(ITERATIONS):
        residual = (gradient - force) * scale
        size = float(np.linalg.norm(residual))
        if size <= TOLERANCE * load:
            return q
        scaled = hessian * np.outer(scale, scale)
        mean = np.trace(scaled) / force.size
        damped = scaled + mean * (1e-13 + 1e-6 * min(1.0, size / load)) * np.eye(force.size)
        step = np.linalg.solve(damped, -residual)
        step *= min(1.0, LARGEST_STEP / float(np.abs(step).max()))
        slope, value = float(residual @ step), energy - force @ q
        for _ in range(SHORTENINGS):
            trial = q + scale * step
            energy, gradient, hessian = potential(trial)
            lower = energy - force @ trial <= value + LEAST_GAIN * slope
            if lower or np.linalg.norm((gradient - force) * scale) < size / 2:
                break
            step, slope = step / 2, slope / 2
        else:
            break
        q = trial
        if np.abs(q / scale).max() > LARGEST:
            break
    _, gradient, _ = potential(q)
    if np.linalg.norm((gradient - force) * scale) <= ROUNDING * load:
        return q
    raise NotCarried(_far(q / scale))


def _start_on_ray(potential, force: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """The point of the ray q = s direction at which the potential U - F q is least."""

    def slope(s: float) -> float:
        return float((potential(s * direction)[1] - force) @ direction)

    low, high = 0.0, FIRST
    while slope(high) < 0:
        low, high = high, 2 * high
        if high > LARGEST:
            raise NotCarried(_far(high * direction))
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if slope(middle) < 0 else (low, middle)
        if high - low < 1e-3 * high:
            break
    return high * direction


def _far(q: np.ndarray) -> str:
    return f"displaced by {np.abs(q).max():.3g} m, the rolling elements do not balance the load"
