"""The gear contact in Exudyn: an ObjectGenericODE2 on the nodes of two gears, with forces by a compiled kernel.

`CreateGearContact` has more than seven arguments, and defaults for those that it requires: it follows the Create
functions of Exudyn.
"""

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Annotated, Any, NamedTuple

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.misc.extensionRegistry import extends, install

from exugear.contact.contact_frame import frame_between
from exugear.contact.reference_configuration import is_rotated, rotational_frame
from exugear.contact.rotation import SPIN, BodyKind
from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.mesh_friction import MeshFriction
from exugear.mesh_force.ring_pair import RingPair
from exugear.multibody.addresses import address_of
from exugear.multibody.contact_kernels import kernel_of, reads_step_ends
from exugear.multibody.contact_tangent import ContactTangent, HeldContact, contact_tangent, spring_matrix
from exugear.multibody.direct_call import direct
from exugear.multibody.elastic_rings import RingInMesh
from exugear.multibody.exudyn_objects import check_spin_axes, gear_body, kind_of, node_of
from exugear.multibody.integrator_steps import contact_state
from exugear.multibody.recorder import Recorder
from exugear.multibody.step_ends import StepEnds, keep_step_ends
from exugear.multibody.user_function_errors import errors_kept, stopped
from fem.pair.pair import GearPair
from fem.support.arguments import REQUIRED, checked
from fem.support.validation import require, require_finite

#: Key of mbs.variables under which a system keeps its contacts; name of the user function of an ObjectGenericODE2.
CONTACTS, FUNCTION = "gear contacts", "forceUserFunction"
#: Interval between two samples at which each time of a run is that of the first sample [s].
NO_SAMPLE_INTERVAL = 1e300
#: What the kernel of a contact takes: force table, frame, state, and friction or None.
Records = tuple[np.record, np.record, np.record, np.record | None]


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
    phase            phase of the mesh in the reference configuration, as share of a pitch, in pitches of a law over
                     several. There the driving flanks just touch: deflection 0
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
    check_kinds(mbs, itemNumbers, force)
    nodes = {int(node_of(mbs, item)) for item in itemNumbers}
    require(len(nodes) == len(itemNumbers), f"itemNumbers must be bodies with a node each, got {itemNumbers}")
    frame = frame_of(mbs, itemNumbers, pair, localPositions, localAxes, phase=phase, direction=direction)
    check_turns(frame, pair, force=force.pitches, friction=friction.pitches if friction else 1)
    records = force.table, frame, contact_state(), friction.table(pair) if friction else None
    return add_contact(mbs, name, itemNumbers, records, recorder or Recorder(), pair)


def check_mesh(pair, force, phase: float, direction: int) -> None:
    """ValueError unless a contact can have this pair, force law, phase and direction."""
    require(isinstance(pair, GearPair | RingPair), f"pair must be a fem.GearPair, got {type(pair).__name__}")
    require(isinstance(force, MeshForce), f"force must be an exugear.MeshForce, got {type(force).__name__}")
    require(direction in (1, -1), f"direction must be +1 or -1, got {direction}")
    require_finite("phase", phase, "pass a share of a pitch")


def check_kinds(mbs, items, force: MeshForce) -> None:
    """ValueError where bodies cannot carry gears of such a force law."""
    kinds = tuple(kind_of(mbs, item) for item in items)
    spins = set(kinds) == {SPIN}
    names = [kind.name for kind in kinds]
    carrier = f"a third body carries ObjectRotationalMass1D alone, got {names}; for bodies that move leave it out"
    require(len(kinds) == 2 or spins, carrier)
    fixed = f"bodies that only spin need a force without offsets, got {list(force.offsets)}; take force.at(...)"
    require(not (spins and force.offsets), fixed)


def check_turns(frame: np.record, pair: GearPair | RingPair, **laws: int) -> None:
    """ValueError where a law runs over more pitches than the attitude of the pinion's body can tell apart.

    laws   numbers of pitches by the argument that has them
    """
    z = pair.pinion.z
    unknown = f"the turns of these bodies are not counted, only which of its {z} teeth the pinion has in mesh"
    remedy = "take bodies on Rxyz nodes that turn about global z, or that move in the plane, or a law over one pitch"
    for name, pitches in laws.items():
        known = z % pitches == 0 or not is_rotated(frame)
        require(known, f"{name} must run over a divisor of {z} pitches, got {pitches}: {unknown}; {remedy}")


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
    mbs,
    name: str,
    items,
    records: Records,
    recorder: Recorder,
    pair: GearPair | RingPair,
    ring: RingInMesh | None = None,
    *,
    orbits: bool = False,
) -> int:
    """The contact as ObjectGenericODE2 on the nodes of its bodies; the system keeps its records (`records_of`).

    ring     elastic ring, whose amplitudes follow the coordinates of the bodies
    orbits   whether it orbits, as that of a planet on an elastic pin, which turns it away from its share in the matrix
             of Newton's iteration (`exugear.multibody.step_ends`)
    """
    contacts = contacts_of(mbs)
    shared = [i for i, contact in contacts.items() if contact.recorder is recorder]
    remedy = "each contact needs a separate Recorder"
    require(not shared, f"recorder records the gear contact {shared} already; {remedy}")
    nodes = [*(node_of(mbs, item) for item in items), *([ring.node] if ring else [])]
    kinds = tuple(kind_of(mbs, item) for item in items)
    kernel = kernel_of(kinds, records[1], rubs=records[3] is not None)
    ends = None
    if orbits and reads_step_ends(kinds, records[1]):
        ends = StepEnds(sum(len(mbs.GetNode(node)["referenceCoordinates"]) for node in nodes))
        records[2]["ends"] = ends.address
        keep_step_ends(mbs, [ends])
    functions = user_functions(mbs, nodes, ContactCopy(kernel, records, kinds), records, (recorder, ring, ends))
    item = eii.ObjectGenericODE2(name=name, nodeNumbers=nodes, **functions)
    item.visualization["show"] = False
    number = mbs.AddObject(item)
    if ends is not None:
        ends.item = number
    contact = StoredContact(kernel, records, kinds, recorder, mbs.GetObject(number)[FUNCTION], pair, ring)
    mbs.variables[CONTACTS] = [*contacts.values(), contact]
    return number


