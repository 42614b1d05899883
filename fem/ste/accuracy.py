"""Mesh, phases and torques that keep the errors of a map within a requested share.

Each kind of error is held twice, at every torque. Its root mean square over the mesh cycle is a share of the
deflection, the mean of te under load minus te without (at light loads: of a tenth of the largest one). Its effect on
the peak to peak is five times that share of the peak to peak (0.01: half a decibel), or of a quarter of the largest
one. Pairs whose te hardly varies are held less strictly, by shares of the deflection: their peak to peak is a small
difference of large numbers, for which finite elements, unlike torques and phases, soon grow too large.
"""

from dataclasses import dataclass, replace

import numpy as np

from fem.contact.resolution import Discretization, Resolution, Slices
from fem.elasticity.hertz import largest_torque
from fem.pair.pair import GearPair
from fem.ste.error_estimation import (
    CHECKED_PHASES,
    LoadedCurves,
    MapError,
    MeshErrors,
    halfway_torques,
    interpolation_errors,
    interval_error,
    mesh_errors,
    peak_to_peak,
    phase_error,
)
from fem.support.representation import short
from fem.support.validation import as_floats, require

FEWEST_PHASES, MOST_PHASES, MOST_TORQUES = 12, 400, 40
#: Of a deflection counts at least this share of the largest one, of a peak to peak that share of the largest one.
LIGHTEST, SMALLEST = 0.1, 0.25
#: Of a peak to peak counts at least so much of the deflection: for the mesh, and between phases and torques.
QUIET_MESH, QUIET_BETWEEN = 0.08, 0.02
#: Allowed error of the peak to peak over that of te, as shares of each.
SWING = 5.0
#: Slices for what is chosen in the slice mode, and most ones of a map.
FEWEST_SLICES, MOST_SLICES = 40, 80
#: Square of the elements along the flank times those across half the width, up to which a mesh takes 1.6 to 2.3 GB; of
#: spurs most have the half width only.
LARGEST_HELICAL, LARGEST_SPUR = 24**2 * 4, 36**2 * 6
#: Share of an allowed error from which on its cause is refined.
NEGLIGIBLE = 0.2


@short(torque="N m")
@dataclass(frozen=True)
class UpTo:
    """Torques from 0 to a largest one [N m], as many as the requested accuracy takes."""

    torque: float

    def __post_init__(self):
        as_floats(self)
        require(0 < self.torque < np.inf, f"torque must be > 0 N m, got {self.torque}")


def choose(
    pair: GearPair, torque: np.ndarray | UpTo, phase: np.ndarray | None, values: dict, accuracy: float
) -> tuple[np.ndarray, np.ndarray, Discretization, dict[str, MapError]]:
    """Torques and phases where they are not given, the coarsest resolution and its errors, within the share accuracy.

    What adds most to an error beyond the allowed one is refined, until the mesh has its largest size. Raises
    RuntimeError where that does not do, or too many torques or phases would be needed.
    """
    resolution: Discretization = Slices()
    least = np.inf
    while True:
        loaded = LoadedCurves(pair, values, replace(resolution, slices=max(resolution.slices, FEWEST_SLICES)))
        torques = chosen_torques(loaded, torque.torque, accuracy) if isinstance(torque, UpTo) else torque
        allowed = allowed_error(loaded, torques, accuracy, QUIET_MESH)
        errors = mesh_errors(pair, torques, values, resolution)
        excess = _excess(errors.total, allowed).max()
        if excess <= 1:
            break
        least, finer = min(least, excess), _refined(pair, resolution, errors, allowed)
        if finer is None:
            best = f"the best mesh tried is within {least * accuracy:.3g} of the deflection and of the peak to peak"
            remedy = "pass a larger accuracy, or a finer mesh as resolution=fem.Resolution(...)"
            raise RuntimeError(f"{best}, requested was accuracy={accuracy:g}; {remedy}")
        resolution = finer
    phases = chosen_phases(loaded, torques, accuracy) if phase is None else phase
    interpolation = interpolation_errors(pair, torques, phases, values, loaded.resolution)
    return torques, phases, resolution, {"error_mesh": errors.total} | interpolation


