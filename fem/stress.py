"""Stress of a meshing pair: fields of both gears at one phase and load, root stress and pressure over the mesh cycle.

Two levels of fields: plane strain on a section that resolves the contact, and the whole solid, where the contact is
smaller than an element. Both carry the pressure that the contact found; what acts on one gear acts on the other.
"""

import os
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path

import meshio
import numpy as np
import xarray as xr
from skfem.io.meshio import to_meshio
from tqdm import tqdm

from fem import elastic, profile
from fem import mesh as meshes
from fem.compliance import Compliance, flank_compliance, hats
from fem.contact import State, state_at
from fem.elastic import FINE, Body, FlankLoad, Root
from fem.gap import STRIPS, Deviation, Flanks, flanks_at
from fem.gear import Gear, GearPair, involute, require
from fem.mesh import Density
from fem.ste import PHASE, TORQUE
from fem.transmission import largest_torque


@dataclass(frozen=True)
class Field:
    """One gear under load, in its meshing position: pinion at the origin, wheel at (a, 0).

    points          (dim, n) without load, turned by phase and transmission error [m]
    cells           (n_corner, n_cell) triangles or hexahedra, corners in meshio's order
    displacement    (dim, n) elastic, seen from the hub [m]; points + displacement is what touches the mate
    von_mises, principal, pressure      (n,) equivalent stress, largest principal stress, contact pressure [Pa]
    fillet          (n,) whether a node lies on the tensile root of a loaded tooth
    centre, turn    of the hub [m]; how far it turned from no load [rad]
    """

    points: np.ndarray
    cells: np.ndarray
    displacement: np.ndarray
    von_mises: np.ndarray
    principal: np.ndarray
    pressure: np.ndarray
    fillet: np.ndarray
    centre: tuple[float, float]
    turn: float

    @property
    def root_stress(self) -> float:
        """Largest principal stress in the fillets of the loaded teeth [Pa]."""
        return float(self.principal[self.fillet].max(initial=0.0))

    def deformed(self, scale: float) -> np.ndarray:
        """(dim, n) points with displacement and turn of the hub scaled; what touches, touches at any scale."""
        x, y = self.points[:2] - np.array(self.centre)[:, None]
        moved = self.points + scale * self.displacement
        moved[:2] += (scale - 1) * self.turn * np.stack([-y, x])
        return moved


def plane_fields(
    pair: GearPair, torque: float, phase: float, *, misalignment: float = 0.0, density: Density = FINE, refine: int = 6
) -> tuple[Field, Field]:
    """Fields of pinion and wheel in plane strain, in the slice of the width where the pressure is largest.

    torque          pinion torque F r_b1 > 0 [N m]
    phase           position in the mesh cycle in [0, 1); 0: pair 0 at the pitch point
    misalignment    angle in the plane of action by which the gap opens towards positive z [rad]
    density         of the section away from the contact
    refine          elements over half the width of the contact, at least 4

    Raises ValueError for bad input, RuntimeError where the contact does not settle.
    """
    require(refine >= 4 and refine == int(refine), f"refine must be a whole number >= 4, got {refine}")
    sides = _loaded(pair, torque, phase, misalignment)
    density = replace(density, teeth=max(density.teeth, ceil(pair.eps_alpha)))
    worst = int(np.argmax(np.max([load.pressure.max(axis=1) for load in sides[0][1]], axis=0)))
    made = []
    for gear, loads, place in sides:
        lines = [line for line in (load.in_section(worst) for load in loads) if line.force.any()]
        body = elastic.plane_body(gear, elastic.graded(gear, density, lines, 1 / refine))
        made.append(_field(body, lines, *place))
    return made[0], made[1]


def solid_fields(
    pair: GearPair, torque: float, phase: float, *, misalignment: float = 0.0, density: Density | None = None
) -> tuple[Field, Field]:
    """Fields of pinion and wheel on the hexahedra of `mesh.hexahedra`; arguments as in `plane_fields`.

    The contact is smaller than an element: forces, bending and root stress are there, the stress under it is not.
    """
    sides = _loaded(pair, torque, phase, misalignment)
    density = replace(density or Density(), teeth=ceil(pair.eps_alpha))
    pinion, wheel = (_field(elastic.solid_body(gear, density), loads, *place) for gear, loads, place in sides)
    return pinion, wheel


def _field(body: Body, loads: list[FlankLoad], centre: tuple[float, float], angle: float, turn: float) -> Field:
    """Solution of one gear, turned by angle and moved to centre."""
    mesh, dim = body.basis.mesh, body.basis.mesh.dim()
    u = body.displacement(elastic.forces(body, loads))
    stress = elastic.stress(body, u)
    turned, at = np.eye(dim), np.zeros((dim, 1))
    turned[:2, :2], at[:2, 0] = meshes.rotated(np.eye(2), angle), centre
    root = np.zeros(body.section.mesh.p.shape[1], bool)
    for load in loads:
        root[body.section.mesh.facets[:, elastic.outline(body.gear, body.section.mesh, load.tooth)[1]]] = True
    return Field(
        turned @ mesh.p + at,
        to_meshio(mesh).cells[0].data.T,
        turned @ u.reshape(dim, -1)[:, body.basis.dofs.nodal_dofs[0]],
        von_mises(stress),
        np.linalg.eigvalsh(stress.transpose(2, 0, 1))[:, -1],
        elastic.contact_pressure(body, loads),
        np.repeat(root, max(body.axial.size, 1)),
        centre,
        turn,
    )


