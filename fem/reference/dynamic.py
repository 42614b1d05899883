"""Transmission error by implicit time integration of both gears of finite elements: run-up of the pinion from rest.

In the frames of the hubs (`fem.reference.time_integration`) find displacements u of both gears and te with

    M (u'' + 2 w x u' + w' x r + w x (w x r)) + d M v = -R(u) + G^T f       nodes; w: spin of the hub, r: position
    sum r x (inertia and damping of the wheel) / r_b2 = load - c . f        hub of the wheel, on the line of action

with the contact conditions, gaps and Newton steps of `fem.nonlinear`; v is the velocity relative to steady rotation.
Time steps by HHT-alpha: Newmark's rule, forces averaged between both ends of a step with the weight alpha (Hilber,
Hughes, Taylor, Improved numerical dissipation for time integration algorithms in structural dynamics, 1977).
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import xarray as xr
from skfem import ElementQuad1
from skfem.element import Element

from fem.elasticity.mesh_density import Density
from fem.pair.pair import GearPair
from fem.reference.deformable_gear import clamped_pair
from fem.reference.deformed_flank import quarter_turn
from fem.reference.mortar import MatingGears, PairGaps, pair_gaps
from fem.reference.nonlinear import ContactProblem, contact_problem, newton_step
from fem.reference.st_venant_kirchhoff import internal_force
from fem.reference.time_integration import LoadedRun, RunUp, checked_run
from fem.support.arguments import checked
from fem.support.progress import bar, shown
from fem.support.representation import exact
from fem.support.validation import require

__all__ = ["RunUp", "transmission_error"]


def __dir__() -> list[str]:
    """Public names, for help and completion."""
    return __all__


#: Newton steps in a time step; where one moves te by more than LARGEST_STEP [modules] the iteration diverges.
NEWTON_STEPS, LARGEST_STEP = 40, 1.0
#: A time step has converged where Newton moves nodes by less than this share of the pinion's largest displacement.
TOLERANCE = 1e-6


class Motion(NamedTuple):
    """Displacements u (n_dofs, 2) of both gears in their frames and te; also their rates, or the forces on them."""

    u: tuple[np.ndarray, np.ndarray]
    te: float

    def plus(self, change: "Motion", factor: float) -> "Motion":
        pinion, wheel = (u + factor * du for u, du in zip(self.u, change.u, strict=True))
        return Motion((pinion, wheel), self.te + factor * change.te)


class State(NamedTuple):
    """Displacement, velocity, acceleration and all forces at the end of a time step."""

    displacement: Motion
    velocity: Motion
    acceleration: Motion
    force: Motion


@dataclass(frozen=True)
class Newmark:
    """Newmark's rule with the parameters beta = (1 - alpha)^2 / 4, gamma = 1/2 - alpha of HHT and a time step [s]."""

    alpha: float
    step: float

    @property
    def acceleration_change(self) -> float:
        """1 / (beta step^2): change of the acceleration per change of the displacement [1/s^2]."""
        return 4 / ((1 - self.alpha) ** 2 * self.step**2)

    @property
    def velocity_change(self) -> float:
        """gamma / (beta step): change of the velocity per change of the displacement [1/s]."""
        return (0.5 - self.alpha) * self.step * self.acceleration_change

    def predicted(self, displacement: Motion, velocity: Motion, acceleration: Motion) -> tuple[Motion, Motion, Motion]:
        """Displacement, velocity and acceleration after a step with acceleration 0 at its end."""
        beta, gamma = 1 / (self.acceleration_change * self.step**2), 0.5 - self.alpha
        ahead = displacement.plus(velocity, self.step).plus(acceleration, self.step**2 / 2)
        ahead = ahead.plus(acceleration, -beta * self.step**2)
        zero = Motion((0 * acceleration.u[0], 0 * acceleration.u[1]), 0.0)
        return ahead, velocity.plus(acceleration, self.step * (1 - gamma)), zero

    def corrected(self, motions: tuple[Motion, Motion, Motion], change: Motion) -> tuple[Motion, Motion, Motion]:
        """Displacement, velocity and acceleration after a change of the displacement at the end of the step."""
        displacement, velocity, acceleration = motions
        return (
            displacement.plus(change, 1.0),
            velocity.plus(change, self.velocity_change),
            acceleration.plus(change, self.acceleration_change),
        )


