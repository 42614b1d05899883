"""How wrong a map may be, and the mesh, phases and torques that keep it within a requested share of the deflection.

The deflection is the mean over the mesh cycle of te under load minus te without. Errors are root mean squares over it:
where a pair of teeth just joins, te bends sharply, and there they are larger.
"""

from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from fem.checks import as_floats
from fem.gear import GearPair, require
from fem.hertz import largest_torque
from fem.mesh import Density
from fem.representation import short
from fem.ste import at_phases, compliance_at
from fem.sweep import Resolution, each, sweep

#: Errors fall with these powers of the number of elements along the section, and of those and slices across the width,
#: at least; so slowly where loads are light and flanks crowned.
SECTION_ORDER, WIDTH_ORDER = 1.5, 1.26
#: Half-way is not always where an interpolation is furthest off.
FROM_HALFWAY = 1.5
CHECKED_TORQUES, FEWEST_PHASES, MOST_PHASES, MOST_TORQUES = 5, 12, 400, 40
#: Slices and torques are off most where a corner touches, for some hundredths of the mesh cycle; meshes at some light
#: load.
MESHED_PHASES, MESHED_TORQUES = 24, 9
#: Not mirror images of one another, as those of equal gears about the pitch point would be the same again.
CHECKED_PHASES = (np.arange(48) + 1 / 4) / 48


@short(torque="N m")
@dataclass(frozen=True)
class UpTo:
    """Torques from 0 to a largest one [N m], as many as the requested accuracy takes."""

    torque: float

    def __post_init__(self):
        as_floats(self)
        require(0 < self.torque < np.inf, f"torque must be > 0 N m, got {self.torque}")


