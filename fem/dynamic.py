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

from fem.arguments import Finite, checked
from fem.body import clamped_pair
from fem.checks import as_floats, number, require_kind
from fem.gear import GearPair, require
from fem.mesh import Density
from fem.nonlinear import Meshing, Rows, check, checked_load, correction, factorized, rows
from fem.pair import ROUNDING
from fem.progress import bar, shown
from fem.representation import exact
from fem.solid import internal_force, lumped_mass
from fem.ste import pair_attributes
from fem.touch import quarter_turn
from fem.units import rpm

__all__ = ["RunUp", "transmission_error"]

#: Newton steps in a time step; no step that converges moves te so far [modules].
ITERATIONS, FARTHEST = 40, 1.0


@dataclass(frozen=True)
class RunUp:
    """From rest to a constant speed [rad/s] of the pinion's hub.

    start, stop     phases between which the gears turn, within [-0.75, 0.75]: three teeth of each gear touch
    run_up          phase that passes before the speed is reached
    steps           time steps per pitch at full speed
    damping         force per mass and velocity of every point beyond that of steady rotation [1/s]
    alpha           of HHT: 0 keeps the energy, -1/3 damps most
    """

    speed: float = 10 * rpm
    start: float = -0.7
    stop: float = 0.7
    run_up: float = 0.35
    steps: int = 300
    damping: float = 0.0
    alpha: float = -0.1

    def __post_init__(self):
        as_floats(self)
        require(0 < self.speed < np.inf, f"speed must be > 0 and finite [rad/s], got {self.speed}")
        inside = -0.75 <= self.start < self.start + self.run_up < self.stop <= 0.75 and self.run_up > 0
        require(inside, f"start, start + run_up and stop must increase within [-0.75, 0.75], got {self}")
        require(-1 / 3 <= self.alpha <= 0, f"alpha must lie in [-1/3, 0], got {self.alpha}")
        require(20 <= number("steps", self.steps) < 1e9, f"steps must be at least 20 a pitch, got {self.steps}")
        require(0 <= self.damping < np.inf, f"damping must be >= 0 and finite [1/s], got {self.damping}")

    @checked
    def motion(self, t: Finite, pitch: Finite) -> tuple[float, float, float]:
        """Phase, speed and acceleration [rad/s, rad/s^2] of the pinion's hub at time t; pitch [rad]."""
        ramp = 2 * self.run_up * pitch / self.speed
        if t >= ramp:
            return self.start + self.run_up + (t - ramp) * self.speed / pitch, self.speed, 0.0
        angle = np.pi * t / ramp
        turned = self.speed * (t - ramp / np.pi * np.sin(angle)) / 2
        rate = np.pi / ramp * self.speed / 2 * np.sin(angle)
        return self.start + turned / pitch, self.speed / 2 * (1 - np.cos(angle)), rate

    @checked
    def times(self, pitch: Finite) -> np.ndarray:
        """All time steps [s]; pitch [rad]."""
        seconds = (self.stop - self.start + self.run_up) * pitch / self.speed
        return np.linspace(0, seconds, int(np.ceil((self.stop - self.start + self.run_up) * self.steps)) + 1)


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


def checked_run(pair: GearPair, torque, run: RunUp | None, density: Density | None, element: Element):
    """Torque, run-up and density, those not given by default; ValueError for what time integration does not take."""
    density, run = Density() if density is None else density, RunUp() if run is None else run
    check(pair, element, density)
    require_kind("run", run, RunUp)
    return float(checked_load(pair, number("torque", torque))[0]), run, density


def check_play(pair: GearPair, te: float, phase: float) -> None:
    """RuntimeError where back flanks would touch, which are not modelled; rounding as of `GearPair` may pass."""
    if te < -pair.backlash - ROUNDING * pair.pinion.m_n:
        apart = f"at phase {phase:g} the gears have parted by {-te:.3g} m, their backlash is {pair.backlash:.3g} m"
        less = "take a longer run_up, less speed, more torque or a larger a"
        raise RuntimeError(f"{apart}; back flanks are not modelled: {less}")


def over_time(times, te, phase, torque) -> xr.Dataset:
    """Labelled columns (n_time,)."""
    columns = {
        "te": ("time", te, {"units": "m", "long_name": "transmission error"}),
        "phase": ("time", phase, {"units": "1", "long_name": "phase"}),
        "torque": ("time", torque, {"units": "N m", "long_name": "load on the pinion"}),
    }
    return xr.Dataset(columns, {"time": ("time", times, {"units": "s", "long_name": "time"})})


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
