"""Motion of a gear train as one rigid body: its acceleration under torques, and the speeds to expect of a run."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy

from exugear.gearbox.gearbox import Gearbox
from fem.support.validation import require
from fem.units import rpm

#: Relative tolerance of the expected speeds, and largest speed of a shaft [rad/s].
TOLERANCE, HIGHEST_SPEED = 1e-5, 1e5
#: A torque on a shaft in the sense of its motion: name of the shaft, function of time, speed and angle of that shaft.
TrainTorque = tuple[str, Callable[[float, float, float], Any]]


def reduced_inertia(gearbox: Gearbox) -> float:
    """Inertia [kg m^2] of all shafts and of the rotors behind their couplings, reduced to the driving shaft."""
    return sum(shaft.turning_inertia * gearbox.ratios[shaft.name] ** 2 for shaft in gearbox.shafts)


def force_per_torque(gearbox: Gearbox, held: str | None) -> np.ndarray:
    """(n_stage, n_shaft) static mesh forces by torques about z on the shafts [1/m].

    held   name of the shaft whose speed is imposed; None: a torque accelerates the whole train, whose inertia torques
           take part
    """
    columns = []
    for shaft, torques in zip(gearbox.shafts, np.eye(len(gearbox.shafts)), strict=True):
        accelerated = 0.0 if held else gearbox.ratios[shaft.name] / reduced_inertia(gearbox)
        columns.append(gearbox.forces_under(torques, accelerated, held=held or gearbox.driving.name))
    return np.array(columns).T


def acceleration(gearbox: Gearbox, torques: Sequence[TrainTorque], t: float, speed: float, angle: float) -> float:
    """Acceleration of the driving shaft [rad/s^2] of the free train, at its speed and angle."""
    ratios = [abs(gearbox.ratios[name]) for name, _ in torques]
    total = sum(
        ratio * float(torque(t, ratio * speed, ratio * angle))
        for ratio, (_, torque) in zip(ratios, torques, strict=True)
    )
    return total / reduced_inertia(gearbox)


def expected_speeds(
    gearbox: Gearbox, torques: Sequence[TrainTorque], start_speed: float, times: np.ndarray, ends: Sequence[float] = ()
) -> np.ndarray:
    """(n,) speeds of the driving shaft [rad/s] at times (n,), those after the end of the run left out.

    ends   speeds of the driving shaft at which the run ends

    Raises ValueError where a speed grows beyond `HIGHEST_SPEED`.
    """

    def motion(t, state):
        return [acceleration(gearbox, torques, t, *state), state[0]]

    def event(speed):
        reached = lambda t, state: state[0] - speed  # noqa: E731
        vars(reached)["terminal"] = True
        return reached

    limits = [event(sense * HIGHEST_SPEED) for sense in (-1, 1)]
    events = [*limits, *(event(speed) for speed in ends if speed != start_speed)]
    options = {"method": "LSODA", "rtol": TOLERANCE, "atol": 1e-6, "max_step": (times[-1] - times[0]) / 100}
    solution = scipy.integrate.solve_ivp(
        motion, times[[0, -1]], [start_speed, 0.0], t_eval=times, events=events, **options
    )
    for reached in solution.t_events[:2]:
        far = f"the shaft {gearbox.driving.name!r} reaches {HIGHEST_SPEED / rpm:.3g} rpm"
        remedy = "add a load, shorten the duration, or stop at SpeedReached"
        require(not len(reached), f"drives and loads: {far} at t = {reached[0] if len(reached) else 0:.4g} s; {remedy}")
    require(solution.success, f"drives and loads: no motion of the train, {solution.message}; try smoother torques")
    return solution.y[0]
