"""Friction of spur and unlike pairs."""

import numpy as np
from spatial_meshes import PAIRS

import exugear
import fem
from fem.units import mm

MU, SPUR = 0.06, PAIRS["spur"]
N = 512


def unlike_pair(beta: float = 0.0) -> fem.GearPair:
    data = {"m_n": 3 * mm, "b": 25 * mm, "d_bore": 20 * mm}
    return fem.GearPair(fem.Gear(z=23, beta=beta, **data), fem.Gear(z=61, beta=-beta, **data))


def friction_for(pair, mu: float = MU, **options) -> exugear.MeshFriction:
    """Equal shares, and for the ring a smooth table."""
    if isinstance(pair, fem.GearPair):
        return exugear.MeshFriction.of_pair(pair, mu, **options)
    phase = 2 * np.pi * np.arange(64) / 64
    return exugear.MeshFriction(mu, 0.7 * np.cos(phase), (4 + np.sin(phase)) * mm, **options)
