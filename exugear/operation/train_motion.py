"""A gear train as one rigid body: its inertia, mesh forces by torques, and the speeds to expect of a run."""

from collections.abc import Callable, Sequence
from math import expm1

import numpy as np

from exugear.gearbox.drag import braking_torque
from exugear.gearbox.gearbox import Gearbox
from fem.support.validation import require
from fem.units import rpm

#: Largest speed of a shaft, and difference of speeds for the slope of a torque [rad/s].
HIGHEST_SPEED, SPEED_STEP = 1e5, 1e-4
#: Exponents of growth over a step: largest one, and one that is rounding.
LARGEST_EXPONENT, ROUNDING = 50.0, 1e-9


def reduced_inertia(gearbox: Gearbox) -> float:
    """Inertia [kg m^2] of all shafts and of the rotors behind their couplings, reduced to the driving shaft."""
    return sum(inertia * gearbox.ratios[name] ** 2 for name, inertia in gearbox.turning_inertias.items())


def drag_torques(gearbox: Gearbox, speed: float) -> np.ndarray:
    """(n_shaft,) torques of the drags about z [N m] at a speed of the driving shaft [rad/s].

    Bearings whose load only the run knows count as unloaded.
    """
    return np.array([
        -sum(braking_torque(drag.terms, gearbox.ratios[shaft.name] * speed, 0.0) for _, drag in shaft.drags)
        for shaft in gearbox.shafts
    ])  # fmt: skip


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


def expected_speeds(
    gearbox: Gearbox,
    torques: np.ndarray,
    of_speed: Callable[[float], float],
    start_speed: float,
    times: np.ndarray,
    ends: Sequence[float] = (),
) -> np.ndarray:
    """Speeds of the driving shaft [rad/s] at times (n,), those after the end of the run left out.

    torques    (n - 1,) mean torques between the times, reduced to the driving shaft [N m]
    of_speed   further torque, reduced likewise, as a function of the speed of the driving shaft
    ends       speeds at which the run ends

    Rosenbrock-Euler steps: exact where the torque is linear in the speed, stable however steep it is (Hochbruck and
    Ostermann 2010). Raises ValueError where a speed grows beyond `HIGHEST_SPEED`.
    """
    inertia, speeds = reduced_inertia(gearbox), [start_speed]
    for t, step, torque in zip(times, np.diff(times), torques, strict=False):
        speed = speeds[-1]
        present, after, before = (of_speed(speed + change) for change in (0.0, SPEED_STEP, -SPEED_STEP))
        x = step / inertia * (after - before) / (2 * SPEED_STEP)
        growth = expm1(min(x, LARGEST_EXPONENT)) / x if abs(x) > ROUNDING else 1.0
        speeds.append(speed + step / inertia * growth * (torque + present))
        far = f"drives and loads: the shaft {gearbox.driving.name!r} reaches {HIGHEST_SPEED / rpm:.3g} rpm"
        remedy = "add a load, shorten the duration, or stop at SpeedReached"
        require(abs(speeds[-1]) < HIGHEST_SPEED, f"{far} after t = {t:.4g} s; {remedy}")
        if any((speed - end) * (speeds[-1] - end) < 0 for end in ends):
            break
    return np.array(speeds)
