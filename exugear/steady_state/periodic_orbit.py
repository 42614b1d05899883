"""Periodic orbits of a steady system: residual, Newton's iteration, Floquet multipliers.

A point holds the unknowns u = (states at the beginning of a mesh cycle over the static deflection, mesh frequency over
the resonance); it solves: the states after `period` mesh cycles are those at the beginning.
"""

from dataclasses import dataclass, replace

import numpy as np

from exugear.steady_state.steady_system import SteadySystem

#: Newton's iteration: number at most, and residual and correction over the static deflection that count as 0.
ITERATIONS, CONVERGED = 8, 1e-9
#: Correction of the last iteration that shows that the residual will not fall further, as rounding is reached.
ROUNDED = 1e-11
#: Largest modulus of the multipliers of a stable orbit, less what rounding may add.
STABLE = 1.0 - 1e-7


@dataclass(frozen=True, eq=False)
class OrbitPoint:
    """A periodic orbit.

    unknowns     (2 n + 1,) states over the static deflection, mesh frequency over the resonance
    jacobian     (2 n, 2 n + 1) of the residual by the unknowns
    period       in mesh cycles
    tangent      (2 n + 1,) of the branch, of length 1
    bifurcation  "fold", "period doubling" or ""
    iterations   of Newton's method
    """

    unknowns: np.ndarray
    jacobian: np.ndarray
    period: int
    tangent: np.ndarray
    bifurcation: str = ""
    iterations: int = 0

    @property
    def multipliers(self) -> np.ndarray:
        """(2 n,) Floquet multipliers."""
        return np.linalg.eigvals(self.jacobian[:, :-1]) + 1.0

    @property
    def stable(self) -> bool:
        """Whether small disturbances decay."""
        return not self.bifurcation and bool(np.abs(self.multipliers).max() < STABLE)

    @property
    def doubling(self) -> float:
        """Function that changes its sign where a multiplier passes -1."""
        n = len(self.jacobian)
        return float(np.linalg.det(self.jacobian[:, :-1] + 2.0 * np.eye(n)))


@dataclass(frozen=True, eq=False)
class PeriodicOrbits:
    """The equations of the periodic orbits of a system, of a period in mesh cycles."""

    system: SteadySystem
    period: int = 1

    def states_of(self, unknowns: np.ndarray) -> np.ndarray:
        """(2 n,) states [m]."""
        return self.system.static_deflection * unknowns[:-1]

    def frequency_of(self, unknowns: np.ndarray) -> float:
        """Mesh frequency [Hz]."""
        return self.system.resonance * float(unknowns[-1])

    def residual(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(2 n,) residual and its jacobian (2 n, 2 n + 1)."""
        scale, states, frequency = self.system.static_deflection, self.states_of(u), self.frequency_of(u)
        end = self.system.cycles_end(states, frequency, self.period)
        by_frequency = self.system.slope_by_frequency(states, end.states, frequency, self.period)
        by_unknown = by_frequency * self.system.resonance / scale
        jacobian = np.column_stack([end.slopes - np.eye(states.size), by_unknown])
        return end.states / scale - u[:-1], jacobian

    def solved(self, guess: np.ndarray, direction: np.ndarray) -> OrbitPoint | None:
        """The orbit on the plane through the guess across the direction; None where Newton's iteration fails.

        Raises ValueError where the orbit leaves the map.
        """
        u = guess.copy()
        for iteration in range(1, ITERATIONS + 1):
            residual, jacobian = self.residual(u)
            matrix = np.vstack([jacobian, direction])
            try:
                change = np.linalg.solve(matrix, -np.append(residual, direction @ (u - guess)))
            except np.linalg.LinAlgError:
                return None
            u = u + change
            if not u[-1] > 0:
                return None
            if np.abs(residual).max() < CONVERGED and np.abs(change).max() < 1e3 * CONVERGED:
                return OrbitPoint(u, jacobian, self.period, _tangent(jacobian, direction), iterations=iteration)
        return None

    def at_frequency(self, states: np.ndarray, frequency: float) -> OrbitPoint | None:
        """The orbit at a mesh frequency [Hz] near states [m]; None where Newton's iteration fails."""
        guess = np.append(states / self.system.static_deflection, frequency / self.system.resonance)
        return self.solved(guess, np.append(np.zeros(states.size), 1.0))


def _tangent(jacobian: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Tangent of the branch, along the direction."""
    matrix = np.vstack([jacobian, direction])
    tangent = np.linalg.solve(matrix, np.append(np.zeros(len(jacobian)), 1.0))
    return tangent / np.linalg.norm(tangent)


def reversed_point(point: OrbitPoint) -> OrbitPoint:
    """The point with the opposite tangent."""
    return replace(point, tangent=-point.tangent)
