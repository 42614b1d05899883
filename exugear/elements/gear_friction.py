"""Friction between the teeth in Exudyn: an ObjectGenericODE2 on the same nodes as that of the contact."""

from collections.abc import Sequence
from typing import Annotated, Any

import exudyn as exu
from exudyn.misc.extensionRegistry import extends, install

from exugear.contact_geometry.contact_records import is_rotated
from exugear.elements.gear_contact import add_forces, check_mesh, frame_of, kinds_of
from exugear.friction.mesh_friction import MeshFriction
from exugear.kernels.friction_kernels import friction_of
from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.ring_pair import RingPair
from fem.pair.pair import GearPair
from fem.support.arguments import REQUIRED, checked
from fem.support.validation import require


def check_friction(name: str, value) -> None:
    """ValueError unless the value is a `MeshFriction`."""
    kind = f"{name} must be an exugear.MeshFriction, got {type(value).__name__}"
    require(isinstance(value, MeshFriction), f"{kind}; make it with MeshFriction.of_pair")


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
    """Create the Coulomb friction of a gear contact; also called as mbs.CreateGearFriction(...).

    itemNumbers, pair, force, localPositions, localAxes, phase, direction
                as for the `CreateGearContact` of the same gears, without a carrier
    friction    `MeshFriction`

    The normal force of the friction is the static mesh force, without its damping. The torques of the friction jump
    where the teeth pass the pitch point, so that a mesh cycle needs about a hundred steps.

    Returns the number of the ObjectGenericODE2. Raises ValueError as `CreateGearContact` does.
    """
    check_mesh(pair, force, phase, direction)
    check_friction("friction", friction)
    two = f"itemNumbers must be [pinion, wheel], got {itemNumbers}; leave a carrier out and let the bodies move"
    require(len(itemNumbers) == 2, two)
    kinds = kinds_of(mbs, itemNumbers, force)
    frame = frame_of(mbs, itemNumbers, pair, localPositions, localAxes, phase=phase, direction=direction)
    kernel = friction_of(kinds, is_rotated(frame))
    return add_forces(mbs, name, itemNumbers, kernel, (force.table, frame, friction.table(pair)))


extends(exu.MainSystem, "CreateGearFriction")(CreateGearFriction)
install()
