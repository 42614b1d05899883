"""Linear system of a gear whose section is meshed as a whole, for comparison with that of one pitch."""

from functools import partial

import numpy as np
import scipy.sparse as sp
from skfem import Basis, ElementLineP2, ElementQuad2, MeshLine

import fem
from fem import Density
from fem.elasticity import section_mesh
from fem.elasticity.face_symmetry import HalfFace, WholeFace
from fem.elasticity.flank_compliance import axial_loads, flank_forces, lines_across
from fem.elasticity.pitch_condensation import Prism, flank_displacements
from fem.linalg.block_matrix import KroneckerMatrix

#: Part of the face width that is modelled, by the forces on both halves: equal, opposite or any.
FACES = {"equal": HalfFace(), "opposite": HalfFace(antisymmetric=True), "any": WholeFace()}


def solid_prism(gear: fem.Gear, density: Density, halves: str) -> Prism:
    """Finite elements over the modelled part of the face width, and forces spread as hats.

    halves   forces on both halves of the width: "equal", "opposite" or "any"
    """
    face = FACES[halves]
    upper, line = lines_across(gear, density, gear.b)
    across = Basis(MeshLine(face.positions(np.sort(line.p[0]))), ElementLineP2())
    return Prism(gear, across, axial_loads(across, face.positions(upper)), face)


def uniform_prism(gear: fem.Gear) -> Prism:
    """Sections that all deform alike."""
    return Prism(gear, None, np.ones((1, 1)), WholeFace())


def linear_system(prism: Prism, density: Density, hats: int) -> tuple[KroneckerMatrix, list[sp.csr_matrix]]:
    """Stiffness over the free unknowns, and forces (n_unknown, n_load) on them: `flank_displacements`' virtual ones."""
    arcs = section_mesh.flank_arcs(prism.gear, hats)
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


def displacements_by_pitch(prism: Prism, density: Density, hats: int) -> np.ndarray:
    """The displacements u of the forces' system by condensation of a single pitch, in the order of the forces."""
    arcs = section_mesh.flank_arcs(prism.gear, hats)
    return flank_displacements(prism, density, partial(flank_forces, gear=prism.gear, arcs=arcs))