def von_mises(stress: np.ndarray) -> np.ndarray:
    """(n,) equivalent stress of stress (3, 3, n)."""
    deviator = stress - np.einsum("iin->n", stress) / 3 * np.eye(3)[:, :, None]
    return np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1)))


def _places(pair: GearPair, phase: float, te: float) -> list[tuple[tuple[float, float], float, float]]:
    """Centre, angle from the mesh's position, and part of the angle due to the load, of pinion and wheel.

    The pinion drives counter-clockwise: it leads by half the transmission error, the wheel lags by the other half.
    """
    roll = pair.roll_pitch + phase * pair.p_bt
    sides = ((pair.pinion, roll, 0.0), (pair.wheel, pair.a * np.sin(pair.alpha_wt) - roll, pair.a))
    places = []
    for gear, roll, x in sides:
        base_half_angle, turn = gear.s_t / (2 * gear.r) + involute(gear.alpha_t), te / (2 * gear.r_b)
        facing = np.pi / 2 if x else -np.pi / 2
        places.append(((x, 0.0), facing + roll / gear.r_b - pair.alpha_wt - base_half_angle + turn, turn))
    return places


def save_vtu(fields, path) -> Path:
    """Write the fields of one or both gears as one VTU file, whole or not at all.

    Point data: displacement [m], von_mises, principal, pressure [Pa].
    """
    fields, path = tuple(fields), Path(path)
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


def root_stress(
    pair: GearPair, torque, phases=30, *, misalignment: float = 0.0, density: Density = FINE, progress: bool = True
) -> xr.Dataset:
    """Root stress of both gears and contact pressure over (torque, phase).

    "root_stress" [Pa] over (gear, torque, phase): largest tensile stress along the fillets of all loaded teeth;
    "tangent_stress" that where the fillet's tangent makes 30 degrees with the tooth; "peak_pressure" [Pa].

    torque          pinion torques F r_b1 >= 0 [N m], increasing
    phases          number of equidistant phases, or their values in [0, 1)
    misalignment    angle in the plane of action by which the gap opens towards positive z [rad]
    density         of the section that gives the root stress of unit loads, once per gear, kept in the cache

    Each slice of the width is taken for itself, in plane strain: too much where the load is uneven (at b = 23 mm 26 %
    under 0.5 mrad of misalignment, 38 % with 10 um of crowning); `solid_fields` has its neighbours' help.
    Where the sharp corner of an unrelieved tip touches, the pressure is a mean over one strip of what has no limit.
    Raises ValueError for bad input, RuntimeError where the contact does not settle.
    """
    torque, phase = _checked(pair, torque, phases, misalignment)
    pinion, wheel = _compliances(pair, misalignment)
    density = replace(density, teeth=max(density.teeth, ceil(pair.eps_alpha)))
    roots = [elastic.root_influence(gear, density) for gear in (pair.pinion, pair.wheel)]
    found = np.zeros((5, torque.size, phase.size))
    grid = [(i, j) for j in range(phase.size) for i in range(torque.size)]
    for i, j in tqdm(grid, "root stress", disable=not progress, delay=1.0, leave=False):
        state = state_at(pair, pinion, wheel, phase[j], torque[i] / pair.pinion.r_b, misalignment)
        loads = flank_loads(pair, state, phase[j], misalignment)
        for k, (root, side) in enumerate(zip(roots, loads, strict=True)):
            found[[k, k + 2], i, j] = largest_in_roots(root, side)
        found[4, i, j] = state.peak_pressure()
    return _cycle(torque, phase, found)


def _cycle(torque: np.ndarray, phase: np.ndarray, found: np.ndarray) -> xr.Dataset:
    grid, said = (TORQUE, PHASE), "tensile stress in the tooth root"
    axes = {
        "gear": ["pinion", "wheel"],
        TORQUE: (TORQUE, torque, {"units": "N m", "long_name": "pinion torque"}),
        PHASE: (PHASE, phase, {"units": "1", "long_name": "phase of the mesh cycle"}),
    }
    values = {
        "root_stress": (("gear", *grid), found[:2], {"units": "Pa", "long_name": f"largest {said}"}),
        "tangent_stress": (("gear", *grid), found[2:4], {"units": "Pa", "long_name": f"{said}, 30 degree tangent"}),
        "peak_pressure": (grid, found[4], {"units": "Pa", "long_name": "largest contact pressure"}),
    }
    return xr.Dataset(values, axes, {"title": "tooth root stress and contact pressure over the mesh cycle"})


