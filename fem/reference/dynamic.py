"""Transmission error by time integration of both gears of finite elements: run-up of the pinion's hub from rest.

Each gear lives in the frame of its hub, where the elements stay near rest; centrifugal, Coriolis and Euler forces bring
the inertia of the turning body back. The pinion's hub turns as prescribed, the wheel's hub follows against a viscous
load torque. Implicit in time (HHT-alpha: Hilber, Hughes, Taylor 1977), contact as in `fem.nonlinear`.
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
from fem.reference.mortar import quarter_turn
from fem.reference.nonlinear import Meshing, Rows, correction, factorized, rows
from fem.reference.st_venant_kirchhoff import internal_force, lumped_mass
from fem.reference.time_integration import RunUp, check_play, checked_run, over_time
from fem.ste.ste_map import pair_attributes
from fem.support.arguments import checked
from fem.support.progress import bar, shown
from fem.support.representation import exact
from fem.support.validation import require

__all__ = ["RunUp", "transmission_error"]

#: Newton steps in a time step; no step that converges moves te so far [modules].
ITERATIONS, FARTHEST = 40, 1.0


class Motion(NamedTuple):
    """Displacements of both gears in their frames (n_dofs, 2) and transmission error, or a time derivative of them."""

    u: tuple[np.ndarray, np.ndarray]
    te: float

    def plus(self, other: "Motion", factor: float) -> "Motion":
        u = tuple(one + factor * two for one, two in zip(self.u, other.u, strict=True))
        return Motion((u[0], u[1]), self.te + factor * other.te)


@dataclass(frozen=True)
class Newmark:
    """Newmark's rule with the parameters of HHT and a time step [s]."""

    alpha: float
    step: float

    @property
    def per_place(self) -> float:
        """Acceleration per displacement [1/s^2]."""
        return 4 / ((1 - self.alpha) ** 2 * self.step**2)

    @property
    def per_speed(self) -> float:
        """Velocity per displacement [1/s]."""
        return (0.5 - self.alpha) * self.step * self.per_place

    def predicted(self, at: Motion, speed: Motion, rate: Motion) -> tuple[Motion, Motion, Motion]:
        """Motion, velocity and acceleration after a step in which nothing moves but at constant velocity."""
        moved = at.plus(speed, self.step).plus(rate, self.step**2 / 2)
        beta, gamma = 1 / (self.per_place * self.step**2), 0.5 - self.alpha
        slower = speed.plus(rate, self.step * (1 - gamma))
        ahead = moved.plus(rate, -beta * self.step**2)
        return ahead, slower, Motion((0 * rate.u[0], 0 * rate.u[1]), 0.0)


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
    """Transmission error "te" [m] over "time" [s], and "phase" and load "torque" on the pinion [N m] of the moment.

    torque      pinion torque F r_b1 at full speed [N m]; the viscous load follows the speed of the wheel's hub, which
                te slows down and speeds up: it is the load of the moment that the statics must be compared under
    density     of the FE mesh, element of scikit-fem: ElementQuad1() by default (plane strain)

    Raises ValueError for bad input, RuntimeError where a step does not converge or the gears part beyond the backlash.
    """
    element = element or ElementQuad1()
    require(element.dim == 2, f"element must be a quadrilateral (plane strain), got {type(element).__name__}")
    torque, run, density = checked_run(pair, torque, run, density, element)
    pitch = 2 * np.pi / pair.pinion.z
    times = run.times(pitch)
    rule = Newmark(run.alpha, times[1] - times[0])
    system = turning_gears(pair, torque, run, rule, density, element)
    still = Motion((system.meshing.bodies[0].rest(), system.meshing.bodies[1].rest()), 0.0)
    state = (still, still, still, still)
    phase, spin, _ = np.array([run.motion(t, pitch) for t in times]).T
    te, rate = np.zeros((2, times.size))
    with shown(progress):
        for i, t in enumerate(bar(times[1:], "time integration"), start=1):
            state = system.step(state, t)
            te[i], rate[i] = state[0].te, state[1].te
            check_play(pair, te[i], phase[i])
    of_moment = system.load * (spin * pair.pinion.r_b - rate) * pair.pinion.r_b
    attributes = {**pair_attributes(pair), "torque": torque, "method": "HHT-alpha", "density": exact(density)}
    return over_time(times, te, phase, of_moment).assign_attrs(attributes)


def stiffness_per_mass(rule: Newmark, run: RunUp) -> float:
    """Force of inertia and damping per mass and step [1/s^2]."""
    return rule.per_place / (1 + run.alpha) + run.damping * rule.per_speed


def turning_gears(pair, torque: float, run: RunUp, rule: Newmark, density: Density, element: Element) -> "System":
    """Both gears with their masses, factorized for a time step."""
    bodies = clamped_pair(pair, density, element)
    masses = tuple(lumped_mass(body.solid) for body in bodies)
    added = tuple(stiffness_per_mass(rule, run) * mass for mass in masses)
    meshing = factorized(pair, bodies, added, penalty=np.inf, lag=1.0)
    return System(meshing, masses, torque / pair.pinion.r_b, run, rule)  # type: ignore[arg-type]


