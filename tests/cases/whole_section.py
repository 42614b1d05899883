"""Linear system of a gear whose section is meshed as a whole, for comparison with that of one pitch."""

import numpy as np
import scipy.sparse as sp
from skfem import Basis, ElementLineP2, ElementQuad2, MeshLine

import fem
from fem import Density
from fem.elasticity import section_mesh
from fem.elasticity.face_symmetry import Face, WholeFace
from fem.elasticity.flank_compliance import axial_loads, flank_forces, lines_across
from fem.elasticity.pitch_condensation import Prism
from fem.linalg.block_matrix import KroneckerMatrix


def solid_prism(gear: fem.Gear, density: Density, face: Face) -> Prism:
    """Finite elements over the modelled part of the face width, and forces spread as hats."""
    upper, line = lines_across(gear, density, gear.b)
    across = Basis(MeshLine(face.positions(np.sort(line.p[0]))), ElementLineP2())
    return Prism(gear, across, axial_loads(across, face.positions(upper)), face)


def uniform_prism(gear: fem.Gear) -> Prism:
    """Sections that all deform alike."""
    return Prism(gear, None, np.ones((1, 1)), WholeFace())


def linear_system(prism: Prism, density: Density, arcs: np.ndarray) -> tuple[KroneckerMatrix, list[sp.csr_matrix]]:
    """Stiffness over the free unknowns, and forces (n_unknown, n_load) on them: `flank_displacements`' virtual ones."""
    section = Basis(section_mesh.section(prism.gear, density), ElementQuad2())
    matrix, free = prism.stiffness(section)
    on_teeth = {
        tooth: flank_forces(section, prism.gear, arcs, tooth) for tooth in range(-density.behind, density.teeth + 1)
    }
    into = [on_teeth[tooth][0] for tooth in range(density.teeth + 1)]
    forces = []
    for by_hat in [*into, *(along for _, along in on_teeth.values())]:
        full = np.einsum("cnh,as->cnash", by_hat[: len(free)], prism.spread)
        forces.append(sp.csr_matrix(full.reshape(free.size, -1)[free.ravel()]))
    return matrix, forces
