"""The gear contact in Exudyn: an ObjectGenericODE2 on the nodes of two gears, with forces by a compiled kernel.

`CreateGearContact` has more than seven arguments, and defaults for those that it requires: it follows the Create
functions of Exudyn.
"""

from collections.abc import Sequence
from functools import partial
from typing import Annotated, Any, NamedTuple

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.misc.extensionRegistry import extends, install

from exugear.contact.contact_frame import frame_between
from exugear.contact.contact_kernels import SPIN, kernel_of
from exugear.contact.contact_records import contact_state, is_rotated, rotational_frame
from exugear.contact.difference_jacobian import jacobian
from exugear.contact.recorder import Recorder
from exugear.contact.rubbing_contact import rubbing_contact_of
from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.kernel_records import address_of
from exugear.mesh_force.mesh_friction import MeshFriction
from exugear.mesh_force.ring_pair import RingPair
from exugear.multibody.exudyn_objects import check_spin_axes, gear_body, kind_of, node_of
from exugear.multibody.native import direct_or_portable
from exugear.multibody.user_function_errors import errors_kept, stopped
from fem.pair.pair import GearPair
from fem.support.arguments import REQUIRED, checked
from fem.support.validation import require, require_finite

#: Steps of the difference Jacobian in coordinates [m, rad] and velocities [m/s, rad/s]. Exudyn's own differences would
#: change an angle by 1e-7 of its value: after a thousand revolutions more than any mesh deflects.
DIFFERENCE_STEPS = 1e-9, 1e-3
#: Key of mbs.variables under which a system keeps its contacts; name of the user function of an ObjectGenericODE2.
CONTACTS, FUNCTION = "gear contacts", "forceUserFunction"
#: Number of records that the kernel of a contact without friction takes.
FRICTIONLESS = 3


def check_friction(name: str, value) -> None:
    """ValueError unless the value is a `MeshFriction`."""
    kind = f"{name} must be an exugear.MeshFriction, got {type(value).__name__}"
    require(isinstance(value, MeshFriction), f"{kind}; make it with MeshFriction.of_pair")


@checked
def CreateGearContact(
    mbs: exu.MainSystem,
    name: str = "",
    itemNumbers: Sequence[Any] = (None, None),
    pair: GearPair | RingPair = REQUIRED,
    force: MeshForce = REQUIRED,
    localPositions: Sequence[Sequence[float]] = ((0, 0, 0), (0, 0, 0)),
    localAxes: Sequence[Sequence[float]] = ((0, 0, 1), (0, 0, 1)),
    phase: float = 0.0,
    direction: int = 1,
    recorder: Recorder | None = None,
    friction: Annotated[MeshFriction | None, check_friction] = None,
):
    """Create the contact of a gear pair between two bodies; also called as mbs.CreateGearContact(...).

    itemNumbers      [pinion, wheel]: rigid bodies, ObjectRigidBody2D or ObjectRotationalMass1D, in any mixture.
                     ObjectRigidBody2D and ObjectRotationalMass1D turn about global z; the latter lies at its
                     referencePosition, which does not matter between two of them. Two ObjectRotationalMass1D may be
                     followed by a third, the carrier on which their axes turn; bodies that move need none
    pair             `fem.GearPair`, or `RingPair` for a ring gear
    force            `MeshForce`, the force law of the mesh
    localPositions   centre of each gear on its body [m]; it must lie on the gear's axis
    localAxes        direction of each gear's axis on its body
    phase            phase of the mesh in the reference configuration, as share of a pitch. There the driving flanks
                     just touch: deflection 0
    direction        +1: the pinion drives counter-clockwise, so that its advance is a positive deflection; -1:
                     clockwise
    recorder         `Recorder` that takes samples of the contact
    friction         `MeshFriction` of the pair: Coulomb's friction between the teeth, of the static mesh force without
                     its damping. Its torques jump where teeth pass the pitch point, so that a mesh cycle needs about a
                     hundred steps

    The axes must be parallel within 0.05 rad. The z axis of the contact is global z where the gears' axes lie along it,
    else the pinion's axis in the reference configuration; the wheel's axis may point either way. The reference
    configuration is that of the bodies at this call: later changes of their reference coordinates do not count. Bodies
    on Rxyz nodes that turn about global z cost least. For shafts along global x give the bodies no reference rotation
    and pass localAxes=[[1, 0, 0], [1, 0, 0]], or use nodeType=RotationRotationVector: an Rxyz node is singular where
    its z axis points along global x.

    Centre distance, misalignment and axial offset follow from the motion of the bodies; a force law with such an axis
    is interpolated there. Helical gears push along their axes. Each force acts at the force centroid of the map.

    Returns the number of the ObjectGenericODE2. Raises ValueError for bodies that cannot carry a gear and for a
    reference distance that is not the pair's centre distance. A solve that leaves the range of the map raises
    RuntimeError with what to change.
    """
    check_mesh(pair, force, phase, direction)
    require(len(itemNumbers) in (2, 3), f"itemNumbers must be [pinion, wheel] (and a carrier), got {itemNumbers}")
    kinds = kinds_of(mbs, itemNumbers, force)
    nodes = {int(node_of(mbs, item)) for item in itemNumbers}
    require(len(nodes) == len(itemNumbers), f"itemNumbers must be bodies with a node each, got {itemNumbers}")
    frame = frame_of(mbs, itemNumbers, pair, localPositions, localAxes, phase=phase, direction=direction)
    kernel = (rubbing_contact_of if friction else kernel_of)(kinds, rotated=is_rotated(frame))
    records = force.table, frame, contact_state(), *([friction.table(pair)] if friction else [])
    return add_contact(mbs, name, itemNumbers, kernel, records, recorder or Recorder(), pair)


