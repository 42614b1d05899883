"""Meshes between bodies in space: pairs, bodies, force laws, attitudes."""

from typing import NamedTuple

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.rigidBodyUtilities import RigidBodyInertia
from paper_gears import paper_gear
from scenes import K, paper_pair

import exugear
import fem
from exugear.contact.contact import contact_in_space, contact_of_spins
from exugear.contact.reference_configuration import rotational_frame, spatial_frame
from fem.units import deg, mm, um

BETA = 15 * deg
SPUR = paper_pair()
OFFSETS = {"a": SPUR.a + np.array([-40, 0, 60]) * um, "misalignment": np.array([-2e-4, -5e-5, 0, 1e-4, 2e-4])}


def helical_pair(hand: int = 1) -> fem.GearPair:
    """The paper's pair with helical teeth of its transverse section; hand +1: the pinion is right-hand."""
    sizes = {"m_n": 2.6 * mm * np.cos(BETA), "s_n": 3.78 * mm * np.cos(BETA)}
    gears = [paper_gear(beta=s * BETA, **sizes) for s in (hand, -hand)]
    return fem.GearPair(*gears, a=150 * mm)


PAIRS = {"spur": SPUR, "helical": helical_pair(), "ring": exugear.RingPair(paper_gear(z=57), -120, a=-84 * mm)}


def law_of(width: float = 20 * mm, k: float = K, tilts=None, **options) -> exugear.MeshForce:
    """A foundation of springs across the width, misaligned: F = k mean(max(deflection - misalignment z, 0))."""
    axial = (np.arange(400) + 0.5) / 400 * width - width / 2
    deflection = np.r_[0, np.geomspace(1e-3, 1, 60)] * 40 * um
    tilt = OFFSETS["misalignment"] if tilts is None else tilts
    depth = deflection[None, :] - np.abs(tilt[:, None]) * width / 2
    pressed = np.maximum(depth[..., None] - (tilt[:, None] * axial)[:, None, :], 0)
    force = k * pressed.mean(axis=-1)
    weight = np.maximum(pressed.sum(axis=-1), 1e-30)
    centroid = np.where(force > 0, (pressed * axial).sum(axis=-1) / weight, -np.sign(tilt)[:, None] * width / 2)
    depth, force, centroid = (
        np.broadcast_to(x[None, :, None], (3, tilt.size, 1, 61)) for x in (depth, force, centroid)
    )
    return exugear.MeshForce(
        [0.0], depth, force, centroid=centroid, offsets=OFFSETS | {"misalignment": tilt}, **options
    )


def two_helical_stages(bearing: exugear.Bearing, angles, *, hand: int = 1, backlash: float) -> exugear.Gearbox:
    """Equal helical stages, each shaft on two bearings at 0 and 100 mm; hand +1: the first pinion is right-hand.

    The force centroid lies beside mid-plane.
    """
    pair = helical_pair(hand)
    right, left, ends = pair.pinion, pair.wheel, {0.0: bearing, 100 * mm: bearing}
    gears = {"input": {30 * mm: right}, "middle": {30 * mm: left, 65 * mm: right}, "output": {65 * mm: left}}
    shafts = [exugear.Shaft(name, teeth | ends) for name, teeth in gears.items()]
    law = law_of(backlash=backlash, damping=2700.0)
    return exugear.Gearbox(
        [exugear.Stage(*shafts[i : i + 2], law, pair=pair, angle=angle) for i, angle in enumerate(angles)]
    )


def frame_in_space(pair, reference, phase: float = 0.0, direction: int = 1, axial=(0.0, 0.0), **values) -> np.record:
    """Frame of a mesh of Rxyz bodies with reference coordinates (2, 6); axial positions of the gears on them [m]."""
    return spatial_frame(pair, phase, direction, axial, reference, **values)


class Meshing(NamedTuple):
    """Deflection [m], mesh force [N], generalized forces, offsets and centroid as a recorder has them, energy [J]."""

    deflection: float
    force: float
    pinion: tuple
    wheel: tuple
    offsets: tuple
    centroid: float
    energy: float


