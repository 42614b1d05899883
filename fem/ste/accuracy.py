"""Mesh, phases and torques that keep the errors of a map within a requested share.

Each kind of error is bounded twice, at every torque. Its root mean square over the mesh cycle is a share of the
deflection, the mean of te under load minus te without load (at light loads: of a tenth of the largest deflection). Its
effect on the peak to peak is five times that share of the peak to peak (0.01: half a decibel), or of a quarter of the
largest peak to peak. If te hardly varies over the cycle, its peak to peak is a small difference of large numbers: then
the allowed error is a share of the deflection, larger for the mesh, which would grow too large, than between torques
and phases.
"""

from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from fem.contact.resolution import Discretization, Resolution, Slices
from fem.elasticity.mesh_density import PARTS
from fem.gear.rim_support import period
from fem.ste.error_estimation import (
    CHECKED_PHASES,
    LoadedCurves,
    MapError,
    MeshErrors,
    halfway_torques,
    interpolation_errors,
    interval_error,
    mesh_errors,
    phase_error,
    ring_angle_error,
)
from fem.ste.inputs import UpTo
from fem.ste.map_solver import ContactModel
from fem.ste.right_flanks import Symmetry, mirrored_model, symmetry_of
from fem.ste.ste_map import RING_ANGLE
from fem.ste.te_measures import curve_peak_to_peak

FEWEST_PHASES, MOST_PHASES, MOST_TORQUES, MOST_ANGLES = 12, 400, 40, 400
#: Least deflection that counts, over the largest; least peak to peak that counts, over the largest.
LEAST_DEFLECTION, LEAST_PEAK_TO_PEAK = 0.1, 0.25
#: Least peak to peak that counts, over the deflection: for the mesh, and between phases and torques.
LEAST_RATIO_MESH, LEAST_RATIO_BETWEEN = 0.08, 0.02
#: Allowed relative error of the peak to peak over that of te.
PEAK_TO_PEAK_FACTOR = 5.0
#: Least number of slices of the curves by which torques and phases are chosen, and largest number of a map.
FEWEST_SLICES, MOST_SLICES = 40, 80
#: Largest number of elements along the flank squared times that across half the width: such a mesh takes 1.6 to
#: 2.3 GB. Most spurs are modelled over half the width only.
LARGEST_HELICAL, LARGEST_SPUR = 24**2 * 4, 36**2 * 6
#: A cause of errors is refined if it contributes more than this share of the allowed error.
NEGLIGIBLE = 0.2
#: Torques from which the choice starts, over the largest one.
FIRST_TORQUES = np.array([0, 1 / 64, 1 / 16, 1 / 4, 1])


@dataclass(frozen=True)
class MapGrid:
    """Torques, phases and resolution at which a map is solved.

    torque      (n_torque,) pinion torques [N m]
    phase       (n_phase,) phases as share of a pitch
    resolution  resolution of mesh and contact
    errors      estimated errors of all torques, by name
    """

    torque: np.ndarray
    phase: np.ndarray
    resolution: Discretization
    errors: dict[str, MapError]


def choose(model: ContactModel, torque: np.ndarray | UpTo, phase: np.ndarray | None, accuracy: float) -> MapGrid:
    """The coarsest resolution within the accuracy, with torques for `UpTo` and phases for None.

    Torques < 0 load the right flanks. Where these differ from the left ones each side is chosen by itself, and the map
    takes the finer resolution and the larger number of phases.
    """
    if isinstance(torque, UpTo) or torque[0] >= 0:
        return choose_side(model, torque, phase, accuracy)
    left, right = torque[torque >= 0], np.abs(torque[torque <= 0])[::-1]
    if symmetry_of(model) is not Symmetry.NONE:
        grid = choose_side(model, np.union1d(left, right), phase, accuracy)
        return replace(grid, torque=torque, errors=_on_both_sides(torque, grid, grid))
    sides = [(model, left), (mirrored_model(model), right)]
    chosen = [choose_side(side, loads, phase, accuracy) for side, loads in sides if loads.any()]
    resolution = reduce(finer_of, (grid.resolution for grid in chosen))
    phases = max((grid.phase for grid in chosen), key=len)
    grids = [_estimated(replace(side, resolution=resolution), loads, phases) for side, loads in sides]
    return replace(grids[0], torque=torque, errors=_on_both_sides(torque, *grids))


