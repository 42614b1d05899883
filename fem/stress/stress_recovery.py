"""Stress at the vertices of an elastic gear, recovered from the points where it is most accurate.

In quadratic elements these are the Gauss points, two in each direction of the section (Barlow, Optimal stress locations
in finite element models, 1976). Linear interpolation of the nodal values is the least-squares fit to these stresses.
"""

import numpy as np
import scipy.sparse as sp
from skfem import Basis, ElementQuad1, ElementTriP1, MeshTri
from skfem.helpers import transpose
from skfem.models.elasticity import lame_parameters, linear_stress

from fem.elasticity import extruded_elasticity
from fem.elasticity.section_mesh import rotated
from fem.linalg.direct_solver import factorize
from fem.stress.gear_elasticity import ElasticGear

#: Orders of quadrature on the section and along the axis.
SECTION_ORDER, AXIS_ORDER = 2, 4


def stress(elastic: ElasticGear, u: np.ndarray) -> np.ndarray:
    """(3, 3, n_vertex) stress [Pa] along fixed axes at the vertices of `elastic.mesh`, of dofs u (n_dofs,)."""
    section = Basis(elastic.section.mesh, elastic.section.elem, intorder=SECTION_ORDER)
    axis_shapes, axis_recovery = _axis_operators(elastic)
    gradient = displacement_gradient(elastic, section, axis_shapes, u)
    material = elastic.gear.material
    at_points = linear_stress(*lame_parameters(material.E, material.nu))((gradient + transpose(gradient)) / 2)
    nodal = _on_vertices(section, at_points @ axis_recovery.T)
    rotation = np.zeros((3, 3, elastic.axial.size))
    rotation[2, 2] = 1.0
    rotation[:2, :2] = rotated(np.eye(2)[..., None], elastic.gear.twist * elastic.axial)
    fixed = np.einsum("iaz,jbz,abnz->ijnz", rotation, rotation, nodal, optimize=True)
    return fixed[..., elastic.axial_order].reshape(3, 3, -1)


def displacement_gradient(elastic: ElasticGear, section: Basis, axis_shapes: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(3, 3, n_point, n_axis_point) d_j u_i along axes that turn, at points of the section times those of the axis.

    axis_shapes     shape functions of `_axis_operators`

    On a displacement U(X, Y) N(z) of section and axis its terms are products of an operator on U and one on N.
    """
    dofs = u.reshape(elastic.dim, elastic.section.N, -1)[:, section.element_dofs.T]
    in_section = np.einsum("eqno,cenz->coeqz", extruded_elasticity.operators(section), dofs, optimize=True)
    gradient = np.zeros((3, 3, *section.dx.shape, axis_shapes.shape[1]))
    for entry, terms in extruded_elasticity.displacement_gradient(elastic.dim, elastic.gear.twist).items():
        for component, operator, derivative, factor in terms:
            gradient[entry] += factor * in_section[component, operator] @ axis_shapes[derivative].T
    return gradient.reshape(3, 3, -1, axis_shapes.shape[1])


def _axis_operators(elastic: ElasticGear) -> tuple[np.ndarray, np.ndarray]:
    """Shape functions of the axis and their derivatives (2, n_axis_point, n_axis) at Gauss points, and their recovery.

    The recovery (n_axis, n_axis_point) is the projection in L2 of values at the points to nodal values.
    """
    if elastic.axis is None:
        return np.ones((2, 1, 1)), np.ones((1, 1))
    axis = Basis(elastic.axis.mesh, elastic.axis.elem, intorder=AXIS_ORDER)
    shapes, (element, point) = np.zeros((2, *axis.dx.shape, axis.N)), np.indices(axis.dx.shape)
    for (shape,), dofs in zip(axis.basis, axis.element_dofs, strict=True):
        shapes[0, element, point, dofs[:, None]] = shape
        shapes[1, element, point, dofs[:, None]] = shape.grad[0]
    shapes = shapes.reshape(2, -1, axis.N)
    weighted = shapes[0].T * axis.dx.ravel()
    return shapes, np.linalg.solve(weighted @ shapes[0], weighted)


def _on_vertices(section: Basis, values: np.ndarray) -> np.ndarray:
    """(3, 3, n_vertex, k) projection in L2 of values (3, 3, n_point, k) to linear elements."""
    linear = section.with_element(ElementTriP1() if isinstance(section.mesh, MeshTri) else ElementQuad1())
    shapes = np.stack([np.broadcast_to(shape, linear.dx.shape) for (shape,) in linear.basis], axis=-1)
    points = np.broadcast_to(np.arange(linear.dx.size).reshape(linear.dx.shape)[..., None], shapes.shape)
    dofs = np.broadcast_to(linear.element_dofs.T[:, None], shapes.shape)
    at_points = sp.csr_matrix((shapes.ravel(), (points.ravel(), dofs.ravel())))
    weighted = at_points.T @ sp.diags_array(linear.dx.ravel())
    by_point = np.moveaxis(values, 2, 0)
    nodal = factorize(weighted @ at_points)(weighted @ by_point.reshape(len(by_point), -1))
    return np.moveaxis(nodal.reshape(-1, *by_point.shape[1:]), 0, 2)
