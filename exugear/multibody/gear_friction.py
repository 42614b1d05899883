"""Friction that is added to a gear contact: the former way, which `CreateGearContact(friction=)` replaces."""

import warnings
from collections.abc import Sequence
from typing import Annotated, Any

import exudyn as exu
import numpy as np
from exudyn.misc.extensionRegistry import extends, install

from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.mesh_friction import MeshFriction, require_same_pair
from exugear.mesh_force.ring_pair import RingPair
from exugear.multibody.contact_kernels import kernel_of
from exugear.multibody.exudyn_objects import kind_of, node_of
from exugear.multibody.gear_contact import (
    CONTACTS,
    FUNCTION,
    ContactCopy,
    StoredContact,
    check_friction,
    check_mesh,
    check_turns,
    contacts_of,
    frame_of,
    user_functions,
)
from fem.pair.pair import GearPair
from fem.support.arguments import REQUIRED, checked
from fem.support.validation import require

INSTEAD = "pass friction= to CreateGearContact, which takes the rest from the contact"


@checked
def CreateGearFriction(
    mbs: exu.MainSystem,
    name: str = "",
    itemNumbers: Sequence[Any] = (None, None),
    pair: GearPair | RingPair = REQUIRED,
    force: MeshForce = REQUIRED,
    friction: Annotated[MeshFriction, check_friction] = REQUIRED,
    localPositions: Sequence[Sequence[float]] = ((0, 0, 0), (0, 0, 0)),
    localAxes: Sequence[Sequence[float]] = ((0, 0, 1), (0, 0, 1)),
    phase: float = 0.0,
    direction: int = 1,
):
    """Deprecated: pass friction= to `CreateGearContact`. Adds friction to a contact; also mbs.CreateGearFriction(...).

    itemNumbers, pair, force, localPositions, localAxes, phase, direction
                those of the `CreateGearContact` of the same gears, without a carrier
    friction    `MeshFriction` of the pair

    Returns the number of the contact. Raises ValueError without a contact on the bodies, and for arguments
    unlike those of the contact.
    """
    check_mesh(pair, force, phase, direction)
    check_friction("friction", friction)
    two = f"itemNumbers must be [pinion, wheel], got {itemNumbers}; {INSTEAD}, also for gears on a carrier"
    require(len(itemNumbers) == 2, two)
    kinds = tuple(kind_of(mbs, item) for item in itemNumbers)
    number, contact = _contact_between(mbs, itemNumbers)
    table, frame, state, *_ = contact.records
    require_same_pair(contact.pair, pair, f"that of gear contact {number}", INSTEAD)
    given = frame_of(mbs, itemNumbers, pair, localPositions, localAxes, phase=phase, direction=direction)
    _check_alike(contact, given, force.table, number)
    check_turns(frame, pair, friction=friction.pitches)
    records = table, frame, state, friction.table(contact.pair)
    kernel, nodes = kernel_of(kinds, frame, rubs=True), [node_of(mbs, item) for item in itemNumbers]
    for function, value in user_functions(
        mbs, nodes, ContactCopy(kernel, records, kinds), records, (contact.recorder, contact.ring, None)
    ).items():
        mbs.SetObjectParameter(number, function, value)
    replaced = contact._replace(kernel=kernel, records=records, function=mbs.GetObject(number)[FUNCTION])
    known = dict(mbs.variables)[CONTACTS]
    mbs.variables[CONTACTS] = [replaced if c.function == contact.function else c for c in known]
    warnings.warn(f"CreateGearFriction is deprecated; {INSTEAD}", DeprecationWarning, stacklevel=3)
    return number


def _contact_between(mbs, items) -> tuple[int, StoredContact]:
    """Number and contents of the contact on two bodies; ValueError where there is none, or where it has friction."""
    nodes = [int(node_of(mbs, item)) for item in items]
    matching = [
        (number, contact)
        for number, contact in contacts_of(mbs).items()
        if [int(node) for node in mbs.GetObject(number)["nodeNumbers"]] == nodes
    ]
    require(bool(matching), f"itemNumbers must be those of a gear contact, there is none on {list(items)}; {INSTEAD}")
    number, contact = matching[-1]
    require(
        contact.records[3] is None,
        f"itemNumbers {list(items)}: gear contact {number} has friction already; leave this out",
    )
    return number, contact


def _check_alike(contact: StoredContact, frame: np.record, table: np.record, number: int) -> None:
    """ValueError unless a contact frame and a table of the mesh force are those of a contact, by its number."""
    contact_table, contact_frame, *_ = contact.records
    for name in ("phase", "direction"):
        alike = (
            f"{name} must be {contact_frame[name]:g} as that of gear contact {number}, got {frame[name]:g}; {INSTEAD}"
        )
        require(bool(frame[name] == contact_frame[name]), alike)
    unlike = f"localPositions and localAxes must be those of gear contact {number}; {INSTEAD}"
    require(frame.tobytes() == contact_frame.tobytes(), unlike)
    require(table.tobytes() == contact_table.tobytes(), f"force must be that of gear contact {number}; {INSTEAD}")


extends(exu.MainSystem, "CreateGearFriction")(CreateGearFriction)
install()