def finer_of(resolution: Discretization, alternative: Discretization) -> Discretization:
    """The finer of two resolutions in each respect: strips before slices, more elements, more slices."""
    kind = Resolution if Resolution in (type(resolution), type(alternative)) else Slices
    numbers = [[getattr(x.density, part) for x in (resolution, alternative)] for part in (*PARTS, "width")]
    density = replace(resolution.density, **dict(zip((*PARTS, "width"), map(max, numbers), strict=True)))
    return kind(density, max(resolution.slices, alternative.slices), resolution.neighbours)


def choose_side(model: ContactModel, torque: np.ndarray | UpTo, phase: np.ndarray | None, accuracy: float) -> MapGrid:
    """The grid of the left flanks, under torques >= 0.

    Refines the largest error contribution until all are within the accuracy, or the mesh has its largest size.
    Raises RuntimeError if that is not fine enough, or too many torques or phases would be needed.
    """
    model, least = replace(model, resolution=Slices()), np.inf
    while True:
        loaded = _loaded_curves(model)
        torques = chosen_torques(loaded, torque.torque, accuracy) if isinstance(torque, UpTo) else torque
        allowed = allowed_error(loaded, torques, accuracy, LEAST_RATIO_MESH)
        errors = mesh_errors(model, torques)
        excess = _excess(errors.total, allowed).max()
        if excess <= 1:
            break
        least, finer = min(least, excess), _refined(model, errors, allowed)
        if finer is None:
            best = f"the best mesh tried is within {least * accuracy:.3g} of the deflection and of the peak to peak"
            remedy = "pass a larger accuracy, or a finer mesh as resolution=fem.Resolution(...)"
            raise RuntimeError(f"{best}, requested was accuracy={accuracy:g}; {remedy}")
        model = replace(model, resolution=finer)
    phases = chosen_phases(loaded, torques, accuracy) if phase is None else phase
    between = interpolation_errors(loaded.model, torques, phases)
    return MapGrid(torques, phases, model.resolution, {"error_mesh": errors.total} | between)


def _loaded_curves(model: ContactModel) -> LoadedCurves:
    """Curves of a model with the slices that suffice for the choice of torques and phases."""
    slices = max(model.resolution.slices, FEWEST_SLICES)
    return LoadedCurves(replace(model, resolution=replace(model.resolution, slices=slices)))


def _estimated(model: ContactModel, torque: np.ndarray, phase: np.ndarray) -> MapGrid:
    """The grid of the left flanks at a given resolution with its errors, which are 0 without load."""
    if not torque.any():
        none = MapError(np.zeros(torque.size), np.zeros(torque.size))
        return MapGrid(torque, phase, model.resolution, {"error_mesh": none})
    between = interpolation_errors(_loaded_curves(model).model, torque, phase)
    return MapGrid(torque, phase, model.resolution, {"error_mesh": mesh_errors(model, torque).total} | between)


def _on_both_sides(torque: np.ndarray, left: MapGrid, right: MapGrid) -> dict[str, MapError]:
    """Errors over signed torques, of the grids of both sides over torques >= 0; NaN where a side has no estimate."""
    names = dict.fromkeys([*left.errors, *right.errors])

    def at(grid: MapGrid, name: str, load: float) -> tuple[float, float]:
        row = np.flatnonzero(grid.torque == abs(load))
        error = grid.errors.get(name, MapError(np.full(grid.torque.size, np.nan), np.full(grid.torque.size, np.nan)))
        return error.rms[row[0]], error.peak_to_peak[row[0]]

    columns = {name: [at(right if load < 0 else left, name, load) for load in torque.tolist()] for name in names}
    return {name: MapError(*np.array(column).T) for name, column in columns.items()}


def _refined(model: ContactModel, errors: MeshErrors, allowed: MapError) -> Discretization | None:
    """The resolution refined against the cause of the largest error; None if no cause that matters can be refined."""
    excess = {cause: _excess(error, allowed).max() for cause, error in errors.by_cause.items()}
    largest = LARGEST_HELICAL if model.pair.beta_b else LARGEST_SPUR
    for cause in sorted(excess, key=excess.__getitem__, reverse=True):
        finer = _finer_in(model.resolution, cause)
        small = finer.density.flank**2 * finer.density.width <= largest and finer.slices <= MOST_SLICES
        if excess[cause] > NEGLIGIBLE and finer != model.resolution and small:
            return finer
    return None


