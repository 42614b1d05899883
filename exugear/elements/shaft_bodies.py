"""Shafts as Exudyn's bodies: spinning, planar, in space; on bearings or joints; with the rotor behind a coupling."""

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.rigidBodyUtilities import RigidBodyInertia, RotXYZ2RotationMatrix

from exugear.elements import bearing_elements
from exugear.elements.gear_contact import node_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.shaft import Shaft
from exugear.plan.coordinates import Coordinates, pose


def add_body(mbs, ground: int, gearbox: Gearbox, shaft: Shaft, coordinates: Coordinates) -> int:
    """A shaft as a body on its bearings."""
    x, y, z, a, b, _ = pose(gearbox, shaft)
    if coordinates is Coordinates.SPIN:
        node = mbs.AddNode(eii.Node1D(name=shaft.name, referenceCoordinates=[0.0]))
        data = {"inertia": shaft.inertia, "nodeNumber": node, "referencePosition": [x, y, z]}
        return mbs.AddObject(eii.ObjectRotationalMass1D(name=shaft.name, **data))
    if coordinates is Coordinates.PLANAR:
        node = mbs.AddNode(eii.NodeRigidBody2D(name=shaft.name, referenceCoordinates=[x, y, 0.0]))
        data = {"mass": shaft.mass, "inertia": shaft.inertia, "nodeNumber": node}
        body = mbs.AddObject(eii.ObjectRigidBody2D(name=shaft.name, **data))
        bearing_elements.add_bearings(mbs, node, shaft, coordinates)
        return body
    body = mbs.CreateRigidBody(
        name=shaft.name,
        referencePosition=[x, y, z],
        referenceRotationMatrix=RotXYZ2RotationMatrix([a, b, 0.0]),
        inertia=RigidBodyInertia(mass=shaft.mass, inertiaTensor=np.diag([shaft.transverse] * 2 + [shaft.inertia])),
        nodeType=exu.NodeType.RotationRxyz,
    )
    if coordinates is Coordinates.JOINT:
        axis = list(shaft.offset.axis)
        mbs.CreateRevoluteJoint(itemNumbers=[ground, body], position=[x, y, z], axis=axis, useGlobalFrame=True)
    else:
        bearing_elements.add_bearings(mbs, node_of(mbs, body), shaft, coordinates)
    return body


def spin_marker(mbs, body: int, place: int) -> int:
    """Marker on a body's spin."""
    return mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node_of(mbs, body), coordinate=place))


def add_rotor(mbs, gearbox: Gearbox, body: int, coordinates: Coordinates, name: str) -> int | None:
    """The rotor behind a shaft's coupling, if it has one."""
    coupling = next(shaft for shaft in gearbox.shafts if shaft.name == name).coupling
    if coupling is None:
        return None
    node = mbs.AddNode(eii.Node1D(name=f"{name} rotor", referenceCoordinates=[0.0]))
    data = {"inertia": coupling.inertia, "nodeNumber": node}
    rotor = mbs.AddObject(eii.ObjectRotationalMass1D(name=f"{name} rotor", **data))
    markers = [spin_marker(mbs, body, coordinates.spin_index), spin_marker(mbs, rotor, 0)]
    spring = eii.CoordinateSpringDamper(
        name=f"{name} coupling", markerNumbers=markers, stiffness=coupling.torsion, damping=coupling.damping
    )
    mbs.AddObject(spring)
    return rotor
