"""The gear contact in Exudyn: one ObjectGenericODE2 on the nodes of both gears, one user function, one kernel call."""

from functools import partial
from math import hypot

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.misc.extensionRegistry import extends, install

from exugear.divergence import stopped
from exugear.force import MeshForce
from exugear.kernels import PLANAR, SPATIAL, SPIN, kernel_of
from exugear.kinematics import reference_line, rotational_frame, spatial_frame
from exugear.native import native
from exugear.recorder import Recorder
from exugear.ring import RingPair
from fem.gear import GearPair, require
from fem.units import mm

#: For derivatives by coordinates [m, rad] and velocities [m/s, rad/s]. Exudyn's own differences move an angle by 1e-7
#: of itself, which after a thousand revolutions is more than any mesh deflects.
NUDGE, NUDGE_T = 1e-9, 1e-3


def CreateGearContact(
    mbs,
    name: str = "",
    itemNumbers=(None, None),
    pair: GearPair | RingPair = None,  # type: ignore[assignment]
    force: MeshForce = None,  # type: ignore[assignment]
    localPositions=((0, 0, 0), (0, 0, 0)),
    phase: float = 0.0,
    direction: int = 1,
    recorder: Recorder | None = None,
):
    """Contact of a gear pair between two bodies that turn about z; also mbs.CreateGearContact.

    itemNumbers      pinion and wheel: rigid bodies on Rxyz nodes, ObjectRigidBody2D or ObjectRotationalMass1D (positive
                     about +z, at its referencePosition), in any mixture; with two ObjectRotationalMass1D a third one
                     may carry both (planet carrier)
    pair, force      `fem.GearPair` or `RingPair`, and `MeshForce`
    localPositions   gear centres on the bodies' z axes [m]
    phase            phase [1] in the reference configuration, where the driving flanks just touch (deflection 0)
    direction        +1: the pinion drives counter-clockwise (positive deflection); -1: clockwise
    recorder         `Recorder` of what the contact does

    Centre distance, misalignment and axial offset follow from the bodies as they move; where the force has such an axis
    it is looked up. Helical gears push along their axes, and every force acts at the centroid that the map gives.

    Returns the number of the ObjectGenericODE2. Raises ValueError for bodies that cannot carry a gear, and a reference
    distance that is not the pair's. A solve that leaves the map's range stops and says so.
    """
    require(isinstance(pair, GearPair | RingPair), f"pair must be a fem.GearPair, got {type(pair).__name__}")
    require(isinstance(force, MeshForce), f"force must be an exugear.MeshForce, got {type(force).__name__}")
    require(direction in (1, -1), f"direction must be +1 or -1, got {direction}")
    require(np.isfinite(phase), f"phase must be finite, a share of a pitch, got {phase}")
    require(len(itemNumbers) in (2, 3), f"itemNumbers must be [pinion, wheel] (and a carrier), got {itemNumbers}")
    kinds = tuple(kind_of(mbs, item) for item in itemNumbers)
    _check_kinds(kinds, force)
    frame = frame_of(mbs, itemNumbers, pair, localPositions, phase=phase, direction=direction)
    return add_contact(mbs, name, itemNumbers, kernel_of(kinds), force, frame, recorder or Recorder())


def add_contact(mbs, name: str, items, kernel, force: MeshForce, frame: np.ndarray, recorder: Recorder) -> int:
    """The contact as ObjectGenericODE2 on the nodes of its bodies."""
    number = add_forces(mbs, name, items, kernel, force.law, frame, recorder)
    addresses = force.law.ctypes.data, frame.ctypes.data
    mbs.variables[contact_key(number)] = partial(kernel, *addresses)
    return number


def add_forces(mbs, name: str, items, kernel, law: np.ndarray, frame: np.ndarray, recorder: Recorder) -> int:
    """What a kernel gives as ObjectGenericODE2 on the nodes of its bodies; called without Python where that works."""
    function, jacobian = user_functions(kernel, law, frame, recorder)
    nodes = [node_of(mbs, item) for item in items]
    addresses = law.ctypes.data, frame.ctypes.data, recorder.header.ctypes.data
    function = native(function, kernel, addresses, sum(len(mbs.GetNode(n)["referenceCoordinates"]) for n in nodes))
    item = eii.ObjectGenericODE2(
        name=name, nodeNumbers=nodes, forceUserFunction=function, jacobianUserFunction=jacobian
    )
    item.visualization["show"] = False
    return mbs.AddObject(item)


def contact_key(number: int) -> str:
    """Under which mbs.variables keeps the kernel of a contact, for its sensors."""
    return f"gear contact {number}"


