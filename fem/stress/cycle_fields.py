"""Fields of displacement and stress in a transverse section over the mesh cycle, on the same elements at all phases.

Spur gears are solved in plane strain, helical ones as solids. The contact is smaller than an element.
"""

from concurrent.futures import Executor

import numpy as np

from fem.contact.resolution import Resolution
from fem.contact.tooth_contact import ToothContact
from fem.elasticity import section_mesh
from fem.elasticity.mesh_density import Density
from fem.gear.gear import Gear
from fem.pair.offsets import Offsets
from fem.pair.pair import GearPair
from fem.pair.placement import Placement, placements
from fem.ste.inputs import checked_phases, checked_torque
from fem.stress import gear_elasticity
from fem.stress.fields import Field, field_of
from fem.stress.flank_loads import FlankLoad, flank_loads, states_of, tooth_contacts, with_loaded_teeth
from fem.stress.gear_elasticity import SOLID, ElasticGear
from fem.support.arguments import Finite, Numbers, checked
from fem.support.validation import number, require, require_kind
from fem.units import mm

#: Section of spur gears: root stress of the pair of the paper within 4 % of that on finer sections.
PLANE = Density(flank=16, fillet=6, land=3, tooth=4, rim=4, body=4)


@checked
def cycle_fields(
    pair: GearPair,
    torque: float,
    phases: Numbers = 24,
    *,
    axial: Finite = 0.0,
    offsets: Offsets | None = None,
    ring_angle: Finite = 0.0,
    density: Density | None = None,
    resolution: Resolution | None = None,
    executor: Executor | None = None,
) -> list[tuple[Field, Field]]:
    """Fields in a transverse section of pinion and wheel at every phase, on triangles.

    torque      pinion torque F r_b1 > 0 [N m]
    phases      number of equidistant phases, or their values in [0, 1)
    axial       axial position of the section [m]; of helical gears the nearest of their elements
    offsets     offsets of the wheel, one value each
    ring_angle  position of the mesh on a ring on `fem.Bolts`, as in a map [rad]
    density     density of the elements, which do not resolve the contact; its teeth follow from the load
    resolution  resolution of the contact, as for a map
    executor    any `concurrent.futures.Executor`, which solves the contacts, a phase in each call

    Returns a pair of `Field` (pinion, wheel) of each phase.
    A spur pair takes 0.3 s and 30 ms a phase, a helical pair 10 s and 1 s a phase.
    Raises ValueError for bad input, RuntimeError where the contact does not converge.
    """
    require(number("torque", torque) > 0, f"torque must be > 0 N m for a field, got {torque}")
    if density is not None:
        require_kind("density", density, Density)
    checked_torque(pair, torque)
    contacts, misalignment = tooth_contacts(pair, checked_phases(phases, pair), offsets, resolution, ring_angle)
    force = np.array([torque / pair.pinion.r_b])
    states = [state for (state,) in states_of(contacts, force, misalignment, executor, "contact")]
    loads = [flank_loads(contact, state) for contact, state in zip(contacts, states, strict=True)]
    placed = [placements(contact.position, state.te) for contact, state in zip(contacts, states, strict=True)]
    te = [state.te for state in states]
    fields = []
    for side, gear in enumerate((pair.pinion, pair.wheel)):
        columns = zip(contacts, [sides[side] for sides in loads], [sides[side] for sides in placed], te, strict=True)
        fields.append(_fields_of(gear, density, axial, list(columns)))
    return list(zip(*fields, strict=True))


def _fields_of(
    gear: Gear,
    density: Density | None,
    axial: float,
    columns: list[tuple[ToothContact, list[FlankLoad], Placement, float]],
) -> list[Field]:
    """Fields of a gear in its contacts, under its loads, in its placement and under the transmission error [m]."""
    density = density or (SOLID if gear.beta_b else PLANE)
    toothed = with_loaded_teeth(gear, density, [load for _, loads, *_ in columns for load in loads])
    toothed = toothed.with_teeth(toothed.teeth + 1, toothed.behind + 1)
    on_gear = axial - columns[0][2].centre[2]
    within = f"axial must lie on the faces of both gears, within {gear.b / 2 / mm:g} mm of the middle of the gear of"
    require(abs(on_gear) <= gear.b / 2 * (1 + 1e-9), f"{within} {gear.z} teeth, got {on_gear / mm:g} mm; pass metres")
    if gear.beta_b:
        solid = gear_elasticity.solid_gear(gear, toothed)
        return [
            _section(solid, field_of(solid, loads, placed, te, contact.position.tooth_angle), on_gear)
            for contact, loads, placed, te in columns
        ]
    plane = gear_elasticity.plane_gear(gear, section_mesh.section(gear, toothed).to_meshtri())
    fields = []
    for contact, loads, placed, te in columns:
        lines = [line for load in loads if (line := load.section(on_gear)).force.any()]
        fields.append(field_of(plane, lines, placed, te, contact.position.tooth_angle))
    return fields


def _section(solid: ElasticGear, field: Field, axial: float) -> Field:
    """Field of a solid in the plane of its vertices that is nearest to an axial position [m]."""
    positions, quads = solid.axial[solid.axial_order], solid.section.mesh.t
    at = slice(int(np.abs(positions - axial).argmin()), None, positions.size)
    nodal = (field.von_mises, field.principal, field.pressure, field.fillet)
    triangles = np.hstack([quads[[0, 1, 2]], quads[[0, 2, 3]]])
    von_mises, principal, pressure, fillet = (values[at] for values in nodal)
    plane = field.points[:2, at], triangles, field.displacement[:2, at]
    return Field(*plane, von_mises, principal, pressure, fillet, field.centre[:2], field.turn)