def edges_of(values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Of each offset the value furthest from nominal, where errors are largest."""
    return {name: at[[-1]] if name == "a" else at[[np.argmax(np.abs(at))]] for name, at in values.items()}


def curves(pair: GearPair, torque, phase, values: dict, resolution: Resolution) -> np.ndarray:
    """(n_torque, n_phase) transmission errors [m] at the offsets furthest from nominal."""
    forces, offsets = np.asarray(torque) / pair.pinion.r_b, edges_of(values)
    states = sweep(pair, forces, np.asarray(phase), offsets, resolution, what="estimating errors")
    return each(states, lambda state: state[0]).reshape(len(torque), len(phase))


def deflection(te: np.ndarray, unloaded: np.ndarray) -> np.ndarray:
    """(n_torque,) mean of te (n_torque, n_phase) over that without load (n_phase,) [m]."""
    return (te - unloaded).mean(axis=1)


def rms(te: np.ndarray) -> np.ndarray:
    """(n_torque,) root mean square over the phases."""
    return np.sqrt((te**2).mean(axis=-1))


def mesh_error(pair: GearPair, torque, values: dict, resolution: Resolution) -> np.ndarray:
    """(n_torque,) estimated error [m]: by elements of the section together with those across the width, and by slices.

    Each by what others than these change: fewer, or more where there is but one. In the slice mode also what
    resolving the strips changes.
    """
    torque, phase = np.asarray(torque), np.arange(MESHED_PHASES) / MESHED_PHASES
    few, fine, other = _few(torque, MESHED_TORQUES), resolution.density, resolution.compared()
    both, sliced = replace(resolution, density=other.density), replace(resolution, slices=other.slices)
    section = replace(resolution, density=replace(other.density, width=fine.width))
    te, by_both, by_slices, by_section = (
        curves(pair, few, phase, values, each) for each in (resolution, both, sliced, section)
    )
    inside = left(te - by_section, along(fine) / along(other.density), SECTION_ORDER)
    across = left(by_section - by_both, fine.width / other.density.width, WIDTH_ORDER)
    in_slices = left(te - by_slices, resolution.slices / other.slices, WIDTH_ORDER)
    error = rms(inside + across) + rms(in_slices)
    if not resolution.resolved:
        error += rms(curves(pair, few, phase, values, replace(both, resolved=True)) - by_both)
    return _at_all(torque, few, error)


def along(density: Density) -> float:
    """Elements along a line through the tooth, either way in its section: the root of their number."""
    pairs = density.paired()
    return sqrt(pairs.flank * pairs.tooth)


def left(change: np.ndarray, finer: float, order: float) -> np.ndarray:
    """Error left after a change by so many times as many elements, of which it falls with a power (Richardson)."""
    return change / (1 - finer**order)


def phase_error(pair: GearPair, torque, phase, values: dict, resolution: Resolution) -> np.ndarray:
    """(n_torque,) error [m] of the periodic cubic spline through the phases, seen half-way in the slice mode."""
    torque, phase = np.asarray(torque), np.asarray(phase)
    few, halfway = _few(torque, CHECKED_TORQUES), phase + np.diff(np.append(phase, phase[0] + 1)) / 2
    te = curves(pair, few, np.concatenate([phase, halfway]), values, replace(resolution, resolved=False))
    error = FROM_HALFWAY * rms(at_phases(phase, te[:, : phase.size], halfway) - te[:, phase.size :])
    return _at_all(torque, few, error)


def _few(torque: np.ndarray, number: int) -> np.ndarray:
    """No torque, where that is among them, and a number of others with the first and the last."""
    loaded = torque[torque > 0]
    some = np.unique(np.linspace(0, loaded.size - 1, number).round().astype(int))
    return np.concatenate([torque[torque == 0], loaded[some]])


def _at_all(torque: np.ndarray, few: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Errors at all torques from those at few of them, along straight lines between logarithms."""
    least, loaded = 1e-15, few > 0
    known = np.log(np.maximum(error[loaded], least))
    return np.append(error[~loaded], np.exp(np.interp(np.log(torque[torque > 0]), np.log(few[loaded]), known)))


def torque_error(pair: GearPair, torque, values: dict, resolution: Resolution) -> np.ndarray:
    """(n_torque,) error [m] between a torque and its neighbours, seen half-way in the slice mode.

    torque      at least three values, the first of them 0
    """
    torque, phase = np.asarray(torque), CHECKED_PHASES
    halfway = np.append(torque[1] / 4, np.sqrt(torque[1:-1] * torque[2:]))
    te = curves(pair, np.append(torque, halfway), phase, values, replace(resolution, resolved=False))
    given, between = te[1 : torque.size] - te[0], te[torque.size :] - te[0]
    compliance = compliance_at(torque[1:], given / torque[1:, None], halfway)
    error = FROM_HALFWAY * rms(compliance * halfway[:, None] - between)
    return np.maximum(np.append(0.0, error), np.append(error, 0.0))


def interpolation_errors(pair: GearPair, torque, phase, values: dict, resolution: Resolution) -> dict[str, np.ndarray]:
    """Estimated errors [m] over phase and over torque where they can be told, (n_torque,)."""
    torque, phase, found = np.asarray(torque), np.asarray(phase), {}
    if phase.size >= 4 and np.allclose(np.diff(phase), 1 / phase.size, atol=1e-9):
        found["error_phase"] = phase_error(pair, torque, phase, values, resolution)
    if torque.size >= 3 and torque[0] == 0:
        found["error_torque"] = torque_error(pair, torque, values, resolution)
    return found


def choose(
    pair: GearPair, torque: np.ndarray | UpTo, phase: np.ndarray | None, values: dict, accuracy: float
) -> tuple[np.ndarray, np.ndarray, Resolution, dict[str, np.ndarray]]:
    """Torques and phases where they are not given, the coarsest level and its errors [m], within the share accuracy.

    Raises RuntimeError where no level does, or too many torques or phases would be needed.
    """
    least = np.inf
    for level in _levels(pair):
        fast = replace(level, resolved=False)
        torques = chosen_torques(pair, torque.torque, values, accuracy, fast) if isinstance(torque, UpTo) else torque
        mesh = mesh_error(pair, torques, values, level)
        over = (mesh / _allowed(pair, torques, values, accuracy, fast)).max()
        if over <= 1:
            phases = chosen_phases(pair, torques, values, accuracy, fast) if phase is None else phase
            found = {"error_mesh": mesh} | interpolation_errors(pair, torques, phases, values, level)
            return torques, phases, level, found
        least = min(least, over)
    short = f"the best mesh tried is within {least * accuracy:.3g} of the deflection"
    raise RuntimeError(f"{short}, accuracy {accuracy:g} was asked; ask for less or pass a finer fem.Resolution")


def _levels(pair: GearPair) -> tuple[Resolution, ...]:
    """From the coarsest to the finest that is tried, which takes 1.6 to 2.3 GB.

    The last two are finer in the section, or across the width: of helical gears, which have no half width, than the
    default, of spurs than one that is finer in both.
    """
    default = Resolution()
    finer = default.finer()
    if pair.beta_b:
        return replace(default, resolved=False), default, default.finer_inside(), default.finer_across()
    return replace(default, resolved=False), default, finer, finer.finer_across(), finer.finer_inside()


def _allowed(pair, torque, values, accuracy: float, fast: Resolution) -> np.ndarray:
    """(n_torque,) error [m] that is the requested share of the deflection, or of a tenth of the largest."""
    phase = CHECKED_PHASES
    te = curves(pair, np.append(0.0, torque), phase, values, fast)
    found = deflection(te[1:], te[0])
    return accuracy * np.maximum(found, 0.1 * found.max())


def chosen_phases(pair: GearPair, torque, values: dict, accuracy: float, fast: Resolution) -> np.ndarray:
    """As few equidistant phases as keep the error between them within accuracy; RuntimeError beyond MOST_PHASES."""
    number, allowed = FEWEST_PHASES, _allowed(pair, torque, values, accuracy, fast)
    while number <= MOST_PHASES:
        phase = np.arange(number) / number
        if (phase_error(pair, torque, phase, values, fast) <= allowed).all():
            return phase
        number = 2 * round(number * 0.75)
    raise RuntimeError(f"more than {MOST_PHASES} phases for accuracy {accuracy:g}; ask for less, or pass phases=")


def chosen_torques(pair: GearPair, largest: float, values: dict, accuracy: float, fast: Resolution) -> np.ndarray:
    """Torques from 0 to the largest [N m] that keep the error between them within accuracy.

    Raises RuntimeError beyond MOST_TORQUES.
    """
    limit = largest_torque(pair)
    require(largest < limit, f"torque must be below {limit:.4g} N m, where Hertz pressure passes E/20, got {largest:g}")
    torque = np.append(0.0, largest / np.array([64, 16, 4, 1]))
    while torque.size <= MOST_TORQUES:
        wide = torque_error(pair, torque, values, fast) > _allowed(pair, torque, values, accuracy, fast)
        if not wide.any():
            return torque
        between = [np.sqrt(torque[i] * torque[i + 1]) for i in range(1, torque.size - 1) if wide[i] or wide[i + 1]]
        torque = np.unique(np.concatenate([torque, between, torque[1:2] / 4 if wide[1] else []]))
    raise RuntimeError(f"more than {MOST_TORQUES} torques for accuracy {accuracy:g}; ask for less, or pass torques")
