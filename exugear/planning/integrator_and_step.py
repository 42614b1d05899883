"""Choice of the integrator and the time step: fourth order while it is stable, else the trapezoidal rule."""

from dataclasses import dataclass
from math import inf, sqrt

from fem.support.arguments import checked
from fem.support.validation import require, require_within

#: Newmark beta = 1/12, gamma = 1/2 (Fox & Goodwin 1949): fourth order, stable for omega h below this.
STABLE = sqrt(6)
BETA, TRAPEZOIDAL_BETA, GAMMA = 1 / 12, 1 / 4, 1 / 2
#: omega_mesh h at a tolerance of 1e-3; the measured error is half of that (tests/exugear/running/test_run.py).
ANGLE_AT_1E3 = 0.63
#: The same for bodies on bearings, where the bound omega_mesh lies farther above the modes that the meshes excite.
ANGLE_ON_BEARINGS_AT_1E3 = 0.8
#: Step over the mesh period at a tolerance of 1e-3.
PERIOD_SHARE_AT_1E3 = 1 / 12.5
#: omega_mesh h of the trapezoidal rule at a tolerance of 1e-3: second order, 1.8 % of the windowed rms at 0.18.
TRAPEZOIDAL_ANGLE_AT_1E3 = 0.18 * sqrt(1e-3 / 0.018)
#: Share of the stability limit that is used.
BOUND_MARGIN = 0.95


@checked
@dataclass(frozen=True)
class Rule:
    """Newmark's rule with gamma = 1/2, a beta and a step [s], for `exugear.run` and `exugear.run_up`.

    With a spectral radius it is the generalized-alpha method (Chung & Hulbert 1993) instead, for comparisons.
    """

    beta: float
    step: float
    spectral_radius: float | None = None

    def __post_init__(self):
        require(
            0 < self.beta <= 1, f"beta must lie in (0, 1], got {self.beta}; 1/12 is of fourth order, 1/4 trapezoidal"
        )
        require(0 < self.step < inf, f"step must be > 0 s and finite, got {self.step}")
        within = self.spectral_radius is None or 0 <= self.spectral_radius <= 1
        require(within, f"spectral_radius must lie in [0, 1], got {self.spectral_radius}")

    @classmethod
    def fourth_order(cls, step: float) -> "Rule":
        """Newmark's rule of fourth order, stable up to a step of sqrt(6) over the highest eigenfrequency."""
        return cls(BETA, step)

    @classmethod
    def trapezoidal(cls, step: float) -> "Rule":
        """The trapezoidal rule: second order, always stable."""
        return cls(TRAPEZOIDAL_BETA, step)

    @property
    def always_stable(self) -> bool:
        """Whether no step is too long for the highest eigenfrequency."""
        return self.beta >= TRAPEZOIDAL_BETA or self.spectral_radius is not None

    def __str__(self) -> str:
        if self.spectral_radius is not None:
            return f"generalized-alpha with spectral radius {self.spectral_radius:g}"
        fourth = "Newmark beta = 1/12, gamma = 1/2 (fourth order, conditionally stable), index 2"
        return fourth if self.beta == BETA else "trapezoidal rule (second order, always stable), index 2: stiff scene"


def rule_for(
    omega_mesh: float, largest: float, tolerance: float = 1e-3, mesh_frequency: float = 0.0, angle: float = ANGLE_AT_1E3
) -> Rule:
    """The rule that allows the larger step, of the two, for a relative error of the windowed rms of the DTE.

    omega_mesh       highest eigenfrequency of interest [rad/s]
    largest          step up to which the fourth-order rule is stable [s]
    tolerance        relative error
    mesh_frequency   highest of the run [Hz]
    angle            omega_mesh h that reaches a tolerance of 1e-3
    """
    require_within("tolerance", tolerance, 1e-9, 0.1, remedy="(relative error of the rms: 1e-3)")
    refinement = (tolerance / 1e-3) ** 0.25
    period_share = PERIOD_SHARE_AT_1E3 * refinement / mesh_frequency if mesh_frequency > 0 else 1.0
    fourth_order = min(angle * refinement / omega_mesh, period_share, largest)
    second_order = TRAPEZOIDAL_ANGLE_AT_1E3 * refinement**2 / omega_mesh
    second_order = min(second_order, second_order * period_share * omega_mesh / ANGLE_AT_1E3 / refinement)
    return Rule(BETA, fourth_order) if fourth_order >= second_order else Rule(TRAPEZOIDAL_BETA, second_order)