def check_mesh(pair, force, phase: float, direction: int) -> None:
    """ValueError unless a contact can have this pair, force law, phase and direction."""
    require(isinstance(pair, GearPair | RingPair), f"pair must be a fem.GearPair, got {type(pair).__name__}")
    require(isinstance(force, MeshForce), f"force must be an exugear.MeshForce, got {type(force).__name__}")
    require(direction in (1, -1), f"direction must be +1 or -1, got {direction}")
    require_finite("phase", phase, "pass a share of a pitch")


def kinds_of(mbs, items, force: MeshForce) -> tuple[str, ...]:
    """Kind of each body; ValueError where they cannot carry gears of such a force law."""
    kinds = tuple(kind_of(mbs, item) for item in items)
    spins = set(kinds) == {SPIN}
    carrier = f"a third body carries ObjectRotationalMass1D alone, got {list(kinds)}; for bodies that move leave it out"
    require(len(kinds) == 2 or spins, carrier)
    fixed = f"bodies that only spin need a force without offsets, got {list(force.offsets)}; take force.at(...)"
    require(not (spins and force.offsets), fixed)
    return kinds


def frame_of(mbs, items, pair, positions, axes, *, phase: float, direction: int) -> np.record:
    """The contact frame of a pair on two bodies; ValueError where the bodies and the pair do not fit."""
    for name, value in {"localPositions": positions, "localAxes": axes}.items():
        require(len(value) == 2, f"{name} must have two entries, [pinion, wheel], got {value}")
    pinion, wheel = (gear_body(mbs, *mounting) for mounting in zip(items[:2], positions, axes, strict=True))
    check_spin_axes(mbs, items)
    if all(kind_of(mbs, item) == SPIN for item in items):
        return rotational_frame(pair, phase, direction)
    return frame_between(pair, phase, direction, (pinion, wheel))


def add_contact(
    mbs, name: str, items, kernel, records: Sequence[np.record], recorder: Recorder, pair: GearPair | RingPair
) -> int:
    """The contact as ObjectGenericODE2 on the nodes of its bodies; the system keeps its records (`records_of`).

    records   arguments of the kernel: table of the mesh force, contact frame, contact state, and friction if it rubs
    """
    contacts = contacts_of(mbs)
    shared = [i for i, contact in contacts.items() if contact.recorder is recorder]
    remedy = "pass each contact a recorder of its own"
    require(not shared, f"recorder records the gear contact {shared} already; {remedy}")
    number = add_forces(mbs, name, items, kernel, records, recorder)
    evaluate, function = partial(kernel, *map(address_of, records)), mbs.GetObject(number)[FUNCTION]
    contact = StoredContact(evaluate, tuple(records), recorder, function, pair, rubs=len(records) > FRICTIONLESS)
    mbs.variables[CONTACTS] = [*contacts.values(), contact]
    return number


def add_forces(mbs, name: str, items, kernel, records: Sequence[np.record], recorder: Recorder | None = None) -> int:
    """Forces of a kernel as ObjectGenericODE2 on the nodes of its bodies; called without Python where that works."""
    nodes = [node_of(mbs, item) for item in items]
    sizes = [len(mbs.GetNode(node)["referenceCoordinates"]) for node in nodes]
    function, jacobian = user_functions(kernel, records, recorder, sizes[0])
    addresses = tuple(address_of(record) for record in (*records, *([recorder.header] if recorder else [])))
    function = direct_or_portable(errors_kept(mbs, function), kernel, addresses, sum(sizes))
    item = eii.ObjectGenericODE2(
        name=name, nodeNumbers=nodes, forceUserFunction=function, jacobianUserFunction=jacobian
    )
    item.visualization["show"] = False
    return mbs.AddObject(item)


