"""How wrong a map is: by the mesh, by slices, and between its phases and torques.

Of each torque two errors are estimated over the mesh cycle: the root mean square of te, and its peak to peak, on which the
noise of a gear pair depends. The peak to peak of a curve changes by at most the range of what is added to it; where the
same phases stay extreme it changes by their difference, which may vanish by chance. The estimate is that difference and a
share of the range.
"""

from dataclasses import dataclass, field, replace
from math import sqrt
from typing import NamedTuple

import numpy as np

from fem.gear import GearPair
from fem.load_interpolation import deflection_under
from fem.mesh import Density
from fem.ste import STIFFNESS, at_phases
from fem.sweep import QUANTITIES, Resolution, each, sweep

#: Errors fall with these powers of the number of elements along the section, and of those and slices across the width,
#: at least; so slowly where loads are light and flanks crowned.
SECTION_ORDER, WIDTH_ORDER = 1.5, 1.26
#: Half-way is not always where an interpolation is furthest off.
FROM_HALFWAY = 1.5
#: Share of the range of an error over the mesh cycle that counts for the peak to peak.
RANGE_SHARE = 0.25
CHECKED_TORQUES = 5
#: Slices and torques are off most where a corner touches, for some hundredths of the mesh cycle; meshes at some light
#: load.
MESHED_PHASES, MESHED_TORQUES = 24, 9
#: Not mirror images of one another, as those of equal gears about the pitch point would be the same again.
CHECKED_PHASES = (np.arange(48) + 1 / 4) / 48
#: Phases at which a curve between those of a map is looked at.
DENSE = np.arange(240) / 240


class MapError(NamedTuple):
    """Errors of each torque, (n_torque,) [m]: root mean square of te over the mesh cycle, and of its peak to peak."""

    rms: np.ndarray
    peak_to_peak: np.ndarray