def mesh_in_space(force: exugear.MeshForce, frame, *motion) -> Meshing:
    """Mesh forces on two Rxyz bodies with displacements q_1, q_2 and velocities v_1, v_2, (6,) each."""
    contact = contact_in_space(force.table.head, frame, *(tuple(map(float, x)) for x in motion))
    deflection, push = contact.motion.advance - contact.motion.opening, contact.push
    sides = contact.pinion, contact.wheel, contact.offsets, contact.centroid
    return Meshing(deflection, push.force, *sides, push.static.energy)


def mesh_of_spins(force: exugear.MeshForce, pair, phase: float, spins, speeds) -> tuple:
    """(deflection, force, torques) of two bodies that spin."""
    frame = rotational_frame(pair, phase, 1)
    contact = contact_of_spins(force.table.head, frame, *map(float, (*spins, *speeds)))
    return contact.motion.advance, contact.push.force, (contact.pinion, contact.wheel)


def friction_in_space(pair, force: exugear.MeshForce, friction: exugear.MeshFriction, frame, *motion) -> tuple:
    """Generalized forces (6) of the friction on two Rxyz bodies; their motion as that of `mesh_in_space`."""
    table, coordinates = friction.table(pair), (tuple(map(float, x)) for x in motion)
    sliding = contact_in_space(force.table.head, frame, *coordinates, table.head).friction
    return sliding.pinion, sliding.wheel


def friction_of_spins(pair, force, friction, phase: float, direction: int, spins, speeds) -> np.ndarray:
    """Torques of the friction on two bodies that spin."""
    frame, table = rotational_frame(pair, phase, direction), friction.table(pair)
    sliding = contact_of_spins(force.table.head, frame, *map(float, (*spins, *speeds)), table.head).friction
    return np.array([sliding.pinion, sliding.wheel])


def attitudes(pair, seed: int, tilt: float = 0.05):
    """Reference and displacements of two bodies in meshing but otherwise arbitrary attitudes, and velocities."""
    random = np.random.default_rng(seed)
    angle, shift = random.uniform(-3, 3), random.normal(size=3)
    reference = np.zeros((2, 6))
    reference[:, :3] = shift
    reference[1, :2] += pair.a * np.array([np.cos(angle), np.sin(angle)])
    displacement = np.r_[random.normal(size=3), random.normal(size=2) * tilt, 0.0]
    q = np.array([displacement, displacement]) + random.normal(size=(2, 6)) * [*[5 * um] * 3, *[2e-5] * 2, 0]
    q[0, 5] = random.uniform(-20, 20)
    q[1, 5] = -q[0, 5] * pair.pinion.r_b / pair.wheel.r_b + 4e-3 / pair.wheel.r_b
    return reference, q, random.normal(size=(2, 6)) * 1e-3


def bodies_of_kinds(mbs, kinds):
    """Two bodies of the paper's pair that are free to spin only."""
    fixed = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
    bodies = []
    for kind, x in zip(kinds, (0, SPUR.a), strict=True):
        if kind == "spin":
            node = mbs.AddNode(eii.Node1D(referenceCoordinates=[0]))
            body = eii.ObjectRotationalMass1D(inertia=1e-2, nodeNumber=node, referencePosition=[x, 0, 0])
            bodies.append(mbs.AddObject(body))
            continue
        if kind == "planar":
            node = mbs.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[x, 0, 0]))
            bodies.append(mbs.AddObject(eii.ObjectRigidBody2D(mass=3, inertia=1e-2, nodeNumber=node)))
        else:
            inertia = RigidBodyInertia(mass=3, inertiaTensor=np.diag([1e-2] * 3))
            types = {"nodeType": exu.NodeType.RotationRxyz, "inertia": inertia}
            bodies.append(mbs.CreateRigidBody(referencePosition=[x, 0, 0], **types))
            node = mbs.GetObject(bodies[-1])["nodeNumber"]
        for held in range(2 if kind == "planar" else 5):
            marker = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=held))
            mbs.AddObject(eii.CoordinateConstraint(markerNumbers=[fixed, marker]))
    return bodies