@dataclass(frozen=True)
class System:
    """Equations of motion; force is the mesh force at full speed [N]."""

    meshing: Meshing
    masses: tuple[np.ndarray, np.ndarray]
    force: float
    run: RunUp
    rule: Newmark

    @property
    def load(self) -> float:
        """Viscous load on the wheel's hub: force on the line of action per velocity there [N s/m]."""
        return self.force / (self.run.speed * self.meshing.pair.pinion.r_b)

    def applied(self, at: Motion, speed: Motion, drive: float) -> Motion:
        """Internal, damping and load forces; drive is the velocity of the pinion's base circle [m/s]."""
        found, torque = [], 0.0
        for side, (body, mass, u, v) in enumerate(zip(self.meshing.bodies, self.masses, at.u, speed.u, strict=True)):
            turning = quarter_turn((body.solid.places + u).T).T / self.meshing.pair.wheel.r_b
            beyond = v + side * turning * speed.te
            damping = self.run.damping * mass[:, None] * beyond
            found.append(-internal_force(body.solid, u) - damping)
            torque -= side * (turning * damping).sum()
        return Motion((found[0], found[1]), torque + self.load * (drive - speed.te))

    def inertia(self, at: Motion, speed: Motion, rate: Motion, spin: float, euler: float) -> Motion:
        """Mass times acceleration; spin and euler are the speed and acceleration of the pinion's hub."""
        pair, found, along = self.meshing.pair, [], 0.0
        ratio = -pair.pinion.z / pair.wheel.z
        turns = ((spin, euler), (ratio * spin + speed.te / pair.wheel.r_b, ratio * euler + rate.te / pair.wheel.r_b))
        for side, (body, mass) in enumerate(zip(self.meshing.bodies, self.masses, strict=True)):
            (omega, rising), place = turns[side], (body.solid.places + at.u[side]).T
            swept = rising * quarter_turn(place) + 2 * omega * quarter_turn(speed.u[side].T) - omega**2 * place
            found.append(mass[:, None] * (rate.u[side] + swept.T))
            along += side * (quarter_turn(place).T * found[side]).sum() / pair.wheel.r_b
        return Motion((found[0], found[1]), along)

    def step(self, state: tuple[Motion, Motion, Motion, Motion], t: float, tolerance: float = 1e-6):
        """Motion, velocity, acceleration and all forces at time t after those one step before."""
        pair, alpha = self.meshing.pair, self.run.alpha
        phase, spin, euler = self.run.motion(t, 2 * np.pi / pair.pinion.z)
        drive, touches = spin * pair.pinion.r_b, self.meshing.touches(phase, state[0].te)
        at, speed, rate = self.rule.predicted(*state[:3])
        for _ in range(ITERATIONS):
            applied = self.applied(at, speed, drive)
            moving = self.inertia(at, speed, rate, spin, euler).plus(state[3], alpha)
            rest = applied.plus(moving, -1 / (1 + alpha))
            here = rows(self.meshing, touches, phase, at.te, at.u)
            change, f = self._change(here, at.te, rest)
            if not abs(change.te) < FARTHEST * pair.pinion.m_n:
                break
            at, speed = at.plus(change, 1.0), speed.plus(change, self.rule.per_speed)
            rate = rate.plus(change, self.rule.per_place)
            if max(np.abs(du).max() for du in change.u) < tolerance * max(np.abs(at.u[0]).max(), 1e-9):
                contact = self._contact(here, f)
                return at, speed, rate, self.applied(at, speed, drive).plus(contact, 1.0)
        longer = "use more steps per pitch, a longer run_up or alpha nearer -1/3"
        raise RuntimeError(f"no balance at phase {phase:g}; {longer}")

    def _change(self, here: Rows, te: float, rest: Motion) -> tuple[Motion, np.ndarray]:
        """Newton step towards the balance of what is at rest, and forces under the hats (n,) [N].

        The wheel's nodes ride on its hub: by a step of te they move as `_riding` says, if nothing else presses them.
        """
        pushed, riding = self._riding
        moved = here.by[1] @ (self.meshing.bodies[1].transverse @ riding.ravel())
        inertia, force = self._inertia_of_error - (pushed * riding).sum(), rest.te - (riding * rest.u[1]).sum()
        new = correction(self.meshing, replace(here, closing=here.closing + moved), te, rest.u, force, inertia)
        return Motion((new.du[0], new.du[1] - riding * (new.te - te)), new.te - te), new.f

    @cached_property
    def _riding(self) -> tuple[np.ndarray, np.ndarray]:
        """Forces of inertia and damping on the wheel's nodes per te [N/m], how these lag behind, each (n_dofs, 2)."""
        turning = quarter_turn(self.meshing.bodies[1].solid.places.T).T / self.meshing.pair.wheel.r_b
        pushed = (stiffness_per_mass(self.rule, self.run) * self.masses[1])[:, None] * turning
        return pushed, self.meshing.solve[1](pushed[..., None])[..., 0]

    @cached_property
    def _inertia_of_error(self) -> float:
        """Derivative of the balance on the line of action by the transmission error [N/m]."""
        places = self.meshing.bodies[1].solid.places
        mass = (self.masses[1][:, None] * places**2).sum() / self.meshing.pair.wheel.r_b**2
        damped = (self.run.damping * mass + self.load) * self.rule.per_speed
        return float(mass * self.rule.per_place / (1 + self.run.alpha) + damped)

    def _contact(self, here, f: np.ndarray) -> Motion:
        found = []
        for body, by in zip(self.meshing.bodies, here.by, strict=True):
            found.append((body.transverse.T @ (f @ by)).reshape(body.solid.places.shape))
        return Motion((found[0], found[1]), -float(here.closing @ f))