@checked
def transmission_error(
    pair: GearPair,
    torque: float,
    run: RunUp | None = None,
    *,
    density: Density | None = None,
    element: Element | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Transmission error "te" [m], "phase" and the present load "torque" on the pinion [N m] over "time" [s].

    torque      pinion torque F r_b1 at full speed [N m]; the viscous load follows the speed of the wheel's hub, which
                varies with te: compare with statics under the present load
    run         speed, phases, steps and damping of the run-up
    density     density of the FE mesh; teeth that it leaves out count as inertia of the hub
    element     element of scikit-fem: ElementQuad1() by default (plane strain)

    Raises ValueError for bad input, RuntimeError where a step does not converge or the gears separate by the backlash.
    """
    element = element or ElementQuad1()
    require(element.dim == 2, f"element must be a quadrilateral (plane strain), got {type(element).__name__}")
    loaded, density = checked_run(pair, torque, run, density, element)
    equations, times = equations_of_motion(loaded, density, element), loaded.times
    state = equations.at_rest()
    phase, spin, _ = np.array([loaded.motion(t) for t in times]).T
    te, te_rate = np.zeros((2, times.size))
    with shown(progress):
        for i, t in enumerate(bar(times[1:], "time integration"), start=1):
            state = equations.step(state, t)
            te[i], te_rate[i] = state.displacement.te, state.velocity.te
            loaded.check_backlash(te[i], phase[i])
    load_torque = loaded.load_torque(spin, te_rate)
    return loaded.result(te, phase, load_torque, method="HHT-alpha", density=exact(density))


def equations_of_motion(loaded: LoadedRun, density: Density, element: Element) -> "EquationsOfMotion":
    """Equations of both gears with their masses, factorized for a time step."""
    gears, times = clamped_pair(loaded.pair, density, element), loaded.times
    rule = Newmark(loaded.run.alpha, times[1] - times[0])
    pinion, wheel = (gear.masses for gear in gears)
    dynamic = stiffness_per_mass(rule, loaded.run)
    mating = MatingGears(loaded.pair, gears, wheel_share=1.0)
    return EquationsOfMotion(
        contact_problem(mating, (dynamic * pinion, dynamic * wheel)), (pinion, wheel), loaded, rule
    )


def stiffness_per_mass(rule: Newmark, run: RunUp) -> float:
    """Change of the forces of inertia and damping per mass and displacement [1/s^2]."""
    return rule.acceleration_change / (1 + run.alpha) + run.damping * rule.velocity_change


@dataclass(frozen=True)
class EquationsOfMotion:
    """Time steps of both gears; masses (n_dofs,) [kg] of pinion and wheel."""

    problem: ContactProblem
    masses: tuple[np.ndarray, np.ndarray]
    loaded: LoadedRun
    rule: Newmark

    def at_rest(self) -> State:
        pinion, wheel = (gear.undeformed() for gear in self.problem.gears)
        rest = Motion((pinion, wheel), 0.0)
        return State(rest, rest, rest, rest)

    def applied_forces(self, displacement: Motion, velocity: Motion, drive: float) -> Motion:
        """Internal, damping and load forces; drive is the velocity of the pinion's base circle [m/s]."""
        forces, on_hub, r_b = [], 0.0, self.loaded.pair.wheel.r_b
        sides = zip(self.problem.gears, self.masses, displacement.u, velocity.u, strict=True)
        for side, (gear, mass, u, v) in enumerate(sides):
            per_te = quarter_turn((gear.solid.positions + u).T).T / r_b
            relative = v + side * per_te * velocity.te
            damping = self.loaded.run.damping * mass[:, None] * relative
            forces.append(-internal_force(gear.solid, u) - damping)
            on_hub -= side * (per_te * damping).sum()
        return Motion((forces[0], forces[1]), on_hub + self.loaded.viscosity * (drive - velocity.te))

    def inertia_forces(self, motions: tuple[Motion, Motion, Motion], spin: float, euler: float) -> Motion:
        """Mass times acceleration; spin and euler are the speed and acceleration of the pinion's hub."""
        displacement, velocity, acceleration = motions
        r_b, ratio, forces = self.loaded.pair.wheel.r_b, self.loaded.speed_ratio, []
        spins = (spin, ratio * spin + velocity.te / r_b)
        eulers = (euler, ratio * euler + acceleration.te / r_b)
        for side, (gear, mass) in enumerate(zip(self.problem.gears, self.masses, strict=True)):
            omega, position = spins[side], (gear.solid.positions + displacement.u[side]).T
            frame = eulers[side] * quarter_turn(position) - omega**2 * position
            frame = frame + 2 * omega * quarter_turn(velocity.u[side].T)
            forces.append(mass[:, None] * (acceleration.u[side] + frame.T))
        on_hub = (quarter_turn(position).T * forces[1]).sum() / r_b
        return Motion((forces[0], forces[1]), on_hub)

    def step(self, state: State, t: float) -> State:
        """State at time t after the state of the step before."""
        phase, spin, euler = self.loaded.motion(t)
        drive = spin * self.loaded.pair.pinion.r_b
        candidates = self.problem.mating.candidates(phase, state.displacement.te)
        motions = self.rule.predicted(*state[:3])
        for _ in range(NEWTON_STEPS):
            residual = self._residual(motions, state.force, drive, (spin, euler))
            gaps = pair_gaps(self.problem.mating, candidates, phase, motions[0].te, motions[0].u)
            change, f = self._newton_step(gaps, motions[0].te, residual)
            if not abs(change.te) < LARGEST_STEP * self.loaded.pair.pinion.m_n:
                break
            motions = self.rule.corrected(motions, change)
            if max(np.abs(du).max() for du in change.u) < TOLERANCE * max(np.abs(motions[0].u[0]).max(), 1e-9):
                applied = self.applied_forces(motions[0], motions[1], drive)
                return State(*motions, applied.plus(self._contact_forces(gaps, f), 1.0))
        remedy = "use more steps per pitch, a longer run_up or alpha nearer -1/3"
        raise RuntimeError(f"no balance at phase {phase:g}; {remedy}")

    def _residual(self, motions, last_force: Motion, drive: float, hub: tuple[float, float]) -> Motion:
        """Unbalanced forces of HHT apart from the contact; last_force at the start of the step."""
        alpha, inertia = self.loaded.run.alpha, self.inertia_forces(motions, *hub)
        applied = self.applied_forces(motions[0], motions[1], drive)
        return applied.plus(inertia.plus(last_force, alpha), -1 / (1 + alpha))

    def _newton_step(self, gaps: PairGaps, te: float, residual: Motion) -> tuple[Motion, np.ndarray]:
        """Step towards the balance of the residual, and contact forces (n,) [N].

        The displacement of the wheel, K du = r - c dte, is eliminated from the equation of its hub; c as `_coupling`.
        """
        coupling, response = self._coupling
        operator = self.problem.gears[1].flank_operator
        closing = gaps.closing + gaps.gradients[1] @ (operator @ response.ravel())
        hub_stiffness = self._hub_stiffness - (coupling * response).sum()
        force = residual.te - (response * residual.u[1]).sum()
        step = newton_step(self.problem, replace(gaps, closing=closing), te, residual.u, force, hub_stiffness)
        change = step.te - te
        return Motion((step.du[0], step.du[1] - response * change), change), step.contact_forces

    @cached_property
    def _coupling(self) -> tuple[np.ndarray, np.ndarray]:
        """Forces of inertia and damping c on the wheel's nodes per te [N/m] and their response K^-1 c, (n_dofs, 2)."""
        per_te = quarter_turn(self.problem.gears[1].solid.positions.T).T / self.loaded.pair.wheel.r_b
        coupling = (stiffness_per_mass(self.rule, self.loaded.run) * self.masses[1])[:, None] * per_te
        return coupling, self.problem.solvers[1](coupling[..., None])[..., 0]

    @cached_property
    def _hub_stiffness(self) -> float:
        """Change of inertia, damping and load of the rigid wheel per te, on the line of action [N/m]."""
        positions, run = self.problem.gears[1].solid.positions, self.loaded.run
        mass = (self.masses[1][:, None] * positions**2).sum() / self.loaded.pair.wheel.r_b**2
        viscous = (run.damping * mass + self.loaded.viscosity) * self.rule.velocity_change
        return float(mass * self.rule.acceleration_change / (1 + run.alpha) + viscous)

    def _contact_forces(self, gaps: PairGaps, f: np.ndarray) -> Motion:
        """Nodal forces of contact forces f (n,) on both gears, and their force on te."""
        sides = zip(self.problem.gears, gaps.gradients, strict=True)
        pinion, wheel = ((gear.flank_operator.T @ (f @ by)).reshape(gear.solid.positions.shape) for gear, by in sides)
        return Motion((pinion, wheel), -float(gaps.closing @ f))
