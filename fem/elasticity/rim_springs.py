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
                weight, components = _on_rim(gear, section, angle + turned, support.width / (2 * radius))
                means = [sp.csr_matrix(weight / weight.sum()) @ component for component in components]
                rows += [np.sqrt(k) * mean for k, mean in zip(stiffness, means, strict=True)]
        else:
            weight, components = _on_rim(gear, section, 0.0, inf)
            of_points = sp.diags_array(np.sqrt(radius * weight))
            rows += [np.sqrt(k) * of_points @ component for k, component in zip(stiffness, components, strict=True)]
    return sp.csr_matrix(sp.vstack(rows))


def _on_rim(gear: Gear, section: Basis, angle: float, half: float) -> tuple[np.ndarray, list[sp.csr_matrix]]:
    """Weights (n,) [rad] of points on the rim within half an angle of an angle, and their displacements (n, 2 n_dofs):
    along the circumference and radial."""
    mesh, facets = section.mesh, section_mesh.clamped_facets(gear, section.mesh)
    ends = _angle(*mesh.p[:, mesh.facets[:, facets]])
    start = angle + _turned(ends[0] - angle)
    size = _turned(ends[1] - ends[0])
    low, high = np.sort(np.clip([(angle - half - start) / size, (angle + half - start) / size], 0, 1), axis=0)
    at = low + (high - low) * POINTS[:, None]
    weight = (WEIGHTS[:, None] * (high - low) * np.abs(size)).ravel()
    dofs = [section.nodal_dofs[0][end] for end in mesh.facets[:, facets]]
    values = [1 - at, at]
    if section.elem.facet_dofs:
        dofs.append(section.facet_dofs[0][facets])
        values = [(1 - at) * (1 - 2 * at), at * (2 * at - 1), 4 * at * (1 - at)]
    theta, point = (start + at * size).ravel(), np.arange(at.size).reshape(at.shape)
    components = []
    for x, y in ((-np.cos(theta), np.sin(theta)), (-np.sin(theta), -np.cos(theta))):
        entries = [
            (
                (direction[point] * value).ravel(),
                (point.ravel(), np.broadcast_to(dof + axis * section.N, at.shape).ravel()),
            )
            for dof, value in zip(dofs, values, strict=True)
            for axis, direction in enumerate((x, y))
        ]
        shape = at.size, 2 * section.N
        components.append(sp.csr_matrix(sum(sp.coo_matrix(entry, shape) for entry in entries)))
    return weight, components


def _angle(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Angle of points of a ring from the middle of tooth 0, at -y, in the direction of the teeth [rad]."""
    return np.arctan2(-x, -y)


def _turned(angle: np.ndarray) -> np.ndarray:
    """Angle between -pi and pi [rad]."""
    return (angle + pi) % (2 * pi) - pi
