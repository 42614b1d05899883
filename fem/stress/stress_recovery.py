"""Stress at the nodes of a body, recovered from the points where that of its quadratic elements is most accurate.

These are Gauss points, two in each direction of the section. Source: Barlow, Optimal stress locations in finite element
models, 1976.
"""

import numpy as np
import scipy.sparse as sp
from skfem import Basis, ElementQuad1, ElementTriP1, MeshTri

from fem.elasticity import extruded_elasticity
from fem.elasticity.section_mesh import rotated
from fem.linalg.direct_solver import factorize
from fem.stress.gear_elasticity import Body

#: Order that is integrated with the points of the section, and along the axis.
SECTION, AXIS = 2, 4


def stress(body: Body, u: np.ndarray) -> np.ndarray:
    """(3, 3, n_vertex) stress [Pa] along fixed axes at the vertices of `body.mesh`, of unknowns u (n_dofs,)."""
    section = Basis(body.section.mesh, body.section.elem, intorder=SECTION)
    along, recovered = _along(body)
    at_points = hooke(body, displacement_gradient(body, section, along, u))
    nodal = _on_vertices(section, at_points @ recovered.T)
    turned = np.zeros((3, 3, body.axial.size))
    turned[2, 2] = 1.0
    turned[:2, :2] = rotated(np.eye(2)[..., None], body.gear.twist * body.axial)
    fixed = np.einsum("iaz,jbz,abnz->ijnz", turned, turned, nodal, optimize=True)
    return fixed[..., body.upwards].reshape(3, 3, -1)


def displacement_gradient(body: Body, section: Basis, along: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(3, 3, n_point, n_place) d_j u_i, along axes that turn, at points of the section over places along."""
    parts = u.reshape(body.dim, body.section.N, -1)[:, section.element_dofs.T]
    in_section = np.einsum("eqno,cenz->coeqz", extruded_elasticity.operators(section), parts, optimize=True)
    gradient = np.zeros((3, 3, *section.dx.shape, along.shape[1]))
    for entry, terms in extruded_elasticity.displacement_gradient(body.dim, body.gear.twist).items():
        for component, operator, axial, factor in terms:
            gradient[entry] += factor * in_section[component, operator] @ along[axial].T
    return gradient.reshape(3, 3, -1, along.shape[1])


def hooke(body: Body, gradient: np.ndarray) -> np.ndarray:
    """(3, 3, ...) stress of displacement gradients (3, 3, ...) [Pa]."""
    lame, mu = extruded_elasticity.lame_parameters(body.gear.material)
    volume = np.multiply.outer(np.eye(3), np.einsum("ii...->...", gradient))
    return mu * (gradient + gradient.swapaxes(0, 1)) + lame * volume


def _along(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Values of shape functions and derivatives (2, n_place, n_axis) at Gauss points of the axis, and their recovery.

    The latter (n_axis, n_place) gives nodal values of which the interpolation is closest to values at the places.
    """
    if body.axis is None:
        return np.ones((2, 1, 1)), np.ones((1, 1))
    axis = Basis(body.axis.mesh, body.axis.elem, intorder=AXIS)
    found, (element, point) = np.zeros((2, *axis.dx.shape, axis.N)), np.indices(axis.dx.shape)
    for (shape,), dofs in zip(axis.basis, axis.element_dofs, strict=True):
        found[0, element, point, dofs[:, None]] = shape
        found[1, element, point, dofs[:, None]] = shape.grad[0]
    along = found.reshape(2, -1, axis.N)
    weighted = along[0].T * axis.dx.ravel()
    return along, np.linalg.solve(weighted @ along[0], weighted)


def _on_vertices(section: Basis, values: np.ndarray) -> np.ndarray:
    """(3, 3, n_vertex, k) values whose linear interpolation is closest to values (3, 3, n_point, k)."""
    linear = section.with_element(ElementTriP1() if isinstance(section.mesh, MeshTri) else ElementQuad1())
    shapes = np.stack([np.broadcast_to(shape, linear.dx.shape) for (shape,) in linear.basis], axis=-1)
    points = np.broadcast_to(np.arange(linear.dx.size).reshape(linear.dx.shape)[..., None], shapes.shape)
    dofs = np.broadcast_to(linear.element_dofs.T[:, None], shapes.shape)
    at_points = sp.csr_matrix((shapes.ravel(), (points.ravel(), dofs.ravel())))
    weighted = at_points.T @ sp.diags_array(linear.dx.ravel())
    by_point = np.moveaxis(values, 2, 0)
    nodal = factorize(weighted @ at_points)(weighted @ by_point.reshape(len(by_point), -1))
    return np.moveaxis(nodal.reshape(-1, *by_point.shape[1:]), 0, 2)
