"""A steel shaft as finite elements of scikit-fem, reduced by Exudyn to Craig-Bampton modes; its closed-form references.

`shaft_rig.py` puts it under a gear. Three cross-sections stay rigid: under the gear and in both bearings. The modes
leave out the gear's cross-section, because the floating frame sits there.
"""

import numpy as np
from exudyn.FEM import FEMinterface, HCBstaticModeSelection
from skfem import Basis, BilinearForm, ElementTetP2, ElementVector, MeshHex
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

from fem import STEEL
from fem.units import mm

LENGTH, DIAMETER = 300 * mm, 40 * mm
#: Axial positions of the gear and of both bearings.
SECTIONS = (0.0, -LENGTH / 2, LENGTH / 2)


def solid_shaft(slices: int = 24, rings: int = 2) -> FEMinterface:
    """Quadratic tetrahedra of a cylinder about z, its cross-section a polygon of the circle's area; no modes yet."""
    across, along = np.linspace(-1, 1, 2 * rings + 1), np.linspace(-LENGTH / 2, LENGTH / 2, slices + 1)
    block = MeshHex.init_tensor(across, across, along)
    x, y, z = block.p
    corners = 8 * rings
    radius = DIAMETER / 2 * np.sqrt(2 * np.pi / (corners * np.sin(2 * np.pi / corners)))
    rounded = radius * x * np.sqrt(1 - y**2 / 2), radius * y * np.sqrt(1 - x**2 / 2), z
    mesh = MeshHex(np.array(rounded), block.t).to_meshtet()
    solid = FEMinterface()
    element = ElementVector(ElementTetP2())
    elastic = linear_elasticity(*lame_parameters(STEEL.E, STEEL.nu))
    solid.stiffnessMatrix = elastic.assemble(Basis(mesh, element, intorder=2)).tocsr()
    basis = Basis(mesh, element, intorder=4)
    solid.massMatrix = BilinearForm(lambda u, v, w: STEEL.density * dot(u, v)).assemble(basis).tocsr()
    solid.nodes = {"Position": np.ascontiguousarray(basis.doflocs[:, ::3].T)}
    solid.surface = [{"Name": "mantle", "Trigs": mesh.facets[:, mesh.boundary_facets()].T}]
    return solid


def sections(solid: FEMinterface) -> list[np.ndarray]:
    """Nodes of the cross-sections under the gear and in both bearings."""
    return [np.flatnonzero(abs(solid.nodes["Position"][:, 2] - z) < 1e-9) for z in SECTIONS]


def corners(solid: FEMinterface, nodes: np.ndarray) -> np.ndarray:
    """Four nodes of a rigid cross-section, farthest out in +x, -x, +y, -y; they move as all of it does."""
    x, y, _ = solid.nodes["Position"][nodes].T
    return nodes[[x.argmax(), x.argmin(), y.argmax(), y.argmin()]]


def reduced(solid: FEMinterface, modes: int = 6) -> FEMinterface:
    """The shaft with Craig-Bampton modes over its rigid cross-sections."""
    solid.ComputeHurtyCraigBamptonModes(sections(solid), modes, computationMode=HCBstaticModeSelection.RBE2)
    return solid


def torsion_frequency() -> float:
    """First torsional frequency of a free rod [Hz]."""
    return np.sqrt(STEEL.E / (2 * (1 + STEEL.nu)) / STEEL.density) / (2 * LENGTH)


def beam_deflection(force: float) -> float:
    """Timoshenko beam on two supports under a force in the middle [m]."""
    area, inertia = np.pi * DIAMETER**2 / 4, np.pi * DIAMETER**4 / 64
    shear = STEEL.E / (2 * (1 + STEEL.nu)) * area * 6 * (1 + STEEL.nu) / (7 + 6 * STEEL.nu)
    return force * (LENGTH**3 / (48 * STEEL.E * inertia) + LENGTH / (4 * shear))
