"""The law of a bearing: a potential U of its displacement, from which force, damping, energy and losses follow.

U = q^T K q / 2, and for a bearing with clearance or table a function of the radial displacement, piecewise quadratic
between the points of its table. The force on the shaft is -(dU/dq + damping d2U/dq2 dq/dt), the dissipated power
damping dq/dt^T d2U/dq2 dq/dt: along a radial displacement the damping follows the tangent stiffness of the law, across
it the secant. numpy and the compiled kernels call the same functions. Of rolling bearings U is a function of all
displacements and tilts (`exugear.rolling_bearings.law`), and the damping follows its Hessian.
"""

from typing import TypeGuard

import numpy as np

from exugear.gearbox.bearing import Bearing, about_pole, radial_law, radial_points
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.rolling_bearings.law import response
from fem.support.numba_cache import compiled_or_not

#: Number of samples whose Hessians are computed at once.
BLOCK = 4096
SMALLEST = float(np.finfo(float).tiny)


def has_radial_law(bearing: Bearing | RollingBearing) -> TypeGuard[Bearing]:
    """Whether the radial force of a bearing follows the points of its law: with a clearance or a table."""
    return isinstance(bearing, Bearing) and not bearing.linear


def has_rolling_law(bearing: Bearing | RollingBearing) -> TypeGuard[RollingBearing]:
    """Whether the force of a bearing is that of its rolling elements: of a rolling bearing that is not linear."""
    return isinstance(bearing, RollingBearing) and not bearing.linear


@compiled_or_not
def radial_potential(points, x, y):
    """Energy [J], gradient (x, y) [N] and Hessian (xx, xy, yy) [N/m] at displacements x, y [m] of a bearing."""
    r = np.sqrt(x * x + y * y)
    energy, force, slope = radial_law(points, r)
    length = np.maximum(r, SMALLEST)
    e_x, e_y = x / length, y / length
    secant = np.where(r > 0.0, force / length, slope)
    excess = slope - secant
    hessian = secant + excess * e_x * e_x, excess * e_x * e_y, secant + excess * e_y * e_y
    return energy, (force * e_x, force * e_y), hessian


@compiled_or_not
def radial_motion(lever, x, y, tilt_x, tilt_y):
    """Motion x, y at a bearing by that of the centre of mass, a distance lever [m] below, or the same of rates."""
    return x + lever * tilt_y, y - lever * tilt_x


def radial_secant(bearing: Bearing, force: float) -> float:
    """Secant stiffness [N/m] of a nonlinear bearing under a radial force > 0 [N] that its table reaches."""
    displacement, forces, _ = radial_points(bearing)
    contact = np.flatnonzero(forces == 0)[-1]
    return force / float(np.interp(force, forces[contact:], displacement[contact:]))


def linear_part(bearing: Bearing | RollingBearing, lever: float) -> np.ndarray:
    """(6, 6) stiffness about a pole at a distance lever [m], without the radial part of a nonlinear bearing.

    0 for a rolling bearing that does not count as linear.
    """
    if bearing.linear:
        return bearing.at(lever)
    if isinstance(bearing, RollingBearing):
        return np.zeros((6, 6))
    return about_pole(np.diag([0.0, 0.0, bearing.axial, bearing.tilt, bearing.tilt, 0.0]), lever)


def radial_part(k: float | np.ndarray, lever: float) -> np.ndarray:
    """(6, 6) stiffness about a pole at a distance lever [m], of a radial stiffness, k [N/m] or (2, 2) over x, y."""
    stiffness = np.zeros((6, 6))
    stiffness[:2, :2] = k * np.eye(2) if np.ndim(k) == 0 else k
    return about_pole(stiffness, lever)


def tangent_stiffness(bearing: Bearing | RollingBearing, lever: float, q: np.ndarray) -> np.ndarray:
    """(6, 6) Hessian of the potential about a pole, a distance lever [m] below, at its displacement q (6,)."""
    if has_rolling_law(bearing):
        return np.pad(response(bearing.law_of_runs, lever, q[None]).hessian[0], (0, 1))
    stiffness = linear_part(bearing, lever)
    if has_radial_law(bearing):
        _, _, (xx, xy, yy) = radial_potential(radial_points(bearing), *_radial_motion(lever, q))
        stiffness = stiffness + radial_part(np.array([[xx, xy], [xy, yy]]), lever)
    return stiffness


