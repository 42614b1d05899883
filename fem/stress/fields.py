"""Fields of displacement, stress and pressure of both gears of a pair at a phase and a load.

Two models: plane strain on a section that resolves the contact, and the whole solid, in which the contact is smaller
than an element. Both gears carry the pressure of the contact solution of `fem.contact`.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import meshio
import numpy as np
from skfem.helpers import ddot, eye, trace
from skfem.io.meshio import to_meshio

from fem.contact.contact_state import State
from fem.contact.resolution import Resolution
from fem.contact.tooth_contact import ToothContact
from fem.elasticity import section_mesh
from fem.elasticity.mesh_density import Density
from fem.pair.offsets import Offsets
from fem.pair.pair import GearPair
from fem.pair.placement import Placement, placements
from fem.ste.inputs import checked_phases, checked_torque
from fem.stress import gear_elasticity, stress_recovery
from fem.stress.flank_loads import FlankLoad, flank_loads, tooth_contacts, with_loaded_teeth
from fem.stress.gear_elasticity import FINE, SOLID, ElasticGear
from fem.stress.tooth_boundary import bent_root
from fem.support.arguments import FilePath, Finite, checked
from fem.support.validation import number, require, require_kind

__all__ = ["Field", "plane_fields", "save_vtu", "solid_fields"]


@dataclass(frozen=True)
class Field:
    """A gear under load in its meshing position: pinion at the origin, wheel at (a, 0), or (a, 0, axial).

    points          (dim, n) of the undeformed gear, turned by phase and transmission error [m]
    cells           (n_corner, n_cell) triangles or hexahedra, corners in meshio's order
    displacement    (dim, n) elastic, relative to the hub [m]; the flanks touch at points + displacement
    von_mises       (n,) equivalent stress [Pa]
    principal       (n,) largest principal stress [Pa]
    pressure        (n,) largest contact pressure in the part of the flank that is nearest to each point [Pa]
    fillet          (n,) whether a node lies on the tensile root of a loaded tooth where bending causes the stress
    centre          (dim,) centre of the hub [m]
    turn            rotation of the hub from its position without load [rad]
    """

    points: np.ndarray
    cells: np.ndarray
    displacement: np.ndarray
    von_mises: np.ndarray
    principal: np.ndarray
    pressure: np.ndarray
    fillet: np.ndarray
    centre: np.ndarray
    turn: float

    @property
    def root_stress(self) -> float:
        """Largest principal stress in the fillets of the loaded teeth [Pa]."""
        return float(self.principal[self.fillet].max(initial=0.0))

    @checked
    def deformed(self, scale: Finite) -> np.ndarray:
        """(dim, n) points with displacement and turn of the hub scaled; contacts stay closed at any scale."""
        x, y = self.points[:2] - self.centre[:2, None]
        points = self.points + scale * self.displacement
        points[:2] += (scale - 1) * self.turn * np.stack([-y, x])
        return points


@checked
def plane_fields(
    pair: GearPair,
    torque: float,
    phase: float,
    *,
    offsets: Offsets | None = None,
    ring_angle: Finite = 0.0,
    density: Density = FINE,
    refine: int = 6,
    resolution: Resolution | None = None,
) -> tuple[Field, Field]:
    """Fields of pinion and wheel of a spur pair in plane strain, in the slice of the width with the largest pressure.

    torque          pinion torque F r_b1 > 0 [N m]
    phase           position in the mesh cycle in [0, 1); 0: pair 0 at the pitch point
    offsets         offsets of the wheel, one value each
    ring_angle      position of the mesh on a ring on `fem.Bolts`, as in a map [rad]
    density         density of the section away from the contact; its teeth follow from the load
    refine          number of elements over half the contact width, at least 4
    resolution      resolution of the contact, as for a map

    Returns the `Field` of pinion and wheel, lengths in metres, stresses in Pa.
    Raises ValueError for bad input and helical pairs, RuntimeError where the contact does not converge.
    """
    whole = 4 <= number("refine", refine) < 1e3 and refine % 1 == 0
    require(whole, f"refine must be a whole number >= 4, got {refine}")
    require_kind("density", density, Density)
    require(pair.beta_b == 0, f"plane fields are of spur pairs, got {pair}; take solid_fields for helical ones")
    contact, state = _solved_contact(pair, torque, phase, offsets, resolution, ring_angle)
    axial = state.slices.middle[np.argmax(state.pressure)]
    fields = []
    for loads, placed in zip(flank_loads(contact, state), placements(contact.position, state.te), strict=True):
        lines = [line for load in loads if (line := load.section(axial - placed.centre[2])).force.any()]
        section = gear_elasticity.section_refined_at(
            placed.gear, with_loaded_teeth(placed.gear, density, loads), lines, 1 / refine
        )
        elastic = gear_elasticity.plane_gear(placed.gear, section)
        fields.append(field_of(elastic, lines, placed, state.te, contact.position.tooth_angle))
    return fields[0], fields[1]


@checked
def solid_fields(
    pair: GearPair,
    torque: float,
    phase: float,
    *,
    offsets: Offsets | None = None,
    ring_angle: Finite = 0.0,
    density: Density = SOLID,
    resolution: Resolution | None = None,
) -> tuple[Field, Field]:
    """Fields of pinion and wheel on hexahedra of the whole width, spur or helical; arguments as in `plane_fields`.

    The contact is smaller than an element: pressure, bending and root stress are resolved, the stress under the contact
    is not. The line of contact of a helical gear is a step function: a slice is loaded as in its middle section.
    Elements are quadratic; the fields divide each into two hexahedra along the width.

    Raises ValueError for bad input, RuntimeError where the contact does not converge.
    """
    require_kind("density", density, Density)
    contact, state = _solved_contact(pair, torque, phase, offsets, resolution, ring_angle)
    fields = []
    for loads, placed in zip(flank_loads(contact, state), placements(contact.position, state.te), strict=True):
        elastic = gear_elasticity.solid_gear(placed.gear, with_loaded_teeth(placed.gear, density, loads))
        fields.append(field_of(elastic, loads, placed, state.te, contact.position.tooth_angle))
    return fields[0], fields[1]


def _solved_contact(
    pair: GearPair,
    torque: float,
    phase: float,
    offsets: Offsets | None,
    resolution: Resolution | None,
    ring_angle: float,
) -> tuple[ToothContact, State]:
    require(number("torque", torque) > 0, f"torque must be > 0 N m for a field, got {torque}")
    checked_torque(pair, torque), checked_phases([number("phase", phase)], pair)
    (contact,), misalignment = tooth_contacts(pair, [phase], offsets, resolution, ring_angle)
    return contact, contact.state(torque / pair.pinion.r_b, misalignment)


def field_of(elastic: ElasticGear, loads: list[FlankLoad], placed: Placement, te: float, angle: float = 0.0) -> Field:
    """Solution of a gear under loads, turned and moved to its placement; angle: of a ring on its supports [rad]."""
    mesh, dim, section = elastic.mesh, elastic.dim, elastic.section.mesh
    u = elastic.displacement(gear_elasticity.nodal_forces(elastic, loads), elastic.supports(angle))
    stress = stress_recovery.stress(elastic, u)
    rotation, root = np.eye(dim), np.zeros(section.p.shape[1], bool)
    rotation[:2, :2] = section_mesh.rotated(np.eye(2), placed.rotation)
    for load in loads:
        root[section.facets[:, bent_root(elastic.gear, section, load.tooth)]] = True
    return Field(
        rotation @ mesh.p + placed.centre[:dim, None],
        to_meshio(mesh).cells[0].data.T,
        rotation @ elastic.displacement_at_vertices(u),
        von_mises(stress),
        np.linalg.eigvalsh(stress.transpose(2, 0, 1))[:, -1],
        gear_elasticity.contact_pressure(elastic, loads),
        np.repeat(root, elastic.axial.size),
        placed.centre[:dim],
        te * placed.turn_per_te,
    )


def von_mises(stress: np.ndarray) -> np.ndarray:
    """(n,) equivalent stress of stress (3, 3, n)."""
    deviator = stress - eye(trace(stress) / 3, 3)
    return np.sqrt(1.5 * ddot(deviator, deviator))


@checked
def save_vtu(fields: Sequence[Field], path: FilePath) -> Path:
    """Write the fields of one or both gears as a VTU file; an interrupted write leaves no file, or the old one.

    fields   of one phase, as `plane_fields` and `solid_fields` return them; `cycle_fields` returns those of each phase

    Point data: displacement [m], von_mises, principal, pressure [Pa].
    Raises ValueError for an empty sequence, and for a path that does not end in .vtu.
    """
    none = "fields must be one Field or more, got none; pass what plane_fields or solid_fields returned"
    require(len(fields) > 0, none)
    path = Path(path)
    require(path.suffix == ".vtu", f"path must end in .vtu, got {path}")
    first = np.cumsum([0] + [field.points.shape[1] for field in fields])
    kind = {3: "triangle", 8: "hexahedron"}
    cells = [(kind[len(field.cells)], field.cells.T + start) for field, start in zip(fields, first, strict=False)]
    names = ("von_mises", "principal", "pressure", "displacement", "points")
    data = {name: np.concatenate([getattr(field, name).T for field in fields]) for name in names}
    for name in ("displacement", "points"):
        data[name] = np.pad(data[name], ((0, 0), (0, 3 - data[name].shape[1])))
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        meshio.write(part, meshio.Mesh(data.pop("points"), cells, point_data=data), file_format="vtu")
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    return path
