"""Friction between the teeth in Exudyn: one ObjectGenericODE2 beside that of the contact, on the same nodes."""

from collections.abc import Sequence
from typing import Annotated, Any

import exudyn as exu
import numpy as np
from exudyn.misc.extensionRegistry import extends, install

from exugear.elements.gear_contact import add_forces, frame_of, kind_of
from exugear.kernels.contact_kernels import SPIN
from exugear.kernels.contact_records import is_turned
from exugear.kernels.friction_kernels import friction_of
from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.friction import MeshFriction
from exugear.mesh_force.ring_pair import RingPair
from fem.pair.pair import GearPair
from fem.support.arguments import checked
from fem.support.validation import require


def check_friction(name: str, value) -> None:
    """ValueError unless it is a `MeshFriction`."""
    given = f"{name} must be an exugear.MeshFriction, got {type(value).__name__}"
    require(isinstance(value, MeshFriction), f"{given}; say MeshFriction.of_pair")


@checked
def CreateGearFriction(
    mbs: exu.MainSystem,
    name: str = "",
    itemNumbers: Sequence[Any] = (None, None),
    pair: GearPair | RingPair = None,  # type: ignore[assignment]
    force: MeshForce = None,  # type: ignore[assignment]
    friction: Annotated[MeshFriction, check_friction] = None,  # type: ignore[assignment]
    localPositions: Sequence[Sequence[float]] = ((0, 0, 0), (0, 0, 0)),
    localAxes: Sequence[Sequence[float]] = ((0, 0, 1), (0, 0, 1)),
    phase: float = 0.0,
    direction: int = 1,
):
    """Coulomb friction of a gear contact; also mbs.CreateGearFriction.

    itemNumbers, pair, force   those of the `CreateGearContact` that it goes with; so are localPositions, localAxes,
                               phase and direction
    friction                   `MeshFriction`

    The teeth rub with the static force of the mesh, without its damping. Its torques jump where the teeth pass the
    pitch point, so that a mesh cycle takes some hundred steps.

    Returns the number of the ObjectGenericODE2. Raises ValueError as `CreateGearContact` does.
    """
    require(isinstance(pair, GearPair | RingPair), f"pair must be a fem.GearPair, got {type(pair).__name__}")
    require(isinstance(force, MeshForce), f"force must be an exugear.MeshForce, got {type(force).__name__}")
    check_friction("friction", friction)
    require(direction in (1, -1), f"direction must be +1 or -1, got {direction}")
    require(bool(np.isfinite(phase)), f"phase must be finite, a share of a pitch, got {phase}")
    both = f"itemNumbers must be [pinion, wheel], got {itemNumbers}; leave a carrier out and let the bodies move"
    require(len(itemNumbers) == 2, both)
    kinds = tuple(kind_of(mbs, item) for item in itemNumbers)
    fixed = f"bodies that only spin need a force without offsets, got {list(force.offsets)}; take force.at(...)"
    require(not (set(kinds) == {SPIN} and force.offsets), fixed)
    frame = frame_of(mbs, itemNumbers, pair, localPositions, localAxes, phase=phase, direction=direction)
    kernel = friction_of(kinds, is_turned(frame))
    return add_forces(mbs, name, itemNumbers, kernel, (force.table, frame, friction.table(pair)))


extends(exu.MainSystem, "CreateGearFriction")(CreateGearFriction)
install()
