"""Estimated errors of a map: by mesh and slices, and by interpolation between its phases and torques.

Two errors are estimated for each torque over the mesh cycle: the root mean square error of te, and the error of its
peak to peak, which governs the noise of a gear pair. The change of the peak to peak may vanish by chance at the phases
that are checked, but never exceeds the range of the error: between phases and torques a share of that range is added.
"""

from dataclasses import replace
from math import floor, sqrt
from typing import NamedTuple

import numpy as np

from fem.contact.resolution import Discretization, Resolution, Slices
from fem.elasticity.mesh_density import Density
from fem.gear.rim_support import period
from fem.ste.load_interpolation import deflection_under
from fem.ste.map_solver import ContactModel, sweep
from fem.ste.ring_angle import softest
from fem.ste.ste_map import OFFSETS, RING_ANGLE, STIFFNESS, TE, at_phases, periodic_spline
from fem.ste.te_measures import LEAST_PHASES, curve_peak_to_peak, periodic_curve

#: Errors fall at least with these powers of the number of elements along the section, and of elements and slices across
#: the width; such slow convergence occurs only where loads are light and flanks crowned.
SECTION_ORDER, WIDTH_ORDER = 1.5, 1.26
#: Factor on interpolation errors that are estimated half-way, as they are not always largest there.
FROM_HALFWAY = 1.5
#: Share of the range of an error over the mesh cycle that counts for the peak to peak, between phases and torques.
RANGE_SHARE = 0.25
#: Loaded torques at which the error between phases is estimated.
CHECKED_TORQUES = 5
#: Phases and loaded torques at which mesh errors are estimated: slices err most where a corner touches, for some
#: hundredths of the mesh cycle, meshes at some light load.
MESHED_PHASES, MESHED_TORQUES = 24, 9
#: Phases of `LoadedCurves`: none is the mirror image of another, which would repeat the states of equal gears.
CHECKED_PHASES = (np.arange(48) + 1 / 4) / 48
#: Phases at which the error between ring angles is estimated.
RING_PHASES = np.arange(6) / 6
#: Phases at which the peak to peak of an interpolated curve is taken.
DENSE = np.arange(240) / 240
#: Least error of which a logarithm is taken for interpolation [m].
LEAST_ERROR = 1e-15


class MapError(NamedTuple):
    """Errors of each torque, (n_torque,) [m]: root mean square of te over the mesh cycle, and of its peak to peak."""

    rms: np.ndarray
    peak_to_peak: np.ndarray


def at_furthest_offsets(model: ContactModel) -> ContactModel:
    """The model at the value of each offset furthest from nominal, where errors are largest, and between bolts."""
    furthest = {name: values[[np.argmax(np.abs(values))]] for name, values in model.offsets.items()}
    between = model.offsets[RING_ANGLE][[softest(model.pair.wheel, model.offsets[RING_ANGLE])]]
    return replace(model, offsets=furthest | {"a": model.offsets["a"][[-1]], RING_ANGLE: between})


def curves(model: ContactModel, torque, phase) -> tuple[np.ndarray, np.ndarray]:
    """(n_torque, n_phase) transmission errors [m], tangent stiffnesses [N/m] at the offsets furthest from nominal."""
    torque, phase = np.asarray(torque), np.asarray(phase)
    states = sweep(at_furthest_offsets(model), torque / model.pair.pinion.r_b, phase, what="estimating errors")
    te, stiffness = (states[name].values.reshape(torque.size, phase.size) for name in (TE, STIFFNESS))
    return te, stiffness


def rms(te: np.ndarray) -> np.ndarray:
    """(...) root mean square over the phases of te (..., n_phase)."""
    return np.sqrt((te**2).mean(axis=-1))


def peak_to_peak_error(phase: np.ndarray, te: np.ndarray, error: np.ndarray, range_share: float = 0.0) -> np.ndarray:
    """(...) error of the peak to peak of te (..., n_phase) that has an estimated error (..., n_phase) [m].

    range_share     of the range of the error, added to the change of the peak to peak
    """
    changed = curve_peak_to_peak(phase, te) - curve_peak_to_peak(phase, te - error)
    return np.abs(changed) + range_share * curve_peak_to_peak(phase, error)


class Comparisons(NamedTuple):
    """Resolutions to compare with a given one: other numbers of elements or slices, or resolved strips."""

    elements: Discretization
    section: Discretization
    slices: Discretization
    strips: Discretization


def comparisons(resolution: Discretization) -> Comparisons:
    """Fewer elements or slices, or more if there is only one; strips with that number of elements."""
    compared = resolution.compared()
    elements = replace(resolution, density=compared.density)
    section = replace(resolution, density=replace(compared.density, width=resolution.density.width))
    slices = replace(resolution, slices=compared.slices)
    return Comparisons(elements, section, slices, strips=Resolution.like(elements))