def edges_of(values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Of each offset the value furthest from nominal, where errors are largest."""
    return {name: at[[-1]] if name == "a" else at[[np.argmax(np.abs(at))]] for name, at in values.items()}


def curves(pair: GearPair, torque, phase, values: dict, resolution: Resolution) -> tuple[np.ndarray, np.ndarray]:
    """(n_torque, n_phase) transmission errors [m] and tangent stiffnesses [N/m] at the offsets furthest from nominal."""
    forces, offsets = np.asarray(torque) / pair.pinion.r_b, edges_of(values)
    states = sweep(pair, forces, np.asarray(phase), offsets, resolution, what="estimating errors")
    columns = 0, 1 + list(QUANTITIES).index(STIFFNESS)
    te, stiffness = (each(states, lambda state, i=i: state[i]).reshape(len(torque), len(phase)) for i in columns)
    return te, stiffness


def rms(te: np.ndarray) -> np.ndarray:
    """(...) root mean square over the phases of te (..., n_phase)."""
    return np.sqrt((te**2).mean(axis=-1))


def peak_to_peak(phase: np.ndarray, te: np.ndarray) -> np.ndarray:
    """(...) peak to peak of te (..., n_phase) over phases (n_phase,), also between them."""
    return np.ptp(at_phases(phase, te, DENSE), axis=-1)


def peak_to_peak_error(phase: np.ndarray, te: np.ndarray, error: np.ndarray) -> np.ndarray:
    """(...) of te (..., n_phase) that is off by an estimated error (..., n_phase) [m]."""
    changed = peak_to_peak(phase, te) - peak_to_peak(phase, te - error)
    return np.abs(changed) + RANGE_SHARE * peak_to_peak(phase, error)


def mesh_error(pair: GearPair, torque, values: dict, resolution: Resolution) -> MapError:
    """By elements of the section together with those across the width, and by slices.

    Each by what others than these change: fewer, or more where there is but one. In the slice mode also what
    resolving the strips changes.
    """
    torque, phase = np.asarray(torque), np.arange(MESHED_PHASES) / MESHED_PHASES
    few, fine, other = _few(torque, MESHED_TORQUES), resolution.density, resolution.compared()
    both, sliced = replace(resolution, density=other.density), replace(resolution, slices=other.slices)
    section = replace(resolution, density=replace(other.density, width=fine.width))
    te, by_both, by_slices, by_section = (
        curves(pair, few, phase, values, compared)[0] for compared in (resolution, both, sliced, section)
    )
    inside = left(te - by_section, along(fine) / along(other.density), SECTION_ORDER)
    across = left(by_section - by_both, fine.width / other.density.width, WIDTH_ORDER)
    in_slices = left(te - by_slices, resolution.slices / other.slices, WIDTH_ORDER)
    errors = [inside + across, in_slices]
    if not resolution.resolved:
        errors.append(by_both - curves(pair, few, phase, values, replace(both, resolved=True))[0])
    estimates = (sum(map(rms, errors)), sum(peak_to_peak_error(phase, te, error) for error in errors))
    return MapError(*(_at_all(torque, few, np.asarray(estimate)) for estimate in estimates))


def along(density: Density) -> float:
    """Elements along a line through the tooth, either way in its section: the root of their number."""
    pairs = density.paired()
    return sqrt(pairs.flank * pairs.tooth)


def left(change: np.ndarray, finer: float, order: float) -> np.ndarray:
    """Error left after a change by so many times as many elements, of which it falls with a power (Richardson)."""
    return change / (1 - finer**order)


def phase_error(pair: GearPair, torque, phase, values: dict, resolution: Resolution) -> MapError:
    """Of the periodic cubic spline through equidistant phases, seen half-way in the slice mode."""
    torque, phase = np.asarray(torque), np.asarray(phase)
    few, halfway = _few(torque, CHECKED_TORQUES), phase + 1 / (2 * phase.size)
    twice = np.concatenate([phase, halfway])
    te, _ = curves(pair, few, twice, values, replace(resolution, resolved=False))
    error = at_phases(phase, te[:, : phase.size], halfway) - te[:, phase.size :]
    order = np.argsort(twice)
    both, error_at_both = te[:, order], np.concatenate([0 * error, error], axis=1)[:, order]
    swing = peak_to_peak_error(twice[order], both + error_at_both, error_at_both)
    return MapError(*(_at_all(torque, few, FROM_HALFWAY * estimate) for estimate in (rms(error), swing)))


def _few(torque: np.ndarray, number: int) -> np.ndarray:
    """No torque, where that is among them, and a number of others with the first and the last."""
    loaded = torque[torque > 0]
    chosen = np.unique(np.linspace(0, loaded.size - 1, number).round().astype(int))
    return np.concatenate([torque[torque == 0], loaded[chosen]])


def _at_all(torque: np.ndarray, few: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Errors at all torques from those at few of them, along straight lines between logarithms."""
    least, loaded = 1e-15, few > 0
    known = np.log(np.maximum(error[loaded], least))
    return np.append(error[~loaded], np.exp(np.interp(np.log(torque[torque > 0]), np.log(few[loaded]), known)))


@dataclass(frozen=True)
class LoadedCurves:
    """Transmission errors and stiffnesses of slices at any torques over CHECKED_PHASES; each torque is solved once."""

    pair: GearPair
    values: dict[str, np.ndarray]
    resolution: Resolution
    solved: dict[float, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict, init=False)

    def at(self, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """te [m] and tangent stiffness [N/m], (n_torque, n_phase)."""
        missing = [load for load in torque.tolist() if load not in self.solved]
        if missing:
            states = curves(self.pair, missing, CHECKED_PHASES, self.values, replace(self.resolution, resolved=False))
            self.solved.update(zip(missing, zip(*states, strict=True), strict=True))
        te, stiffness = (np.array(rows) for rows in zip(*(self.solved[load] for load in torque.tolist()), strict=True))
        return te, stiffness


def halfway_torques(torque: np.ndarray) -> np.ndarray:
    """(n_torque - 1,) a quarter of the lowest load, then the geometric means of neighbouring loads; torque from 0."""
    return np.append(torque[1] / 4, np.sqrt(torque[1:-1] * torque[2:]))


def interval_error(curves: LoadedCurves, torque: np.ndarray) -> MapError:
    """(n_torque - 1,) errors between neighbouring torques, the first of them 0, seen half-way in the slice mode."""
    halfway, r_b = halfway_torques(torque), curves.pair.pinion.r_b
    (te, stiffness), (between, _) = curves.at(torque), curves.at(halfway)
    deflection = deflection_under(torque[1:] / r_b, te[1:] - te[0], halfway / r_b, stiffness[1:])
    error = te[0] + deflection - between
    swing = peak_to_peak_error(CHECKED_PHASES, between + error, error)
    return MapError(FROM_HALFWAY * rms(error), FROM_HALFWAY * swing)


def torque_error(pair: GearPair, torque, values: dict, resolution: Resolution) -> MapError:
    """Between a torque and its neighbours; torque: at least three values, the first of them 0."""
    error = interval_error(LoadedCurves(pair, values, resolution), np.asarray(torque, float))
    return MapError(*(np.maximum(np.append(0.0, part), np.append(part, 0.0)) for part in error))


def interpolation_errors(pair: GearPair, torque, phase, values: dict, resolution: Resolution) -> dict[str, MapError]:
    """Over phase and over torque, where they can be told, as `error_phase` and `error_torque`."""
    torque, phase, errors = np.asarray(torque), np.asarray(phase), {}
    if phase.size >= 4 and np.allclose(np.diff(phase), 1 / phase.size, atol=1e-9):
        errors["error_phase"] = phase_error(pair, torque, phase, values, resolution)
    if torque.size >= 3 and torque[0] == 0:
        errors["error_torque"] = torque_error(pair, torque, values, resolution)
    return errors
