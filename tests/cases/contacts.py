"""Teeth of a pair in contact: positions of the mesh, and contacts of given or of resolved bodies."""

from collections.abc import Iterable

import fem
from fem.contact.tooth_contact import ToothContact
from fem.pair.mesh_position import MeshPosition
from fem.ste.map_solver import compliances_of


def position_of(pair: fem.GearPair, phase: float = 0.0, axial: float = 0.0) -> MeshPosition:
    """The pair at its centre distance, at a phase and an axial offset [m] of the wheel."""
    return MeshPosition(pair, pair.a, axial, phase)


def contact_of(pair: fem.GearPair, bodies: Iterable, phase: float, slices: int, axial: float = 0.0) -> ToothContact:
    """Contact of bodies with known compliances."""
    return ToothContact(position_of(pair, phase, axial), *bodies, slices)


def resolved_contacts(
    pair: fem.GearPair, resolution, phases: Iterable[float], slices: int | None = None, **offsets: float
) -> list[ToothContact]:
    """Contacts of a pair at some phases as maps resolve it, in their number of slices unless it is given."""
    bodies, chosen = compliances_of(pair, fem.Offsets(**offsets).values(pair), resolution)
    return [contact_of(pair, bodies, phase, chosen if slices is None else slices) for phase in phases]