def _finer_in(resolution: Discretization, cause: str) -> Discretization:
    """Twice the slices, resolved strips, or 1.5 times the elements across the width or of the section."""
    density, finer = resolution.density, resolution.density.scaled(3 / 2)
    return {
        "slices": replace(resolution, slices=2 * resolution.slices),
        "strips": Resolution.like(resolution),
        "width": replace(resolution, density=replace(density, width=finer.width)),
        "section": replace(resolution, density=replace(finer, width=density.width)),
    }[cause]


def allowed_error(
    loaded: LoadedCurves, torque: np.ndarray, accuracy: float, least_ratio: float = LEAST_RATIO_BETWEEN
) -> MapError:
    """Largest allowed errors of each torque.

    least_ratio     least peak to peak that counts, over the deflection
    """
    (unloaded, *te), _ = loaded.at(np.append(0.0, torque))
    deflection = np.mean(te - unloaded, axis=1)
    counted = np.maximum(deflection, LEAST_DEFLECTION * deflection.max())
    p2p = curve_peak_to_peak(CHECKED_PHASES, np.array(te))
    p2p = np.max([p2p, np.full(p2p.size, LEAST_PEAK_TO_PEAK * p2p.max()), least_ratio * counted], axis=0)
    return MapError(accuracy * counted, PEAK_TO_PEAK_FACTOR * accuracy * p2p)


def with_ring_angles(
    model: ContactModel, torque: np.ndarray, accuracy: float, *, fixed: bool
) -> tuple[ContactModel, MapError]:
    """The model with twice the ring angles until the error between them is within accuracy; errors over torques.

    torque      (n_torque,) of the map, those < 0 on the right flanks, which bend the rim as much
    fixed       whether to keep the angles, and only estimate the error

    Raises RuntimeError beyond MOST_ANGLES.
    """
    loads, rows = np.unique(np.append(0.0, np.abs(torque)), return_inverse=True)
    while True:
        error, deflection = ring_angle_error(model, loads)
        allowed = accuracy * np.maximum(deflection, LEAST_DEFLECTION * deflection.max())
        if fixed or (error.rms <= allowed).all():
            return model, MapError(*(part[rows[1:]] for part in error))
        angles = model.offsets[RING_ANGLE]
        more = f"more than {MOST_ANGLES} ring angles for accuracy {accuracy:g}; ask for less, or pass ring_angles="
        if 2 * angles.size > MOST_ANGLES:
            raise RuntimeError(more)
        between = np.append(angles[1:], angles[0] + (period(model.pair.wheel.support) or 0.0))
        finer = np.column_stack([angles, (angles + between) / 2]).ravel()
        model = replace(model, offsets=model.offsets | {RING_ANGLE: finer})


def _excess(error: MapError, allowed: MapError) -> np.ndarray:
    """(n_torque,) largest ratio of an error to the allowed one."""
    return np.maximum(error.rms / allowed.rms, error.peak_to_peak / allowed.peak_to_peak)


def chosen_phases(loaded: LoadedCurves, torque: np.ndarray, accuracy: float) -> np.ndarray:
    """As few equidistant phases as keep the error between them within accuracy; RuntimeError beyond MOST_PHASES."""
    number, allowed = FEWEST_PHASES, allowed_error(loaded, torque, accuracy)
    while number <= MOST_PHASES:
        phase = np.arange(number) / number
        if (_excess(phase_error(loaded.model, torque, phase), allowed) <= 1).all():
            return phase
        number = 2 * round(number * 0.75)
    raise RuntimeError(f"more than {MOST_PHASES} phases for accuracy {accuracy:g}; ask for less, or pass phases=")


def chosen_torques(loaded: LoadedCurves, largest: float, accuracy: float) -> np.ndarray:
    """Torques from 0 to the largest [N m] that keep the error between them within accuracy.

    Raises RuntimeError beyond MOST_TORQUES.
    """
    torque = largest * FIRST_TORQUES
    while torque.size <= MOST_TORQUES:
        allowed = (np.minimum(part[:-1], part[1:]) for part in allowed_error(loaded, torque, accuracy))
        wide = _excess(interval_error(loaded, torque), MapError(*allowed)) > 1
        if not wide.any():
            return torque
        torque = np.sort(np.append(torque, halfway_torques(torque)[wide]))
    raise RuntimeError(f"more than {MOST_TORQUES} torques for accuracy {accuracy:g}; ask for less, or pass torques")