def compared_slices(model: ContactModel, torque, phase) -> ContactModel | None:
    """The model by `Slices` that checks the peak to peak of a helical pair by `Resolution`; None for others."""
    helical = bool(model.pair.pinion.beta) and isinstance(model.resolution, Resolution)
    enough = phase.size >= LEAST_PHASES * (floor(phase[-1]) + 1) and bool(np.any(torque))
    return replace(model, resolution=Slices.like(model.resolution)) if helical and enough else None


class MeshErrors(NamedTuple):
    """Errors by cause: elements of the section, elements across the width, both (may cancel), slices, no strips."""

    section: MapError
    width: MapError
    elements: MapError
    slices: MapError
    strips: MapError

    @property
    def total(self) -> MapError:
        """Sum of the errors by elements, slices and strips."""
        return MapError(*(np.sum(parts, axis=0) for parts in zip(self.elements, self.slices, self.strips, strict=True)))

    @property
    def by_cause(self) -> dict[str, MapError]:
        """Errors by cause that can be refined: section, width, slices, strips."""
        return {"section": self.section, "width": self.width, "slices": self.slices, "strips": self.strips}


def mesh_errors(model: ContactModel, torque) -> MeshErrors:
    """Errors by each cause, extrapolated from the change of te with the number of elements or slices."""
    torque, phase = np.asarray(torque), np.arange(MESHED_PHASES) / MESHED_PHASES
    checked, fine, compared = _checked(torque, MESHED_TORQUES), model.resolution, comparisons(model.resolution)

    def te_with(resolution: Discretization) -> np.ndarray:
        return curves(replace(model, resolution=resolution), checked, phase)[0]

    te, te_elements, te_section, te_slices = map(te_with, (fine, compared.elements, compared.section, compared.slices))
    te_strips = te_elements if compared.strips == compared.elements else te_with(compared.strips)
    coarse = compared.elements.density
    section = richardson(te - te_section, elements_along(fine.density) / elements_along(coarse), SECTION_ORDER)
    width = richardson(te_section - te_elements, fine.density.width / coarse.width, WIDTH_ORDER)
    slices = richardson(te - te_slices, fine.slices / compared.slices.slices, WIDTH_ORDER)
    causes = section, width, section + width, slices, te_elements - te_strips
    errors = (MapError(rms(error), peak_to_peak_error(phase, te, error)) for error in causes)
    return MeshErrors(*(_at_all(torque, checked, error) for error in errors))


def elements_along(density: Density) -> float:
    """Number of elements along a line through the section of a tooth: the square root of their number."""
    pairs = density.paired()
    return sqrt(pairs.flank * pairs.tooth)


def richardson(change: np.ndarray, ratio: float, order: float) -> np.ndarray:
    """Error of a fine solution from its change against a coarse one (Richardson extrapolation).

    ratio   number of elements of the fine solution over that of the coarse one
    order   power of the number of elements with which the error falls
    """
    return change / (1 - ratio**order)


def phase_error(model: ContactModel, torque, phase) -> MapError:
    """Error between equidistant phases, estimated half-way between them by `Slices`.

    The root mean square is that of the periodic cubic spline, which force laws follow; the error of the peak to peak is
    that of `curve_peak_to_peak`, to which its difference from that of the spline is added: where the two curves differ,
    neither is known. With that sum, 99 % of the bounds of 16 random pairs at two torques held.
    """
    torque, phase = np.asarray(torque), np.asarray(phase)
    checked, halfway = _checked(torque, CHECKED_TORQUES), phase + 1 / (2 * phase.size)
    doubled = np.concatenate([phase, halfway])
    te, _ = curves(replace(model, resolution=Slices.like(model.resolution)), checked, doubled)
    mapped, order = te[:, : phase.size], np.argsort(doubled)
    error = at_phases(phase, mapped, halfway) - te[:, phase.size :]
    curve, doubled_curve = curve_peak_to_peak(phase, mapped), curve_peak_to_peak(doubled[order], te[:, order])
    between = periodic_curve(phase, mapped)(halfway).T - te[:, phase.size :]
    p2p = np.abs(curve - doubled_curve) + RANGE_SHARE * np.ptp(np.append(between, 0 * between, axis=-1), axis=-1)
    p2p = FROM_HALFWAY * p2p + np.abs(np.ptp(at_phases(phase, mapped, DENSE), axis=-1) - curve)
    return _at_all(torque, checked, MapError(FROM_HALFWAY * rms(error), p2p))


