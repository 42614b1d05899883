"""Linear elasticity of a prism, straight or twisted: Kronecker products of matrices of its section and of its axis.

The weak form is that of `skfem.models.elasticity.linear_elasticity` with Lame's parameters lambda and mu,

    integral of lambda div u div v + 2 mu eps(u) : eps(v) = integral of lambda tr G tr H + mu (G : H + G : H^T),

with the displacement gradients G of u and H of v. On shape functions phi(x, y) psi(z) each product of two entries of
G and H is an integral over the section times one along the axis, so that the hexahedra are never assembled; tests
compare the matrices with those that scikit-fem assembles on the hexahedra.

In a twisted prism the unknowns are displacement components along axes that turn with the twist, over coordinates of the
section that turn with it too: x = R(twist z) X, u = R(twist z) U. There a derivative along z is
d_Z - twist (X d_Y - Y d_X) on every component, plus twist e_z x U; nothing else depends on the twist, and every section
has the same mesh.
"""

from collections import defaultdict
from itertools import product

import numpy as np
import scipy.sparse as sp
from skfem import Basis, BilinearForm
from skfem.models.elasticity import lame_parameters

from fem.gear.material import Material
from fem.linalg.block_matrix import KroneckerMatrix

#: Operators on the section: derivatives along x and y, by the turn X d_Y - Y d_X, and the value.
D_X, D_Y, D_TURN, VALUE = range(4)
#: Number of derivatives along the axis.
ALONG, ACROSS = 1, 0
#: Integrals of values along the axis per length, where all sections deform alike.
UNIFORM = np.ones((1, 1, 1, 1))
#: Component, operator on the section, derivatives along the axis, factor
Term = tuple[int, int, int, float]


def displacement_gradient(dim: int, twist: float) -> dict[tuple[int, int], list[Term]]:
    """Entries d_j u_i as terms (component, operator on the section, derivatives along the axis, factor)."""
    gradient = {(i, j): [(i, (D_X, D_Y)[j], ACROSS, 1.0)] for i, j in product(range(dim), range(2))}
    for i in range(dim if dim == 3 else 0):
        gradient[i, 2] = [(i, VALUE, ALONG, 1.0)] + ([(i, D_TURN, ACROSS, -twist)] if twist else [])
    if dim == 3 and twist:
        gradient[0, 2].append((1, VALUE, ACROSS, -twist))
        gradient[1, 2].append((0, VALUE, ACROSS, twist))
    return gradient


def weak_form_factors(dim: int, twist: float, lame: float, mu: float) -> dict:
    """Factors of the weak form by components i, j, axial derivatives a, b and section operators m, n of v and u."""
    gradient = displacement_gradient(dim, twist)
    factors: dict[tuple, float] = defaultdict(float)
    axes = range(dim)
    products = [(lame, (i, i), (j, j)) for i in axes for j in axes]
    products += [(mu, (i, j), entry) for i in axes for j in axes for entry in ((i, j), (j, i))]
    for modulus, of_v, of_u in products:
        for (i, m, a, s), (j, n, b, t) in product(gradient[of_v], gradient[of_u]):
            factors[i, j, a, b, m, n] += modulus * s * t
    return factors


def operators(basis: Basis) -> np.ndarray:
    """(n_element, n_point, n_shape, 4) shape functions of a section under D_X, D_Y, D_TURN and VALUE."""
    shapes = np.stack([np.broadcast_to(shape, basis.dx.shape) for (shape,) in basis.basis], axis=-1)
    d_x, d_y = (np.stack([shape.grad[i] for (shape,) in basis.basis], axis=-1) for i in range(2))
    x, y = np.asarray(basis.global_coordinates())[..., None]
    return np.stack([d_x, d_y, x * d_y - y * d_x, shapes], axis=-1)


def section_products(basis: Basis, wanted: list[tuple[int, int]]) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (2, m), values (m, k) of the integrals over the section of m(v) n(u) for k operators m, n.

    All elements at once: a form of scikit-fem for each pair of operators takes five times as long.
    """
    parts = operators(basis)
    flat = parts.reshape(*basis.dx.shape, -1)
    local = (flat * basis.dx[..., None]).swapaxes(1, 2) @ flat
    local = local.reshape(len(flat), *parts.shape[2:], *parts.shape[2:])
    each = np.stack([local[:, :, m, :, n] for m, n in wanted], axis=-1).reshape(-1, len(wanted))
    dofs = basis.element_dofs.T.astype(np.int64)
    key, entry = np.unique((dofs[:, :, None] * basis.N + dofs[:, None, :]).ravel(), return_inverse=True)
    summing = sp.csr_matrix((np.ones(entry.size), (entry, np.arange(entry.size))))
    return np.stack(np.divmod(key, basis.N)), summing @ each


def points(section: Basis, axis: Basis) -> np.ndarray:
    """(3, n_section, n_axis) coordinates of the dofs, along axes that turn with the twist [m]."""
    x, y = section.doflocs[:, :, None]
    return np.stack(np.broadcast_arrays(x, y, axis.doflocs[0]))


def axis_products(basis: Basis) -> np.ndarray:
    """(2, 2, n, n) integrals of a(v) b(u) along the axis, a, b: 0 the value, 1 the derivative."""
    parts = [lambda u: u, lambda u: u.grad[0]]
    forms = [[BilinearForm(lambda u, v, w, a=a, b=b: a(v) * b(u)) for b in parts] for a in parts]
    return np.array([[form.assemble(basis).toarray() for form in row] for row in forms])


def stiffness(section: Basis, axis: Basis | None, material: Material, twist: float = 0.0) -> KroneckerMatrix:
    """Stiffness [N/m], without an axis that of plane strain [N/m^2]; unknowns by component, section dof, axis dof.

    twist       turn of the section per length along the axis [1/m]
    """
    lame = lame_parameters(material.E, material.nu)
    if axis is None:
        return _summed(2, weak_form_factors(2, twist, *lame), section, UNIFORM)
    return _summed(3, weak_form_factors(3, twist, *lame), section, axis_products(axis))


def uniform_stiffness(section: Basis, material: Material, twist: float = 0.0) -> KroneckerMatrix:
    """Stiffness [N/m^2] of a prism whose sections all deform alike; unknowns by component, section dof.

    A straight prism has two components (plane strain), a twisted prism has the axial component too.
    """
    factors = weak_form_factors(3 if twist else 2, twist, *lame_parameters(material.E, material.nu))
    uniform = {key: factor for key, factor in factors.items() if key[2:4] == (ACROSS, ACROSS)}
    return _summed(3 if twist else 2, uniform, section, UNIFORM)


def _summed(dim: int, factors: dict, section: Basis, along: np.ndarray) -> KroneckerMatrix:
    """Sum of the products of section and axis with the factors of `weak_form_factors`."""
    n, wanted = along.shape[-1], sorted({key[-2:] for key in factors})
    inside = np.zeros((len(wanted), dim, n, dim, n))
    for (i, j, a, b, *pair), factor in factors.items():
        inside[wanted.index(tuple(pair)), i, :, j] += factor * along[a, b]
    unknowns = np.arange(dim * section.N * n).reshape(dim, section.N, n).swapaxes(0, 1).reshape(section.N, -1)
    indices, entries = section_products(section, wanted)
    return KroneckerMatrix(indices, entries, inside.reshape(-1, dim * n, dim * n), unknowns)
