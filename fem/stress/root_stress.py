"""Stress in the tooth roots over the mesh cycle, on solids with quadratic elements; contact pressure beside it."""

import numpy as np
import xarray as xr

from fem.contact.resolution import Resolution
from fem.contact.tooth_contact import ToothContact
from fem.elasticity.mesh_density import Density
from fem.elasticity.section_mesh import rotated
from fem.gear.gear import Gear
from fem.pair.offsets import Offsets
from fem.pair.pair import GearPair
from fem.ste.inputs import checked_phases, checked_torque
from fem.ste.ste_map import PHASE, TORQUE, description
from fem.stress import gear_elasticity
from fem.stress.flank_loads import (
    LEAST_INCLINATION,
    FlankLoad,
    encounters,
    flank_loads,
    inclination,
    outline,
    with_loaded_teeth,
)
from fem.stress.gear_elasticity import Body
from fem.support.arguments import Numbers, checked
from fem.support.progress import bar, shown

__all__ = ["root_stress"]

#: Root stress within 1 % of finer sections (2.5 % of an undercut one), and within 4 % of a finer width where a line of
#: contact of a helix of 28 deg begins at an end face.
ROOT = Density(flank=6, fillet=6, land=2, tooth=4, rim=3, body=4, width=3, rim_power=1.5)

#: What stands beside the stress of the roots.
CONTACT = ("hertz_pressure", "peak_pressure", "tip_contact")


