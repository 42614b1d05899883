"""Reduction of a built gearbox to the mesh that excites it: linear about its equilibrium but for the law of that mesh.

The linear system keeps all coordinates. Bearings and couplings have their tangent stiffness under the load, the other
meshes their mean tangent stiffness over the mesh cycle; gyroscopic terms are those in the middle of the speed range.
The potential of the mesh depends on deflection, phase and misalignment, which depend linearly on the coordinates; it
has the centre distance and the axial offset of the equilibrium, and expands the misalignment to first order about it.
The mean of what this leaves out, the tilting stiffness of the mesh, belongs to the linear system.
"""

from math import acos

import numpy as np

from exugear.force_table.layout import OFFSETS
from exugear.mesh_force.force import MeshForce
from exugear.modes.linear_system import linear_gearbox
from exugear.modes.mesh_tangents import mesh_tangent
from exugear.modes.operating_point import loaded
from exugear.steady_state.mesh_measures import STEP, Measures, measures_of, static_at, tilting_stiffness_at
from exugear.steady_state.orbits.modal_blocks import modal_blocks
from exugear.steady_state.orbits.steady_system import MeshEquilibrium, SteadySystem
from exugear.system.drive_and_load import INITIAL
from exugear.system.model import Mesh, Model
from fem.gear.involute import involute
from fem.support.validation import require

#: Number of phases at which the stiffness of the other meshes is compared.
PHASES = 8


def steady_system(model: Model, load: float, stage: int, *, speed: float, drive: str) -> SteadySystem:
    """The system that the mesh of a stage excites, under a load on the driven shaft [N m].

    speed   of the driving shaft [rad/s] at which gyroscopic terms are taken
    drive   "held": the driving shaft turns as imposed; "free": it turns under a constant torque
    """
    with loaded(model, load, drive) as in_equilibrium:
        system = linear_gearbox(in_equilibrium, [speed], None)
        q = np.array(model.mbs.systemData.GetODE2Coordinates(INITIAL))
        mesh, others = in_equilibrium.meshes[stage], list(in_equilibrium.meshes)
        others.remove(mesh)
        _, tangent = mesh_tangent(model.mbs, mesh.contact, None)
        variation = max((_variation(model.mbs, each.contact) for each in others), default=0.0)
    rows, measures = measures_of(model, mesh, q)
    by_mesh, of_mesh = np.outer(rows[0], rows[0]), np.outer(system.rows[stage], system.rows[stage])
    law = _law_at(mesh.law, measures.offsets)
    tilting = _tilting_stiffness(mesh.law, law, float(system.mesh_force[stage]))
    stiffness = system.stiffness - system.elements[stage].stiffness + tangent.stiffness * by_mesh
    stiffness = stiffness + tilting * np.outer(rows[2], rows[2])
    damping = system.damping[0] - tangent.damping * of_mesh
    mass, stiffness, damping = (system.reduced(matrix) for matrix in (system.mass, stiffness, damping))
    rows = rows @ system.motions
    rows = rows if np.abs(rows[1:]).max() > 0 else rows[:1]
    blocks = modal_blocks(mass, stiffness, damping, rows)
    equilibrium = _equilibrium(law, mesh, measures, float(system.mesh_force[stage]), float(tangent.stiffness))
    return SteadySystem(law, blocks, equilibrium, variation)


def _variation(mbs, contact: int) -> float:
    """Range of the tangent stiffness of a mesh over its cycle, over twice its mean."""
    stiffness = [mesh_tangent(mbs, contact, phase)[1].stiffness for phase in np.arange(PHASES) / PHASES]
    return float(np.ptp(stiffness) / 2 / np.mean(stiffness))


def _equilibrium(law: MeshForce, mesh: Mesh, measures: Measures, force: float, stiffness: float) -> MeshEquilibrium:
    """The equilibrium of a mesh at its measures, with a force [N] and a mean stiffness [N/m]."""
    side, opening = 1.0 if force > 0 else -1.0, _opening(mesh, measures.offsets)
    phase, deflection = measures.phase, measures.deflection
    if side < 0:
        phase, deflection = law.back_phase - phase, -(deflection + law.backlash) - 2 * opening
    static = static_at(law.table.head, phase, deflection)
    slopes = {"by_phase": side * static.by_phase, "by_misalignment": static.by_lever}
    return MeshEquilibrium(force, measures.deflection, stiffness, **slopes, opening=opening, side=side)


def _law_at(law: MeshForce, offsets: dict[str, float]) -> MeshForce:
    """A law at offsets, clamped to its axes."""
    return law.at(**{name: float(np.clip(offsets[name], axis[0], axis[-1])) for name, axis in law.offsets.items()})


def _tilting_stiffness(law: MeshForce, at_offsets: MeshForce, force: float) -> float:
    """Mean over the mesh cycle of `tilting_stiffness_at` under a force [N]; 0 of a law of first order."""
    if "misalignment" not in law.offsets:
        return 0.0
    axis, offsets = law.offsets["misalignment"], {"a": 0.0, "axial": 0.0} | dict(at_offsets.fixed_offsets)
    offsets["misalignment"] = float(np.clip(offsets["misalignment"], axis[0] + STEP, axis[-1] - STEP))
    values = tuple(offsets[name] for name in OFFSETS)
    phases = np.arange(PHASES) / PHASES
    deflections = [at_offsets.deflection_at(phase, abs(force)) for phase in phases]
    tables = law.table.head, at_offsets.table.head
    return float(np.mean([tilting_stiffness_at(*tables, *x, values) for x in zip(phases, deflections, strict=True)]))


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
