"""From the scene to the assembled Exudyn system."""

from collections.abc import Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.rigidBodyUtilities import RigidBodyInertia
from scipy.linalg import eigh

from exugear.connector import CreateGearContact, frame_of, node_of
from exugear.gearbox import Gearbox
from exugear.kinematics import rotational_row, spatial_row
from exugear.plan import Coordinates, Plan
from exugear.plan import plan as plan_of
from exugear.recorder import Recorder
from exugear.shaft import NOWHERE, Shaft
from exugear.stage import Stage
from fem.gear import require


@dataclass(frozen=True, eq=False)
class Mesh:
    """One stage in the built system.

    contact    object number of the gear contact
    recorder   samples of its deflection and force
    frame      numbers of its kinematics
    row        (n_coordinates,) deflection = row . coordinates, about the reference configuration
    """

    stage: Stage
    contact: int
    recorder: Recorder
    frame: np.ndarray
    row: np.ndarray


@dataclass(frozen=True, eq=False)
class Model:
    """A gearbox in an assembled Exudyn system `mbs`, open to further items (call mbs.Assemble() after adding).

    bodies, spins   per shaft: object number, place of its spin among the system's coordinates
    drive, load     object number of the constraint that imposes the speed, number of the load torque
    """

    gearbox: Gearbox
    plan: Plan
    mbs: Any
    container: Any
    bodies: Mapping[str, int]
    spins: Mapping[str, int]
    meshes: tuple[Mesh, ...]
    drive: int
    load: int


def build(gearbox: Gearbox, *, plan: Plan | None = None) -> Model:
    """The assembled system of a gearbox, by default after `exugear.plan(gearbox)`.

    Raises ValueError for what is no gearbox, and a plan of another one.
    """
    require(isinstance(gearbox, Gearbox), f"gearbox must be an exugear.Gearbox, got {type(gearbox).__name__}")
    plan = plan_of(gearbox) if plan is None else plan
    names = [shaft.name for shaft in gearbox.shafts]
    require(list(plan.shafts) == names, f"plan is for the shafts {list(plan.shafts)}, the gearbox has {names}")
    _check_built(gearbox)
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    ground = mbs.CreateGround()
    bodies = {shaft.name: _body(mbs, ground, gearbox, shaft, plan.shafts[shaft.name]) for shaft in gearbox.shafts}
    phases = zip(gearbox.stages, gearbox.phases, strict=True)
    contacts = [_contact(mbs, gearbox, stage, phase, bodies) for stage, phase in phases]
    spin_coordinate = {name: 0 if plan.shafts[name] is Coordinates.SPIN else 5 for name in names}
    drive, load = _drive_and_load(mbs, gearbox, bodies, spin_coordinate)
    with quiet():
        mbs.Assemble()
    start = {name: mbs.GetNodeODE2Index(node_of(mbs, body)) for name, body in bodies.items()}
    meshes = tuple(_mesh(mbs, stage, contact, start) for stage, contact in zip(gearbox.stages, contacts, strict=True))
    spins = {name: start[name] + spin_coordinate[name] for name in names}
    model = Model(gearbox, plan, mbs, container, bodies, spins, meshes, drive, load)
    return replace(model, plan=replace(plan, omega=_omega(model), omega_mesh=max(map(_omega_mesh, gearbox.stages))))


def _check_built(gearbox: Gearbox) -> None:
    """Refuse what the data can say and the model cannot do yet."""
    for shaft in gearbox.shafts:
        later = f"of shaft {shaft.name!r} cannot be built into a model yet; leave it out"
        require(all(bearing.linear for bearing in shaft.bearings.values()), f"nonlinear bearing {later}")
        require(shaft.coupling is None, f"coupling {later}")
        require(shaft.offset == NOWHERE, f"offset {later}")


@contextmanager
def quiet():
    """Exudyn's console output off, and on again as it was."""
    before = exu.config.printToConsole
    exu.config.printToConsole = False
    try:
        yield
    finally:
        exu.config.printToConsole = before


def _body(mbs, ground: int, gearbox: Gearbox, shaft: Shaft, coordinates: Coordinates) -> int:
    if coordinates is Coordinates.SPIN:
        node = mbs.AddNode(eii.Node1D(name=shaft.name, referenceCoordinates=[0.0]))
        return mbs.AddObject(eii.ObjectRotationalMass1D(name=shaft.name, inertia=shaft.inertia, nodeNumber=node))
    position = [*gearbox.places[shaft.name], shaft.centre]
    tensor = np.diag([shaft.transverse, shaft.transverse, shaft.inertia])
    body = mbs.CreateRigidBody(
        name=shaft.name,
        referencePosition=position,
        inertia=RigidBodyInertia(mass=shaft.mass, inertiaTensor=tensor),
        nodeType=exu.NodeType.RotationRxyz,
    )
    if coordinates is Coordinates.JOINT:
        mbs.CreateRevoluteJoint(itemNumbers=[ground, body], position=position, axis=[0, 0, 1], useGlobalFrame=True)
    else:
        _bearings(mbs, body, shaft)
    return body


