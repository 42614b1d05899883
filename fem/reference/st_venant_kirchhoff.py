"""Solids of the St. Venant-Kirchhoff material in their reference configuration (total Lagrangian).

Find u with, for all test functions v,

    int P(u) : grad v dV = int f . v dV,    P = F S,  F = I + grad u,  S = lambda tr(E) I + 2 mu E,  E = (F^T F - I)/2

(Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2008). Works in the plane (plane strain) and
in space; displacements are arrays (n_dofs, dim). The loops below evaluate these integrals element by element;
`tests/fem/reference/test_st_venant_kirchhoff.py` assembles the same forms with scikit-fem.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from skfem import Basis
from skfem.models.elasticity import lame_parameters

from fem.gear.material import Material
from fem.support.numba_cache import compiled, fast


@dataclass(frozen=True)
class Solid:
    """Finite elements as arrays for the element loops.

    dofs        (n_element, n_shape) numbers of the scalar shape functions
    gradients   (n_element, n_point, n_shape, dim) their gradients in the reference configuration [1/m]
    shapes      (n_point, n_shape) their values
    weights     (n_element, n_point) volumes of the quadrature points [m^3]
    positions   (n_dofs, dim) reference positions [m]
    material    elasticity and density
    """

    dofs: np.ndarray
    gradients: np.ndarray
    shapes: np.ndarray
    weights: np.ndarray
    positions: np.ndarray
    material: Material

    @property
    def lame(self) -> tuple[float, float]:
        """Lame's parameters lambda and mu [Pa]."""
        return lame_parameters(self.material.E, self.material.nu)


def solid_on_basis(basis: Basis, material: Material, thickness: float = 1.0) -> Solid:
    """Solid on a basis of scalar shape functions; thickness [m] in plane strain."""
    shape = (basis.mesh.dim(), *basis.dx.shape)
    gradients = np.stack([np.broadcast_to(function.grad, shape) for (function,) in basis.basis])
    values = [np.broadcast_to(np.asarray(function), basis.dx.shape)[0] for (function,) in basis.basis]
    dofs = np.ascontiguousarray(basis.element_dofs.T)
    gradients = np.ascontiguousarray(gradients.transpose(2, 3, 0, 1))
    positions = basis.doflocs.T.copy()
    return Solid(dofs, gradients, np.stack(values, axis=1), thickness * basis.dx, positions, material)


def internal_force(solid: Solid, u: np.ndarray) -> np.ndarray:
    """(n_dofs, dim) int P(u) : grad v dV for every shape function v: derivative of the strain energy [N]."""
    force = np.zeros_like(u)
    add_force = add_plane_force if u.shape[1] == 2 else _add_internal_force
    add_force(u, solid.dofs, solid.gradients, solid.weights, solid.lame, force)
    return force


def strain_energy(solid: Solid, u: np.ndarray) -> float:
    """int lambda tr(E)^2 / 2 + mu E : E dV [J]."""
    H = np.einsum("eai,eqaj->eqij", u[solid.dofs], solid.gradients)
    E = (H + H.swapaxes(2, 3) + H.swapaxes(2, 3) @ H) / 2
    lam, mu = solid.lame
    density = lam / 2 * np.trace(E, axis1=2, axis2=3) ** 2 + mu * (E**2).sum(axis=(2, 3))
    return float((solid.weights * density).sum())