def potential(bearing: Bearing | RollingBearing, lever: float, q: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Energy [J], gradient (5,) and Hessian (5, 5) of a bearing at the displacement q (5,) [m, rad] of a pole."""
    if has_rolling_law(bearing):
        energies, gradients, hessians = response(bearing.law, lever, q[None])
        return float(energies[0]), gradients[0], hessians[0]
    gradient = linear_part(bearing, lever)[:5, :5] @ q
    if has_radial_law(bearing):
        _, (x, y), _ = radial_potential(radial_points(bearing), *_radial_motion(lever, q))
        gradient = gradient + np.array([x, y, 0.0, -lever * y, lever * x])
    return float(strain_energy(bearing, lever, q[None])[0]), gradient, tangent_stiffness(bearing, lever, q)[:5, :5]


def strain_energy(bearing: Bearing | RollingBearing, lever: float, q: np.ndarray) -> np.ndarray:
    """(n,) energy [J] of a bearing at displacements q (n, 5) [m, rad] of a pole, a distance lever [m] below.

    Of rolling bearings q may be (n, 6) with the spin of the shaft, with which cages roll; likewise below.
    """
    if has_rolling_law(bearing):
        return np.concatenate([response(bearing.law_of_runs, lever, part).energy for part in _blocks(q)])
    energy = 0.5 * np.einsum("ni,ij,nj->n", q, linear_part(bearing, lever)[:5, :5], q)
    if has_radial_law(bearing):
        energy = energy + radial_potential(radial_points(bearing), *_radial_motion(lever, q))[0]
    return energy


def dissipated_power(bearing: Bearing | RollingBearing, lever: float, q: np.ndarray, q_t: np.ndarray) -> np.ndarray:
    """(n,) power [W] that the damping of a bearing dissipates, at displacements q (n, 5) and rates q_t of a pole."""
    if has_rolling_law(bearing):
        if not bearing.damping_time:
            return np.zeros(len(q))
        parts = zip(_blocks(q), _blocks(q_t), strict=True)
        powers = [
            np.einsum("ni,nij,nj->n", w[:, :5], response(bearing.law_of_runs, lever, part).hessian, w[:, :5])
            for part, w in parts
        ]
        return bearing.damping_time * np.concatenate(powers)
    power = np.einsum("ni,ij,nj->n", q_t, linear_part(bearing, lever)[:5, :5], q_t)
    if has_radial_law(bearing):
        _, _, (xx, xy, yy) = radial_potential(radial_points(bearing), *_radial_motion(lever, q))
        u, v = _radial_motion(lever, q_t)
        power = power + xx * u * u + 2 * xy * u * v + yy * v * v
    return bearing.damping_time * power


@compiled_or_not
def radial_reaction(points, damping, x, y, u, v):
    """Force (x, y) [N] of a nonlinear bearing on its shaft, at displacements x, y [m] and rates u, v [m/s]."""
    _, gradient, (xx, xy, yy) = radial_potential(points, x, y)
    return -(gradient[0] + damping * (xx * u + xy * v)), -(gradient[1] + damping * (xy * u + yy * v))


def rolling_reaction(
    bearing: RollingBearing, lever: float, q: np.ndarray, q_t: np.ndarray, components: int = 3
) -> np.ndarray:
    """(n, components) forces [N] and moments [N m] of a rolling bearing on its shaft.

    At displacements q (n, 5 or 6) and rates q_t of a pole.
    """
    _, gradient, hessian = response(bearing.law_of_runs, lever, q)
    damping = bearing.damping_time * np.einsum("nij,nj->ni", hessian[:, :components], q_t)
    return -gradient[:, :components] - damping


def _blocks(q: np.ndarray) -> list[np.ndarray]:
    """The samples in blocks that stay in the processor's cache."""
    return [q[first : first + BLOCK] for first in range(0, max(len(q), 1), BLOCK)]


def _radial_motion(lever: float, q: np.ndarray):
    """Motion x, y at a bearing, from the motion q (..., 5 or 6) of a pole."""
    x, y, _, tilt_x, tilt_y = np.moveaxis(q, -1, 0)[:5]
    return radial_motion(lever, x, y, tilt_x, tilt_y)
