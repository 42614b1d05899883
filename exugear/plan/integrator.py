"""Integrator and step: fourth order while it is stable, else the trapezoidal rule."""

from dataclasses import dataclass
from math import sqrt

from fem.support.validation import require_within

#: Newmark beta = 1/12, gamma = 1/2 (Fox & Goodwin 1949): fourth order, stable for omega h below this.
STABLE = sqrt(6)
BETA, TRAPEZOIDAL_BETA, GAMMA = 1 / 12, 1 / 4, 1 / 2
#: omega_mesh h and 1 / steps per mesh cycle at tolerance 1e-3; half of it was measured (tests/test_run.py, slow).
ANGLE_AT_1E3, CYCLE_SHARE_AT_1E3 = 0.63, 1 / 12.5
#: The same with bodies on bearings, whose highest bound lies farther above what the meshes excite.
ANGLE_ON_BEARINGS_AT_1E3 = 0.8
#: omega h of the trapezoidal rule at tolerance 1e-3, from 1.8 % of the windowed rms at 0.18.
TRAPEZOIDAL_ANGLE_AT_1E3 = 0.18 * sqrt(1e-3 / 0.018)
#: The same where it is a bound.
BOUND_MARGIN = 0.95


@dataclass(frozen=True)
class Rule:
    """A Newmark rule with gamma = 1/2, its beta and its step [s].

    With a spectral radius it is the generalized-alpha method (Chung & Hulbert 1993) instead, for comparison.
    """

    beta: float
    step: float
    spectral_radius: float | None = None

    @property
    def lag(self) -> float:
        """Velocities of the fourth-order rule are q_t + lag d2(q_t)/dt2 [s^2]; its displacements err by step^4."""
        return self.step**2 / 12 if self.beta == BETA and self.spectral_radius is None else 0.0

    def __str__(self) -> str:
        if self.spectral_radius is not None:
            return f"generalized-alpha with spectral radius {self.spectral_radius:g}"
        fourth = "Newmark beta = 1/12, gamma = 1/2 (fourth order, conditionally stable), index 2"
        return fourth if self.beta == BETA else "trapezoidal rule (second order, always stable), index 2: stiff scene"


def rule(
    omega_mesh: float, largest: float, tolerance: float = 1e-3, mesh_frequency: float = 0.0, angle: float = ANGLE_AT_1E3
) -> Rule:
    """The rule with the larger step for a tolerance of the windowed rms of the DTE.

    omega_mesh       highest eigenfrequency of interest [rad/s]
    largest          step up to which the fourth-order rule is stable [s]
    mesh_frequency   highest of the run [Hz]
    angle            omega_mesh h that reaches a tolerance of 1e-3
    """
    require_within("tolerance", tolerance, 1e-9, 0.1, remedy="(relative error of the rms: 1e-3)")
    finer = (tolerance / 1e-3) ** 0.25
    cycle = CYCLE_SHARE_AT_1E3 * finer / mesh_frequency if mesh_frequency > 0 else 1.0
    wanted = min(angle * finer / omega_mesh, cycle)
    second = TRAPEZOIDAL_ANGLE_AT_1E3 * finer**2 / omega_mesh
    second = min(second, second * cycle * omega_mesh / ANGLE_AT_1E3 / finer)
    return Rule(BETA, min(wanted, largest)) if min(wanted, largest) >= second else Rule(TRAPEZOIDAL_BETA, second)
