"""The built model: a gearbox as an assembled Exudyn system, with its matrices and frequency bounds."""

from collections.abc import Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from math import cos, pi, sin, sqrt
from typing import Annotated, Any

import exudyn as exu
import numpy as np
import scipy

from exugear.elements.exudyn_objects import kind_of, node_of, quiet
from exugear.elements.gear_contact import add_contact, state_of
from exugear.elements.native.native import call_path
from exugear.elements.shaft_bodies import add_body, add_drive_and_load, add_rotor
from exugear.gearbox.bearing import radial_part
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.shaft import NO_DISPLACEMENT
from exugear.gearbox.stage import Stage
from exugear.kernels.contact_kernels import SPIN, kernel_of
from exugear.kernels.contact_records import contact_state, is_spatial, rotational_frame
from exugear.kernels.friction_kernels import rubbing_contact_of
from exugear.kernels.recorder import Recorder
from exugear.kernels.reference_configuration import (
    phase_of,
    reference_state,
    rotational_row,
    spatial_frame,
    spatial_row,
)
from exugear.mesh_force.force import MeshForce
from exugear.plan.built_plan import BuiltPlan
from exugear.plan.coordinates import Coordinates, pose
from exugear.plan.integrator_and_step import Rule
from exugear.plan.plan import Plan
from exugear.plan.plan import plan as plan_of
from fem.support.arguments import checked
from fem.support.validation import require, require_kind

#: Share of a mode's strain energy in the meshes above which the step must resolve the mode.
STRAIN_SHARE = 0.02


@dataclass(frozen=True, eq=False)
class Mesh:
    """The mesh of a stage in the built system.

    law                        force law with the axes that the scene needs
    contact                    object number of the gear contact
    recorder                   samples of the contact
    frame                      geometry of the contact
    row                        (n_coordinates,) deflection = reference_deflection + row . coordinates, to first order
    reference_deflection       in the reference configuration, by static displacement of the shafts [m]
    opening                    of either flank in the reference configuration [m]
    phase                      in the reference configuration
    mobility                   acceleration along the line of action per mesh force, the drive fixed [1/kg]
    acceleration_by_bearings   (12,) acceleration along the line of action per displacement of pinion and wheel [1/s^2];
                               0 for a shaft with nonlinear bearings
    force_per_load             mesh force that balances a load of 1 N m, the bearings not yet displaced [1/m]
    """

    stage: Stage
    law: MeshForce
    contact: int
    recorder: Recorder
    frame: np.record
    row: np.ndarray
    reference_deflection: float
    opening: float
    phase: float
    mobility: float = 0.0
    acceleration_by_bearings: np.ndarray = field(default_factory=lambda: np.zeros(12))
    force_per_load: float = 0.0


@checked
@dataclass(frozen=True, eq=False)
class Model:
    """A gearbox in an assembled Exudyn system `mbs`, open to further items (call mbs.Assemble() after adding).

    bodies, spins   of each shaft: object number, index of its spin among the system's coordinates
    rotors          of each shaft with a coupling: index of the spin of the rotor behind it
    drive, load     object number of the constraint that imposes the speed, number of the load torque
    """

    gearbox: Gearbox
    plan: BuiltPlan
    mbs: Annotated[Any, partial(require_kind, kind=exu.MainSystem)]
    container: Annotated[Any, partial(require_kind, kind=exu.SystemContainer)]
    bodies: Mapping[str, int]
    spins: Mapping[str, int]
    rotors: Mapping[str, int]
    meshes: tuple[Mesh, ...]
    drive: int
    load: int

    @property
    def mesh_cycles(self) -> np.ndarray:
        """(n_stage,) mesh cycles per radian of the driving shaft."""
        box = self.gearbox
        return np.array([abs(box.ratios[s.fast.name]) * s.pair.pinion.z / (2 * pi) for s in box.stages])

    def __repr__(self) -> str:
        return f"Model of {self.gearbox!r}\n{self.plan}"


