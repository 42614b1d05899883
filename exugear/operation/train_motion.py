"""A gear train as one rigid body: its inertia, mesh forces by torques, and the speeds to expect of a run."""

from collections.abc import Callable, Sequence

import numpy as np

from exugear.gearbox.drag import braking_torque
from exugear.gearbox.gearbox import Gearbox, anchors_of, forces_of_motion, motions_of
from fem.support.validation import require
from fem.units import rpm

#: Largest speed of a shaft, and difference of speeds for the slope of a torque [rad/s].
HIGHEST_SPEED, SPEED_STEP = 1e5, 1e-4
#: Exponents of growth over a step: largest one, and one that is rounding.
LARGEST_EXPONENT, ROUNDING = 50.0, 1e-9


def reduced_inertia(gearbox: Gearbox, motions: np.ndarray) -> np.ndarray:
    """(n, n) inertia [kg m^2] of all shafts and of the rotors behind their couplings over motions (n, n_shaft)."""
    inertias = np.array([gearbox.turning_inertias[shaft.name] for shaft in gearbox.shafts])
    return (motions * inertias) @ motions.T


def drag_torques(gearbox: Gearbox, speeds: np.ndarray) -> np.ndarray:
    """(n_shaft,) torques of the drags about z [N m] at speeds of all shafts about z (n_shaft,) [rad/s].

    Bearings whose load only the run knows count as unloaded.
    """
    on_ground, between = gearbox.drag_terms
    of_shafts = zip(on_ground, speeds.tolist(), strict=True)
    torques = np.array([-sum(braking_torque(x, speed, 0.0) for x in terms) for terms, speed in of_shafts], float)
    for carried, carrying, terms in between:
        torque = braking_torque(terms, speeds[carried] - speeds[carrying], 0.0)
        torques[carried] -= torque
        torques[carrying] += torque
    return torques


def accelerations_under(
    gearbox: Gearbox, torques: np.ndarray, imposed: Sequence[str], given: np.ndarray | None = None
) -> np.ndarray:
    """(n_shaft,) accelerations about z [rad/s^2] of a gearbox as a rigid train under torques (n_shaft,) [N m].

    imposed   names of the shafts whose motion is imposed
    given     accelerations of these shafts; by default 0
    """
    anchors = anchors_of(gearbox, imposed)
    motions, number = motions_of(gearbox, anchors), len(imposed)
    inertia = reduced_inertia(gearbox, motions)
    of_anchors = np.zeros(len(anchors)) if given is None else np.r_[given, np.zeros(len(anchors) - number)]
    free = slice(number, None)
    push = motions[free] @ torques - inertia[free, :number] @ of_anchors[:number]
    of_anchors[free] = np.linalg.solve(inertia[free, free], push)
    return of_anchors @ motions


def force_per_torque(gearbox: Gearbox, imposed: Sequence[str]) -> np.ndarray:
    """(n_stage, n_shaft) static mesh forces by torques about z on the shafts [1/m].

    imposed   names of the shafts whose speeds are imposed; a torque accelerates what they leave free, whose inertia
              torques take part
    """
    anchors, columns = anchors_of(gearbox, imposed), []
    for torques in np.eye(len(gearbox.shafts)):
        accelerations = accelerations_under(gearbox, torques, imposed)
        columns.append(forces_of_motion(gearbox, torques, accelerations, anchors))
    return np.array(columns).T


def expected_speeds(
    gearbox: Gearbox,
    imposed: Sequence[str],
    given: tuple[np.ndarray, np.ndarray],
    torques: np.ndarray,
    of_speed: Callable[[np.ndarray], np.ndarray],
    start_speeds: Sequence[float],
    times: np.ndarray,
    ends: Sequence[tuple[str, float]] = (),
) -> np.ndarray:
    """Speeds of all shafts about z (n_shaft, n) [rad/s] at times (n,), those after the end of the run left out.

    imposed        names of the shafts whose motion is imposed
    given          (n_imposed, n) their speeds and accelerations about z at the times
    torques        (n_shaft, n - 1) mean torques on the shafts about z between the times [N m]
    of_speed       further torques (n_shaft,), each as a function of the speed of its shaft (n_shaft,)
    start_speeds   about z of the `Gearbox.anchors` behind the imposed ones
    ends           name of a shaft and its speed about z at which the run ends

    Rosenbrock-Euler steps: exact where the torques are linear in the speeds, stable however steep they are (Hochbruck
    and Ostermann 2010). Raises ValueError where a speed grows beyond `HIGHEST_SPEED`.
    """
    names, number = [shaft.name for shaft in gearbox.shafts], len(imposed)
    motions = motions_of(gearbox, anchors_of(gearbox, imposed))
    of_imposed, free = given[0].T @ motions[:number], motions[number:]
    inertia = reduced_inertia(gearbox, motions)
    inverse, pull = np.linalg.inv(inertia[number:, number:]), inertia[number:, :number] @ given[1]
    speeds, limits = np.array(start_speeds, float), [(names.index(name), speed) for name, speed in ends]
    listed = [of_imposed[0] + speeds @ free]
    for k, (t, step) in enumerate(zip(times, np.diff(times), strict=False)):
        present, after, before = (of_speed(listed[-1] + change) for change in (0.0, SPEED_STEP, -SPEED_STEP))
        slopes = (free * ((after - before) / (2 * SPEED_STEP))) @ free.T
        accelerations = inverse @ (free @ (torques[:, k] + present) - pull[:, k])
        speeds = speeds + step * _growth(step * inverse @ slopes) @ accelerations
        listed.append(of_imposed[k + 1] + speeds @ free)
        fastest = int(np.abs(listed[-1]).argmax())
        far = f"drives and loads: the shaft {names[fastest]!r} reaches {HIGHEST_SPEED / rpm:.3g} rpm"
        remedy = "add a load, shorten the duration, or stop at SpeedReached"
        require(abs(listed[-1][fastest]) < HIGHEST_SPEED, f"{far} after t = {t:.4g} s; {remedy}")
        if any((listed[-2][i] - end) * (listed[-1][i] - end) < 0 for i, end in limits):
            break
    return np.array(listed).T


def _growth(x: np.ndarray) -> np.ndarray:
    """(e^x - 1) / x of a matrix x (n, n) with a basis of eigenvectors."""
    if not np.abs(x).max(initial=0.0) > ROUNDING:
        return np.eye(len(x))
    values, vectors = np.linalg.eig(x)
    values = np.where(np.abs(values) > ROUNDING, values, ROUNDING)
    phi = np.expm1(np.minimum(values.real, LARGEST_EXPONENT)) / values.real
    return (vectors * phi @ np.linalg.inv(vectors)).real
