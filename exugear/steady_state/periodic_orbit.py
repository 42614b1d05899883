"""Periodic orbits of a steady system: residual, Newton's iteration, Floquet multipliers.

A point holds the unknowns u = (states at the beginning of the common period of the meshes over the static deflection,
mesh frequency over the resonance); it solves: the states after `period` common periods are those at the beginning.
"""

from dataclasses import dataclass, replace

import numpy as np

from exugear.steady_state.steady_system import SteadySystem

#: Effort of Newton's iteration at most, that of an iteration without a new jacobian, and share to which the residual
#: must then fall.
ITERATIONS, CHORD_EFFORT, FALL = 8, 0.4, 0.3
#: Correction of the unknowns after which, by a new jacobian, Newton's iteration ends: the error left is its square.
SMALL = 3e-5
#: Largest modulus of the multipliers of a stable orbit, less what rounding may add.
STABLE = 1.0 - 1e-7


@dataclass(frozen=True, eq=False)
class OrbitPoint:
    """A periodic orbit.

    unknowns     (2 n + 1,) states over the static deflection, mesh frequency over the resonance
    jacobian     (2 n, 2 n + 1) of the residual by the unknowns
    period       in common periods
    tangent      (2 n + 1,) of the branch, of length 1
    bifurcation  "fold", "period doubling" or ""
    effort       of Newton's method, in iterations with a new jacobian
    missed       largest difference of the unknowns from the guess
    """

    unknowns: np.ndarray
    jacobian: np.ndarray
    period: int
    tangent: np.ndarray
    bifurcation: str = ""
    effort: float = 0.0
    missed: float = np.inf

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
    """The equations of the periodic orbits of a system, of a period in common periods of its meshes."""

    system: SteadySystem
    period: int = 1

    def states_of(self, unknowns: np.ndarray) -> np.ndarray:
        """(2 n,) states [m]."""
        return self.system.static_deflection * unknowns[:-1]

    def frequency_of(self, unknowns: np.ndarray) -> float:
        """Mesh frequency [Hz]."""
        return self.system.resonance * float(unknowns[-1])

    def residual(self, u: np.ndarray) -> np.ndarray:
        """(2 n,) change of the states over the period, over the static deflection."""
        end = self.system.settled(self.states_of(u), self.frequency_of(u), self.period)
        return end / self.system.static_deflection - u[:-1]

    def linearized(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(2 n,) residual and its jacobian (2 n, 2 n + 1)."""
        scale, states, frequency = self.system.static_deflection, self.states_of(u), self.frequency_of(u)
        end = self.system.periods_end(states, frequency, self.period)
        by_frequency = self.system.slope_by_frequency(states, end.states, frequency, self.period)
        by_unknown = by_frequency * self.system.resonance / scale
        jacobian = np.column_stack([end.slopes - np.eye(states.size), by_unknown])
        return end.states / scale - u[:-1], jacobian

    def solved(self, guess: np.ndarray, direction: np.ndarray, jacobian: np.ndarray | None = None) -> OrbitPoint | None:
        """The orbit on the plane through the guess across the direction; None where Newton's iteration fails.

        jacobian   near the orbit, which serves as long as corrections are not small and the residual falls fast

        Raises ValueError where the orbit leaves the map.
        """
        u, size, effort, last = guess, np.inf, 0.0, np.inf
        while effort < ITERATIONS:
            if current := jacobian is None:
                residual, jacobian = self.linearized(u)
            else:
                residual = self.residual(u)
            effort += 1.0 if current else CHORD_EFFORT
            before, size = size, float(np.abs(residual).max())
            if not current and size > FALL * before:
                jacobian = None
                continue
            change = _correction(jacobian, direction, np.append(residual, direction @ (u - guess)))
            u = u + change
            if not u[-1] > 0:
                return None
            largest = float(np.abs(change).max())
            if current and largest < SMALL:
                missed = float(np.abs(u - guess).max())
                return OrbitPoint(u, jacobian, self.period, _tangent(jacobian, direction), "", effort, missed)
            if current and largest > last:
                return None
            last = largest if current else last
            jacobian = None if current or largest < SMALL else jacobian
        return None

    def at_frequency(self, states: np.ndarray, frequency: float) -> OrbitPoint | None:
        """The orbit at a mesh frequency [Hz] near states [m]; None where Newton's iteration fails."""
        guess = np.append(states / self.system.static_deflection, frequency / self.system.resonance)
        return self.solved(guess, np.append(np.zeros(states.size), 1.0))


def _correction(jacobian: np.ndarray, direction: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """(2 n + 1,) correction of the unknowns, across the direction; not finite where the equations are singular."""
    try:
        return np.linalg.solve(np.vstack([jacobian, direction]), -residual)
    except np.linalg.LinAlgError:
        return np.full(residual.size, np.nan)


def _tangent(jacobian: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Tangent of the branch, along the direction."""
    tangent = _correction(jacobian, direction, np.append(np.zeros(len(jacobian)), -1.0))
    return tangent / np.linalg.norm(tangent)


def reversed_point(point: OrbitPoint) -> OrbitPoint:
    """The point with the opposite tangent."""
    return replace(point, tangent=-point.tangent)
