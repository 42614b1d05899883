"""Shafts as Exudyn's bodies on bearings or joints, rotors behind their couplings, drive and load."""

from collections.abc import Mapping
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.rigidBodyUtilities import RigidBodyInertia, RotXYZ2RotationMatrix

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.shaft import Coupling, Shaft
from exugear.mesh_force.kernel_records import address_of
from exugear.multibody.bearings_and_drags import add_bearings, add_drags
from exugear.multibody.coupling_kernels import coupling_kernel, coupling_record
from exugear.multibody.exudyn_objects import node_of
from exugear.multibody.native import direct_or_portable
from exugear.planning.coordinates import Coordinates, pose


def add_body(mbs, ground: int, gearbox: Gearbox, shaft: Shaft, coordinates: Coordinates) -> int:
    """Add a shaft as a body with its bearings or its joint, and with its drags; returns the number of the body."""
    body = _add_supported_body(mbs, ground, gearbox, shaft, coordinates)
    add_drags(mbs, node_of(mbs, body), shaft, coordinates)
    return body


def _add_supported_body(mbs, ground: int, gearbox: Gearbox, shaft: Shaft, coordinates: Coordinates) -> int:
    """Add a shaft as a body with its bearings or its joint."""
    x, y, z, a, b, _ = pose(gearbox, shaft)
    if coordinates is Coordinates.SPIN:
        node = mbs.AddNode(eii.Node1D(name=shaft.name, referenceCoordinates=[0.0]))
        data = {"inertia": shaft.inertia, "nodeNumber": node, "referencePosition": [x, y, z]}
        return mbs.AddObject(eii.ObjectRotationalMass1D(name=shaft.name, **data))
    if coordinates is Coordinates.PLANAR:
        node = mbs.AddNode(eii.NodeRigidBody2D(name=shaft.name, referenceCoordinates=[x, y, 0.0]))
        data = {"mass": shaft.mass, "inertia": shaft.inertia, "nodeNumber": node}
        body = mbs.AddObject(eii.ObjectRigidBody2D(name=shaft.name, **data))
        add_bearings(mbs, node, shaft, coordinates)
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
        add_bearings(mbs, node_of(mbs, body), shaft, coordinates)
    return body


def spin_marker(mbs, body: int, spin_index: int) -> int:
    """Marker on the spin of a body, by its index among the body's coordinates."""
    return mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node_of(mbs, body), coordinate=spin_index))


def add_rotors(mbs, shaft: Shaft, body: int, coordinates: Coordinates) -> dict[str, int]:
    """Add the rotors behind the couplings of a shaft with their springs; returns their numbers by name."""
    rotors: dict[str, int] = {}
    for rotor in shaft.rotors:
        node = mbs.AddNode(eii.Node1D(name=rotor.name, referenceCoordinates=[0.0]))
        data = {"inertia": rotor.coupling.inertia, "nodeNumber": node}
        number = mbs.AddObject(eii.ObjectRotationalMass1D(name=rotor.name, **data))
        inner = spin_marker(mbs, rotors[rotor.body], 0) if rotor.body in rotors else None
        inner = spin_marker(mbs, body, coordinates.spin_index) if inner is None else inner
        k, c, markers = rotor.coupling.torsion, rotor.coupling.damping, [inner, spin_marker(mbs, number, 0)]
        spring = eii.CoordinateSpringDamper(name=rotor.spring, markerNumbers=markers, stiffness=k, damping=c)
        mbs.AddObject(spring)
        rotors[rotor.name] = number
    return rotors


def end_marker(mbs, shaft: Shaft, body: int, rotors: Mapping[str, int], coordinates: Coordinates) -> int:
    """Marker on the spin of the body that drive or load of a shaft act on (`Shaft.end`)."""
    if shaft.end in rotors:
        return spin_marker(mbs, rotors[shaft.end], 0)
    return spin_marker(mbs, body, coordinates.spin_index)


def add_drive_and_load(mbs, gearbox: Gearbox, end_markers: Mapping[str, int]) -> tuple[int, int]:
    """Add the constraint on the driving and the load on the driven shaft, by their markers.

    Returns the numbers of the constraint and of the load.
    """
    fixed = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
    markers = [fixed, end_markers[gearbox.driving.name]]
    drive = mbs.AddObject(eii.CoordinateConstraint(name="drive", markerNumbers=markers))
    return drive, mbs.AddLoad(eii.LoadCoordinate(name="load", markerNumber=end_markers[gearbox.driven.name], load=0.0))


def add_driven_coupling(mbs, name: str, nodes: tuple[Any, Any], coupling: Coupling, motion: np.record) -> None:
    """Add a coupling between the nodes of a rotor with an imposed motion and of the body that bears the coupling."""
    record, n = coupling_record(coupling, motion), len(mbs.GetNode(nodes[1])["referenceCoordinates"])
    kernel, address = coupling_kernel(n), address_of(record)

    def driven_coupling(mbs, t, item, q, q_t):
        return kernel(address, t, *q, *q_t)

    def coupling_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        jacobian = np.zeros((n + 1, n + 1))
        jacobian[n, n] = factor * record.torsion + factor_t * record.damping
        return jacobian

    vars(driven_coupling)["owned"] = record
    function = direct_or_portable(driven_coupling, kernel, (address,), n + 1)
    item = eii.ObjectGenericODE2(
        name=name, nodeNumbers=list(nodes), forceUserFunction=function, jacobianUserFunction=coupling_jacobian
    )
    item.visualization["show"] = False
    mbs.AddObject(item)
