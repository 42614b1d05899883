"""How wrong a map may be, and the mesh, phases and torques that keep it within a requested share of the deflection.

The deflection is the mean over the mesh cycle of te under load minus te without. Errors are root mean squares over it:
where a pair of teeth just joins, te bends sharply, and there they are larger.
"""

from dataclasses import dataclass, replace

import numpy as np

from fem.gear import GearPair, require
from fem.hertz import largest_torque
from fem.ste import at_phases, compliance_at
from fem.sweep import Resolution, each, sweep

#: From the coarsest to the finest that is tried.
LEVELS = (Resolution(resolved=False), Resolution(), Resolution().finer())
#: A mesh is off by this much of what one coarser by 2/3 changes: 1 / (1.5^p - 1) at an order p of 1.26.
#: Measured were 1.45 on helical pairs, and more.
FROM_COARSER = 1.5
#: Half-way is not always where an interpolation is furthest off.
FROM_HALFWAY = 1.5
CHECKED_PHASES, CHECKED_TORQUES, FEWEST_PHASES, MOST_PHASES, MOST_TORQUES = 8, 5, 12, 400, 40


@dataclass(frozen=True)
class UpTo:
    """Torques from 0 to a largest one [N m], as many as the requested accuracy takes."""

    torque: float

    def __post_init__(self):
        require(0 < self.torque < np.inf, f"torque must be > 0 N m, got {self.torque}")