@checked
def build(gearbox: Gearbox, *, plan: Plan | BuiltPlan | None = None) -> Model:
    """Assemble the Exudyn system of a gearbox: bodies on their bearings, gear contacts, drive and load.

    plan   by default `exugear.plan(gearbox)`; a changed plan such as `exugear.plan(gearbox).with_joints()` builds an
           unreduced model. The plan of a built model counts as its `Plan`

    Returns a `Model`. Its system `model.mbs` is open to further items of your own; call `model.mbs.Assemble()` after
    adding them. `print(model.plan)` shows which coordinates the shafts have and why, which integrator and step a run
    takes, what it costs, and how Exudyn calls the contacts.

    Raises ValueError where gearbox is no `Gearbox`, and for the plan of another gearbox.
    """
    scene = _scene(gearbox, plan)
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    ground = mbs.CreateGround()
    bodies = {shaft.name: add_body(mbs, ground, gearbox, shaft, scene.shafts[shaft.name]) for shaft in gearbox.shafts}
    meshes = [_mesh(mbs, gearbox, i, scene, bodies) for i in range(len(gearbox.stages))]
    rotors = {name: add_rotor(mbs, gearbox, body, scene.shafts[name], name) for name, body in bodies.items()}
    drive, load = add_drive_and_load(mbs, gearbox, bodies, rotors, scene.shafts)
    with quiet():
        mbs.Assemble()
    first = {name: mbs.GetNodeODE2Index(node_of(mbs, body)) for name, body in bodies.items()}
    spins = {name: index + scene.shafts[name].spin_index for name, index in first.items()}
    rotor_spins = {name: mbs.GetNodeODE2Index(node_of(mbs, r)) for name, r in rotors.items() if r is not None}
    rows = tuple(_with_row(mbs, mesh, first, scene) for mesh in meshes)
    unlinearized = BuiltPlan(scene, omega=0.0, omega_mesh=0.0, contact=call_path())
    return linearized(Model(gearbox, unlinearized, mbs, container, bodies, spins, rotor_spins, rows, drive, load))


def _scene(gearbox: Gearbox, plan: Plan | BuiltPlan | None) -> Plan:
    """The plan by which to build; ValueError for the plan of another gearbox."""
    scene = plan.scene if isinstance(plan, BuiltPlan) else plan or plan_of(gearbox)
    names = [shaft.name for shaft in gearbox.shafts]
    require(list(scene.shafts) == names, f"plan is for the shafts {list(scene.shafts)}, the gearbox has {names}")
    return scene


def linearized(model: Model) -> Model:
    """The model with the rows, frequency bounds and mobilities of its present system, further items included."""
    added = model.mbs.systemData.ODE2Size() - model.meshes[0].row.size
    meshes = tuple(replace(mesh, row=np.append(mesh.row, np.zeros(added))) for mesh in model.meshes)
    model = replace(model, meshes=meshes)
    mass, stiffness = matrices_without_meshes(model)
    omega, omega_mesh = _frequency_bounds(model, mass, stiffness)
    meshes = tuple(_with_mobility(model, mesh, mass, stiffness) for mesh in meshes)
    return replace(model, plan=replace(model.plan, omega=omega, omega_mesh=omega_mesh), meshes=meshes)


@contextmanager
def lag_corrected(model: Model, rule: Rule):
    """Let contacts correct their damping for the lag of the velocities of an integration rule.

    In loops the correction leaves out the acceleration by the mesh force: there the load does not determine the mesh
    forces.
    """
    loops = len(model.meshes) >= len(model.bodies)
    for mesh in model.meshes:
        state = state_of(model.mbs, mesh.contact)
        state.lag, state.mobility = rule.lag * mesh.mobility, 0.0 if loops else mesh.mobility
        state.pinion_lag, state.wheel_lag = np.split(rule.lag * mesh.acceleration_by_bearings, 2)
    try:
        yield
    finally:
        for mesh in model.meshes:
            state = state_of(model.mbs, mesh.contact)
            state.lag, state.pinion_lag, state.wheel_lag = 0.0, np.zeros(6), np.zeros(6)