def user_functions(
    mbs, nodes, copy: "ContactCopy", records: Records, beside: tuple[Recorder, RingInMesh | None, StepEnds | None]
) -> dict[str, Callable]:
    """Force and Jacobian of a contact for Exudyn, by their names; the former called without Python where that works.

    copy     of the contact, for its Jacobian
    beside   recorder, elastic ring and step ends, which live as long as the functions
    """
    (table, frame, state, _), (recorder, _, ends) = records, beside
    kernel, all_records = copy.kernel, (*records, recorder.header)
    evaluate = partial(kernel, *map(address_of, all_records))
    sizes = [len(mbs.GetNode(node)["referenceCoordinates"]) for node in nodes]

    def gear_contact(mbs, t, item, q, q_t):
        try:
            return evaluate(t, *q, *q_t)
        except ValueError as error:
            raise stopped(table, frame, error) from None

    def share_of(t, q, q_t, factors):
        try:
            return copy.spring_matrix(t, q, q_t, factors)
        except ValueError as error:
            raise stopped(table, frame, error) from None

    def gear_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        if ends is not None:
            return ends.matrix_for_newton(t, q, q_t, (factor, factor_t))
        matrix = share_of(t, q, q_t, (factor, factor_t))
        if state["steps"]["duration"]:
            note_matrix(state, frame, matrix, sizes)
        return matrix

    if ends is not None:
        ends.share_of = share_of

    function = direct(errors_kept(mbs, gear_contact), kernel, all_records, sum(sizes), pointed_to=beside)
    return {FUNCTION: function, "jacobianUserFunction": errors_kept(mbs, gear_jacobian)}


class ContactCopy:
    """A contact with a copy of its state, outside the steps of the integrator: looking at it changes nothing.

    recorder   whose only sample is that of the last evaluation
    records    that the kernel takes, with the copy of the state
    forces     function (t, *coordinates, *velocities) -> generalized forces
    """

    def __init__(self, kernel, records: Records, kinds: tuple[BodyKind, ...]):
        table, frame, self.state, friction = records
        self.kernel, self.kinds = kernel, kinds
        self.recorder, self.copied = Recorder(), np.zeros(1, self.state.dtype)
        self.bytes_of_state, self.bytes_of_copy = np.frombuffer(self.state, np.uint8), self.copied.view(np.uint8)
        self.recorder.start(NO_SAMPLE_INTERVAL, 1, power=True)
        self.records = table, frame, self.copied[0], friction
        self.forces = partial(kernel, *map(address_of, (*self.records, self.recorder.header)))
        self.update()

    def update(self) -> None:
        """Copy the present state of the contact."""
        self.bytes_of_copy[:] = self.bytes_of_state
        self.copied["steps"]["duration"], self.copied["ends"] = 0.0, 0

    @cached_property
    def held(self) -> HeldContact:
        """The copy with its law replaced."""
        return HeldContact(self.kernel, self.records, self.kinds)

    def spring_matrix(self, t: float, q, q_t, factors: tuple[float, float]) -> np.ndarray:
        """`exugear.multibody.contact_tangent.spring_matrix` of the contact in its present state."""
        self.update()
        return spring_matrix(self.held, t, q, q_t, factors)

    def tangent(self, q, q_t) -> ContactTangent:
        """The contact linearized at coordinates and velocities (n,)."""
        self.update()
        try:
            return contact_tangent(self.held, q, q_t)
        finally:
            self.update()


class StoredContact(NamedTuple):
    """What a system keeps of a contact.

    kernel     of the contact (`exugear.multibody.contact_kernels.kernel_of`)
    records    that the kernel takes
    kinds      of its bodies
    recorder   of the contact
    function   that Exudyn calls, as mbs.GetObject returns it
    pair       of the contact
    ring       elastic one whose amplitudes it shares, or None
    """

    kernel: Any
    records: Records
    kinds: tuple[BodyKind, ...]
    recorder: Recorder
    function: Any
    pair: GearPair | RingPair
    ring: RingInMesh | None


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


def records_of(mbs, number: int) -> Records:
    """Records that the kernel of a contact takes."""
    return stored_contact(mbs, number).records


def state_of(mbs, number: int) -> np.record:
    """State of a contact (`exugear.multibody.integrator_steps.CONTACT_STATE`), which a run changes."""
    return records_of(mbs, number)[2]


def note_matrix(state: np.record, frame: np.record, matrix: np.ndarray, sizes: Sequence[int]) -> None:
    """Note the share of the contact in the matrix of Newton's iteration, for its first guesses.

    sizes   numbers of coordinates of pinion and wheel, and of their carrier
    """
    spin, gear = (sizes[0] - 1, "pinion") if state["imposed"][1] else (sizes[0] + sizes[1] - 1, "wheel")
    state["steps"]["matrix"] = matrix[spin, spin] / frame[gear]["r_b"] ** 2


extends(exu.MainSystem, "CreateGearContact")(CreateGearContact)
install()
