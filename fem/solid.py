"""St. Venant-Kirchhoff solids in their reference configuration: internal force, stiffness, mass (total Lagrangian).

Works in the plane (plane strain) and in space alike. Displacements are stored as (n_dofs, dim).
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numba import njit
from skfem import Basis

from fem.gear import Material
from fem.prism import lame_parameters


@dataclass(frozen=True)
class Solid:
    """What the element loops need.

    dofs        (n_element, n_shape) numbers of the scalar shape functions
    gradients   (n_element, n_point, n_shape, dim) their reference gradients [1/m]
    shapes      (n_point, n_shape) their values
    weights     (n_element, n_point) volumes of the quadrature points [m^3]
    places      (n_dofs, dim) reference positions [m]
    material    elasticity and density
    """

    dofs: np.ndarray
    gradients: np.ndarray
    shapes: np.ndarray
    weights: np.ndarray
    places: np.ndarray
    material: Material


def solid(basis: Basis, material: Material, thickness: float = 1.0) -> Solid:
    """Solid on a basis of scalar shape functions; thickness of a plane one [m]."""
    gradients = np.stack([np.broadcast_to(one[0].grad, (basis.mesh.dim(), *basis.dx.shape)) for one in basis.basis])
    shapes = np.stack([np.broadcast_to(np.asarray(one[0]), basis.dx.shape)[0] for one in basis.basis], axis=1)
    dofs = np.ascontiguousarray(basis.element_dofs.T)
    gradients = np.ascontiguousarray(gradients.transpose(2, 3, 0, 1))
    return Solid(dofs, gradients, shapes, thickness * basis.dx, basis.doflocs.T.copy(), material)


def internal_force(body: Solid, u: np.ndarray) -> np.ndarray:
    """(n_dofs, dim) derivative of the strain energy with respect to u [N]."""
    force = np.zeros_like(u)
    _add_internal_force(u, body.dofs, body.gradients, body.weights, *lame_parameters(body.material), force)
    return force


@njit(cache=True, fastmath=True)
def _add_internal_force(u, dofs, gradients, weights, lam, mu, force):
    dim = u.shape[1]
    H, S = np.empty((dim, dim)), np.empty((dim, dim))
    for e in range(dofs.shape[0]):
        for q in range(weights.shape[1]):
            H[:] = 0.0
            for a in range(dofs.shape[1]):
                for i in range(dim):
                    for j in range(dim):
                        H[i, j] += u[dofs[e, a], i] * gradients[e, q, a, j]
            _second_piola_kirchhoff(H, lam, mu, S)
            for a in range(dofs.shape[1]):
                for i in range(dim):
                    value = 0.0
                    for j in range(dim):
                        first = S[i, j]
                        for k in range(dim):
                            first += H[i, k] * S[k, j]
                        value += first * gradients[e, q, a, j]
                    force[dofs[e, a], i] += weights[e, q] * value


@njit(cache=True, fastmath=True, inline="always")
def _second_piola_kirchhoff(H, lam, mu, S):
    """S = lambda tr(E) I + 2 mu E of Green's strain E = (H + H^T + H^T H) / 2."""
    dim = H.shape[0]
    trace = 0.0
    for i in range(dim):
        for j in range(dim):
            strain = H[i, j] + H[j, i]
            for k in range(dim):
                strain += H[k, i] * H[k, j]
            S[i, j] = mu * strain
            trace += 0.5 * strain if i == j else 0.0
    for i in range(dim):
        S[i, i] += lam * trace


def stiffness(body: Solid) -> sp.csr_matrix:
    """Derivative of the internal force at u = 0; row dim * dof + component."""
    lam, mu = lame_parameters(body.material)
    n_element, _, n_shape, dim = body.gradients.shape
    weighted = body.gradients * body.weights[:, :, None, None]
    flat = (n_element, -1, n_shape * dim)
    products = weighted.reshape(flat).transpose(0, 2, 1) @ body.gradients.reshape(flat)
    products = products.reshape(n_element, n_shape, dim, n_shape, dim)
    laplace = np.einsum("eakbk->eab", products)
    blocks = lam * products + mu * products.transpose(0, 1, 4, 3, 2)
    blocks += mu * np.einsum("eab,ij->eaibj", laplace, np.eye(dim))
    rows = (body.dofs[:, :, None] * dim + np.arange(dim)).reshape(n_element, -1)
    place = np.broadcast_to(rows[:, :, None], (*rows.shape, rows.shape[1]))
    n = body.places.size
    matrix = sp.coo_matrix((blocks.ravel(), (place.ravel(), place.transpose(0, 2, 1).ravel())), shape=(n, n))
    return matrix.tocsr()


def lumped_mass(body: Solid) -> np.ndarray:
    """(n_dofs,) row sums of the mass matrix [kg]."""
    per_element = body.material.density * body.weights @ body.shapes
    return np.bincount(body.dofs.ravel(), per_element.ravel(), body.places.shape[0])
