"""What implicit and explicit time integration share: the run from rest to speed, its checks, its result."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from skfem.element import Element

from fem.elasticity.mesh_density import Density
from fem.pair.pair import ROUNDING, GearPair
from fem.reference.nonlinear import check, checked_load
from fem.support.arguments import Finite, checked
from fem.support.validation import as_floats, number, require, require_kind
from fem.units import rpm


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