def edges_of(values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Of each offset the value furthest from nominal, where errors are largest."""
    return {name: at[[-1]] if name == "a" else at[[np.argmax(np.abs(at))]] for name, at in values.items()}


def curves(pair: GearPair, torque, phase, values: dict, resolution: Resolution) -> np.ndarray:
    """(n_torque, n_phase) transmission errors [m] at the offsets furthest from nominal."""
    states = sweep(pair, np.asarray(torque) / pair.pinion.r_b, np.asarray(phase), edges_of(values), resolution)
    return each(states, lambda state: state[0]).reshape(len(torque), len(phase))


def deflection(te: np.ndarray, unloaded: np.ndarray) -> np.ndarray:
    """(n_torque,) mean of te (n_torque, n_phase) over that without load (n_phase,) [m]."""
    return (te - unloaded).mean(axis=1)


def rms(te: np.ndarray) -> np.ndarray:
    """(n_torque,) root mean square over the phases."""
    return np.sqrt((te**2).mean(axis=-1))


def mesh_error(pair: GearPair, torque, phase, values: dict, resolution: Resolution) -> np.ndarray:
    """(n_torque,) estimated error [m] by mesh and slices: what a coarser mesh and wider slices change at some phases.

    In the slice mode also what resolving the strips changes on that coarser mesh.
    """
    some = np.asarray(phase)[:: max(1, len(phase) // CHECKED_PHASES)]
    coarser = resolution.coarser()
    meshed, sliced = replace(resolution, density=coarser.density), replace(resolution, slices=coarser.slices)
    te, coarse, wide = (curves(pair, torque, some, values, each) for each in (resolution, meshed, sliced))
    error = FROM_COARSER * (rms(te - coarse) + rms(te - wide))
    if not resolution.resolved:
        error = error + rms(curves(pair, torque, some, values, replace(meshed, resolved=True)) - coarse)
    return error


def phase_error(pair: GearPair, torque, phase, values: dict, resolution: Resolution) -> np.ndarray:
    """(n_torque,) error [m] of the periodic cubic spline through the phases, seen half-way in the slice mode."""
    phase = np.asarray(phase)
    halfway = phase + np.diff(np.append(phase, phase[0] + 1)) / 2
    fast = replace(resolution, resolved=False)
    te = curves(pair, torque, np.concatenate([phase, halfway]), values, fast)
    return FROM_HALFWAY * rms(at_phases(phase, te[:, : phase.size], halfway) - te[:, phase.size :])


def torque_error(pair: GearPair, torque, values: dict, resolution: Resolution) -> np.ndarray:
    """(n_torque,) error [m] between a torque and its neighbours, seen half-way in the slice mode.

    torque      at least three values, the first of them 0
    """
    torque, phase = np.asarray(torque), np.arange(CHECKED_PHASES) / CHECKED_PHASES
    halfway = np.append(torque[1] / 4, np.sqrt(torque[1:-1] * torque[2:]))
    te = curves(pair, np.append(torque, halfway), phase, values, replace(resolution, resolved=False))
    given, between = te[1 : torque.size] - te[0], te[torque.size :] - te[0]
    compliance = compliance_at(torque[1:], given / torque[1:, None], halfway)
    error = FROM_HALFWAY * rms(compliance * halfway[:, None] - between)
    return np.maximum(np.append(0.0, error), np.append(error, 0.0))


def errors(pair: GearPair, torque, phase, values: dict, resolution: Resolution) -> dict[str, np.ndarray]:
    """Estimated errors [m] of each kind that can be told, (n_torque,)."""
    torque, phase = np.asarray(torque), np.asarray(phase)
    found = {"error_mesh": mesh_error(pair, torque, phase, values, resolution)}
    if phase.size >= 4 and np.allclose(np.diff(phase), 1 / phase.size, atol=1e-9):
        found["error_phase"] = phase_error(pair, torque, phase, values, resolution)
    if torque.size >= 3 and torque[0] == 0:
        found["error_torque"] = torque_error(pair, torque, values, resolution)
    return found


def _allowed(pair, torque, phase, values, accuracy: float) -> np.ndarray:
    """(n_torque,) error [m] that is the requested share of the deflection, or of a tenth of the largest."""
    te = curves(pair, np.append(0.0, torque), phase, values, LEVELS[0])
    found = deflection(te[1:], te[0])
    return accuracy * np.maximum(found, 0.1 * found.max())


def resolution_within(pair: GearPair, torque, values: dict, accuracy: float) -> Resolution:
    """The first of the levels whose estimated error is within accuracy.

    Raises RuntimeError where none is.
    """
    phase = np.arange(CHECKED_PHASES) / CHECKED_PHASES
    loaded = np.asarray(torque)[np.asarray(torque) > 0][[0, -1]]
    allowed = _allowed(pair, loaded, phase, values, accuracy)
    worst = np.inf
    for level in LEVELS:
        worst = (mesh_error(pair, loaded, phase, values, level) / allowed).max()
        if worst <= 1:
            return level
    short = f"the finest mesh tried is within {worst * accuracy:.2g} of the deflection"
    raise RuntimeError(f"{short}, accuracy {accuracy:g} was asked; ask for less or pass a finer fem.Resolution")


def chosen_phases(pair: GearPair, torque, values: dict, accuracy: float) -> np.ndarray:
    """As few equidistant phases as keep the error between them within accuracy; RuntimeError beyond MOST_PHASES."""
    loaded = np.asarray(torque)[np.asarray(torque) > 0]
    loaded = loaded[np.unique(np.linspace(0, loaded.size - 1, CHECKED_TORQUES).round().astype(int))]
    number, some = FEWEST_PHASES, np.arange(CHECKED_PHASES) / CHECKED_PHASES
    allowed = _allowed(pair, loaded, some, values, accuracy)
    while number <= MOST_PHASES:
        phase = np.arange(number) / number
        if (phase_error(pair, loaded, phase, values, LEVELS[0]) <= allowed).all():
            return phase
        number = 2 * round(number * 0.75)
    raise RuntimeError(f"more than {MOST_PHASES} phases for accuracy {accuracy:g}; ask for less, or pass phases=")


def chosen_torques(pair: GearPair, largest: float, values: dict, accuracy: float) -> np.ndarray:
    """Torques from 0 to the largest [N m] that keep the error between them within accuracy.

    Raises RuntimeError beyond MOST_TORQUES.
    """
    limit = largest_torque(pair)
    require(largest < limit, f"torque must be below {limit:.4g} N m, where Hertz pressure passes E/20, got {largest:g}")
    torque, phase = np.append(0.0, largest / np.array([64, 16, 4, 1])), np.arange(CHECKED_PHASES) / CHECKED_PHASES
    while torque.size <= MOST_TORQUES:
        allowed = _allowed(pair, torque, phase, values, accuracy)
        wide = torque_error(pair, torque, values, LEVELS[0]) > allowed
        if not wide.any():
            return torque
        between = [np.sqrt(torque[i] * torque[i + 1]) for i in range(1, torque.size - 1) if wide[i] or wide[i + 1]]
        torque = np.unique(np.concatenate([torque, between, torque[1:2] / 4 if wide[1] else []]))
    raise RuntimeError(f"more than {MOST_TORQUES} torques for accuracy {accuracy:g}; ask for less, or pass torques")
