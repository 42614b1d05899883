"""Bearings in Exudyn: stiffness and damping matrices of linear bearings, user functions of nonlinear ones."""

from math import sqrt

import exudyn.itemInterface as eii
import numpy as np
from numba import carray

from exugear.contact.difference_jacobian import jacobian
from exugear.gearbox.bearing import Bearing
from exugear.gearbox.bearing_stiffness import linear_part, radial_stiffness, radial_table
from exugear.gearbox.shaft import Shaft
from exugear.mesh_force.kernel_records import address_of, doubles_at, reader, record_of, record_type, start_of
from exugear.multibody.user_function_errors import DIVERGED, FAR
from exugear.planning.coordinates import Coordinates
from fem.support.numba_cache import compiled, kept

#: Head of a radial law: number of points, axial distance from the centre of mass [m], damping over stiffness [s];
#: behind it lie the displacements [m] and the forces [N] of the points.
RADIAL_LAW = record_type(("points", "i8"), ("lever", "f8"), ("damping", "f8"))
HEAD_SIZE = RADIAL_LAW.itemsize
radial_law_at = reader(RADIAL_LAW)
#: Steps of the difference Jacobian in coordinates [m, rad] and velocities [m/s, rad/s].
DIFFERENCE_STEPS = 1e-9, 1e-6
#: Number of samples whose reactions are computed at once: they stay in the processor's cache, which is 5 times as fast.
BLOCK = 4096


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
def radial_force(law, r):
    """Force [N] and slope [N/m] at a radial displacement r >= 0 [m]; ValueError(r, end) beyond the law's end."""
    n = law.points
    columns = carray(doubles_at(start_of(law) + HEAD_SIZE), (2, n))
    displacement, force = columns[0], columns[1]
    if not r <= displacement[n - 1]:
        raise ValueError(r, displacement[n - 1])
    i = 0
    while i < n - 2 and r > displacement[i + 1]:
        i += 1
    slope = (force[i + 1] - force[i]) / (displacement[i + 1] - displacement[i])
    return force[i] + slope * (r - displacement[i]), slope


@kept
def bearing_forces(address, x, y, z, a, b, c, u, v, w, d, e, f):
    """Generalized forces (6) of a nonlinear bearing on a shaft, first order in the tilts.

    address            of its radial law, whose slope is damped in radial, and whose secant in circumferential direction
    x, y, z, a, b, c   displacements [m], tilts and spin [rad] of the shaft's centre of mass
    u, v, w, d, e, f   their rates
    """
    law = radial_law_at(address)
    lever = law.lever
    x, y, u, v = x + lever * b, y - lever * a, u + lever * e, v - lever * d
    r = sqrt(x * x + y * y)
    force, slope = radial_force(law, r)
    secant = force / r if r > 0.0 else slope
    total = secant + law.damping * (slope - secant) * (x * u + y * v) / (r * r) if r > 0.0 else secant
    p, q = -total * x - law.damping * secant * u, -total * y - law.damping * secant * v
    return p, q, 0.0, -lever * q, lever * p, 0.0


def radial_law(bearing: Bearing, lever: float) -> np.record:
    """The record of a nonlinear bearing that `bearing_forces` reads: `RADIAL_LAW`, behind it the points."""
    displacement, force = radial_table(bearing)
    n = displacement.size
    head = record_of(RADIAL_LAW, points=n, lever=lever, damping=bearing.damping)
    kind = record_type(("head", RADIAL_LAW), ("displacement", "f8", n), ("force", "f8", n))
    return record_of(kind, head=head, displacement=displacement, force=force)


def user_functions(bearing: Bearing, lever: float):
    """Force and Jacobian of a nonlinear bearing for Exudyn; the force keeps the law alive whose address it passes.

    lever   axial distance of the bearing from the shaft's centre of mass [m]
    """
    law = radial_law(bearing, lever)
    address = address_of(law)

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

    vars(bearing_force)["owned"] = law
    return bearing_force, bearing_jacobian


def reactions(shaft: Shaft, q: np.ndarray, q_t: np.ndarray, forces: np.ndarray) -> None:
    """Add the forces (n_bearing, 3, n) [N] of all bearings of a shaft on it, in their order.

    q, q_t   displacements [m] of the shaft's centre of mass, (n, 2) in its plane or (n, 5) with its tilts [rad], and
             their rates
    """
    for (axial, bearing), force in zip(shaft.bearings.items(), forces, strict=True):
        motion = _motion_at(shaft, axial, q.shape[1])
        stiffness, radial = linear_part(bearing, 0.0)[:3] @ motion, motion[:2]
        directions = np.flatnonzero(stiffness.any(axis=1))
        for first in range(0, len(q), BLOCK):
            block = slice(first, first + BLOCK)
            displacements, rates = q[block].T, q_t[block].T
            strained = displacements + bearing.damping * rates
            for i in directions:
                force[i, block] -= stiffness[i] @ strained
            if not bearing.linear:
                force[:2, block] += _radial_reaction(bearing, radial @ displacements, radial @ rates)


def displacements(shaft: Shaft, q: np.ndarray, at_bearings: np.ndarray) -> None:
    """Compute the displacements (n_bearing, 3, n) [m] of a shaft at all its bearings, in their order.

    q   displacements [m] of the shaft's centre of mass, (n, 2) in its plane or (n, 5) with its tilts [rad]
    """
    for axial, displacement in zip(shaft.bearings, at_bearings, strict=True):
        displacement[:] = _motion_at(shaft, axial, q.shape[1])[:3] @ q.T


def _motion_at(shaft: Shaft, axial: float, components: int) -> np.ndarray:
    """(6, components) displacement and rotation of a shaft at an axial position by those of its centre of mass."""
    motion = np.eye(6)[:, :5]
    motion[0, 4], motion[1, 3] = axial - shaft.centre, shaft.centre - axial
    return motion[:, :components]


def _radial_reaction(bearing: Bearing, displacement: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """(2, n) radial force of a nonlinear bearing at radial displacements (2, n) [m] and their rates."""
    radii, forces = radial_table(bearing)
    r = np.linalg.norm(displacement, axis=0)
    unit = displacement / np.maximum(r, np.finfo(float).tiny)
    slope, secant = radial_stiffness(bearing, r)
    radial_rate = (unit * rate).sum(axis=0)
    total = np.interp(r, radii, forces) + bearing.damping * (slope - secant) * radial_rate
    return -total * unit - bearing.damping * secant * rate
