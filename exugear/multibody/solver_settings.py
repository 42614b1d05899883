"""Integrator, steps and samples of a run, and Exudyn's settings for them; the settings for hand-built models."""

import os
from dataclasses import dataclass, replace
from math import ceil, inf, pi, sqrt

import exudyn as exu
import numpy as np

from exugear.multibody.exudyn_objects import current_state
from exugear.multibody.gear_contact import contacts_of
from exugear.multibody.gear_sensor import teeth_touch
from exugear.multibody.guarded_solves import exudyn_settings
from exugear.multibody.model import Model
from exugear.multibody.turns import in_turn
from exugear.operation.conditions import Conditions
from exugear.planning.integrator_and_step import BETA, GAMMA, STABLE, Rule, rule_for
from exugear.planning.sampling import PERIOD_STEPS, Steps, steps_of
from fem.support.arguments import checked
from fem.support.user_warning import warn_user
from fem.support.validation import require, require_within

#: Share of the stability limit that is used where the stiffness of a single state is known: teeth may become twice as
#: stiff in others.
MARGIN = sqrt(0.5)
#: Newton's relative tolerance over the tolerance. At 1e-3, on bearings, it changes the rms of 95 % of the windows by
#: less than 4e-5 at a damping ratio of 0.02 and 2e-5 at 0.08, where the step changes it by 1e-2 and 5e-3 (measured).
#: A third of it costs 14 % more iterations.
NEWTON_SHARE = 0.1
#: The same where planets stand on pins, over that of other runs: their forces are evaluated at the expected ends of
#: steps, so that the first iteration is close already. It changes the rms of 95 % of the windows of DTE and mesh forces
#: by less than 7e-5 and 4e-4 at a damping ratio of 0.02, and 7e-4 and 1e-3 at 0.005, where the step changes them by at
#: least 2e-3 and 3e-3 and up to 8e-3 and 2e-2 (measured); at a third of it iterations take up to 12 % longer.
LOOSER_ON_PINS = 5.0
#: Residual over the largest static mesh force, over the tolerance: below it Newton's iteration stops.
RESIDUAL_SHARE = 1e-3
#: Residual by rounding over that of a single rounding of the angles at the end of a run.
ROUNDINGS = 4
#: Estimated wall time from which on a run warns at its start [s].
LONG_RUN = 1800.0
#: Step of a run over that of a run whose energy balance closes.
BALANCE_REFINEMENT = 3
#: Newton's tolerance of such a run over that of other runs, and the least tolerance, below which only rounding is left.
BALANCE_TOLERANCE_FACTOR, LEAST_BALANCE_TOLERANCE = 1e-3, 1e-7
#: Newton's relative tolerance where the residual of free bodies, planets on pins, shall be 1e-10 of the mesh forces, or
#: rounding: the torques of the members lack it.
CLOSE = 1e-10


def newton_relative(tolerance: float) -> float:
    """Newton's relative tolerance of a tolerance."""
    return NEWTON_SHARE * min(tolerance, 1e-3)


def settings_for(rule: Rule, duration: float, tolerance: float, residual: float = 0.0) -> exu.SimulationSettings:
    """Settings for mbs.SolveDynamic over a duration [s] in steps of at most the rule's.

    residual   of the equations of motion below which Newton's iteration stops [N, N m]
    """
    settings = exudyn_settings()
    settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = duration, ceil(duration / rule.step * (1 - 1e-9))
    integration.newton.useModifiedNewton = True
    integration.newton.relativeTolerance = newton_relative(tolerance)
    integration.newton.absoluteTolerance = max(integration.newton.absoluteTolerance, residual)
    newmark = integration.generalizedAlpha
    newmark.useNewmark = newmark.useIndex2Constraints = rule.spectral_radius is None
    newmark.newmarkBeta, newmark.newmarkGamma = rule.beta, GAMMA
    if rule.spectral_radius is not None:
        newmark.spectralRadius = rule.spectral_radius
    return settings