def along_root(root: Root, tooth: int, loads: list[FlankLoad]) -> np.ndarray:
    """(n_slice, n_place) stress along the fillet of a tooth [Pa]."""
    total = np.zeros((loads[0].slices.size - 1, root.inclination.size))
    for load in loads:
        line_load = load.force / np.diff(load.slices)[:, None]
        at = hats(root.arcs, (load.edges[1:] + load.edges[:-1]) / 2)
        total += line_load @ at.T @ root.stress[len(root.stress) // 2 + tooth - load.tooth].T
    return total


def largest_in_roots(root: Root, loads: list[FlankLoad]) -> tuple[float, float]:
    """Largest stress along the roots of the loaded teeth, and at their 30 degree tangents [Pa]; 0 without load."""
    rows = [row for load in loads for row in along_root(root, load.tooth, loads)]
    order = np.argsort(root.inclination)
    tangent = [np.interp(np.pi / 6, root.inclination[order], row[order]) for row in rows]
    return max([row.max() for row in rows], default=0.0), max(tangent, default=0.0)


def _compliances(pair: GearPair, misalignment: float) -> list[Compliance]:
    """Compliance of pinion and wheel; over the whole width and on finer slices where the gap varies across it."""
    varies = bool(pair.pinion.flank or pair.wheel.flank or misalignment)
    density = Density(slices=3 if varies else 1, teeth=ceil(pair.eps_alpha))
    return [flank_compliance(gear, density, pair.b, whole=varies) for gear in (pair.pinion, pair.wheel)]


def _loaded(pair: GearPair, torque: float, phase: float, misalignment: float):
    """Gear, loads and place of pinion and wheel."""
    require(torque > 0, f"torque must be > 0 N m for a field, got {torque}")
    _checked(pair, torque, [phase], misalignment)
    pinion, wheel = _compliances(pair, misalignment)
    state = state_at(pair, pinion, wheel, phase, torque / pair.pinion.r_b, misalignment)
    loads = flank_loads(pair, state, phase, misalignment)
    return list(zip((pair.pinion, pair.wheel), loads, _places(pair, phase, state.te), strict=True))


def flank_loads(
    pair: GearPair, state: State, phase: float, misalignment: float = 0.0
) -> tuple[list[FlankLoad], list[FlankLoad]]:
    """What a contact state presses on pinion and wheel; only the teeth that carry load."""
    slices, force = state.slices, state.load
    if slices[0] == 0:
        force = np.concatenate([force[:, ::-1], force], axis=1)
        slices = np.concatenate([-slices[:0:-1], slices])
    flanks = {one.pair: one for one in flanks_at(pair, phase, Deviation(pair, misalignment, state.slices))}
    pinion, wheel = [], []
    for number, on_pair, width in zip(state.pairs, force, state.widths, strict=True):
        if on_pair.any():
            arcs = _strips(flanks[number], width)
            pinion.append(_load(pair.pinion, number, arcs[0], slices, on_pair))
            wheel.append(_load(pair.wheel, -number, arcs[1], slices, on_pair))
    return pinion, wheel


def _strips(flanks: Flanks, width: float) -> np.ndarray:
    """(2, n) arc lengths of the strips on pinion and wheel whose width [m] the state tells."""
    low, high = profile.arc_length(flanks.own, np.array(flanks.roll_limits))
    centre, covered = profile.arc_length(flanks.own, flanks.closest), width * STRIPS
    return flanks.strips(max(covered / 2, covered - min(centre - low, high - centre)))[0]


def _load(gear: Gear, tooth: int, arcs: np.ndarray, slices: np.ndarray, force: np.ndarray) -> FlankLoad:
    """Load on strips around arcs (n,), in whichever order they come; no wider than the flank."""
    if arcs[0] > arcs[-1]:
        arcs, force = arcs[::-1], force[:, ::-1]
    middle = (arcs[1:] + arcs[:-1]) / 2
    edges = np.concatenate([[2 * arcs[0] - middle[0]], middle, [2 * arcs[-1] - middle[-1]]])
    return FlankLoad(tooth, np.clip(edges, *elastic.flank_ends(gear)), slices, force)


def _checked(pair: GearPair, torque, phases, misalignment: float) -> tuple[np.ndarray, np.ndarray]:
    """Torques and phases as arrays."""
    require(pair.pinion.beta == 0, f"beta must be 0, got {pair.pinion.beta:g} rad; only spur pairs are solved so far")
    slope = f"misalignment must lie within 0.01 rad, got {misalignment}; pass radians: 0.5e-3"
    require(abs(misalignment) < 0.01, slope)
    torque, most = np.atleast_1d(np.asarray(torque, float)), largest_torque(pair)
    rising = torque.size > 0 and (np.diff(torque) > 0).all() and torque[0] >= 0 and torque[-1] < most
    require(bool(rising), f"torque must increase from 0 or above, below {most:.4g} N m; sort it, got {torque}")
    count = np.ndim(phases) == 0 and phases == int(phases)
    phase = np.arange(phases) / phases if count else np.atleast_1d(np.asarray(phases, float))
    within = phase.size > 0 and (np.diff(phase) > 0).all() and phase[0] >= 0 and phase[-1] < 1
    told = "phases must be a whole number or increase within [0, 1) as share of a pitch"
    require(bool(within and (count or np.ndim(phases) == 1)), f"{told}, got {phases}")
    return torque, phase
