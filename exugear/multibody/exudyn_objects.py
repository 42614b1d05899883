"""Objects of an Exudyn system, by their numbers: the bodies that carry gears, and their nodes."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any, NamedTuple, SupportsIndex

import exudyn as exu
import numpy as np

from exugear.contact.contact_frame import GearBody
from exugear.contact.rotation import PARAMETERS, PLANAR, ROTATION_VECTOR, SPATIAL, SPIN, BodyKind
from fem.support.validation import require

#: Exudyn's class of a system.
MainSystem = exu.MainSystem
INITIAL, CURRENT = exu.ConfigurationType.Initial, exu.ConfigurationType.Current
#: Distance of a gear's centre from its axis that counts as rounding [m].
OFF_AXIS = 1e-9
#: Rounding of components of a unit vector.
ROUNDING = 1e-9
#: Kinds of bodies by Exudyn's types of their nodes, and what the types of objects on these must contain.
BODIES = {
    "1D": ("Rotational", SPIN),
    "RigidBody2D": ("", PLANAR),
    "RigidBodyRxyz": ("", SPATIAL),
    "RigidBodyEP": ("", PARAMETERS),
    "RigidBodyRotVecLG": ("", ROTATION_VECTOR),
}


class _Silence:
    """Exudyn's console output, which all threads share: off while any of them wants it to be."""

    lock, wanted, before = Lock(), 0, True

    @classmethod
    def begin(cls) -> None:
        with cls.lock:
            if not cls.wanted:
                cls.before = exu.config.printToConsole
            cls.wanted += 1
            exu.config.printToConsole = False

    @classmethod
    def end(cls) -> None:
        with cls.lock:
            cls.wanted -= 1
            if not cls.wanted:
                exu.config.printToConsole = cls.before


@contextmanager
def quiet() -> Iterator[None]:
    """Switch Exudyn's console output off, and restore it once no thread wants it off any more."""
    _Silence.begin()
    try:
        yield
    finally:
        _Silence.end()


class SystemState(NamedTuple):
    """State of a system: its vectors by Exudyn's kinds of coordinates.

    coordinates, velocities, accelerations   of second-order equations (ODE2)
    first_order                              coordinates of first-order equations (ODE1)
    multipliers                              of constraints (algebraic equations, AE)
    data                                     coordinates of data nodes
    """

    coordinates: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray
    first_order: np.ndarray
    multipliers: np.ndarray
    data: np.ndarray


#: Exudyn's names of the coordinates in a `SystemState`, behind Get and Set.
COORDINATES = (
    "ODE2Coordinates",
    "ODE2Coordinates_t",
    "ODE2Coordinates_tt",
    "ODE1Coordinates",
    "AECoordinates",
    "DataCoordinates",
)


def state_of_system(mbs, configuration) -> SystemState:
    """State of a system in a configuration."""
    return SystemState(*(getattr(mbs.systemData, f"Get{name}")(configuration) for name in COORDINATES))


def set_state_of_system(mbs, state: SystemState, configuration) -> None:
    """Put a system into a state; multipliers of constraints that are new are 0."""
    number = mbs.systemData.GetAECoordinates(configuration).size
    state = state._replace(multipliers=np.append(state.multipliers, np.zeros(number))[:number])
    for name, vector_of_state in zip(COORDINATES, state, strict=True):
        getattr(mbs.systemData, f"Set{name}")(vector_of_state, configuration)


def assemble_in_state(mbs) -> None:
    """Assemble a system without a change of its states."""
    states = {configuration: state_of_system(mbs, configuration) for configuration in (INITIAL, CURRENT)}
    mbs.Assemble()
    for configuration, state in states.items():
        set_state_of_system(mbs, state, configuration)


@contextmanager
def current_state(mbs) -> Iterator[None]:
    """Restore the current state of a system, which Exudyn's linearization replaces by the initial one."""
    state, time = state_of_system(mbs, CURRENT), mbs.systemData.GetTime(CURRENT)
    try:
        with quiet():
            yield
    finally:
        set_state_of_system(mbs, state, CURRENT)
        mbs.systemData.SetTime(time, CURRENT)