@dataclass(frozen=True)
class Scheme:
    """How a run is integrated and sampled.

    rule               integrator with its step
    steps              number and size of the steps, and which of them are sampled
    sensor_steps       steps between two samples of the user's sensors
    tolerance          relative error wanted
    newton_tolerance   that to which Newton's tolerance is proportional
    residual           of the equations of motion below which Newton's iteration stops [N, N m]
    jumps              where force laws jump and whether the steps meet the jumps; empty where none jumps
    """

    rule: Rule
    steps: Steps
    sensor_steps: int
    tolerance: float
    newton_tolerance: float
    residual: float
    jumps: str

    def settings(self, rule: Rule | None = None) -> exu.SimulationSettings:
        """Settings of Exudyn for the steps of the run, or for those of another rule."""
        rule = rule or self.rule
        return settings_for(rule, rule.step, self.newton_tolerance, self.residual)

    @property
    def relative_tolerance(self) -> float:
        """Of Newton's iteration."""
        return newton_relative(self.newton_tolerance)


def scheme_of(
    model: Model,
    conditions: Conditions,
    *,
    tolerance: float,
    step: float | Rule | None,
    sample: float,
    sensor_period: float | None,
) -> Scheme:
    """The scheme of a run; arguments as those of `exugear.run_up`. ValueError for intervals and steps out of range."""
    duration = conditions.duration
    require(0 < sample <= duration, f"sample must lie in (0, duration] s, got {sample}")
    period = sample if sensor_period is None else sensor_period
    require(0 < period <= duration, f"sensor_period must lie in (0, duration] s, got {sensor_period}")
    rule = _rule(model, conditions, tolerance, step)
    jumping = _jumping_meshes(model, conditions)
    size, newton_tolerance = rule.step, tolerance
    if step is None and jumping:
        shortest = min(mesh_period for mesh_period, _ in jumping.values())
        size = min(size, shortest / PERIOD_STEPS * sqrt(tolerance / 1e-3))
    if conditions.power:
        size = size if step else size / BALANCE_REFINEMENT
        newton_tolerance = min(tolerance, max(tolerance * BALANCE_TOLERANCE_FACTOR, LEAST_BALANCE_TOLERANCE))
        sample = 0.5 * size
    steps, jumps = steps_of(duration, size, sample, jumping, steady=conditions.constant_speed)
    least = LEAST_BALANCE_TOLERANCE if model.pins else newton_tolerance
    residual = _negligible_residual(model, conditions, least)
    newton_tolerance = CLOSE / NEWTON_SHARE if model.pins and conditions.power else newton_tolerance
    rule, sensor_steps = replace(rule, step=steps.size), steps.within(period)
    return Scheme(rule, steps, sensor_steps, tolerance, newton_tolerance, residual, jumps)


def check_cost(model: Model, scheme: Scheme) -> None:
    """Warn of a run that takes long; ValueError where its samples do not fit into the memory of this machine."""
    steps, plan = scheme.steps, model.plan
    cost = plan.cost(steps.number * steps.size, steps.size, steps.interval)
    enough = plan.memory(steps.samples) < memory_of_machine()
    every = f"the samples of the run, {steps.samples:.3g} at intervals of {steps.interval:.3g} s, exceed the memory"
    require(enough, f"{every} ({cost}); take a larger sample=, or run shorter parts with initial=")
    if plan.wall_time(steps.number) > LONG_RUN:
        remedy = "Take a larger step or tolerance, a shorter duration, or executor="
        warn_user(f"the run takes long: {cost}. {remedy}")


