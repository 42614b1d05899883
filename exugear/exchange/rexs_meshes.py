"""Force laws of the meshes of a file: maps by finite elements, or the constant stiffness of ISO 6336-1."""

from collections.abc import Callable
from inspect import signature

import numpy as np
import xarray as xr

from fem.pair import iso6336
from fem.pair.offsets import Offsets
from fem.pair.pair import GearPair
from fem.ste.ste_map import ste_map
from fem.ste.transmission import static_transmission_error

#: Torques of a map over the largest one of the load cases.
SHARES = 0.0, 0.1, 0.3, 0.6, 1.0, 1.5
PHASES = 20
#: Axial offset from which on a map counts it [m].
LEAST_AXIAL = 1e-6


def mesh_of(mesh: str | Callable, pair: GearPair, torque: float, axial: float, *, progress: bool) -> xr.Dataset:
    """Map of a pair up to 1.5 times its torque [N m], whose wheel stands an axial offset [m] from its pinion.

    axial   > 0 along the z axis of the map, about which the mesh force turns the pinion clockwise
    """
    axial = axial if abs(axial) > LEAST_AXIAL else 0.0
    if callable(mesh):
        return mesh(pair, torque, **{"offsets": Offsets(axial=axial)} if axial and takes_offsets(mesh) else {})
    if mesh == "iso6336":
        return constant_map(pair, torque, axial)
    torques, offsets = torque * np.array(SHARES), Offsets(axial=axial) if axial else None
    return static_transmission_error(pair, torques, PHASES, offsets=offsets, progress=progress)


def takes_offsets(mesh: Callable) -> bool:
    """Whether a function of pair and torque takes the offsets between the gears, too."""
    return "offsets" in signature(mesh).parameters


def constant_map(pair: GearPair, torque: float, axial: float) -> xr.Dataset:
    """Map of the mean mesh stiffness of ISO 6336-1, method B: its transmission error is the same at all phases."""
    torques = torque * np.array(SHARES)
    stiffness = iso6336.mesh_stiffness(pair) * pair.b
    te = np.repeat((torques / (pair.pinion.r_b * stiffness))[:, None], 4, axis=1)
    ste = ste_map(pair, torques, np.arange(4) / 4, te)
    return ste.assign_attrs(axial=axial) if axial else ste