def object_of(mbs, name: str, item: SupportsIndex, **options) -> dict[str, Any]:
    """Exudyn's dictionary of an object; ValueError, with the argument's name, for a number without an object."""
    known = mbs.systemData.NumberOfObjects()
    is_number = isinstance(item, SupportsIndex) and 0 <= int(item) < known
    require(is_number, f"{name} must be numbers of objects below {known}, as Exudyn gave them, got {str(item)[:80]}")
    return mbs.GetObject(item, **options)


def gear_body(mbs, item, position, axis) -> GearBody:
    """A body with the centre and the axis of its gear; ValueError where the body cannot carry a gear there."""
    kind, centre, z = kind_of(mbs, item), vector("localPositions", position), vector("localAxes", axis)
    require(bool(z.any()), f"localAxes must not be the zero vector, got {axis}; pass [0, 0, 1]")
    z = z / np.linalg.norm(z)
    flat = f"localAxes of a {kind.name} body must be [0, 0, 1], got {axis}; use CreateRigidBody for other axes"
    require(not kind.turns_about_z or z[2] == 1, flat)
    off = f"localPositions must lie on the gear's axis {axis} of the body, got {position}; move the body instead"
    require(bool(np.linalg.norm(centre - centre @ z * z) < OFF_AXIS), off)
    return GearBody(kind, reference_of(mbs, item), z, centre)


def check_spin_axes(mbs, items) -> None:
    """ValueError unless bodies that only spin turn about the axis of the contact: global z beside bodies that move."""
    spins = [item for item in items if kind_of(mbs, item) == SPIN]
    axes = [np.array(mbs.GetObject(item)["referenceRotation"])[:, 2] for item in spins]
    axis = axes[0] if len(spins) == len(items) else np.array([0.0, 0.0, 1.0])
    aligned = not spins or np.allclose(axes, axis, rtol=0, atol=ROUNDING)
    remedy = "leave out their referenceRotation, or use CreateRigidBody for other axes"
    require(aligned, f"itemNumbers: ObjectRotationalMass1D {spins} must turn about the same axis; {remedy}")


def vector(name: str, value) -> np.ndarray:
    """(3,) array; ValueError unless the value is a finite vector."""
    three = np.size(value) == 3 and np.ndim(value) == 1
    require(three and bool(np.isfinite(value).all()), f"{name} must be x, y, z for each gear, got {value}")
    return np.array(value, float)


def reference_of(mbs, item) -> np.ndarray:
    """Reference coordinates (6, or 7 with Euler parameters) of a body."""
    components, reference = kind_of(mbs, item).components, np.zeros(7)
    reference[[*components]] = mbs.GetNode(node_of(mbs, item))["referenceCoordinates"]
    reference[:3] += mbs.GetObject(item).get("referencePosition", 0.0)
    return reference[: max(6, len(components))]


def kind_of(mbs, item) -> BodyKind:
    """Kind of a body, by its motion; ValueError for a body that cannot carry a gear."""
    require(item is not None, "itemNumbers must name two bodies, got None; pass [pinion, wheel]")
    body = object_of(mbs, "itemNumbers", item)
    bodies = f"itemNumbers must be bodies with one node, got {body['objectType']}; use CreateRigidBody"
    require("nodeNumber" in body or len(body.get("nodeNumbers", ())) == 1, bodies)
    node = str(mbs.GetNode(node_of(mbs, item))["nodeType"])
    object_type, kind = BODIES.get(node, ("", None))
    remedy = "use CreateRigidBody, or ObjectRotationalMass1D on Node1D"
    if kind is None or object_type not in str(body["objectType"]):
        raise ValueError(f"gears cannot be carried by a {node} ({body['objectType']}); {remedy}")
    return kind


def node_of(mbs, item):
    """Number of the node with the body's coordinates."""
    body = mbs.GetObject(item)
    return body["nodeNumber"] if "nodeNumber" in body else body["nodeNumbers"][0]
