"""How wrong a map is: by the mesh, by slices, and between its phases and torques.

Of each torque two errors are estimated over the mesh cycle: the root mean square of te, and its peak to peak, on which
the noise of a gear pair depends. What an error adds to the peak to peak may vanish by chance at the phases that are
looked at, but never exceeds the range of the error: between phases and torques a share of that range is added.
"""

from dataclasses import replace
from math import sqrt
from typing import NamedTuple

import numpy as np

from fem.contact.resolution import Resolution
from fem.elasticity.mesh_density import Density
from fem.pair.pair import GearPair
from fem.ste.load_interpolation import deflection_under
from fem.ste.map_solver import QUANTITIES, each, sweep
from fem.ste.ste_map import STIFFNESS, at_phases

#: Errors fall with these powers of the number of elements along the section, and of those and slices across the width,
#: at least; so slowly where loads are light and flanks crowned.
SECTION_ORDER, WIDTH_ORDER = 1.5, 1.26
#: Half-way is not always where an interpolation is furthest off.
FROM_HALFWAY = 1.5
#: Share of the range of an error over the mesh cycle that counts for the peak to peak, between phases and torques.
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
    """(n_torque, n_phase) transmission errors [m], tangent stiffnesses [N/m] at the offsets furthest from nominal."""
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


def peak_to_peak_error(phase: np.ndarray, te: np.ndarray, error: np.ndarray, range_share: float = 0.0) -> np.ndarray:
    """(...) of te (..., n_phase) that is off by an estimated error (..., n_phase) [m].

    range_share     of the range of the error, added to what the peak to peak changes
    """
    changed = peak_to_peak(phase, te) - peak_to_peak(phase, te - error)
    return np.abs(changed) + range_share * peak_to_peak(phase, error)


class MeshErrors(NamedTuple):
    """Errors by elements of the section, across the width, by both, which may cancel; by slices; by missing strips."""

    section: MapError
    width: MapError
    elements: MapError
    slices: MapError
    strips: MapError

    @property
    def total(self) -> MapError:
        """Sum of those by elements, slices and strips."""
        return MapError(*(np.sum(parts, axis=0) for parts in zip(self.elements, self.slices, self.strips, strict=True)))

    @property
    def by_cause(self) -> dict[str, MapError]:
        """Errors by what can be refined."""
        return {"section": self.section, "width": self.width, "slices": self.slices, "strips": self.strips}


def mesh_errors(pair: GearPair, torque, values: dict, resolution: Resolution) -> MeshErrors:
    """Each by what other numbers of elements or slices change: fewer, or more where there is but one."""
    torque, phase = np.asarray(torque), np.arange(MESHED_PHASES) / MESHED_PHASES
    few, fine, coarse = _few(torque, MESHED_TORQUES), resolution.density, resolution.compared()
    elements, slices = replace(resolution, density=coarse.density), replace(resolution, slices=coarse.slices)
    section = replace(resolution, density=replace(coarse.density, width=fine.width))
    strips = replace(elements, resolved=True)
    te, by_elements, by_slices, by_section = (
        curves(pair, few, phase, values, compared)[0] for compared in (resolution, elements, slices, section)
    )
    by_strips = by_elements if resolution.resolved else curves(pair, few, phase, values, strips)[0]
    inside = left(te - by_section, along(fine) / along(coarse.density), SECTION_ORDER)
    across = left(by_section - by_elements, fine.width / coarse.density.width, WIDTH_ORDER)
    in_slices = left(te - by_slices, resolution.slices / coarse.slices, WIDTH_ORDER)
    kinds = inside, across, inside + across, in_slices, by_elements - by_strips
    return MeshErrors(*(_map_error(torque, few, rms(e), peak_to_peak_error(phase, te, e)) for e in kinds))