class StoredContact(NamedTuple):
    """What a system keeps of a contact.

    kernel     of the contact, for its sensors: function of the address of a recorder's header, t, *q, *q_t
    records    that the kernel takes: force table, frame, state, and friction if the stage has it
    recorder   of the contact
    function   that Exudyn calls, as mbs.GetObject returns it
    pair       of the contact
    rubs       whether it has friction, of its own or by a further object
    """

    kernel: partial
    records: tuple[np.record, ...]
    recorder: Recorder
    function: Any
    pair: GearPair | RingPair
    rubs: bool


def contacts_of(mbs) -> dict[int, StoredContact]:
    """All gear contacts of a system by their object numbers.

    They are known by their functions: mbs.DeleteObject changes the numbers of objects, and mbs.Reset keeps
    mbs.variables.
    """
    contacts = {i: _contact_of_object(mbs, i) for i in range(mbs.systemData.NumberOfObjects())}
    return {i: contact for i, contact in contacts.items() if contact is not None}


def known_contacts(mbs) -> list[StoredContact]:
    """What a system keeps of its contacts, also of those that it had before a reset."""
    return dict(mbs.variables).get(CONTACTS, [])


def _contact_of_object(mbs, number: int) -> StoredContact | None:
    """What the system keeps of an object if it is a contact."""
    known = known_contacts(mbs)
    function = mbs.GetObject(number).get(FUNCTION) if known else None
    return next((contact for contact in known if contact.function == function), None)


def stored_contact(mbs, number: int) -> StoredContact:
    """What the system keeps of a contact; ValueError for another object."""
    in_system = 0 <= int(number) < mbs.systemData.NumberOfObjects()
    contact = _contact_of_object(mbs, int(number)) if in_system else None
    if contact is None:
        known = f"no contact that mbs.variables[{CONTACTS!r}] knows"
        raise ValueError(f"contact must be what CreateGearContact returned, got object {number}: {known}")
    return contact


def records_of(mbs, number: int) -> tuple[np.record, ...]:
    """Records that the kernel of a contact takes: force table, frame, state, and friction if the stage has it."""
    return stored_contact(mbs, number).records


def state_of(mbs, number: int) -> np.record:
    """State of a contact (`exugear.contact.contact_records.CONTACT_STATE`), which a run changes."""
    return records_of(mbs, number)[2]


def user_functions(kernel, records: Sequence[np.record], recorder: Recorder | None = None, first: int = 1):
    """Force and Jacobian for Exudyn; the force keeps the records alive whose addresses it passes to the kernel.

    records    arguments of the kernel; the first two are the table of the mesh force and the contact frame
    recorder   argument of the kernel behind the records, if it records: then the third record is the contact state
    first      number of coordinates of the first body

    The Jacobian evaluates a copy of the contact state, outside the steps of the integrator: without first guesses.
    """
    idle_recorder, (table, frame, state, *further) = Recorder(), records
    copy, present = np.zeros(1, state.dtype), np.frombuffer(state, np.uint8)
    silent_state = copy[0] if recorder else state
    addresses = tuple(map(address_of, records))
    recording = (*addresses, address_of(recorder.header)) if recorder else addresses
    idle = [idle_recorder.header] if recorder else []
    silent = tuple(map(address_of, (table, frame, silent_state, *further, *idle)))

    def gear_contact(mbs, t, item, q, q_t):
        try:
            return kernel(*recording, t, *q, *q_t)
        except ValueError as error:
            raise stopped(table, frame, error) from None

    def gear_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        copy.view(np.uint8)[:] = present
        if recorder:
            silent_state.steps.duration = 0.0
        try:
            matrix = jacobian(partial(kernel, *silent, t), q, q_t, (factor, factor_t), DIFFERENCE_STEPS)
        except ValueError as error:
            raise stopped(table, frame, error) from None
        if recorder and state.steps.duration:
            note_matrix(state, frame, matrix, first)
        return matrix

    vars(gear_contact)["owned"] = (*records, recorder, idle_recorder, silent_state)
    return gear_contact, gear_jacobian


def note_matrix(state: np.record, frame: np.record, matrix: np.ndarray, first: int) -> None:
    """Note the share of the contact in the matrix of Newton's iteration, for its first guesses."""
    imposed = bool(state.imposed[1])
    spin, gear = (first - 1, frame.pinion) if imposed else (len(matrix) - 1, frame.wheel)
    state.steps.matrix = matrix[spin, spin] / gear.r_b**2


extends(exu.MainSystem, "CreateGearContact")(CreateGearContact)
install()
