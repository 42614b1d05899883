"""Maps on coarse meshes, quick to solve."""

import numpy as np

import fem
from fem import Density

SLICES, STRIPS = fem.Slices(), fem.Resolution()
ROUGH = fem.Resolution(Density(flank=10, fillet=2, tooth=2, rim=2, body=3, width=2), 8)
COARSE = fem.Resolution(Density(flank=8, fillet=1, tooth=2, rim=1, body=2, width=1), 6)


def map_of(pair, torque, phases, resolution):
    return fem.static_transmission_error(pair, torque, phases, resolution=resolution, progress=False)


def te_of(pair, torque, phases, resolution) -> np.ndarray:
    return map_of(pair, torque, phases, resolution)["te"].values
