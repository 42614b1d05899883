"""Exudyn's solver settings for an integrator and a step; the settings for hand-built models."""

from math import ceil, pi, sqrt

import exudyn as exu
import numpy as np

from exugear.plan.integrator import GAMMA, STABLE, Rule, rule
from fem.support.arguments import checked
from fem.support.validation import require, require_within

#: Share of the stability limit taken where the stiffness is that of one state: teeth may become twice as stiff.
MARGIN = sqrt(0.5)
#: Newton's relative tolerance per tolerance: leaves 7e-5 of the peak to peak of the DTE at 1e-3, measured.
NEWTON_SHARE = 0.07


def settings_for(found: Rule, duration: float, tolerance: float) -> exu.SimulationSettings:
    """Settings for mbs.SolveDynamic over a duration [s] in steps of at most the rule's."""
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = duration, ceil(duration / found.step * (1 - 1e-9))
    integration.newton.useModifiedNewton = True
    integration.newton.relativeTolerance = min(NEWTON_SHARE * tolerance, NEWTON_SHARE * 1e-3)
    newmark = integration.generalizedAlpha
    newmark.useNewmark = newmark.useIndex2Constraints = found.spectral_radius is None
    newmark.newmarkBeta, newmark.newmarkGamma = found.beta, GAMMA
    if found.spectral_radius is not None:
        newmark.spectralRadius = found.spectral_radius
    return settings


def highest_frequency(mbs) -> float:
    """Highest eigenfrequency [Hz] of the assembled system about its initial state, constraints ignored."""
    mass, stiffness, *_ = (np.array(matrix) for matrix in mbs.ComputeLinearizedSystem())
    squares = np.linalg.eigvals(np.linalg.pinv(mass, hermitian=True) @ (stiffness + stiffness.T) / 2)
    return sqrt(max(squares.real.max(), 0.0)) / (2 * pi)


@checked
def integrator(
    mbs: exu.MainSystem, duration: float, frequency: float, *, tolerance: float = 1e-3
) -> exu.SimulationSettings:
    """Settings for mbs.SolveDynamic on a hand-built model: flexible bodies, whatever stands beside the gears.

    duration    [s]
    frequency   highest one to be resolved [Hz]: of the mesh, or of its resonance, whichever is higher
    tolerance   relative error wanted of the rms of the DTE

    Newmark beta = 1/12 is fourth order but stable for omega h < 6^0.5 only: its step ends at `highest_frequency`. The
    trapezoidal rule is second order and always stable: it wins where the model is far stiffer than the frequencies of
    interest. Call it in a loaded state, teeth in contact. Raises ValueError for input out of range.
    """
    require(duration > 0, f"duration must be > 0 s, got {duration}")
    require_within("frequency", frequency, 0, 1e6, remedy="Hz (of the mesh: z n / 60)")
    largest = MARGIN * STABLE / (2 * pi * highest_frequency(mbs))
    return settings_for(rule(2 * pi * frequency, largest, tolerance), duration, tolerance)
