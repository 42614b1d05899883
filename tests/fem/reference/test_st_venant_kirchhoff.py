"""St. Venant-Kirchhoff solids against closed forms and against the same weak forms assembled by scikit-fem."""

import numpy as np
import pytest
from raw_twin import components
from skfem import Basis, ElementHex1, ElementQuad2, ElementVector, LinearForm, MeshHex, MeshQuad
from skfem.helpers import ddot, eye, grad, mul, trace, transpose
from skfem.models.elasticity import lame_parameters, linear_elasticity

from fem import STEEL
from fem.reference.st_venant_kirchhoff import (
    Solid,
    internal_force,
    lumped_mass,
    solid_on_basis,
    stiffness,
    strain_energy,
)

LAME = lame_parameters(STEEL.E, STEEL.nu)
MESHES = {2: (MeshQuad().refined(1), ElementQuad2()), 3: (MeshHex().refined(1), ElementHex1())}
both_dimensions = pytest.mark.parametrize("dim", [2, 3])


def block(dim: int) -> Solid:
    mesh, element = MESHES[dim]
    return solid_on_basis(Basis(mesh, element, intorder=5), STEEL)


def vector_basis(dim: int) -> Basis:
    mesh, element = MESHES[dim]
    return Basis(mesh, ElementVector(element), intorder=5)


def numbering(solid: Solid, basis: Basis) -> tuple[np.ndarray, np.ndarray]:
    """Node and component of the solid that belong to each dof of a vector-valued basis."""
    node, component = np.zeros((2, basis.N), int)
    for axis, dofs in components(basis):
        distance = np.abs(basis.doflocs.T[dofs, None] - solid.positions).sum(axis=2)
        node[dofs], component[dofs] = distance.argmin(axis=1), axis
    return node, component


@both_dimensions
def test_large_rotation_causes_no_force(dim):
    solid, rotation = block(dim), np.eye(dim)
    rotation[:2, :2] = [[0, -1], [1, 0]]
    force = internal_force(solid, solid.positions @ rotation.T - solid.positions)
    assert np.abs(force).max() < 1e-9 * STEEL.E


@both_dimensions
def test_force_of_a_stretched_block_is_the_closed_form(dim):
    """Stretch s along x, sides held: P_xx = s (lambda + 2 mu) (s^2 - 1) / 2 on a face of area 1."""
    solid, stretch = block(dim), 1.2
    u = np.zeros_like(solid.positions)
    u[:, 0] = (stretch - 1) * solid.positions[:, 0]
    force = internal_force(solid, u)[solid.positions[:, 0] > 1 - 1e-9, 0].sum()
    lam, mu = LAME
    assert force == pytest.approx(stretch * (lam + 2 * mu) * (stretch**2 - 1) / 2)


@both_dimensions
def test_internal_force_is_the_weak_form_assembled_by_scikit_fem(dim):
    """int P : grad v dV with P = F S, at strains of some per cent."""
    solid, basis = block(dim), vector_basis(dim)
    node, component = numbering(solid, basis)
    u = 0.02 * np.sin(3 * solid.positions + np.arange(dim))
    lam, mu = LAME

    @LinearForm
    def weak_form(v, w):
        F = grad(w["u"]) + eye(np.ones_like(w.x[0]), dim)
        E = (mul(transpose(F), F) - eye(np.ones_like(w.x[0]), dim)) / 2
        S = lam * eye(trace(E), dim) + 2 * mu * E
        return ddot(mul(F, S), grad(v))

    expected = weak_form.assemble(basis, u=basis.interpolate(u[node, component]))
    assert internal_force(solid, u)[node, component] == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())


@both_dimensions
def test_stiffness_is_the_derivative_of_the_force(dim):
    solid = block(dim)
    u = 1e-6 * np.sin(3 * solid.positions + np.arange(dim))
    slope = (internal_force(solid, u) - internal_force(solid, -u)) / 2
    linear = (stiffness(solid) @ u.ravel()).reshape(u.shape)
    assert slope == pytest.approx(linear, abs=1e-9 * np.abs(linear).max())


@both_dimensions
def test_stiffness_is_the_weak_form_assembled_by_scikit_fem(dim):
    solid, basis = block(dim), vector_basis(dim)
    node, component = numbering(solid, basis)
    u = np.sin(3 * solid.positions + np.arange(dim))
    force = (stiffness(solid) @ u.ravel()).reshape(u.shape)
    expected = linear_elasticity(*LAME).assemble(basis) @ u[node, component]
    assert force[node, component] == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())


def test_lumped_mass_is_the_mass_of_the_block():
    assert lumped_mass(block(3)).sum() == pytest.approx(STEEL.density)


@pytest.mark.parametrize("dim", [2, 3])
def test_strain_energy_is_the_work_of_the_internal_force(dim):
    solid, (share, weight) = block(dim), np.polynomial.legendre.leggauss(3)
    u = 0.02 * np.sin(3 * solid.positions + np.arange(dim))
    along = [(internal_force(solid, (1 + s) / 2 * u) * u).sum() / 2 for s in share]
    assert strain_energy(solid, u) == pytest.approx(weight @ along, rel=1e-9)
