"""Common parts of implicit and explicit time integration: run from rest to a constant speed, load, result.

Each gear is described in the frame of its hub, where the elements deform little; centrifugal, Coriolis and Euler forces
account for the motion of that frame. The hub of the pinion turns as prescribed; the hub of the wheel is free and has a
viscous load in proportion to its speed.
"""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from skfem.element import Element

from fem.elasticity.mesh_density import Density
from fem.pair.pair import ROUNDING, GearPair
from fem.reference.nonlinear import check, checked_load
from fem.ste.ste_map import pair_attributes
from fem.support.arguments import Finite, checked
from fem.support.validation import as_floats, number, require, require_kind
from fem.units import rpm


@dataclass(frozen=True)
class RunUp:
    """Run-up of the pinion's hub from rest to a constant speed [rad/s].

    start, stop     phases between which the gears turn, within [-0.75, 0.75]
    run_up          change of phase until the speed is reached
    steps           time steps per pitch at full speed
    damping         force per mass and velocity of every point relative to steady rotation [1/s]
    alpha           parameter of HHT: 0 conserves energy, -1/3 damps most

    Raises ValueError for values out of range.
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
        acceleration = np.pi / ramp * self.speed / 2 * np.sin(angle)
        return self.start + turned / pitch, self.speed / 2 * (1 - np.cos(angle)), acceleration

    @checked
    def times(self, pitch: Finite) -> np.ndarray:
        """(n_time,) times [s] of all steps; pitch [rad]."""
        seconds = (self.stop - self.start + self.run_up) * pitch / self.speed
        return np.linspace(0, seconds, int(np.ceil((self.stop - self.start + self.run_up) * self.steps)) + 1)


@dataclass(frozen=True)
class LoadedRun:
    """A run-up of a pair under a viscous load that is `torque` [N m] on the pinion at full speed."""

    pair: GearPair
    torque: float
    run: RunUp

    @property
    def speed_ratio(self) -> float:
        """Speed of the wheel over that of the pinion, < 0."""
        return -self.pair.pinion.z / self.pair.wheel.z

    @property
    def times(self) -> np.ndarray:
        """(n_time,) times of all steps [s]."""
        return self.run.times(self.pitch)

    @property
    def pitch(self) -> float:
        """Angle of the pinion per mesh cycle [rad]."""
        return 2 * np.pi / self.pair.pinion.z

    def motion(self, t: float) -> tuple[float, float, float]:
        """Phase, speed and acceleration of the pinion's hub from `RunUp.motion`."""
        return self.run.motion(t, self.pitch)

    @property
    def viscosity(self) -> float:
        """Load on the line of action per velocity of the wheel's base circle [N s/m]."""
        return self.torque / (self.run.speed * self.pair.pinion.r_b**2)

    def load_torque(self, spin, te_rate):
        """Load on the pinion [N m] while its hub turns at spin [rad/s] and te changes at te_rate [m/s]."""
        return self.viscosity * (spin * self.pair.pinion.r_b - te_rate) * self.pair.pinion.r_b

    def check_backlash(self, te: float, phase: float) -> None:
        """RuntimeError where coast flanks, which are not modelled, would touch; ROUNDING of `GearPair` is allowed."""
        if te < -self.pair.backlash - ROUNDING * self.pair.pinion.m_n:
            parted = f"at phase {phase:g} the gears have parted by {-te:.3g} m, their backlash is"
            remedy = "take a longer run_up, less speed, more torque or a larger a"
            message = f"{parted} {self.pair.backlash:.3g} m; coast flanks are not modelled: {remedy}"
            raise RuntimeError(message)

    def result(self, te, phase, load_torque, **attributes) -> xr.Dataset:
        """Labelled columns (n_time,) with the pair and further attributes."""
        columns = {
            "te": ("time", te, {"units": "m", "long_name": "transmission error"}),
            "phase": ("time", phase, {"units": "1", "long_name": "phase"}),
            "torque": ("time", load_torque, {"units": "N m", "long_name": "load on the pinion"}),
        }
        time = {"time": ("time", self.times, {"units": "s", "long_name": "time"})}
        return xr.Dataset(columns, time, {**pair_attributes(self.pair), "torque": self.torque, **attributes})


def checked_run(pair: GearPair, torque, run: RunUp | None, density: Density | None, element: Element):
    """`LoadedRun` and density with their defaults; ValueError for input that time integration does not support."""
    density, run = Density() if density is None else density, RunUp() if run is None else run
    ring = "pair must be of two external gears, run-ups of rings are not modelled; take fem.nonlinear for their statics"
    require(not pair.internal, f"{ring}, or exugear.run, got {pair}")
    check(pair, element, density)
    require_kind("run", run, RunUp)
    return LoadedRun(pair, float(checked_load(pair, number("torque", torque))[0]), run), density
