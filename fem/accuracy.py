"""Mesh, phases and torques that keep the errors of a map within a requested share.

Each kind of error is held twice, at every torque. Its root mean square over the mesh cycle is a share of the deflection,
the mean of te under load minus te without (where loads are light: of a tenth of the largest one). Its effect on the peak
to peak is three times that share of the peak to peak there (0.02: half a decibel), or of a tenth of the deflection where
that is more: a pair whose te varies by less is quiet, its peak to peak a small difference of large numbers.
"""

from dataclasses import dataclass, replace

import numpy as np

from fem.checks import as_floats
from fem.error_estimation import (
    CHECKED_PHASES,
    LoadedCurves,
    MapError,
    halfway_torques,
    interpolation_errors,
    interval_error,
    mesh_error,
    peak_to_peak,
    phase_error,
)
from fem.gear import GearPair, require
from fem.hertz import largest_torque
from fem.sweep import Resolution, across_width

FEWEST_PHASES, MOST_PHASES, MOST_TORQUES = 12, 400, 40
#: Of a deflection counts at least this share of the largest one, of its peak to peak this share of the deflection.
LIGHTEST, QUIETEST = 0.1, 0.1
#: Allowed error of the peak to peak over that of te, as shares of each.
SWING = 3.0
#: Slices across a width over which the gap varies, for what is chosen in the slice mode.
FEWEST_SLICES = 40


@dataclass(frozen=True)
class UpTo:
    """Torques from 0 to a largest one [N m], as many as the requested accuracy takes."""

    torque: float

    def __post_init__(self):
        as_floats(self)
        require(0 < self.torque < np.inf, f"torque must be > 0 N m, got {self.torque}")


def choose(
    pair: GearPair, torque: np.ndarray | UpTo, phase: np.ndarray | None, values: dict, accuracy: float
) -> tuple[np.ndarray, np.ndarray, Resolution, dict[str, MapError]]:
    """Torques and phases where they are not given, the coarsest level and its errors, within the share accuracy.

    Raises RuntimeError where no level does, or too many torques or phases would be needed.
    """
    least = np.inf
    for level in _levels(pair, values):
        fast = replace(level, slices=max(level.slices, FEWEST_SLICES))
        loaded = LoadedCurves(pair, values, fast)
        torques = chosen_torques(loaded, torque.torque, accuracy) if isinstance(torque, UpTo) else torque
        mesh = mesh_error(pair, torques, values, level)
        over = _excess(mesh, allowed_error(loaded, torques, accuracy)).max()
        if over <= 1:
            phases = chosen_phases(loaded, torques, accuracy) if phase is None else phase
            errors = {"error_mesh": mesh} | interpolation_errors(pair, torques, phases, values, fast)
            return torques, phases, level, errors
        least = min(least, over)
    short = f"the best mesh tried is within {least * accuracy:.3g} of the deflection and of the peak to peak"
    raise RuntimeError(f"{short}, accuracy {accuracy:g} was asked; ask for less or pass a finer fem.Resolution")


def _levels(pair: GearPair, values: dict) -> tuple[Resolution, ...]:
    """From the coarsest to the finest that is tried, which takes 1.6 to 2.3 GB.

    The last two are finer in the section, or across the width: of helical gears, which have no half width, than the
    default, of spurs than one that is finer in both.
    """
    default = Resolution()
    sliced = (default, replace(default, slices=FEWEST_SLICES)) if across_width(pair, values)[0] else (default,)
    coarse = (*(replace(level, resolved=False) for level in sliced), *sliced)
    if pair.beta_b:
        finer = default.finer_inside(), default.finer_across()
    else:
        finer = default.finer(), default.finer().finer_across(), default.finer().finer_inside()
    return (*coarse, *(replace(level, slices=max(level.slices, sliced[-1].slices)) for level in finer))


def allowed_error(loaded: LoadedCurves, torque: np.ndarray, accuracy: float) -> MapError:
    """Errors of each torque that are the requested shares."""
    (unloaded, *te), _ = loaded.at(np.append(0.0, torque))
    deflection = np.mean(te - unloaded, axis=1)
    counted = np.maximum(deflection, LIGHTEST * deflection.max())
    swing = np.maximum(peak_to_peak(CHECKED_PHASES, np.array(te)), QUIETEST * counted)
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
        halfway = halfway_torques(torque)
        wide = _excess(interval_error(loaded, torque), allowed_error(loaded, halfway, accuracy)) > 1
        if not wide.any():
            return torque
        torque = np.sort(np.append(torque, halfway[wide]))
    raise RuntimeError(f"more than {MOST_TORQUES} torques for accuracy {accuracy:g}; ask for less, or pass torques")