def ring_angle_error(model: ContactModel, torque: np.ndarray) -> tuple[MapError, np.ndarray]:
    """Error between the ring angles of the model, estimated half-way by `Slices`; and mean deflections (n_torque,) [m].

    torque      (n_torque,) >= 0, the first of them 0
    """
    turn, angles = period(model.pair.wheel.support) or 0.0, model.offsets[RING_ANGLE]
    halfway = (angles + np.append(angles[1:], angles[0] + turn)) / 2
    both = np.column_stack([angles, halfway]).ravel()
    offsets = at_furthest_offsets(model).offsets | {RING_ANGLE: both}
    model = replace(model, offsets=offsets, resolution=Slices.like(model.resolution))
    states = sweep(model, torque / model.pair.pinion.r_b, RING_PHASES, what="estimating errors")
    te = states[TE].squeeze([name for name in OFFSETS if name != RING_ANGLE]).values
    curves = te.swapaxes(0, 1)
    error = periodic_spline((angles - angles[0]) / turn, curves[::2])((halfway - angles[0]) / turn) - curves[1::2]
    p2p = np.abs(np.ptp(curves[1::2] + error, axis=2) - np.ptp(curves[1::2], axis=2)).max(axis=0)
    total = np.sqrt((error**2).mean(axis=(0, 2)))
    return MapError(FROM_HALFWAY * total, FROM_HALFWAY * p2p), (te - te[:1]).mean(axis=(1, 2))


def _checked(torque: np.ndarray, number: int) -> np.ndarray:
    """`number` of the loaded torques, both ends included, after 0 if it is among the torques."""
    loaded = torque[torque > 0]
    chosen = np.unique(np.linspace(0, loaded.size - 1, number).round().astype(int))
    return np.concatenate([torque[torque == 0], loaded[chosen]])


def _at_all(torque: np.ndarray, checked: np.ndarray, errors: MapError) -> MapError:
    """Errors at all torques from those at the checked ones, along straight lines between logarithms."""
    loaded = checked > 0

    def interpolated(error: np.ndarray) -> np.ndarray:
        logarithms = np.log(np.maximum(error[loaded], LEAST_ERROR))
        under_load = np.exp(np.interp(np.log(torque[torque > 0]), np.log(checked[loaded]), logarithms))
        return np.append(error[~loaded], under_load)

    return MapError(*map(interpolated, errors))


class LoadedCurves:
    """Transmission errors and stiffnesses by `Slices` over CHECKED_PHASES; each torque is solved once."""

    def __init__(self, model: ContactModel):
        self.model = replace(model, resolution=Slices.like(model.resolution))
        self._solved: dict[float, tuple[np.ndarray, np.ndarray]] = {}

    def at(self, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """te [m] and tangent stiffness [N/m], (n_torque, n_phase)."""
        missing = [load for load in torque.tolist() if load not in self._solved]
        if missing:
            rows = zip(*curves(self.model, missing, CHECKED_PHASES), strict=True)
            self._solved.update(zip(missing, rows, strict=True))
        te, stiffness = zip(*(self._solved[load] for load in torque.tolist()), strict=True)
        return np.array(te), np.array(stiffness)


def halfway_torques(torque: np.ndarray) -> np.ndarray:
    """(n_torque - 1,) a quarter of the lowest load, then the geometric means of neighbouring loads; torque from 0."""
    return np.append(torque[1] / 4, np.sqrt(torque[1:-1] * torque[2:]))


def interval_error(loaded: LoadedCurves, torque: np.ndarray) -> MapError:
    """(n_torque - 1,) errors between neighbouring torques, the first of them 0, estimated half-way by `Slices`."""
    halfway, r_b = halfway_torques(torque), loaded.model.pair.pinion.r_b
    (te, stiffness), (direct, _) = loaded.at(torque), loaded.at(halfway)
    deflection = deflection_under(torque[1:] / r_b, te[1:] - te[0], halfway / r_b, stiffness[1:])
    error = te[0] + deflection - direct
    p2p = peak_to_peak_error(CHECKED_PHASES, direct + error, error, RANGE_SHARE)
    return MapError(*(FROM_HALFWAY * _bounded_at_light_loads(halfway, estimate) for estimate in (rms(error), p2p)))


def _bounded_at_light_loads(torque: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Errors (n,), where those at the two lightest loads fall at most with the square root of the torque.

    Under light loads corners touch for less of the mesh cycle than lies between two checked phases.
    """
    error = error.copy()
    for i in (1, 0):
        if i + 1 < error.size:
            error[i] = max(error[i], error[i + 1] * np.sqrt(torque[i] / torque[i + 1]))
    return error


def torque_error(model: ContactModel, torque) -> MapError:
    """Error between a torque and its neighbours; torque: at least three values, the first of them 0."""
    error = interval_error(LoadedCurves(model), np.asarray(torque, float))
    return MapError(*(np.maximum(np.append(0.0, part), np.append(part, 0.0)) for part in error))


def interpolation_errors(model: ContactModel, torque, phase) -> dict[str, MapError]:
    """Errors over phases if equidistant, "error_phase", and over torques if they start at 0, "error_torque"."""
    torque, phase, errors = np.asarray(torque), np.asarray(phase), {}
    if phase.size >= 4 and np.allclose(np.diff(phase), 1 / phase.size, atol=1e-9):
        errors["error_phase"] = phase_error(model, torque, phase)
    if torque.size >= 3 and torque[0] == 0:
        errors["error_torque"] = torque_error(model, torque)
    return errors
