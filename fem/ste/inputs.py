"""Checks of the inputs of a map: torques, phases, accuracy or resolution, offsets at which the gears mesh."""

from dataclasses import dataclass
from math import floor
from typing import Any

import numpy as np

from fem.contact.resolution import Discretization
from fem.microgeometry.flank import names_teeth
from fem.pair.hertz import largest_torque, least_torque
from fem.pair.mesh_position import MeshPosition
from fem.pair.pair import GearPair
from fem.ste.ste_map import deviating_teeth, warn_of_missing_pitches
from fem.support.representation import short
from fem.support.validation import as_floats, increasing, number, numbers, require, text_of
from fem.units import mm

#: Least torque of `UpTo` over that of a map, as a choice of torques begins far below the largest.
LEAST_UP_TO = 1000


@short(torque="N m")
@dataclass(frozen=True)
class UpTo:
    """Torques from 0 to the largest torque [N m], as many as the requested accuracy needs.

    Raises ValueError for a torque that is not positive.
    """

    torque: float

    def __post_init__(self):
        as_floats(self)
        require(0 < self.torque < np.inf, f"torque must be > 0 N m, got {self.torque}")


def check_offsets_mesh(pair: GearPair, a: np.ndarray, axial: np.ndarray) -> None:
    """Require that the gears run together at all centre distances (n,) and meet at all axial offsets (m,) [m]."""
    for distance in a:
        GearPair(pair.pinion, pair.wheel, a=float(distance))
    shared = (pair.pinion.b + pair.wheel.b) / 2 - np.abs(axial).max()
    least = 0.1 * pair.b
    left = f"leaves {shared / mm:g} mm of face in contact; keep {least / mm:g} mm"
    furthest = f"axial offset {np.abs(axial).max() / mm:g} mm"
    require(bool(shared >= least), f"{furthest} {left}")
    eps_gamma = min(MeshPosition(pair, float(d), float(z), 0.0).eps_gamma for d in a for z in axial)
    require(eps_gamma > 1, f"{furthest} leaves a contact ratio of {eps_gamma:.4g}, which must exceed 1; reduce it")


def checked_request(
    pair: GearPair, torque, phases, accuracy: float | None, resolution: Discretization | None
) -> tuple[Any, Any]:
    """Torques (n_torque,) and phases (n_phase,), or `UpTo` and None if an accuracy is to choose them."""
    conflict = f"accuracy={accuracy} chooses the resolution itself; leave out accuracy or resolution={resolution}"
    require(accuracy is None or resolution is None, conflict)
    listed = phases is not None and not isinstance(torque, UpTo)
    missing = "phases=None and torque=fem.UpTo(...) need an accuracy to choose by, say accuracy=0.005"
    require(listed or accuracy is not None, missing)
    unlike = names_teeth((*pair.pinion.drive_flank, *pair.wheel.drive_flank))
    several = "phases must be given with PitchDeviation, over all pitches of interest; an accuracy chooses those of one"
    require(phases is not None or not unlike, several)
    upto = isinstance(torque, UpTo)
    torque = _checked_largest(pair, torque) if upto else checked_torque(pair, torque, signed=True)
    loaded = accuracy is None or isinstance(torque, UpTo) or np.any(torque)
    require(bool(loaded), f"accuracy needs a torque > 0 or < 0 to be a share of its deflection, got {torque}")
    return torque, None if phases is None else checked_phases(phases, pair)


def checked_accuracy(name: str, accuracy) -> float:
    """The requested accuracy as a Python float."""
    kind = (
        f"{name} must be one real number, got {text_of(accuracy)}; pass resolution=fem.{type(accuracy).__name__}(...)"
    )
    require(not isinstance(accuracy, Discretization), kind)
    share = number(name, accuracy)
    require(1e-4 <= share <= 0.1, f"{name} must lie in [1e-4, 0.1], a share of the deflection (say 0.005), got {share}")
    return share


def _checked_largest(pair: GearPair, torques: UpTo) -> UpTo:
    limit = largest_torque(pair)
    below = f"torque must be below {limit:.4g} N m, where Hertz pressure passes E/20, got {torques.torque:g}"
    require(torques.torque < limit, below)
    least = LEAST_UP_TO * least_torque(pair)
    light = f"torque must be {least:.2g} N m or more, as torques far below it are solved too, got {torques.torque:g}"
    require(torques.torque >= least, light)
    return torques


def checked_torque(pair: GearPair, torque, *, signed: bool = False) -> np.ndarray:
    """(n_torque,) increasing pinion torques [N m]; signed: torques < 0 load the right flanks."""
    values = increasing("torque", np.atleast_1d(numbers("torque", torque)))
    left = f"torque must increase from 0 or above [N m], which loads the left flanks, got {torque}"
    mirrored = "for the right flanks pass fem.mirror_image(pair) and torques > 0"
    require(bool(signed or not values[0] < 0), f"{left}; {mirrored}")
    largest, furthest = largest_torque(pair), float(np.abs(values).max())
    limit = f"{largest:.4g} N m, where Hertz pressure passes E/20 (pass newton metres)"
    require(bool(furthest < largest), f"torque must be finite and below {limit}, got {furthest:g}")
    least, lowest = least_torque(pair), np.abs(values[values != 0]).min(initial=np.inf)
    rounding = f"torque must be 0 or {least:.2g} N m and more; the deflection below it is lost in rounding"
    require(bool(lowest >= least), f"{rounding}, got {lowest:g}")
    return values


def checked_phases(phases, pair: GearPair) -> np.ndarray:
    """(n_phase,) increasing phases; a number of phases is spread over the first pitch."""
    values = numbers("phases", phases)
    if values.ndim == 0:
        require(bool(4 <= values < 1e6 and values % 1 == 0), f"phases must be a whole number in [4, 1e6), got {phases}")
        return np.arange(int(values)) / int(values)
    modifications = (*pair.pinion.drive_flank, *pair.wheel.drive_flank)
    end = 1e6 if names_teeth(modifications) else 1
    within = bool(increasing("phases", values)[0] >= 0 and values[-1] < end)
    require(within, f"phases must increase within [0, {end:g}) as share of a pitch, got {phases}")
    return values


def phases_of_measures(phases, pair: GearPair) -> np.ndarray:
    """`checked_phases` of measures over the mesh cycle; warns where not all teeth that differ meet in them."""
    values = checked_phases(phases, pair)
    warn_of_missing_pitches(floor(values[-1]) + 1, deviating_teeth(pair))
    return values
