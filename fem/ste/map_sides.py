"""The two sides of a map: torques >= 0, which load the left flanks, and torques < 0, which load the right ones."""

import numpy as np
import xarray as xr

from fem.gear.gear import Gear
from fem.microgeometry.flank import removed
from fem.pair.offsets import ANGLES
from fem.ste.ste_map import (
    CENTROID,
    MIRRORED,
    PHASE,
    RIGHT_FLANKS,
    TE,
    TORQUE,
    UNLOADED_RIGHT,
    deviating_teeth,
    pair_of,
    pitches_of,
)

SIDES_DIFFER = "left and right flanks differ"
TEETH_DIFFER = "teeth differ, which the mirror image has in the opposite order"
#: Points along and across a flank at which its two halves are compared; difference that counts as rounding [m].
COMPARED, EVEN_GAP = 101, 1e-15


def has_right_flanks(ste: xr.Dataset) -> bool:
    """Whether a map has torques < 0 whose right flanks are not the mirror image of the left ones."""
    return bool(ste[TORQUE].values[0] < 0) and ste.attrs.get(RIGHT_FLANKS) != MIRRORED


def left_torques(ste: xr.Dataset) -> xr.Dataset:
    """The part of a map under torques >= 0, which load the left flanks."""
    return ste.isel({TORQUE: ste[TORQUE].values >= 0}).drop_vars(UNLOADED_RIGHT, errors="ignore")


def right_torques(ste: xr.Dataset) -> xr.Dataset:
    """The part of a map under torques < 0 as a map of the pair turned by half a turn about the line of centres.

    There the right flanks are the left ones: te and torque are > 0, the phases those of the right flanks from 0 on, and
    z points the other way, as the coast flank of a force law counts misalignment, axial offset and force centroid.
    The torques begin with 0 where the map has te_unloaded_right.
    """
    pitches = float(pitches_of(ste))
    phase = (pair_of(ste).back_phase - ste[PHASE].values) % pitches % pitches
    loaded = ste.isel({TORQUE: np.flatnonzero(ste[TORQUE].values < 0)[::-1]})
    te = -loaded[TE].assign_coords({TORQUE: -loaded[TORQUE].values})
    loaded = loaded.drop_vars([TE, UNLOADED_RIGHT], errors="ignore").assign_coords({TORQUE: te[TORQUE]})
    if UNLOADED_RIGHT in ste:
        unloaded = -ste[UNLOADED_RIGHT].expand_dims({TORQUE: [0.0]}).transpose(*te.dims)
        te = xr.concat([unloaded.rename(TE), te], TORQUE)
        loaded = loaded.reindex({TORQUE: te[TORQUE]})
    return _reversed_z(loaded.assign({TE: te}).assign_coords({PHASE: phase}).sortby(PHASE))


def _reversed_z(ste: xr.Dataset) -> xr.Dataset:
    """A map with z reversed: misalignment, axial offset and force centroid change their signs."""
    axes = [name for name in ("misalignment", "axial") if name in ste.dims]
    ste = ste.isel(dict.fromkeys(axes, slice(None, None, -1)))
    ste = ste.assign_coords({name: -ste[name].values for name in axes})
    return ste.assign({CENTROID: -ste[CENTROID]}) if CENTROID in ste else ste


def why_unlike(ste: xr.Dataset) -> str:
    """Why the right flanks of a map are not the left ones after half a turn about the line of centres; "" if they are.

    Spur gears that are the same on both sides have the same transmission error there all the same, but another force
    centroid.
    """
    pair = pair_of(ste)
    gears = pair.pinion, pair.wheel
    if any(gear.drive_flank != gear.coast_flank for gear in gears):
        return SIDES_DIFFER
    if deviating_teeth(pair) != (1, 1):
        return TEETH_DIFFER
    if not all(map(halves_alike, gears)):
        return "the flanks are not the same on both halves of the width"
    fixed = [name for name in (*ANGLES, "axial") if float(ste.attrs.get(name, 0.0)) != 0.0 and name not in ste.dims]
    return f"{', '.join(fixed)} of the map is not 0" if fixed else ""


def halves_alike(gear: Gear) -> bool:
    """Whether the left flank of a gear is the same on both halves of its width."""
    roll = np.linspace(gear.roll_form, gear.roll_tip, COMPARED)
    relief = removed(gear.drive_flank, gear.face, roll, np.linspace(-gear.b / 2, gear.b / 2, COMPARED)[:, None])
    return bool(np.abs(relief - relief[::-1]).max() <= EVEN_GAP)
