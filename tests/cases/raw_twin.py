"""The contact problem of `fem.nonlinear` linearized, on solids that scikit-fem assembles alone, for comparison."""

import numpy as np
from mating_gears import gaps_of
from scipy.optimize import brentq, nnls
from scipy.sparse.linalg import splu
from skfem import Basis, ElementHex1, ElementQuad2, ElementVector, MeshHex, MeshLine
from skfem.models.elasticity import lame_parameters, linear_elasticity

import fem
from fem import Density, nonlinear, section
from fem.elasticity.extrusion import extruded, half_face
from fem.elasticity.face_symmetry import Face, clamped
from fem.units import um

COARSE = Density(flank=30)


def line_from_mid_plane(b: float, number: int, loaded: float | None = None) -> MeshLine:
    """Elements to the end face of a width [m], so many of them in its loaded part, by default all of it."""
    return half_face(b, b if loaded is None else loaded, number)


def hexahedra_along(gear: fem.Gear, density: Density, line: MeshLine) -> MeshHex:
    """The section along the helix over a line across the width; nodes by those of the section, then of the line."""
    return extruded(section(gear, density), line, gear.twist)


def components(basis: Basis) -> list[tuple[int, np.ndarray]]:
    """Dofs of each component of a vector-valued basis."""
    dim = basis.mesh.dim()
    dofs = basis.dofs
    kinds = (dofs.nodal_dofs, dofs.facet_dofs, dofs.interior_dofs)
    return [(c, np.concatenate([numbers[c::dim].ravel() for numbers in kinds if numbers.size])) for c in range(dim)]


def mean_and_peak_to_peak(te) -> list[float]:
    return [te.mean(), np.ptp(te)]


def gap_change(gears, gradients, du) -> np.ndarray:
    """Change of the gaps under displacements du (n_dofs, dim) of both gears, linearized."""
    return sum(by @ (gear.flank_operator @ v.ravel()) for gear, by, v in zip(gears, gradients, du, strict=True))


def solved(matrix, loads: np.ndarray) -> np.ndarray:
    """Displacements of a symmetric stiffness matrix under loads (n, n_load)."""
    solver = splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    return solver.solve(np.ascontiguousarray(loads))


class RawGear:
    """Linear solid of a gear, assembled by scikit-fem on the mesh of a `DeformableGear`."""

    def __init__(self, gear: fem.Gear, density: Density, element, face: Face):
        mesh, thickness = section(gear, density), gear.b
        if element.dim == 3:
            half, thickness = np.sort(line_from_mid_plane(gear.b, density.width).p[0]), 1.0
            mesh = hexahedra_along(gear, density, MeshLine(face.positions(half)))
        basis = Basis(mesh, ElementVector(element), intorder=5 if mesh.dim() == 2 else 3)
        numbers = [dofs for _, dofs in components(basis)]
        on_bore = np.hypot(*basis.doflocs[:2]) < gear.d_bore / 2 * (1 + 1e-6)
        held = clamped(gear, on_bore, basis.doflocs, mesh.dim(), face)
        self.free = np.concatenate([dofs[~held[axis, dofs]] for axis, dofs in enumerate(numbers)])
        lame = lame_parameters(gear.material.E, gear.material.nu)
        matrix = thickness * linear_elasticity(*lame).assemble(basis).tocsc()
        self.matrix = matrix[self.free][:, self.free]
        self.nodal = np.stack(numbers, axis=1).ravel()

    def flexibility(self, operator) -> np.ndarray:
        """(n, n) of displacements under forces, by an operator on dofs numbered as in `fem.reference`."""
        loads = operator[:, np.argsort(self.nodal)][:, self.free].T.toarray()
        return loads.T @ solved(self.matrix, loads)


class RawTwin:
    """Compliance and contact on the mesh and hat functions of a problem of linear elements, or quadratic ones in 2D."""

    def __init__(self, problem: nonlinear.ContactProblem, density: Density):
        self.problem, (pinion, wheel) = problem, problem.gears
        element = ElementQuad2() if pinion.solid.positions.shape[1] == 2 else ElementHex1()
        first = RawGear(problem.pair.pinion, density, element, pinion.face).flexibility(pinion.flank_operator)
        if wheel.solid is pinion.solid:
            self.flexibility = first, first
        else:
            second = RawGear(problem.pair.wheel, density, element, wheel.face)
            self.flexibility = first, second.flexibility(wheel.flank_operator)

    def te(self, phase: float, force: float) -> float:
        """Transmission error, linearized about undeformed gears that are turned by it."""
        return self.linearized_te(phase, force, self.linearized_te(phase, force, 0.0))

    def linearized_te(self, phase: float, force: float, turned: float) -> float:
        """Linearized about gears turned by a transmission error: non-negative least squares and root search."""
        matrix, gaps = 0.0, gaps_of(self.problem.mating, phase, turned)
        for gradient, flexibility in zip(gaps.gradients, self.flexibility, strict=True):
            matrix = matrix + gradient @ flexibility @ gradient.T
        lower = np.linalg.cholesky((matrix + matrix.T) / 2)

        def excess_force(te: float) -> float:
            f = nnls(lower.T, np.linalg.solve(lower, gaps.closing * (te - turned) - gaps.gap))[0]
            return gaps.closing @ f - force * self.problem.gears[0].face.share

        return brentq(excess_force, 0.0, 60 * um, xtol=1e-14)


def problem_of(pair: fem.GearPair, density: Density, element, **options) -> nonlinear.ContactProblem:
    """Contact of two gears under large displacements, as `fem.nonlinear` solves it."""
    return nonlinear.static_problem(pair, density, element, **options)


def balanced(problem: nonlinear.ContactProblem, phase: float, force: float):
    """The state in equilibrium under a mesh force [N]."""
    return nonlinear.equilibrium(problem, phase, force)