def _bearings(mbs, body: int, shaft: Shaft) -> None:
    """One linear object per bearing on the body's coordinates, which tilts leave small."""
    nodes = [node_of(mbs, body)]
    for axial, bearing in shaft.bearings.items():
        k = bearing.at(axial - shaft.centre)
        item = eii.ObjectGenericODE2(nodeNumbers=nodes, stiffnessMatrix=k, dampingMatrix=bearing.damping * k)
        item.visualization["show"] = False
        mbs.AddObject(item)


def _contact(mbs, gearbox: Gearbox, stage: Stage, phase: float, bodies) -> tuple[int, Recorder, np.ndarray]:
    pinion, wheel = bodies[stage.fast.name], bodies[stage.slow.name]
    positions = [[0, 0, s - shaft.centre] for s, shaft in zip(stage.places, (stage.fast, stage.slow), strict=True)]
    recorder, direction = Recorder(), gearbox.turns[stage.fast.name]
    contact = CreateGearContact(
        mbs,
        stage.name,
        [pinion, wheel],
        stage.pair,
        stage.force,
        localPositions=positions,
        phase=phase,
        direction=direction,
        recorder=recorder,
    )
    return contact, recorder, frame_of(mbs, [pinion, wheel], stage.pair, positions, phase=phase, direction=direction)


def _drive_and_load(mbs, gearbox: Gearbox, bodies, spin_coordinate) -> tuple[int, int]:
    def marker(shaft: Shaft) -> int:
        node, coordinate = node_of(mbs, bodies[shaft.name]), spin_coordinate[shaft.name]
        return mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))

    fixed = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
    drive = mbs.AddObject(eii.CoordinateConstraint(name="drive", markerNumbers=[fixed, marker(gearbox.driving)]))
    return drive, mbs.AddLoad(eii.LoadCoordinate(name="load", markerNumber=marker(gearbox.driven), load=0.0))


def _mesh(mbs, stage: Stage, contact, start: Mapping[str, int]) -> Mesh:
    number, recorder, frame = contact
    row = np.zeros(mbs.systemData.ODE2Size())
    spins = mbs.systemData.ODE2Size() == len(start)
    entries = rotational_row(frame) if spins else spatial_row(frame)
    for shaft, part in zip((stage.fast, stage.slow), np.split(entries, 2), strict=True):
        row[start[shaft.name] : start[shaft.name] + part.size] = part
    return Mesh(stage, number, recorder, frame, row)


def lay(model: Model, deflections, coordinates: np.ndarray) -> np.ndarray:
    """The same coordinates with spins such that the meshes stand at deflections (n_stage,), to first order.

    The driving shaft keeps its spin; loops come as near as they can.
    """
    q, rows = coordinates.copy(), np.array([mesh.row for mesh in model.meshes])
    spins = [spin for name, spin in model.spins.items() if name != model.gearbox.driving.name]
    q[spins] += np.linalg.lstsq(rows[:, spins], deflections - rows @ q)[0]
    return q


def open_system(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness matrix of the built system while no teeth touch."""
    system = model.mbs.systemData
    before = system.GetODE2Coordinates(exu.ConfigurationType.Initial)
    gaps = [-0.5 * min(mesh.stage.force.backlash, 1e-3) for mesh in model.meshes]
    try:
        system.SetODE2Coordinates(lay(model, gaps, np.zeros(len(before))), exu.ConfigurationType.Initial)
        with quiet():
            mass, stiffness, *_ = model.mbs.ComputeLinearizedSystem()
    finally:
        system.SetODE2Coordinates(before, exu.ConfigurationType.Initial)
    return np.array(mass), np.array(stiffness)


def _omega(model: Model) -> float:
    """Upper bound of the eigenfrequencies [rad/s]: every mesh at its stiffest, constraints ignored."""
    mass, stiffness = open_system(model)
    for mesh in model.meshes:
        stiffness += mesh.stage.force.stiffness_max * np.outer(mesh.row, mesh.row)
    return sqrt(eigh((stiffness + stiffness.T) / 2, mass, eigvals_only=True)[-1])


def _omega_mesh(stage: Stage) -> float:
    lightness = stage.pair.pinion.r_b**2 / stage.fast.inertia + stage.pair.wheel.r_b**2 / stage.slow.inertia
    return sqrt(stage.force.stiffness_max * lightness)
