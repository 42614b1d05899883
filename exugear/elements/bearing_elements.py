"""Bearings in Exudyn: the linear ones of a shaft as a matrix, each nonlinear one by its radial force."""

from math import sqrt

import exudyn.itemInterface as eii
import numpy as np
from numba import carray

from exugear.elements.difference_jacobian import jacobian
from exugear.elements.divergence import DIVERGED, FAR
from exugear.force_table.kernel_records import doubles_at
from exugear.gearbox.bearing import Bearing
from exugear.gearbox.bearing_stiffness import linear_part, radial_table
from exugear.gearbox.shaft import Shaft
from exugear.plan.coordinates import Coordinates
from fem.support.numba_cache import compiled, kept

#: Numbers before the columns of a table: size of a column, lever [m], damping [s].
SIZE, LEVER, DAMPING = range(3)
HEADER = 3
#: Steps of the difference Jacobian in coordinates [m, rad] and velocities [m/s, rad/s].
DIFFERENCE_STEPS = 1e-9, 1e-6


def add_bearings(mbs, node: int, shaft: Shaft, coordinates: Coordinates) -> None:
    """Add the bearings of a shaft to the node of its body."""
    stiffness, damping = np.zeros((6, 6)), np.zeros((6, 6))
    for axial, bearing in shaft.bearings.items():
        k = linear_part(bearing, axial - shaft.centre)
        stiffness, damping = stiffness + k, damping + bearing.damping * k
    part = np.ix_(coordinates.components, coordinates.components)
    items = [eii.ObjectGenericODE2(nodeNumbers=[node], stiffnessMatrix=stiffness[part], dampingMatrix=damping[part])]
    for axial, bearing in shaft.bearings.items():
        if not bearing.linear:
            force, jacobian = user_functions(bearing, axial - shaft.centre)
            item = eii.ObjectGenericODE2(nodeNumbers=[node], forceUserFunction=force, jacobianUserFunction=jacobian)
            items.append(item)
    for item in items:
        item.visualization["show"] = False
        mbs.AddObject(item)


@compiled
def interpolated(table, r):
    """Force and slope of a table at r >= 0; ValueError(r, end) beyond its end."""
    n = int(table[SIZE])
    if not r <= table[HEADER + n - 1]:
        raise ValueError(r, table[HEADER + n - 1])
    i = 0
    while i < n - 2 and r > table[HEADER + i + 1]:
        i += 1
    slope = (table[HEADER + n + i + 1] - table[HEADER + n + i]) / (table[HEADER + i + 1] - table[HEADER + i])
    return table[HEADER + n + i] + slope * (r - table[HEADER + i]), slope


@kept
def bearing_forces(address, x, y, z, a, b, c, u, v, w, d, e, f):
    """Generalized forces (6) of a nonlinear bearing on a shaft, first order in the tilts.

    x, y, z, a, b, c are the displacements, tilts and spin of the shaft's centre of mass, u, v, w, d, e, f their rates.
    """
    table = carray(doubles_at(address), int(carray(doubles_at(address), HEADER)[SIZE]) * 2 + HEADER)
    lever = table[LEVER]
    x, y, u, v = x + lever * b, y - lever * a, u + lever * e, v - lever * d
    r = sqrt(x * x + y * y)
    if r == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    force, slope = interpolated(table, r)
    total = force + table[DAMPING] * slope * (x * u + y * v) / r
    p, q = -total * x / r, -total * y / r
    return p, q, 0.0, -lever * q, lever * p, 0.0


def user_functions(bearing: Bearing, lever: float):
    """Force and Jacobian of a nonlinear bearing that Exudyn calls; the force owns the table that it addresses."""
    displacement, force = radial_table(bearing)
    table = np.concatenate([[displacement.size, lever, bearing.damping], displacement, force])
    address = table.ctypes.data

    def forces(*state):
        try:
            return bearing_forces(address, *state)
        except ValueError as error:
            r, end = error.args
            beyond = f"displacement {r:.4g} m of a bearing lies beyond its table, which ends at {end:.4g} m"
            raise RuntimeError(f"{beyond}; {'extend it' if r < FAR else DIVERGED}") from None

    def bearing_force(mbs, t, item, q, q_t):
        return forces(*q, *q_t)

    def bearing_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        return jacobian(forces, q, q_t, (factor, factor_t), DIFFERENCE_STEPS)

    vars(bearing_force)["owned"] = table
    return bearing_force, bearing_jacobian


def reactions(shaft: Shaft, q: np.ndarray, q_t: np.ndarray) -> dict[float, np.ndarray]:
    """Force of each bearing on its shaft (n, 3) [N] by its axial position.

    q, q_t   (n, 5) displacements and tilts of the shaft's centre of mass, and their rates
    """
    forces = {}
    for axial, bearing in shaft.bearings.items():
        lever = axial - shaft.centre
        motion = np.eye(6)[:, :5]
        motion[0, 4], motion[1, 3] = lever, -lever
        stiffness = linear_part(bearing, 0.0)[:3] @ motion
        force = -(q + bearing.damping * q_t) @ stiffness.T
        if not bearing.linear:
            force[:, :2] += _radial_reaction(bearing, q @ motion[:2].T, q_t @ motion[:2].T)
        forces[axial] = force
    return forces


def _radial_reaction(bearing: Bearing, displacement: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """(n, 2) radial force of a nonlinear bearing at radial displacements (n, 2) [m] and their rates."""
    radii, forces = radial_table(bearing)
    r = np.linalg.norm(displacement, axis=1)
    unit = displacement / np.maximum(r, np.finfo(float).tiny)[:, None]
    slopes = np.diff(forces) / np.diff(radii)
    slope = slopes[np.clip(np.searchsorted(radii, r) - 1, 0, slopes.size - 1)]
    total = np.interp(r, radii, forces) + bearing.damping * slope * (unit * rate).sum(axis=1)
    return -total[:, None] * unit
