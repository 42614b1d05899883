"""Supports of the rim of a ring as springs on the finite elements of its section."""

from math import inf, pi

import numpy as np
import scipy.sparse as sp
from skfem import Basis

from fem.elasticity import section_mesh
from fem.gear.gear import Gear
from fem.gear.rim_support import Bolts, Support

#: Gauss points and weights on [0, 1].
POINTS, WEIGHTS = ((x + shift) / 2 for x, shift in zip(np.polynomial.legendre.leggauss(4), (1, 0), strict=True))


def rim_springs(gear: Gear, section: Basis, supports: tuple[Support, ...], turned: float = 0.0) -> sp.csr_matrix:
    """(n, 2 n_dofs) matrix B of springs with the stiffness B^T B [N/m] over the displacements along x, then along y.

    supports    some of those of the gear
    turned      angle by which they are turned in the direction of the teeth [rad]

    A bolt has a spring along the circumference and a radial one, for the mean displacements over its width; a bush has
    these at all quadrature points.
    """
    rows, radius = [sp.csr_matrix((0, 2 * section.N))], abs(gear.r_clamp)
    for support in supports:
        stiffness = support.tangential, support.radial
        if isinstance(support, Bolts):
            for angle in support.angles:
                theta, weight = quadrature_on_rim(gear, section, angle + turned, support.width / (2 * radius))
                mean = sp.csr_matrix(weight / weight.sum())
                components = tangential_and_radial(gear, section, theta)
                rows += [np.sqrt(k) * mean @ component for k, component in zip(stiffness, components, strict=True)]
        else:
            theta, weight = quadrature_on_rim(gear, section)
            of_points = sp.diags_array(np.sqrt(radius * weight))
            components = tangential_and_radial(gear, section, theta + turned)
            rows += [np.sqrt(k) * of_points @ component for k, component in zip(stiffness, components, strict=True)]
    return sp.csr_matrix(sp.vstack(rows))


def quadrature_on_rim(
    gear: Gear, section: Basis, angle: float = 0.0, half: float = inf
) -> tuple[np.ndarray, np.ndarray]:
    """Angles and weights (n,) [rad] of Gauss points on the outside of the rim within half an angle of an angle."""
    start, size = _facets(gear, section)
    start = angle + _turned(start - angle)
    low, high = np.sort(np.clip([(angle - half - start) / size, (angle + half - start) / size], 0, 1), axis=0)
    theta = start + (low + (high - low) * POINTS[:, None]) * size
    return theta.ravel(), (WEIGHTS[:, None] * (high - low) * np.abs(size)).ravel()


def tangential_and_radial(gear: Gear, section: Basis, theta: np.ndarray) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Displacements of the outside of the rim at angles (n,): along the circumference, radial; each (n, 2 n_dofs)."""
    shapes, c, s = shapes_on_rim(gear, section, theta), np.cos(theta), np.sin(theta)

    def component(x: np.ndarray, y: np.ndarray) -> sp.csr_matrix:
        return sp.csr_matrix(sp.hstack([sp.diags_array(x) @ shapes, sp.diags_array(y) @ shapes]))

    return component(-c, s), component(-s, -c)


def shapes_on_rim(gear: Gear, section: Basis, theta: np.ndarray) -> sp.csr_matrix:
    """(n, n_dofs) values of the shape functions at angles (n,) on the outside of the rim."""
    facets, (start, size) = section_mesh.clamped_facets(gear, section.mesh), _facets(gear, section)
    least = np.minimum(start, start + size) % (2 * pi)
    order = np.argsort(least)
    facet = order[np.searchsorted(least[order], theta % (2 * pi), side="right") - 1]
    at = _turned(theta - start[facet] - size[facet] / 2) / size[facet] + 1 / 2
    dofs, values = list(section.nodal_dofs[0][section.mesh.facets[:, facets[facet]]]), [1 - at, at]
    if section.elem.facet_dofs:
        dofs.append(section.facet_dofs[0][facets[facet]])
        values = [(1 - at) * (1 - 2 * at), at * (2 * at - 1), 4 * at * (1 - at)]
    rows = np.tile(np.arange(theta.size), len(dofs))
    return sp.csr_matrix((np.concatenate(values), (rows, np.concatenate(dofs))), (theta.size, section.N))


def _facets(gear: Gear, section: Basis) -> tuple[np.ndarray, np.ndarray]:
    """Angles (n,) at which facets on the outside of the rim start, and those they cover, of either sign [rad]."""
    ends = section.mesh.facets[:, section_mesh.clamped_facets(gear, section.mesh)]
    start, end = _angle(*section.mesh.p[:, ends])
    return start, _turned(end - start)


def _angle(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Angle of points of a ring from the middle of tooth 0, at -y, in the direction of the teeth [rad]."""
    return np.arctan2(-x, -y)


def _turned(angle: np.ndarray) -> np.ndarray:
    """Angle between -pi and pi [rad]."""
    return (angle + pi) % (2 * pi) - pi
