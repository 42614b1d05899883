"""Motion of all shafts and rotors over a run, with the rates corrected for the lag of the integrator."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from exugear.multibody.drive_and_load import ShaftTorques
from exugear.multibody.model import Model, on_bearings
from exugear.operation.conditions import Conditions

#: Second derivative over the squared spacing: in the middle of five values, and of the first two of six values.
MIDDLE = np.array([-1, 16, -30, 16, -1]) / 12
ENDS = np.array([[45, -154, 214, -156, 61, -10], [10, -15, -4, 14, -6, 1]]) / 12


@dataclass(frozen=True, eq=False)
class ShaftMotion:
    """Motion of a shaft or of a rotor, over (n,) samples.

    spin, speed   about z [rad, rad/s]
    q, q_t        (n, 5) displacements [m] and tilts [rad] of the centre of mass, and their rates; None for a shaft that
                  only spins
    """

    spin: np.ndarray
    speed: np.ndarray
    q: np.ndarray | None = None
    q_t: np.ndarray | None = None


def motions(
    model: Model, conditions: Conditions, torques: ShaftTorques, time: np.ndarray, lag: float
) -> dict[str, ShaftMotion]:
    """Motion of each shaft by its name, and of each rotor by its own; lag: of the velocities [s^2]."""
    factor = lag / (time[1] - time[0]) ** 2 if time.size > 1 else 0.0
    by_name = {}
    for mesh in model.meshes:
        for side, shaft in enumerate((mesh.stage.fast, mesh.stage.slow)):
            samples = mesh.recorder.power
            spin, speed = samples[f"spin_{side + 1}"], corrected(samples[f"speed_{side + 1}"], factor)
            q, q_t = mesh.recorder.motion(side) if on_bearings(model, mesh) else (None, None)
            moves = q is not None and model.plan.shafts[shaft.name].on_bearings
            rates = corrected(np.asarray(q_t, float), factor) if moves else None
            by_name[shaft.name] = ShaftMotion(spin, speed, np.asarray(q, float) if moves else None, rates)
    for name in model.rotor_spins:
        recorder = torques[name].recorder
        spin, speed = recorder["angle"][: time.size], recorder["speed"][: time.size]
        by_name[name] = ShaftMotion(spin, corrected(speed, factor))
    return by_name | _imposed(model, conditions, time, by_name)


def _imposed(model: Model, conditions: Conditions, time: np.ndarray, recorded: Mapping[str, ShaftMotion]):
    """The motion of the shaft or rotor whose speed is imposed, with that speed."""
    if conditions.held is None:
        return {}
    name = model.gearbox.ends[conditions.held].end
    speed = model.gearbox.directions[conditions.held] * conditions.speed_of(time)
    motion = recorded[name]
    return {name: ShaftMotion(motion.spin, speed * np.ones(time.size), motion.q, motion.q_t)}


def corrected(rate: np.ndarray, factor: float) -> np.ndarray:
    """Rates (n, ...) of fourth order: rate - lag d2(rate)/dt2; factor: lag over the squared spacing of the samples."""
    if factor == 0.0 or len(rate) < ENDS.shape[1]:
        return rate
    curvature = np.empty_like(rate)
    curvature[2:-2] = sum(c * rate[i : len(rate) - 4 + i] for i, c in enumerate(MIDDLE))
    curvature[:2] = np.tensordot(ENDS, rate[:6], 1)
    curvature[-2:] = np.tensordot(ENDS[::-1, ::-1], rate[-6:], 1)
    return rate - factor * curvature