def _check_kinds(kinds: tuple[str, ...], force: MeshForce) -> None:
    spins = set(kinds) == {SPIN}
    carried = "a third body carries ObjectRotationalMass1D alone; bodies that move know where they are: leave it out"
    require(len(kinds) == 2 or spins, carried)
    fixed = f"bodies that only spin need a force without offsets, got {list(force.offsets)}; take force.at(...)"
    require(not (spins and force.offsets), fixed)


def frame_of(mbs, items, pair, positions, *, phase: float, direction: int) -> np.ndarray:
    """What the kernels know of the gears on two bodies; ValueError where the bodies and the pair do not fit."""
    if all(kind_of(mbs, item) == SPIN for item in items):
        return rotational_frame(pair, phase, direction)
    axial = [axial_of(position) for position in positions]
    reference = [reference_of(mbs, item) for item in items]
    check_distance(pair, reference_line(axial, reference))
    return spatial_frame(pair, phase, direction, axial, reference)


def reference_of(mbs, item) -> list[float]:
    """Reference coordinates (6) of a body."""
    kind, body = kind_of(mbs, item), mbs.GetObject(item)
    if kind == SPIN:
        return [*body["referencePosition"], 0.0, 0.0, 0.0]
    coordinates = list(mbs.GetNode(body["nodeNumber"])["referenceCoordinates"])
    return coordinates if kind == SPATIAL else [*coordinates[:2], 0.0, 0.0, 0.0, coordinates[2]]


def kind_of(mbs, item) -> str:
    """How the body moves; ValueError where a gear cannot live on it."""
    require(item is not None, "itemNumbers must name two bodies, got None; pass [pinion, wheel]")
    body = mbs.GetObject(item)
    require("nodeNumber" in body, f"itemNumbers must be bodies with one node, got {body['objectType']}")
    kind = str(mbs.GetNode(body["nodeNumber"])["nodeType"])
    if kind == "1D" and "Rotational" in str(body["objectType"]):
        return SPIN
    if "Rxyz" in kind:
        return SPATIAL
    remedy = "use nodeType=exu.NodeType.RotationRxyz in CreateRigidBody, or ObjectRotationalMass1D on Node1D"
    require("2D" in kind and "Rigid" in kind, f"gears cannot live on a {kind} ({body['objectType']}); {remedy}")
    return PLANAR


def node_of(mbs, item):
    """The node that carries the body's coordinates."""
    return mbs.GetObject(item)["nodeNumber"]


def axial_of(position) -> float:
    x, y, z = position
    require(x == 0 and y == 0, f"localPositions must lie on the body's z axis, got {position}; move the body instead")
    return float(z)


def check_distance(pair, line: np.ndarray) -> None:
    distance, shift = hypot(line[0], line[1]), line[2]
    a = abs(pair.a)
    agree = abs(distance - a) < 1e-6 * a
    remedy = f"the pair's a = {a / mm:.6g} mm; move the bodies or change a"
    require(agree, f"reference distance of the gear centres, {distance / mm:.6g} mm, must be {remedy}")
    apart = f"gear centres are {shift / mm:g} mm apart along z (face width {pair.b / mm:g} mm)"
    require(abs(shift) < pair.b, f"{apart}; move the bodies or localPositions")


def user_functions(kernel, law: np.ndarray, frame: np.ndarray, recorder: Recorder):
    """Force and Jacobian that Exudyn calls; the force owns the arrays whose addresses it hands over."""
    nobody = np.zeros_like(recorder.header)
    one, two, three, none = (x.ctypes.data for x in (law, frame, recorder.header, nobody))

    def gear_contact(mbs, t, item, q, q_t):
        try:
            return kernel(one, two, three, t, *q, *q_t)
        except ValueError as error:
            raise RuntimeError(stopped(*error.args)) from None

    def gear_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        n, state = len(q), np.array([*q, *q_t])
        jacobian = np.zeros((n, n))
        for i in range(2 * n):
            nudge = np.zeros(2 * n)
            nudge[i] = NUDGE if i < n else NUDGE_T
            try:
                ahead, behind = (np.array(kernel(one, two, none, t, *x)) for x in (state + nudge, state - nudge))
            except ValueError as error:
                raise RuntimeError(stopped(*error.args)) from None
            jacobian[:, i % n] -= (factor if i < n else factor_t) * (ahead - behind) / (2 * nudge[i])
        return jacobian

    gear_contact.arrays = (law, frame, recorder, nobody)  # type: ignore[attr-defined]
    return gear_contact, gear_jacobian


extends(exu.MainSystem, "CreateGearContact")(CreateGearContact)
install()
