"""Checks of what a map is asked for: torques, phases, accuracy, offsets at which the gears mesh."""

import numpy as np

from fem.contact.resolution import Discretization
from fem.elasticity.hertz import largest_torque
from fem.microgeometry.flank import pitch_deviations
from fem.pair.pair import GearPair
from fem.ste.accuracy import UpTo
from fem.support.validation import increasing, number, numbers, require, told
from fem.units import mm


def check_places(pair: GearPair, a: np.ndarray, axial: np.ndarray) -> None:
    """Require that the gears run together at all centre distances (n,) and meet at all axial offsets (m,) [m]."""
    for distance in a:
        GearPair(pair.pinion, pair.wheel, a=float(distance))
    shared = (pair.pinion.b + pair.wheel.b) / 2 - np.abs(axial).max()
    least = 0.1 * pair.b
    left = f"leaves {shared / mm:g} mm of face in contact; keep {least / mm:g} mm"
    require(bool(shared >= least), f"axial offset {np.abs(axial).max() / mm:g} mm {left}")


def checked_accuracy(name: str, accuracy) -> float:
    """The requested accuracy as a Python float."""
    spelling = f"pass resolution=fem.{type(accuracy).__name__}(...)"
    kind = f"{name} must be one real number, got {told(accuracy)}; {spelling}"
    require(not isinstance(accuracy, Discretization), kind)
    share = number(name, accuracy)
    require(1e-4 <= share <= 0.1, f"{name} must lie in [1e-4, 0.1], a share of the deflection (say 0.005), got {share}")
    return share


def require_one_way(accuracy: float | None, resolution: Discretization | None) -> None:
    """Require that an accuracy or a resolution is given, or neither."""
    conflict = f"accuracy={accuracy} chooses the resolution itself; leave out accuracy or resolution={resolution}"
    require(accuracy is None or resolution is None, conflict)


def given(pair: GearPair, torque, phases) -> tuple[np.ndarray, np.ndarray]:
    """Torques and phases of a map that are not left to an accuracy."""
    listed = phases is not None and not isinstance(torque, UpTo)
    require(listed, "phases=None and torque=fem.UpTo(...) need an accuracy to choose by, say accuracy=0.005")
    return checked_torque(pair, torque), checked_phases(phases, pair)


def checked_torque(pair: GearPair, torque) -> np.ndarray:
    values = increasing("torque", np.atleast_1d(numbers("torque", torque)))
    require(bool(values[0] >= 0), f"torque must increase from 0 or above [N m], got {torque}")
    largest = largest_torque(pair)
    limit = f"{largest:.4g} N m, where Hertz pressure passes E/20 (pass newton metres)"
    require(bool(values[-1] < largest), f"torque must be finite and below {limit}, got {values[-1]:g}")
    return values


def checked_phases(phases, pair: GearPair) -> np.ndarray:
    values = numbers("phases", phases)
    if values.ndim == 0:
        require(bool(4 <= values < 1e6 and values % 1 == 0), f"phases must be a whole number, at least 4, got {phases}")
        return np.arange(int(values)) / int(values)
    parts = (*pair.pinion.drive_flank, *pair.wheel.drive_flank)
    end = 1e6 if pitch_deviations(parts) else 1
    within = bool(increasing("phases", values)[0] >= 0 and values[-1] < end)
    require(within, f"phases must increase within [0, {end:g}) as share of a pitch, got {phases}")
    return values
