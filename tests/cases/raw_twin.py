"""The nonlinear contact in its plainest form, for comparison."""

import numpy as np
from scipy.optimize import brentq, nnls
from scipy.sparse.linalg import splu
from skfem import Basis, ElementHex1, ElementQuad2, ElementVector
from skfem.models.elasticity import linear_elasticity

import fem
from fem.elasticity.extruded_elasticity import lame_parameters
from fem.elasticity.extrusion import both_sides, extruded, half_width
from fem.elasticity.mesh_density import Density
from fem.elasticity.section_mesh import section
from fem.reference.nonlinear import Meshing, rows
from fem.units import um

COARSE = Density(flank=30)


def components(basis: Basis) -> list[tuple[int, np.ndarray]]:
    """Dofs of each component of a vector-valued basis."""
    dim = basis.mesh.dim()
    dofs = basis.dofs
    every = (dofs.nodal_dofs, dofs.facet_dofs, dofs.interior_dofs)
    return [(c, np.concatenate([d[c::dim].ravel() for d in every if d.size])) for c in range(dim)]


def numbers(te) -> list[float]:
    return [te.mean(), np.ptp(te)]


class RawGear:
    """Linear solid of a gear, assembled by scikit-fem alone on the mesh of a body that models a share of the width."""

    def __init__(self, gear: fem.Gear, density: Density, element, share: float):
        mesh, thickness = section(gear, density), gear.b
        if element.dim == 3:
            half, thickness = half_width(gear.b, gear.b, density.width), 1.0
            mesh = extruded(mesh, half if share < 1 else both_sides(half), gear.twist)
        basis = Basis(mesh, ElementVector(element), intorder=5 if mesh.dim() == 2 else 3)
        numbers = [dofs for _, dofs in components(basis)]
        held = [dofs[np.hypot(*basis.doflocs[:2, dofs]) < gear.d_bore / 2 * (1 + 1e-6)] for dofs in numbers]
        if share < 1:
            held += [numbers[2][basis.doflocs[2, numbers[2]] < 1e-9 * gear.b]]
        self.free = np.setdiff1d(np.arange(basis.N), np.concatenate(held))
        matrix = thickness * linear_elasticity(*lame_parameters(gear.material)).assemble(basis).tocsc()
        self.solve = splu(matrix[self.free][:, self.free]).solve
        self.nodal = np.stack(numbers, axis=1).ravel()

    def moved(self, load: np.ndarray) -> np.ndarray:
        """Displacements (n, n_dofs) under loads, numbered as in `fem.reference.deformable_gear`."""
        right, found = np.zeros((2, load.shape[0], self.nodal.size))
        right[:, self.nodal] = load
        found[:, self.free] = self.solve(right[:, self.free].T.copy()).T
        return found[:, self.nodal]


class RawTwin:
    """Compliance and contact on the mesh and hats of a meshing of linear solids, or quadratic ones in plane strain."""

    def __init__(self, meshing: Meshing, density: Density):
        self.meshing, (pinion, wheel) = meshing, meshing.bodies
        element = ElementQuad2() if pinion.solid.places.shape[1] == 2 else ElementHex1()
        first = RawGear(meshing.pair.pinion, density, element, pinion.share)
        shared = wheel.solid is pinion.solid
        self.gears = first, first if shared else RawGear(meshing.pair.wheel, density, element, wheel.share)

    def te(self, phase: float, force: float) -> float:
        """Transmission error of flanks at rest on gears that are turned by it: linear about the turned place."""
        return self.near(phase, force, self.near(phase, force, 0.0))

    def near(self, phase: float, force: float, turned: float) -> float:
        """Linear about gears turned by a transmission error: non-negative least squares and bisection."""
        bodies = self.meshing.bodies
        rest = tuple(body.rest() for body in bodies)
        here, matrix = rows(self.meshing, self.meshing.touches(phase), phase, turned, rest), 0.0
        for body, gear, by in zip(bodies, self.gears, here.by, strict=True):
            load = by @ body.transverse
            matrix = matrix + load @ gear.moved(load).T
        lower = np.linalg.cholesky((matrix + matrix.T) / 2)

        def too_much(te: float) -> float:
            f = nnls(lower.T, np.linalg.solve(lower, here.closing * (te - turned) - here.gap))[0]
            return here.closing @ f - force * bodies[0].share

        return brentq(too_much, 0.0, 60 * um, xtol=1e-14)
