"""St. Venant-Kirchhoff solids in their reference configuration: internal force, stiffness, mass (total Lagrangian).

Works in the plane (plane strain) and in space alike. Displacements are stored as (n_dofs, dim).
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from skfem import Basis

from fem.elasticity.extruded_elasticity import lame_parameters
from fem.gear.material import Material
from fem.support.numba_cache import compiled, fast


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
    add = add_plane_force if u.shape[1] == 2 else _add_internal_force
    add(u, body.dofs, body.gradients, body.weights, lame_parameters(body.material), force)
    return force


def strain_energy(body: Solid, u: np.ndarray) -> float:
    """Integral of lambda tr(E)^2 / 2 + mu E:E of Green's strain E [J]."""
    H = np.einsum("eai,eqaj->eqij", u[body.dofs], body.gradients)
    E = (H + H.swapaxes(2, 3) + H.swapaxes(2, 3) @ H) / 2
    lam, mu = lame_parameters(body.material)
    density = lam / 2 * np.trace(E, axis1=2, axis2=3) ** 2 + mu * (E**2).sum(axis=(2, 3))
    return float((body.weights * density).sum())


@fast
def add_plane_force(u, dofs, gradients, weights, lame, force):
    """Adds the internal force of plane strain to force (n_dofs, 2) [N]."""
    n = dofs.shape[1]
    moved, pulled = np.empty((n, 2)), np.empty((n, 2))
    for e in range(dofs.shape[0]):
        for a in range(n):
            moved[a, 0], moved[a, 1] = u[dofs[e, a], 0], u[dofs[e, a], 1]
            pulled[a, 0] = pulled[a, 1] = 0.0
        for q in range(weights.shape[1]):
            xx = xy = yx = yy = 0.0
            for a in range(n):
                gx, gy = gradients[e, q, a, 0], gradients[e, q, a, 1]
                xx, xy = xx + moved[a, 0] * gx, xy + moved[a, 0] * gy
                yx, yy = yx + moved[a, 1] * gx, yy + moved[a, 1] * gy
            p_xx, p_xy, p_yx, p_yy = _piola_kirchhoff_in_plane(xx, xy, yx, yy, lame)
            for a in range(n):
                gx, gy = weights[e, q] * gradients[e, q, a, 0], weights[e, q] * gradients[e, q, a, 1]
                pulled[a, 0] += p_xx * gx + p_xy * gy
                pulled[a, 1] += p_yx * gx + p_yy * gy
        for a in range(n):
            force[dofs[e, a], 0] += pulled[a, 0]
            force[dofs[e, a], 1] += pulled[a, 1]


@compiled(fastmath=True, inline="always")
def _piola_kirchhoff_in_plane(xx, xy, yx, yy, lame):
    """First Piola-Kirchhoff stress F S of the displacement gradient."""
    lam, mu = lame
    e_xx, e_yy = xx + (xx * xx + yx * yx) / 2, yy + (xy * xy + yy * yy) / 2
    shear, pressed = mu * (xy + yx + xx * xy + yx * yy), lam * (e_xx + e_yy)
    s_xx, s_yy = pressed + 2 * mu * e_xx, pressed + 2 * mu * e_yy
    p_xx, p_xy = (1 + xx) * s_xx + xy * shear, (1 + xx) * shear + xy * s_yy
    return p_xx, p_xy, yx * s_xx + (1 + yy) * shear, yx * shear + (1 + yy) * s_yy


@fast
def _add_internal_force(u, dofs, gradients, weights, lame, force):
    (lam, mu), dim = lame, u.shape[1]
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


@compiled(fastmath=True, inline="always")
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
