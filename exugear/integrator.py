"""Integrator and step for a hand-built model: flexible bodies, stiff joints, whatever stands beside the gears."""

from math import ceil, pi, sqrt

import exudyn as exu
import numpy as np

from exugear.plan import ANGLE_AT_1E3, BETA, GAMMA, STABLE
from fem.gear import require, require_within

#: Share of the stability limit taken: teeth may become twice as stiff as where the system was linearised.
MARGIN = sqrt(0.5)
#: omega h of the trapezoidal rule at tolerance 1e-3, from 1.8 % of the windowed rms at 0.18.
TRAPEZOIDAL_ANGLE_AT_1E3 = 0.18 * sqrt(1e-3 / 0.018)


def highest_frequency(mbs) -> float:
    """Highest eigenfrequency [Hz] of the assembled system about its initial state, constraints ignored."""
    mass, stiffness, *_ = (np.array(matrix) for matrix in mbs.ComputeLinearizedSystem())
    squares = np.linalg.eigvals(np.linalg.pinv(mass, hermitian=True) @ (stiffness + stiffness.T) / 2)
    return sqrt(max(squares.real.max(), 0.0)) / (2 * pi)


def integrator(mbs, duration: float, frequency: float, *, tolerance: float = 1e-3) -> exu.SimulationSettings:
    """Settings for mbs.SolveDynamic with the larger of the steps that two integrators may take.

    duration    [s]
    frequency   highest one to be resolved [Hz]: of the mesh, or of its resonance, whichever is higher
    tolerance   relative error wanted of the rms of the DTE

    Newmark beta = 1/12 is fourth order but stable for omega h < 6^0.5 only: its step ends at `highest_frequency`. The
    trapezoidal rule is second order and always stable: it wins where the model is far stiffer than the frequencies of
    interest. Call it in a loaded state, teeth in contact. Raises ValueError for input out of range.
    """
    require(duration > 0, f"duration must be > 0 s, got {duration}")
    require_within("frequency", frequency, 0, 1e6, remedy="Hz (of the mesh: z n / 60)")
    require_within("tolerance", tolerance, 1e-9, 0.1, remedy="(relative error of the rms: 1e-3)")
    share, omega = tolerance / 1e-3, 2 * pi * frequency
    fourth = min(ANGLE_AT_1E3 * share**0.25 / omega, MARGIN * STABLE / (2 * pi * highest_frequency(mbs)))
    second = TRAPEZOIDAL_ANGLE_AT_1E3 * share**0.5 / omega
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = duration, ceil(duration / max(fourth, second))
    integration.newton.useModifiedNewton = True
    integration.newton.relativeTolerance = min(0.1 * tolerance, 1e-4)
    newmark = integration.generalizedAlpha
    newmark.useNewmark = newmark.useIndex2Constraints = True
    newmark.newmarkBeta, newmark.newmarkGamma = (BETA if fourth >= second else 0.25), GAMMA
    return settings