def _refined(
    pair: GearPair, resolution: Discretization, errors: MeshErrors, allowed: MapError
) -> Discretization | None:
    """The resolution finer in what errs most of what can be refined; None where that is too little to matter."""
    excess = {name: _excess(error, allowed).max() for name, error in errors.by_cause.items()}
    largest = LARGEST_HELICAL if pair.beta_b else LARGEST_SPUR
    for name in sorted(excess, key=excess.__getitem__, reverse=True):
        finer = _finer_in(resolution, name)
        small = finer.density.flank**2 * finer.density.width <= largest and finer.slices <= MOST_SLICES
        if excess[name] > NEGLIGIBLE and finer != resolution and small:
            return finer
    return None


def _finer_in(resolution: Discretization, cause: str) -> Discretization:
    """Twice the slices, strips resolved, or half as many elements again."""
    density, finer = resolution.density, resolution.density.scaled(3 / 2)
    return {
        "slices": replace(resolution, slices=2 * resolution.slices),
        "strips": Resolution.like(resolution),
        "width": replace(resolution, density=replace(density, width=finer.width)),
        "section": replace(resolution, density=replace(finer, width=density.width)),
    }[cause]


def allowed_error(loaded: LoadedCurves, torque: np.ndarray, accuracy: float, quiet: float = QUIET_BETWEEN) -> MapError:
    """Errors of each torque that are the requested shares; quiet: what counts of a deflection as peak to peak."""
    (unloaded, *te), _ = loaded.at(np.append(0.0, torque))
    deflection = np.mean(te - unloaded, axis=1)
    counted = np.maximum(deflection, LIGHTEST * deflection.max())
    swing = peak_to_peak(CHECKED_PHASES, np.array(te))
    swing = np.max([swing, np.full(swing.size, SMALLEST * swing.max()), quiet * counted], axis=0)
    return MapError(accuracy * counted, SWING * accuracy * swing)


def _excess(error: MapError, allowed: MapError) -> np.ndarray:
    """(n_torque,) largest ratio of an error to the allowed one."""
    return np.maximum(error.rms / allowed.rms, error.peak_to_peak / allowed.peak_to_peak)


def chosen_phases(loaded: LoadedCurves, torque: np.ndarray, accuracy: float) -> np.ndarray:
    """As few equidistant phases as keep the error between them within accuracy; RuntimeError beyond MOST_PHASES."""
    number, allowed = FEWEST_PHASES, allowed_error(loaded, torque, accuracy)
    while number <= MOST_PHASES:
        phase = np.arange(number) / number
        error = phase_error(loaded.pair, torque, phase, loaded.values, loaded.resolution)
        if (_excess(error, allowed) <= 1).all():
            return phase
        number = 2 * round(number * 0.75)
    raise RuntimeError(f"more than {MOST_PHASES} phases for accuracy {accuracy:g}; ask for less, or pass phases=")


def chosen_torques(loaded: LoadedCurves, largest: float, accuracy: float) -> np.ndarray:
    """Torques from 0 to the largest [N m] that keep the error between them within accuracy.

    Raises RuntimeError beyond MOST_TORQUES.
    """
    limit = largest_torque(loaded.pair)
    require(largest < limit, f"torque must be below {limit:.4g} N m, where Hertz pressure passes E/20, got {largest:g}")
    torque = np.append(0.0, largest / np.array([64, 16, 4, 1]))
    while torque.size <= MOST_TORQUES:
        allowed = (np.minimum(part[:-1], part[1:]) for part in allowed_error(loaded, torque, accuracy))
        wide = _excess(interval_error(loaded, torque), MapError(*allowed)) > 1
        if not wide.any():
            return torque
        torque = np.sort(np.append(torque, halfway_torques(torque)[wide]))
    raise RuntimeError(f"more than {MOST_TORQUES} torques for accuracy {accuracy:g}; ask for less, or pass torques")
