"""Reduction of a built gearbox to the mesh that excites it: linear about its equilibrium but for the force of that mesh.

The linear system keeps all coordinates. Bearings and couplings have their tangent stiffness under the load, the other
meshes their mean tangent stiffness over the mesh cycle, the gyroscopic terms are those at the middle of the speed range;
the contact has its row and its offsets in the equilibrium.
"""

from dataclasses import replace
from math import acos

import exudyn as exu
import numpy as np

from exugear.contact_geometry.contact_records import is_spatial
from exugear.contact_geometry.reference_configuration import offsets_at
from exugear.force_table.layout import OFFSETS
from exugear.mesh_force.fixed_offsets import at_fixed_offsets
from exugear.mesh_force.force import MeshForce
from exugear.modes.linear_system import linear_gearbox
from exugear.modes.mesh_tangents import contact_of
from exugear.modes.operating_point import loaded
from exugear.steady_state.modal_blocks import modal_blocks
from exugear.steady_state.steady_system import SteadySystem
from exugear.system.model import Mesh, Model
from fem.gear.involute import involute
from fem.support.validation import require


def steady_system(model: Model, load: float, stage: int, *, speed: float, drive: str) -> SteadySystem:
    """The system that the mesh of a stage excites, under a load on the driven shaft [N m].

    speed   of the driving shaft [rad/s] at which gyroscopic terms are taken
    drive   "held": the driving shaft turns as imposed; "free": it turns under a constant torque
    """
    with loaded(model, load, drive) as in_equilibrium:
        system = linear_gearbox(in_equilibrium, [speed], None)
        coordinates = np.array(model.mbs.systemData.GetODE2Coordinates(exu.ConfigurationType.Initial))
        mesh, tangent = in_equilibrium.meshes[stage], system.meshes[stage]
        deflection = contact_of(model.mbs, mesh.contact).sample(coordinates[tangent.coordinates]).deflection
    row = system.rows[stage]
    damping = system.damping[0] - tangent.damping * np.outer(row, row)
    matrices = [system.reduced(matrix) for matrix in (system.mass, system.stiffness, damping)]
    blocks = modal_blocks(*matrices, row @ system.motions)
    offsets = _offsets(model, mesh, coordinates)
    law = _law_at(mesh.law, offsets)
    return SteadySystem(law, blocks, tangent.force, deflection, tangent.stiffness, _opening(mesh, offsets))


def _offsets(model: Model, mesh: Mesh, coordinates: np.ndarray) -> dict[str, float]:
    """a [m], misalignment [rad] and axial [m] of a mesh at coordinates of the system; empty where shafts only spin."""
    if not is_spatial(mesh.frame):
        return {}
    displacements = np.zeros((2, 6))
    for displacement, shaft in zip(displacements, (mesh.stage.fast, mesh.stage.slow), strict=True):
        components = model.plan.shafts[shaft.name].components
        first = model.spins[shaft.name] - len(components) + 1
        displacement[components] = coordinates[first : first + len(components)]
    offsets = offsets_at(mesh.law.table.head, mesh.frame, *(tuple(row) for row in displacements.tolist()))
    return dict(zip(OFFSETS, offsets, strict=True))


def _law_at(law: MeshForce, offsets: dict[str, float]) -> MeshForce:
    """The law at offsets, clamped to its axes; in mid-plane, as its force alone matters."""
    if not law.offsets:
        return law
    clamped = {name: float(np.clip(offsets[name], axis[0], axis[-1])) for name, axis in law.offsets.items()}
    arrays = at_fixed_offsets(law, clamped) | {"centroid": np.array(0.0)}
    return replace(law, **arrays, offsets={}, fixed_offsets={**law.fixed_offsets, **clamped})


def _opening(mesh: Mesh, offsets: dict[str, float]) -> float:
    """Opening of either flank [m] by a centre distance beside the nominal one."""
    if not offsets:
        return 0.0
    r_b = mesh.stage.pair.pinion.r_b + mesh.stage.pair.wheel.r_b
    return r_b * (involute(acos(r_b / offsets["a"])) - float(mesh.frame.inv_alpha_wt))


def check_reducible(model: Model) -> None:
    """Require a gearbox without friction and drag, whose torques would depend on the speed."""
    rubbing = [label for label, stage in zip(model.gearbox.labels, model.gearbox.stages, strict=True) if stage.friction]
    require(not rubbing, f"model must be without friction, stages {rubbing} rub; leave friction= out")
    braked = [shaft.name for shaft in model.gearbox.shafts if shaft.drags]
    require(not braked, f"model must be without drag, shafts {braked} are braked; leave it out")