def _mesh(mbs, gearbox: Gearbox, number: int, scene: Plan, bodies: Mapping[str, int]) -> Mesh:
    """Add the contact of a stage; `_with_row` sets the row once the coordinates are numbered."""
    stage, law, recorder = gearbox.stages[number], scene.laws[gearbox.labels[number]], Recorder()
    items = [bodies[stage.fast.name], bodies[stage.slow.name]]
    kinds = tuple(kind_of(mbs, item) for item in items)
    displaced = any(shaft.offset != NO_DISPLACEMENT for shaft in (stage.fast, stage.slow))
    frame = _frame(gearbox, number, spatial=displaced or set(kinds) != {SPIN})
    friction = [stage.friction.table(stage.pair)] if stage.friction else []
    kernel = (rubbing_contact_of if friction else kernel_of)(kinds, displaced)
    records = law.table, frame, contact_state(), *friction
    contact = add_contact(mbs, gearbox.labels[number], items, kernel, records, recorder)
    reference = reference_state(law.table.head, frame) if is_spatial(frame) else (0.0, 0.0, phase_of(frame, 0.0))
    return Mesh(stage, law, contact, recorder, frame, np.zeros(0), *reference)


def _frame(gearbox: Gearbox, number: int, *, spatial: bool) -> np.record:
    """Contact frame of a stage; spatial: whether its bodies move in the plane or in space, or are displaced."""
    stage, phase = gearbox.stages[number], gearbox.phases[number]
    direction = gearbox.directions[stage.fast.name]
    if not spatial:
        return rotational_frame(stage.pair, phase, direction)
    axial = [s - shaft.centre for s, shaft in zip(stage.axial_positions, (stage.fast, stage.slow), strict=True)]
    poses = [pose(gearbox, shaft) for shaft in (stage.fast, stage.slow)]
    nominal = {"e_x": cos(stage.angle), "e_y": sin(stage.angle), "height": 0.0}
    return spatial_frame(stage.pair, phase, direction, axial, poses, **nominal)


def _with_row(mbs, mesh: Mesh, first: Mapping[str, int], scene: Plan) -> Mesh:
    """The mesh with its row over the coordinates of the system; first: index of each shaft's first coordinate."""
    row, entries = np.zeros(mbs.systemData.ODE2Size()), np.zeros((2, 6))
    if is_spatial(mesh.frame):
        entries[:] = spatial_row(mesh.frame).reshape(2, 6)
    else:
        entries[:, 5] = rotational_row(mesh.frame)
    for shaft, entry in zip((mesh.stage.fast, mesh.stage.slow), entries, strict=True):
        components = scene.shafts[shaft.name].components
        row[first[shaft.name] : first[shaft.name] + len(components)] = entry[components]
    return replace(mesh, row=row)


