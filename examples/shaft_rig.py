"""A gear pair whose pinion sits on a flexible or a rigid shaft, assembled in Exudyn for `flexible_shaft.py`.

The gear sits on a rigid cross-section whose node carries the floating frame, so that the gear is a second rigid body on
that very node: no joint, no spring, no added frequency. Torque acts on the pinion's shaft; the wheel's spin is imposed.
"""

from dataclasses import dataclass
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface
from shaft_modes import DIAMETER, LENGTH, SECTIONS, corners, sections

import exugear
import fem
from exugear import graphics

TORQUE = 150.0
BEARING, BEARING_TIME, SHAFT_TIME = 2e8, 1e-5, 5e-6


@dataclass
class Rig:
    """The system, its recorder, the number of its drive, and the markers of gear and bearings on the pinion's shaft."""

    mbs: Any
    container: Any
    pair: fem.GearPair
    force: exugear.MeshForce
    recorder: exugear.Recorder
    bodies: list[int]
    markers: list[int]
    drive: int

    def positions(self) -> np.ndarray:
        """(3, 3) positions of gear and bearings on the pinion's shaft [m]."""
        return np.array([self.mbs.GetMarkerOutput(m, exu.OutputVariableType.Position) for m in self.markers])


def rigid_body(mbs, node: int, disc: exugear.Disc) -> int:
    inertia = [disc.transverse, disc.transverse, disc.inertia, 0, 0, 0]
    return mbs.AddObject(eii.ObjectRigidBody(nodeNumber=node, mass=disc.mass, inertia=inertia))


def rigid_shaft(mbs, position) -> tuple[int, list[int]]:
    """Node of the gear and markers of gear and bearings on a rigid shaft."""
    node = mbs.AddNode(eii.NodeRigidBodyRxyz(referenceCoordinates=[*position, 0, 0, 0, 0]))
    body = rigid_body(mbs, node, exugear.Disc.cylinder(LENGTH, DIAMETER, density=fem.STEEL.density))
    return node, [mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=body, localPosition=[0, 0, z])) for z in SECTIONS]


def flexible_shaft(mbs, position, solid: FEMinterface) -> tuple[int, list[int]]:
    """The same of a flexible shaft in a floating frame; Rxyz, so that its spin is a single coordinate."""
    frame = ObjectFFRFreducedOrderInterface(solid, rigidBodyNodeType=exu.NodeType.RotationRxyz)
    options = {"stiffnessProportionalDamping": SHAFT_TIME, "rotationMatrixRef": np.eye(3)}
    items = frame.AddObjectFFRFreducedOrder(mbs, positionRef=[*position, 0], **options)
    markers = []
    for nodes in sections(solid):
        ends = {"meshNodeNumbers": corners(solid, nodes), "weightingFactors": np.full(4, 0.25)}
        marker = eii.MarkerSuperElementRigid(bodyNumber=items["oFFRFreducedOrder"], **ends)
        markers.append(mbs.AddMarker(marker))
    return items["nRigidBody"], markers


def add_bearings(mbs, position, markers) -> None:
    for z, marker in zip(SECTIONS[1:], markers[1:], strict=True):
        fixed = mbs.AddMarker(eii.MarkerBodyPosition(bodyNumber=mbs.CreateGround(), localPosition=[*position, z]))
        spring = {"stiffness": 3 * [BEARING], "damping": 3 * [BEARING * BEARING_TIME]}
        mbs.AddObject(eii.ObjectConnectorCartesianSpringDamper(markerNumbers=[fixed, marker], **spring))


def build(pair: fem.GearPair, force: exugear.MeshForce, solid: FEMinterface | None = None) -> Rig:
    """Pinion on a flexible shaft, or on a rigid shaft without `solid`, wheel on a rigid shaft; torque on the pinion."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    positions = [(0.0, 0.0), (pair.a, 0.0)]
    driving = flexible_shaft(mbs, positions[0], solid) if solid else rigid_shaft(mbs, positions[0])
    shafts, bodies = [driving, rigid_shaft(mbs, positions[1])], []
    gears = zip(positions, shafts, (pair.pinion, pair.wheel), graphics.meshing_angles(pair), strict=True)
    for position, (node, markers), gear, angle in gears:
        add_bearings(mbs, position, markers)
        blank = exugear.Disc.cylinder(gear.b, gear.r_a + gear.r_f, DIAMETER, density=gear.material.density)
        bodies.append(rigid_body(mbs, node, blank))
        graphics.add_gear_graphics(mbs, bodies[-1], gear, phase_angle=angle)
    recorder = exugear.Recorder()
    mbs.CreateGearContact(itemNumbers=bodies, pair=pair, force=force, recorder=recorder)
    mbs.AddLoad(eii.LoadTorqueVector(markerNumber=driving[1][1], loadVector=[0, 0, TORQUE]))
    drive = mbs.CreateCoordinateConstraint(itemNumbers=[None, bodies[1]], coordinates=[None, 5])
    mbs.Assemble()
    return Rig(mbs, container, pair, force, recorder, bodies, driving[1], drive)


def spins(rig: Rig) -> list[int]:
    """Indices of the spins of pinion and wheel among the system's coordinates."""
    return [rig.mbs.GetNodeODE2Index(rig.mbs.GetObject(body)["nodeNumber"]) + 5 for body in rig.bodies]
