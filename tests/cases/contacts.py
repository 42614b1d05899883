"""Teeth of a pair in contact: positions of the mesh, and contacts of given or of resolved bodies."""

from collections.abc import Iterable

import numpy as np

import fem
from fem.contact.contact_slices import ContactSlices
from fem.contact.strip_contact import StripContact, assemble
from fem.contact.tooth_contact import ToothContact
from fem.pair.mesh_position import MeshPosition
from fem.ste.map_solver import ContactModel, compliances_of, elastic_gears
from fem.units import mm


def position_of(pair: fem.GearPair, phase: float = 0.0, axial: float = 0.0, *, a: float | None = None) -> MeshPosition:
    """The pair at a phase and an axial offset [m] of the wheel, at its own or another centre distance [m]."""
    return MeshPosition(pair, pair.a if a is None else a, axial, phase)


def unloaded_te(pair: fem.GearPair, phase: float) -> float:
    """Transmission error [m] at which flanks first touch between mid-plane and an end face, of all teeth in reach."""
    position = position_of(pair, phase)
    numbers = np.array(position.numbers())
    return ContactSlices(position, numbers, 0.0 * numbers, 0.0 * numbers + pair.b / 2).first_touch(0.0).min()


def single_slice(pair: fem.GearPair, phase: float, te: float = 0.0) -> ContactSlices:
    """A slice of 1 mm of tooth pair 0, where flanks overlap by te [m]."""
    return ContactSlices(position_of(pair, phase), *np.array([[0], [0], [1 * mm]]), te)


def strips_in_contact(contact: ToothContact, slices, strips, misalignment: float = 0.0) -> StripContact:
    """Compliance and gaps of all strips of slices, as states of the contact solve them."""
    return assemble(slices, strips, contact.bodies, contact.face, misalignment)


def contact_of(pair: fem.GearPair, bodies: Iterable, phase: float, slices: int, axial: float = 0.0) -> ToothContact:
    """Contact of bodies with known compliances."""
    return ToothContact(position_of(pair, phase, axial), *bodies, slices)


def resolved_contacts(
    pair: fem.GearPair, resolution, phases: Iterable[float], slices: int | None = None, **offsets: float
) -> list[ToothContact]:
    """Contacts of a pair at some phases as maps resolve it, in their number of slices unless it is given."""
    bodies, chosen = compliances_of(pair, fem.Offsets(**offsets).values(pair), resolution)
    return [contact_of(pair, bodies, phase, chosen if slices is None else slices) for phase in phases]


def densities_of(pair: fem.GearPair, density: fem.Density) -> list[fem.Density]:
    """Densities of pinion and wheel in maps of a pair on a density."""
    bodies = elastic_gears(pair, fem.Offsets().values(pair), fem.Resolution(density=density))
    return [density for _, density, _ in bodies]


def model_of(pair, resolution) -> ContactModel:
    """Contact of a map of the pair without offsets."""
    return ContactModel(pair, fem.Offsets().values(pair), resolution)