def matrices_without_meshes(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness matrix of the built system without the meshes."""
    system, initial = model.mbs.systemData, exu.ConfigurationType.Initial
    before, states = system.GetODE2Coordinates(initial), [state_of(model.mbs, mesh.contact) for mesh in model.meshes]
    try:
        system.SetODE2Coordinates(np.zeros(len(before)), initial)
        for state in states:
            state.engaged = 0.0
        with quiet():
            mass, stiffness, *_ = model.mbs.ComputeLinearizedSystem()
    finally:
        system.SetODE2Coordinates(before, initial)
        for state in states:
            state.engaged = 1.0
    return np.array(mass), np.array(stiffness)


def _with_mobility(model: Model, mesh: Mesh, mass: np.ndarray, stiffness: np.ndarray) -> Mesh:
    """The mesh with the accelerations of its bodies along the line of action, by the mesh force and by bearings."""
    accelerations = _acceleration_by_force(model, mesh, mass)
    mobility = float(mesh.row @ accelerations)
    static_forces = np.array(model.gearbox.static_forces(1.0))
    forces_on_bodies = static_forces @ np.array([each.row for each in model.meshes])
    by_bearings, force_per_load = np.zeros((2, 6)), float(static_forces[model.meshes.index(mesh)])
    for by_displacement, shaft in zip(by_bearings, (mesh.stage.fast, mesh.stage.slow), strict=True):
        if all(bearing.linear for bearing in shaft.bearings.values()):
            components = model.plan.shafts[shaft.name].components[:-1]
            displacements = slice(model.spins[shaft.name] - len(components), model.spins[shaft.name])
            by_displacement[components] = (stiffness @ accelerations)[displacements]
            force_per_load -= float(accelerations[displacements] @ forces_on_bodies[displacements]) / mobility
    mesh = replace(mesh, mobility=mobility, force_per_load=force_per_load)
    return replace(mesh, acceleration_by_bearings=by_bearings.ravel())


def _acceleration_by_force(model: Model, mesh: Mesh, mass: np.ndarray) -> np.ndarray:
    """(n_coordinates,) accelerations by a unit mesh force [1/kg, 1/(kg m)], the drive fixed."""
    driving = model.gearbox.driving.name
    constrained = np.append(held_by_joints(model), model.rotors.get(driving, model.spins[driving]))
    free = np.setdiff1d(np.arange(len(mass)), constrained)
    accelerations = np.zeros(len(mass))
    accelerations[free] = np.linalg.solve(mass[np.ix_(free, free)], mesh.row[free])
    return accelerations


def _frequency_bounds(model: Model, mass: np.ndarray, stiffness: np.ndarray) -> tuple[float, float]:
    """Upper bounds of all eigenfrequencies, and of those of the modes in which meshes deform [rad/s].

    Each mesh and nonlinear bearing has its largest stiffness; the driving shaft is free to turn.
    """
    stiffness = stiffness + nonlinear_bearing_stiffness(model)
    free = np.setdiff1d(np.arange(len(mass)), held_by_joints(model))
    mass, stiffness = mass[np.ix_(free, free)], stiffness[np.ix_(free, free)]
    rows = np.array([np.sqrt(mesh.law.stiffness_max) * mesh.row[free] for mesh in model.meshes])
    stiffness += rows.T @ rows
    squares, modes = scipy.linalg.eigh((stiffness + stiffness.T) / 2, mass)
    strained = ((rows @ modes) ** 2).sum(axis=0) > STRAIN_SHARE * np.maximum(squares, 0)
    return sqrt(squares[-1]), sqrt(squares[strained][-1])


def held_by_joints(model: Model) -> np.ndarray:
    """Indices of the coordinates that ideal joints constrain."""
    spins = [model.spins[name] for name, kind in model.plan.shafts.items() if kind is Coordinates.JOINT]
    return np.array([spin - k for spin in spins for k in range(1, 6)], int)


def nonlinear_bearing_stiffness(model: Model, secants: Mapping[str, Mapping[float, float]] | None = None) -> np.ndarray:
    """Stiffness matrix of the nonlinear bearings, at their steepest slopes or by secants.

    secants   secant stiffness [N/m] of each bearing, by shaft and axial position
    """
    total = np.zeros((model.mbs.systemData.ODE2Size(),) * 2)
    for shaft in model.gearbox.shafts:
        first = model.spins[shaft.name] - 5
        for axial, bearing in shaft.bearings.items():
            if not bearing.linear:
                k = float(bearing.stiffness[0, 0]) if secants is None else secants[shaft.name][axial]
                total[first : first + 6, first : first + 6] += radial_part(k, axial - shaft.centre)
    return total


def on_bearings(model: Model, mesh: Mesh) -> bool:
    """Whether a shaft of a mesh stands on elastic bearings."""
    return any(model.plan.shafts[shaft.name].on_bearings for shaft in (mesh.stage.fast, mesh.stage.slow))