def memory_of_machine() -> float:
    """Memory of this machine [bytes]; inf where the system does not tell."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return inf


def _negligible_residual(model: Model, conditions: Conditions, tolerance: float) -> float:
    """Residual [N] that does not matter beside the static mesh forces, or that is rounding.

    Angles are rounded, and positions of planets that orbit.
    """
    names = [shaft.name for shaft in model.gearbox.shafts]
    torques = np.zeros(len(names))
    for name, table in conditions.tables.items():
        torques[names.index(model.gearbox.ends[name].name)] += table.largest
    force = max(float(np.abs(mesh.force_per_torque) @ torques) for mesh in model.meshes)
    starts = [abs(imposed.start_angle) for imposed in conditions.imposed]
    angle = conditions.fastest * conditions.duration + max(starts, default=0.0)
    stiffness = max(mesh.law.stiffness_max * mesh.stage.pair.pinion.r_b for mesh in model.meshes)
    positions = max(mesh.law.stiffness_max * abs(mesh.stage.pair.a) for mesh in model.meshes) if model.pins else 0.0
    rounding = ROUNDINGS * np.finfo(float).eps * (angle * stiffness + positions)
    return max(RESIDUAL_SHARE * tolerance * force, float(rounding))


def _rule(model: Model, conditions: Conditions, tolerance: float, step: float | Rule | None) -> Rule:
    """Integrator and step by the tolerance or by the user's choice; ValueError for unstable steps."""
    mesh_frequency = float(conditions.highest_mesh_frequencies.max())
    chosen = model.plan.rule(tolerance, mesh_frequency)
    if step is None:
        return chosen
    rule, largest = step if isinstance(step, Rule) else Rule(BETA, step), model.plan.largest_step
    require(0 < rule.step < inf, f"step must be > 0 s and finite, got {rule.step}")
    limit = f"omega h < {STABLE:.3g} at {model.plan.omega / 2 / pi:.4g} Hz"
    stable = rule.step < largest or rule.always_stable
    require(stable, f"step must be below {largest:.4g} s ({limit}: stability), got {rule.step:g} s")
    return rule


def _jumping_meshes(model: Model, conditions: Conditions) -> dict[str, tuple[float, np.ndarray]]:
    """Shortest mesh period of the run [s] and phases of the jumps, by the label of each stage whose law jumps."""
    frequencies = conditions.highest_mesh_frequencies.tolist()
    stages = zip(model.gearbox.labels, model.meshes, frequencies, strict=True)
    return {label: (1 / f, mesh.law.jumps) for label, mesh, f in stages if f > 0 and mesh.law.jumps.size}


def highest_frequency(mbs) -> float:
    """Highest eigenfrequency [Hz] of the assembled system about its initial state, constraints ignored.

    Nodes with Euler parameters have a singular mass matrix, which the symmetric eigenproblem of `undamped_modes` would
    refuse.
    """
    mass, stiffness, *_ = (np.array(matrix) for matrix in mbs.ComputeLinearizedSystem())
    squares = np.linalg.eigvals(np.linalg.pinv(mass, hermitian=True) @ (stiffness + stiffness.T) / 2)
    return sqrt(max(squares.real.max(), 0.0)) / (2 * pi)


@checked
@in_turn
def integrator(
    mbs: exu.MainSystem, duration: float, frequency: float, *, tolerance: float = 1e-3
) -> exu.SimulationSettings:
    """Settings for mbs.SolveDynamic on a hand-built model, for example with flexible bodies coupled to the gears.

    duration    [s]
    frequency   highest frequency to be resolved [Hz]: that of the mesh, or of its resonance, whichever is higher
    tolerance   relative error wanted of the rms of the DTE

    Newmark beta = 1/12 is of fourth order but stable for omega h < 6^0.5 only, omega being the highest eigenfrequency.
    The trapezoidal rule is of second order and always stable; it allows the larger step where the model is far stiffer
    than the frequencies of interest. The initial state counts: call this when the teeth are in contact there, after
    mbs.SolveStatic(updateInitialValues=True); it warns where no teeth touch. Raises ValueError for input out of
    range.
    """
    require(0 < duration < inf, f"duration must be > 0 s and finite, got {duration}")
    require(bool(mbs.systemIsConsistent), "mbs must be assembled; call mbs.Assemble()")
    with current_state(mbs):
        highest = highest_frequency(mbs) if mbs.systemData.ODE2Size() else 0.0
    in_contact = "call integrator with the teeth in contact there: mbs.SolveStatic(updateInitialValues=True)"
    require(highest > 0, f"mbs has no stiffness in its initial state; {in_contact}")
    contacts = contacts_of(mbs)
    if contacts and not any(teeth_touch(mbs, contact, number) for number, contact in contacts.items()):
        warn_user(f"no teeth touch in the initial state, so that steps may be unstable; {in_contact}")
    require_within("frequency", frequency, 0, 1e6, remedy="Hz (of the mesh: z n / 60)")
    largest = MARGIN * STABLE / (2 * pi * highest)
    return settings_for(rule_for(2 * pi * frequency, largest, tolerance), duration, tolerance)