@checked
def root_stress(
    pair: GearPair,
    torque: Numbers,
    phases: Numbers = 30,
    *,
    offsets: Offsets | None = None,
    density: Density = ROOT,
    resolution: Resolution | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Root stress of both gears and contact pressure over (torque, phase).

    "root_stress" [Pa] over (gear, torque, phase): largest tensile stress in the roots of all loaded teeth, as of
    `along_root`, where the fillet is inclined by 20 degrees or more to the tooth's centre line; "tangent_stress" that
    at its 30 degree tangent (ISO 6336-3); "hertz_pressure" [Pa], "tip_contact" and "peak_pressure" [Pa] over (torque,
    phase), as of `fem.static_transmission_error`.

    torque          pinion torques F r_b1 >= 0 [N m], increasing
    phases          number of equidistant phases, or their values in [0, 1)
    offsets         of the wheel, one value each
    density         of the solid on which the roots are solved; the default's stress is within 1 to 4 % of finer ones
    resolution      of the contact, as of a map

    The factorized solids are not kept: some 7 s for each spur gear, 13 s for each helical one, 0.2 s per state.
    Raises ValueError for bad input, RuntimeError where the contact does not settle.
    """
    torque, phase = checked_torque(pair, torque), checked_phases(phases, pair)
    gears = pair.pinion, pair.wheel
    with shown(progress):
        met, misalignment = encounters(pair, phase, offsets, resolution)
        contact, loads = _contacts(met, torque / pair.pinion.r_b, misalignment)
        sides = [[[both[side] for both in column] for column in loads] for side in (0, 1)]
        found = [_both_stresses(gear, density, side) for gear, side in zip(gears, sides, strict=True)]
    return _cycle(torque, phase, np.stack(found), contact)


def _contacts(met: list[ToothContact], forces, misalignment: float) -> tuple[np.ndarray, list[list[tuple]]]:
    """(CONTACT, n_torque, n_phase) numbers of contacts, and by phase and torque what presses on both gears."""
    found, loads = np.zeros((len(CONTACT), forces.size, len(met))), []
    for j, encounter in enumerate(bar(met, "contact")):
        states = [encounter.state(float(force), misalignment) for force in forces]
        found[:, :, j] = [[getattr(state, name)() for state in states] for name in CONTACT]
        loads.append([flank_loads(encounter, state) for state in states])
    return found, loads


def _both_stresses(gear: Gear, density: Density, columns: list[list[list[FlankLoad]]]) -> np.ndarray:
    """(2, n_torque, n_phase) as of `largest_in_roots`, under loads on one gear by phase and torque."""
    every = [load for column in columns for loads in column for load in loads]
    if not every:
        return np.zeros((2, len(columns[0]), len(columns)))
    body = gear_elasticity.solid_body(gear, with_loaded_teeth(density, every))
    found = [largest_in_roots(body, column) for column in bar(columns, "root stress")]
    return np.stack(found, axis=2)


def largest_in_roots(body: Body, cases: list[list[FlankLoad]]) -> np.ndarray:
    """(2, n_case) largest stress in the roots of the loaded teeth, and at their 30 degree tangents [Pa]."""
    u = body.displacement(np.stack([gear_elasticity.forces(body, loads) for loads in cases], axis=1))
    found = np.zeros((2, len(cases)))
    for k, loads in enumerate(cases):
        for load in loads:
            stress = along_root(body, u[:, k], load.tooth)
            inclined = inclination(body.gear, body.section.mesh, load.tooth)
            largest = stress[inclined >= LEAST_INCLINATION].max(), at_tangent(inclined, stress).max()
            found[:, k] = np.maximum(found[:, k], largest)
    return found


def along_root(body: Body, u: np.ndarray, tooth: int) -> np.ndarray:
    """(n_place, n_axial) stress across the helix on the surface of a tooth's fillet [Pa]; from root to flank, upwards.

    Nothing presses there, so it is E/(1 - nu^2) (e + nu e_helix): strains of the facets, and along the helix.
    """
    place = outline(body.gear, body.section.mesh, tooth)[1]
    one, other = body.section.dofs.nodal_dofs[0][body.section.mesh.facets[:, place]]
    order = body.upwards
    parts = np.zeros((3, body.section.N, order.size))
    parts[: body.dim] = u.reshape(body.dim, body.section.N, -1)[:, :, order]
    start, end = body.section.doflocs[:, one], body.section.doflocs[:, other]
    middle, z = (parts[:, one] + parts[:, other]) / 2, body.axial[order]
    grown = np.zeros_like(middle)
    if body.dim == 3:
        grown = np.gradient(middle, z, axis=2, edge_order=2)
        grown[:2] += body.gear.twist * rotated(middle[:2], np.pi / 2)
    along = np.vstack([body.gear.twist * rotated((start + end) / 2, np.pi / 2), np.ones(one.size)])
    across = np.vstack([end - start, np.zeros(one.size)])
    strain, along_helix = surface_strain(across, along, parts[:, other] - parts[:, one], grown)
    E, nu = body.gear.material.E, body.gear.material.nu
    return E / (1 - nu**2) * (strain + nu * along_helix)


def surface_strain(a, b, da, db) -> tuple[np.ndarray, np.ndarray]:
    """(n, m) strains of a surface across b and along b; tangents a, b (3, n), their growth da, db (3, n, m)."""
    aa, ab, bb = (np.einsum("in,in->n", x, y)[:, None] for x, y in ((a, a), (a, b), (b, b)))
    e_aa, e_bb = np.einsum("in,inm->nm", a, da), np.einsum("in,inm->nm", b, db)
    e_ab = (np.einsum("in,inm->nm", a, db) + np.einsum("in,inm->nm", b, da)) / 2
    trace = (bb * e_aa - 2 * ab * e_ab + aa * e_bb) / (aa * bb - ab**2)
    return trace - e_bb / bb, e_bb / bb


def at_tangent(inclined: np.ndarray, stress: np.ndarray) -> np.ndarray:
    """(n_axial,) stress (n_place, n_axial) where the fillet's tangent is inclined by 30 degrees."""
    order = np.argsort(inclined)
    return np.array([np.interp(np.pi / 6, inclined[order], column[order]) for column in stress.T])


def _cycle(torque: np.ndarray, phase: np.ndarray, found: np.ndarray, contact: np.ndarray) -> xr.Dataset:
    grid, said = (TORQUE, PHASE), "tensile stress in the tooth root"
    axes = {
        "gear": ["pinion", "wheel"],
        TORQUE: (TORQUE, torque, {"units": "N m", "long_name": "pinion torque"}),
        PHASE: (PHASE, phase, {"units": "1", "long_name": "phase of the mesh cycle"}),
    }
    values = {
        "root_stress": (("gear", *grid), found[:, 0], {"units": "Pa", "long_name": f"largest {said}"}),
        "tangent_stress": (("gear", *grid), found[:, 1], {"units": "Pa", "long_name": f"{said}, 30 degree tangent"}),
    }
    beside = {name: (grid, contact[i], description(name)) for i, name in enumerate(CONTACT)}
    return xr.Dataset(values | beside, axes, {"title": "tooth root stress and contact pressure over the mesh cycle"})
