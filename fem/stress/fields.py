"""Fields of displacement, stress and pressure of a meshing pair at one phase and load.

Two levels: plane strain on a section that resolves the contact, and the whole solid, where the contact is smaller than
an element. Both carry the pressure that the contact found; what acts on one gear acts on the other.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import meshio
import numpy as np
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
from fem.stress.flank_loads import FlankLoad, bent_root, encounters, flank_loads, with_loaded_teeth
from fem.stress.gear_elasticity import FINE, SOLID, Body
from fem.support.arguments import FilePath, Finite, checked
from fem.support.validation import number, require, require_kind

__all__ = ["Field", "plane_fields", "save_vtu", "solid_fields"]


@dataclass(frozen=True)
class Field:
    """One gear under load, in its meshing position: pinion at the origin, wheel at (a, 0), or (a, 0, axial).

    points          (dim, n) without load, turned by phase and transmission error [m]
    cells           (n_corner, n_cell) triangles or hexahedra, corners in meshio's order
    displacement    (dim, n) elastic, seen from the hub [m]; points + displacement is what touches the mate
    von_mises, principal    (n,) equivalent stress, largest principal stress [Pa]
    pressure        (n,) contact pressure, the largest nearer to a point than to others [Pa]
    fillet          (n,) whether a node lies on the tensile root of a loaded tooth, where bending rules the stress
    centre, turn    (dim,) of the hub [m]; how far it turned from no load [rad]
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
        """(dim, n) points with displacement and turn of the hub scaled; what touches, touches at any scale."""
        x, y = self.points[:2] - self.centre[:2, None]
        moved = self.points + scale * self.displacement
        moved[:2] += (scale - 1) * self.turn * np.stack([-y, x])
        return moved


@checked
def plane_fields(
    pair: GearPair,
    torque: float,
    phase: float,
    *,
    offsets: Offsets | None = None,
    density: Density = FINE,
    refine: int = 6,
    resolution: Resolution | None = None,
) -> tuple[Field, Field]:
    """Fields of pinion and wheel of a spur pair in plane strain, in the slice of the width with the largest pressure.

    torque          pinion torque F r_b1 > 0 [N m]
    phase           position in the mesh cycle in [0, 1); 0: pair 0 at the pitch point
    offsets         of the wheel, one value each
    density         of the section away from the contact; its teeth follow from the load
    refine          elements over half the width of the contact, at least 4
    resolution      of the contact, as of a map

    Raises ValueError for bad input and helical pairs, RuntimeError where the contact does not settle.
    """
    whole = 4 <= number("refine", refine) < 1e3 and refine % 1 == 0
    require(whole, f"refine must be a whole number >= 4, got {refine}")
    require_kind("density", density, Density)
    require(pair.beta_b == 0, "beta must be 0 for plane fields; take solid_fields for helical pairs")
    encounter, state = _contact(pair, torque, phase, offsets, resolution)
    worst = state.slices.middle[np.argmax(state.pressure)]
    fields = []
    placed = placements(encounter.position, state.te)
    for loads, placement in zip(flank_loads(encounter, state), placed, strict=True):
        lines = [line for load in loads if (line := load.section(worst - placement.centre[2])).force.any()]
        section = gear_elasticity.graded(placement.gear, with_loaded_teeth(density, loads), lines, 1 / refine)
        fields.append(_field(gear_elasticity.plane_body(placement.gear, section), lines, placement, state.te))
    return fields[0], fields[1]


@checked
def solid_fields(
    pair: GearPair,
    torque: float,
    phase: float,
    *,
    offsets: Offsets | None = None,
    density: Density = SOLID,
    resolution: Resolution | None = None,
) -> tuple[Field, Field]:
    """Fields of pinion and wheel on hexahedra of the whole width, spur or helical; arguments as in `plane_fields`.

    The contact is smaller than an element: pressure, bending and root stress are there, the stress under it is not.
    Lines of contact of helical gears cross the width in steps: in each slice the load lies as in its middle. Elements
    are quadratic; each is two hexahedra of the fields, one beside the other across the width.
    """
    require_kind("density", density, Density)
    encounter, state = _contact(pair, torque, phase, offsets, resolution)
    fields = []
    placed = placements(encounter.position, state.te)
    for loads, placement in zip(flank_loads(encounter, state), placed, strict=True):
        body = gear_elasticity.solid_body(placement.gear, with_loaded_teeth(density, loads))
        fields.append(_field(body, loads, placement, state.te))
    return fields[0], fields[1]


def _contact(
    pair: GearPair, torque: float, phase: float, offsets: Offsets | None, resolution: Resolution | None
) -> tuple[ToothContact, State]:
    require(number("torque", torque) > 0, f"torque must be > 0 N m for a field, got {torque}")
    checked_torque(pair, torque), checked_phases([number("phase", phase)], pair)
    (encounter,), misalignment = encounters(pair, [phase], offsets, resolution)
    return encounter, encounter.state(torque / pair.pinion.r_b, misalignment)


def _field(body: Body, loads: list[FlankLoad], placement: Placement, te: float) -> Field:
    """Solution of one gear, turned and moved to where it stands."""
    mesh, dim, section = body.mesh, body.dim, body.section.mesh
    u = body.displacement(gear_elasticity.forces(body, loads))
    stress = stress_recovery.stress(body, u)
    turned, root = np.eye(dim), np.zeros(section.p.shape[1], bool)
    turned[:2, :2] = section_mesh.rotated(np.eye(2), placement.rotation)
    for load in loads:
        root[section.facets[:, bent_root(body.gear, section, load.tooth)]] = True
    return Field(
        turned @ mesh.p + placement.centre[:dim, None],
        to_meshio(mesh).cells[0].data.T,
        turned @ body.at_vertices(u),
        von_mises(stress),
        np.linalg.eigvalsh(stress.transpose(2, 0, 1))[:, -1],
        gear_elasticity.contact_pressure(body, loads),
        np.repeat(root, body.axial.size),
        placement.centre[:dim],
        te * placement.turn_per_te,
    )


def von_mises(stress: np.ndarray) -> np.ndarray:
    """(n,) equivalent stress of stress (3, 3, n)."""
    deviator = stress - np.einsum("iin->n", stress) / 3 * np.eye(3)[:, :, None]
    return np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1)))


@checked
def save_vtu(fields: Sequence[Field], path: FilePath) -> Path:
    """Write the fields of one or both gears as one VTU file, whole or not at all.

    Point data: displacement [m], von_mises, principal, pressure [Pa].
    """
    require(len(fields) > 0, "fields must be one or two in a tuple, as plane_fields and solid_fields give them")
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