def mesh_error(pair: GearPair, torque, values: dict, resolution: Resolution) -> MapError:
    """By elements and slices, in the slice mode also by what resolving the strips changes."""
    return mesh_errors(pair, torque, values, resolution).total


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
    swing = peak_to_peak_error(twice[order], both + error_at_both, error_at_both, RANGE_SHARE)
    return _map_error(torque, few, FROM_HALFWAY * rms(error), FROM_HALFWAY * swing)


def _map_error(torque: np.ndarray, few: np.ndarray, error: np.ndarray, swing: np.ndarray) -> MapError:
    """Errors at all torques from those at few of them."""
    return MapError(_at_all(torque, few, error), _at_all(torque, few, swing))


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


class LoadedCurves:
    """Transmission errors and stiffnesses of slices at any torques over CHECKED_PHASES; each torque is solved once."""

    def __init__(self, pair: GearPair, values: dict[str, np.ndarray], resolution: Resolution):
        self.pair, self.values, self.resolution = pair, values, replace(resolution, resolved=False)
        self._solved: dict[float, tuple[np.ndarray, np.ndarray]] = {}

    def at(self, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """te [m] and tangent stiffness [N/m], (n_torque, n_phase)."""
        missing = [load for load in torque.tolist() if load not in self._solved]
        if missing:
            states = curves(self.pair, missing, CHECKED_PHASES, self.values, self.resolution)
            self._solved.update(zip(missing, zip(*states, strict=True), strict=True))
        te, stiffness = zip(*(self._solved[load] for load in torque.tolist()), strict=True)
        return np.array(te), np.array(stiffness)


def halfway_torques(torque: np.ndarray) -> np.ndarray:
    """(n_torque - 1,) a quarter of the lowest load, then the geometric means of neighbouring loads; torque from 0."""
    return np.append(torque[1] / 4, np.sqrt(torque[1:-1] * torque[2:]))


def interval_error(loaded: LoadedCurves, torque: np.ndarray) -> MapError:
    """(n_torque - 1,) errors between neighbouring torques, the first of them 0, seen half-way in the slice mode."""
    halfway, r_b = halfway_torques(torque), loaded.pair.pinion.r_b
    (te, stiffness), (between, _) = loaded.at(torque), loaded.at(halfway)
    deflection = deflection_under(torque[1:] / r_b, te[1:] - te[0], halfway / r_b, stiffness[1:])
    error = te[0] + deflection - between
    swing = peak_to_peak_error(CHECKED_PHASES, between + error, error, RANGE_SHARE)
    return MapError(*(FROM_HALFWAY * _falling(halfway, estimate) for estimate in (rms(error), swing)))


def _falling(torque: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Errors (n,) of which the two at the lightest loads fall with no more than the root of the torque.

    There corners touch for less of the cycle than lies between two checked phases.
    """
    error = error.copy()
    for i in (1, 0):
        if i + 1 < error.size:
            error[i] = max(error[i], error[i + 1] * np.sqrt(torque[i] / torque[i + 1]))
    return error


def torque_error(pair: GearPair, torque, values: dict, resolution: Resolution) -> MapError:
    """Between a torque and its neighbours; torque: at least three values, the first of them 0."""
    error = interval_error(LoadedCurves(pair, values, resolution), np.asarray(torque, float))
    return MapError(*(np.maximum(np.append(0.0, part), np.append(part, 0.0)) for part in error))


def interpolation_errors(pair: GearPair, torque, phase, values: dict, resolution: Resolution) -> dict[str, MapError]:
    """Over phase and over torque, where they can be text_of, as `error_phase` and `error_torque`."""
    torque, phase, errors = np.asarray(torque), np.asarray(phase), {}
    if phase.size >= 4 and np.allclose(np.diff(phase), 1 / phase.size, atol=1e-9):
        errors["error_phase"] = phase_error(pair, torque, phase, values, resolution)
    if torque.size >= 3 and torque[0] == 0:
        errors["error_torque"] = torque_error(pair, torque, values, resolution)
    return errors
