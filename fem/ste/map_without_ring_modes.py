"""The map of a ring that is left when a model holds vibration modes of its rim as coordinates."""

from math import pi

import numpy as np
import xarray as xr

from fem.ste.ste_map import PHASE, RING_ANGLE, STIFFNESS, TE, TORQUE, check, pair_of, periodic_spline
from fem.support.arguments import checked
from fem.support.validation import require

MODE, AT = "ring_mode", "at"
#: Flanks of the ring in `fem.ring_modes` by the sign of the torque of a map.
LEFT, RIGHT = "left_flank", "right_flank"


@checked
def without_ring_modes(ste: xr.Dataset, modes: xr.Dataset) -> xr.Dataset:
    """A map without the static flexibility of modes of its ring, for a model that holds these as coordinates.

    ste     map of a ring on its supports: on `fem.Bolts` over all pitches (`fem.over_pitches`)
    modes   `fem.ring_modes` of the same pair

    te - F sum g^2 / omega^2, with the mesh force F and the displacement g of the flank that it presses at each phase.
    Raises ValueError for modes of another pair, maps over the ring angle, and where te would not grow with the torque.
    """
    data, pair = check(ste), pair_of(ste)
    missing = [name for name in ("frequency", LEFT, RIGHT) if name not in modes or MODE not in modes[name].dims]
    require(not missing, f"modes must be what fem.ring_modes returns, they lack {missing}")
    of_modes = pair_of(modes)
    require(pair == of_modes, "modes must be fem.ring_modes of the pair of ste, got those of another pair")
    require(RING_ANGLE not in data[TE].dims, f"ste has the axis {RING_ANGLE}; pass fem.over_pitches(ste)")
    angle, omega = 2 * pi / abs(pair.wheel.z) * data[PHASE].values, 2 * pi * modes["frequency"].values
    flexible = {}
    for flank in (LEFT, RIGHT):
        around = np.sum((modes[flank].values / omega[:, None]) ** 2, axis=0)
        flexible[flank] = periodic_spline(modes[AT].values, around, 2 * pi)
    force = data[TORQUE] / pair.pinion.r_b
    by_flank = [xr.DataArray(of_flank(angle % (2 * pi)), dims=PHASE) for of_flank in flexible.values()]
    flexibility = xr.where(force >= 0, by_flank[0], by_flank[1])
    te = (data[TE] - force * flexibility).transpose(*data[TE].dims)
    rising = bool((te.diff(TORQUE) > 0).all())
    require(rising, "te without the modes must grow with the torque; map the ring by the resolution of its modes")
    result = data.assign({TE: te.assign_attrs(data[TE].attrs)})
    if STIFFNESS in data:
        soft = data[STIFFNESS] * flexibility
        stiffness = (data[STIFFNESS] / xr.where(soft < 1, 1 - soft, np.nan)).transpose(*data[STIFFNESS].dims)
        result[STIFFNESS] = stiffness.assign_attrs(data[STIFFNESS].attrs)
    return result