@fast
def add_plane_force(u, dofs, gradients, weights, lame, force):
    """Add the internal force in plane strain to force (n_dofs, 2) [N]."""
    n = dofs.shape[1]
    u_e, force_e = np.empty((n, 2)), np.empty((n, 2))
    for e in range(dofs.shape[0]):
        for a in range(n):
            u_e[a, 0], u_e[a, 1] = u[dofs[e, a], 0], u[dofs[e, a], 1]
            force_e[a, 0] = force_e[a, 1] = 0.0
        for q in range(weights.shape[1]):
            xx = xy = yx = yy = 0.0
            for a in range(n):
                gx, gy = gradients[e, q, a, 0], gradients[e, q, a, 1]
                xx, xy = xx + u_e[a, 0] * gx, xy + u_e[a, 0] * gy
                yx, yy = yx + u_e[a, 1] * gx, yy + u_e[a, 1] * gy
            p_xx, p_xy, p_yx, p_yy = _piola_kirchhoff_in_plane(xx, xy, yx, yy, lame)
            for a in range(n):
                gx, gy = weights[e, q] * gradients[e, q, a, 0], weights[e, q] * gradients[e, q, a, 1]
                force_e[a, 0] += p_xx * gx + p_xy * gy
                force_e[a, 1] += p_yx * gx + p_yy * gy
        for a in range(n):
            force[dofs[e, a], 0] += force_e[a, 0]
            force[dofs[e, a], 1] += force_e[a, 1]


@compiled(fastmath=True, inline="always")
def _piola_kirchhoff_in_plane(xx, xy, yx, yy, lame):
    """First Piola-Kirchhoff stress F S of the displacement gradient."""
    lam, mu = lame
    e_xx, e_yy = xx + (xx * xx + yx * yx) / 2, yy + (xy * xy + yy * yy) / 2
    s_xy, volumetric = mu * (xy + yx + xx * xy + yx * yy), lam * (e_xx + e_yy)
    s_xx, s_yy = volumetric + 2 * mu * e_xx, volumetric + 2 * mu * e_yy
    p_xx, p_xy = (1 + xx) * s_xx + xy * s_xy, (1 + xx) * s_xy + xy * s_yy
    return p_xx, p_xy, yx * s_xx + (1 + yy) * s_xy, yx * s_xy + (1 + yy) * s_yy


@fast
def _add_internal_force(u, dofs, gradients, weights, lame, force):
    """Add the internal force in any dimension to force (n_dofs, dim) [N]."""
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
                        P_ij = S[i, j]
                        for k in range(dim):
                            P_ij += H[i, k] * S[k, j]
                        value += P_ij * gradients[e, q, a, j]
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


def stiffness(solid: Solid) -> sp.csr_matrix:
    """Derivative of the internal force at u = 0, int lambda div u div v + 2 mu eps(u) : eps(v) dV [N/m].

    Row dim * dof + component. With the products G[a, i, b, j] = int d_i N_a d_j N_b of an element its matrix is
    lambda G[a, i, b, j] + mu G[a, j, b, i] + mu delta_ij sum_k G[a, k, b, k]; scikit-fem's `linear_elasticity` gives
    the same, but calls Python for each pair of shape functions.
    """
    lam, mu = solid.lame
    n_element, _, n_shape, dim = solid.gradients.shape
    weighted = solid.gradients * solid.weights[:, :, None, None]
    flat = (n_element, -1, n_shape * dim)
    products = weighted.reshape(flat).transpose(0, 2, 1) @ solid.gradients.reshape(flat)
    products = products.reshape(n_element, n_shape, dim, n_shape, dim)
    laplacian = np.einsum("eakbk->eab", products)
    blocks = lam * products + mu * products.transpose(0, 1, 4, 3, 2)
    blocks += mu * np.einsum("eab,ij->eaibj", laplacian, np.eye(dim))
    numbers = (solid.dofs[:, :, None] * dim + np.arange(dim)).reshape(n_element, -1)
    rows = np.broadcast_to(numbers[:, :, None], (*numbers.shape, numbers.shape[1]))
    n = solid.positions.size
    entries = blocks.ravel(), (rows.ravel(), rows.transpose(0, 2, 1).ravel())
    return sp.coo_matrix(entries, shape=(n, n)).tocsr()


def lumped_mass(solid: Solid) -> np.ndarray:
    """(n_dofs,) row sums of the mass matrix, int rho N_a dV [kg]."""
    per_element = solid.material.density * solid.weights @ solid.shapes
    return np.bincount(solid.dofs.ravel(), per_element.ravel(), solid.positions.shape[0])
