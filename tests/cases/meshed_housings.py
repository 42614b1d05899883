"""A housing by finite elements for the paper's gear pair: two walls with two seats each on a base plate."""

from functools import cache

import numpy as np
from skfem import MeshHex
from skfem.io.meshio import to_meshio

import fem
from fem.units import mm

#: Seats of both shafts in the walls, in the order of the reduction.
SEATS = [("fast", 0.0), ("fast", 100 * mm), ("slow", 0.0), ("slow", 100 * mm)]
CENTRE_DISTANCE = 150 * mm


@cache
def walls_on_plate(modes: int = 12, thickness: float = 16 * mm) -> fem.ReducedHousing:
    """The housing, fixed at the bottom of its plate; its material is aluminium."""
    near, far = 25 * mm, 75 * mm
    x = np.array([-far, -near, near, CENTRE_DISTANCE - near, CENTRE_DISTANCE + near, CENTRE_DISTANCE + far])
    y, half = np.array([-120 * mm, -100 * mm, -near, near, far]), thickness / 2
    z = np.array([-half, half, 100 * mm - half, 100 * mm + half])
    grid = MeshHex.init_tensor(x, y, z)
    middle = grid.p[:, grid.t].mean(axis=1)
    kept = (middle[1] < y[1]) | (middle[2] < half) | (middle[2] > 100 * mm - half)
    mesh = to_meshio(grid.restrict(np.flatnonzero(kept)))

    def seat(at_x: float, at_z: float):
        return lambda p: (abs(p[0] - at_x) < near + 1e-6) & (abs(p[1]) < near + 1e-6) & (abs(p[2] - at_z) < half + 1e-6)

    seats = [seat(at_x, at_z) for at_x in (0.0, CENTRE_DISTANCE) for at_z in (0.0, 100 * mm)]
    aluminium = fem.Material(E=70e9, nu=0.33, density=2700.0)
    return fem.reduce_housing(mesh, seats, lambda p: p[1] < y[0] + 1e-6, material=aluminium, modes=modes)
