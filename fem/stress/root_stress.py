"""Stress in the tooth roots over the mesh cycle, on solids of quadratic elements, with the contact pressure."""

from concurrent.futures import Executor
from functools import partial
from math import floor

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
from fem.ste.ste_map import PHASE, TORQUE, description, gap_attribute
from fem.stress import gear_elasticity
from fem.stress.flank_loads import FlankLoad, contact_inputs, flank_loads, states_of, tooth_contacts, with_loaded_teeth
from fem.stress.gear_elasticity import ElasticGear
from fem.stress.tooth_boundary import LEAST_INCLINATION, inclination, outline
from fem.support.arguments import Finite, Numbers, checked
from fem.support.progress import bar, shown

__all__ = ["root_stress"]

#: Root stress within 1 % of finer sections (2.5 % for an undercut tooth or a circular root), and within 4 % of a finer
#: width where a line of contact of a helix of 28 deg begins at an end face.
ROOT = Density(flank=6, fillet=6, land=2, tooth=4, rim=3, body=4, width=3, rim_power=1.5)

#: Quantities of the contact in the result.
CONTACT = ("hertz_pressure", "peak_pressure", "tip_contact")


@checked
def root_stress(
    pair: GearPair,
    torque: Numbers,
    phases: Numbers = 30,
    *,
    offsets: Offsets | None = None,
    ring_angle: Finite = 0.0,
    density: Density = ROOT,
    resolution: Resolution | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Root stress of both gears and contact pressure over (torque, phase).

    "root_stress" [Pa] over (gear, torque, phase): largest tensile stress in the roots of all loaded teeth where the
    fillet is inclined by 20 degrees or more to the tooth's centre line; "tangent_stress" [Pa]: the stress at the 30
    degree tangent of the fillet (ISO 6336-3); "hertz_pressure" [Pa], "tip_contact" and "peak_pressure" [Pa] over
    (torque, phase), as in `fem.static_transmission_error`. The attributes hold the pair (`fem.pair_of`).

    torque          pinion torques F r_b1 >= 0 [N m], increasing
    phases          number of equidistant phases, or their values in [0, 1)
    offsets         offsets of the wheel, one value each
    ring_angle      position of the mesh on a ring on `fem.Bolts`, as in a map [rad]; the bending of its rim adds to the
                    stress in its roots
    density         density of the solid; stresses on the default one are within 1 to 4 % of those on finer solids
    resolution      resolution of the contact, as for a map
    executor        any `concurrent.futures.Executor`, which solves the contacts, a phase in each call; the finite
                    elements of the roots are solved in this process

    The factorized solids are not cached: about 7 s for a spur gear, 13 s for a helical gear, 0.2 s per state.
    Raises ValueError for bad input, RuntimeError where the contact does not converge.
    """
    torque, phase = checked_torque(pair, torque), checked_phases(phases, pair)
    gears = pair.pinion, pair.wheel
    with shown(progress):
        contacts, misalignment = tooth_contacts(pair, phase, offsets, resolution, ring_angle)
        columns = states_of(contacts, torque / pair.pinion.r_b, misalignment, executor, "contact")
        loads = [
            [flank_loads(contact, state) for state in column] for contact, column in zip(contacts, columns, strict=True)
        ]
        by_gear = [[[sides[gear] for sides in column] for column in loads] for gear in (0, 1)]
        stresses = [
            _root_stresses(gear, density, contacts, columns) for gear, columns in zip(gears, by_gear, strict=True)
        ]
    quantities = [[[getattr(state.quantities, x)[0] for state in column] for column in columns] for x in CONTACT]
    data = _dataset(torque, phase, np.stack(stresses), np.array(quantities).transpose(0, 2, 1))
    return data.assign_attrs(contact_inputs(pair, offsets, resolution) | gap_attribute(phase, floor(phase[-1]) + 1))


def _root_stresses(
    gear: Gear, density: Density, contacts: list[ToothContact], columns: list[list[list[FlankLoad]]]
) -> np.ndarray:
    """(2, n_torque, n_phase) stresses of `largest_in_roots` [Pa], under the loads on a gear by phase and torque."""
    all_loads = [load for column in columns for loads in column for load in loads]
    if not all_loads:
        return np.zeros((2, len(columns[0]), len(columns)))
    elastic = gear_elasticity.solid_gear(gear, with_loaded_teeth(gear, density, all_loads))
    angles = [contact.position.tooth_angle for contact in contacts]
    stresses = map(partial(largest_in_roots, elastic), bar(columns, "root stress"), angles)
    return np.stack(list(stresses), axis=2)


def largest_in_roots(elastic: ElasticGear, cases: list[list[FlankLoad]], angle: float = 0.0) -> np.ndarray:
    """(2, n_case) largest stress in the roots of the loaded teeth, and at their 30 degree tangents [Pa].

    angle   of tooth 0 of a ring on its supports [rad]
    """
    forces = np.stack([gear_elasticity.nodal_forces(elastic, loads) for loads in cases], axis=1)
    u = elastic.displacement(forces, elastic.supports(angle))
    largest = np.zeros((2, len(cases)))
    for case, loads in enumerate(cases):
        for load in loads:
            stress = along_root(elastic, u[:, case], load.tooth)
            inclined = inclination(elastic.gear, elastic.section.mesh, load.tooth)
            in_tooth = stress[inclined >= LEAST_INCLINATION].max(), at_tangent(inclined, stress).max()
            largest[:, case] = np.maximum(largest[:, case], in_tooth)
    return largest


def along_root(elastic: ElasticGear, u: np.ndarray, tooth: int) -> np.ndarray:
    """(n_facet, n_axial) stress across the helix on a tooth's fillet [Pa], from root to flank and by axial position.

    The surface is free of traction: stress = E / (1 - nu^2) (e + nu e_helix) of the strains e of the facets and e_helix
    along the helix.
    """
    section, gear, order = elastic.section, elastic.gear, elastic.axial_order
    first, second = section.dofs.nodal_dofs[0][section.mesh.facets[:, outline(gear, section.mesh, tooth)[1]]]
    components = np.zeros((3, section.N, order.size))
    components[: elastic.dim] = u.reshape(elastic.dim, section.N, -1)[:, :, order]
    start, end = section.doflocs[:, first], section.doflocs[:, second]
    middle = (components[:, first] + components[:, second]) / 2
    du_helix = np.zeros_like(middle)
    if elastic.dim == 3:
        du_helix = np.gradient(middle, elastic.axial[order], axis=2, edge_order=2)
        du_helix[:2] += gear.twist * rotated(middle[:2], np.pi / 2)
    helix = np.vstack([gear.twist * rotated((start + end) / 2, np.pi / 2), np.ones(first.size)])
    facet = np.vstack([end - start, np.zeros(first.size)])
    strain, helix_strain = surface_strain(facet, helix, components[:, second] - components[:, first], du_helix)
    E, nu = gear.material.E, gear.material.nu
    return E / (1 - nu**2) * (strain + nu * helix_strain)


def surface_strain(a, b, da, db) -> tuple[np.ndarray, np.ndarray]:
    """(n, m) strains of a surface across b and along b; tangents a, b (3, n), their changes da, db (3, n, m)."""
    aa, ab, bb = (np.einsum("in,in->n", v, w)[:, None] for v, w in ((a, a), (a, b), (b, b)))
    e_aa, e_bb = np.einsum("in,inm->nm", a, da), np.einsum("in,inm->nm", b, db)
    e_ab = (np.einsum("in,inm->nm", a, db) + np.einsum("in,inm->nm", b, da)) / 2
    trace = (bb * e_aa - 2 * ab * e_ab + aa * e_bb) / (aa * bb - ab**2)
    return trace - e_bb / bb, e_bb / bb


def at_tangent(inclined: np.ndarray, stress: np.ndarray) -> np.ndarray:
    """(n_axial,) stress (n_facet, n_axial) where the fillet's tangent is inclined by 30 degrees."""
    order = np.argsort(inclined)
    return np.array([np.interp(np.pi / 6, inclined[order], column[order]) for column in stress.T])


def _dataset(torque: np.ndarray, phase: np.ndarray, stresses: np.ndarray, quantities: np.ndarray) -> xr.Dataset:
    """Labelled stresses (gear, 2, n_torque, n_phase) and CONTACT quantities."""
    grid, stress = (TORQUE, PHASE), "tensile stress in the tooth root"
    axes = {
        "gear": ["pinion", "wheel"],
        TORQUE: (TORQUE, torque, {"units": "N m", "long_name": "pinion torque"}),
        PHASE: (PHASE, phase, {"units": "1", "long_name": "phase of the mesh cycle"}),
    }
    values: dict = {
        "root_stress": (("gear", *grid), stresses[:, 0], {"units": "Pa", "long_name": f"largest {stress}"}),
        "tangent_stress": (
            ("gear", *grid),
            stresses[:, 1],
            {"units": "Pa", "long_name": f"{stress}, 30 degree tangent"},
        ),
    }
    values |= {name: (grid, quantities[i], description(name)) for i, name in enumerate(CONTACT)}
    return xr.Dataset(values, axes, {"title": "tooth root stress and contact pressure over the mesh cycle"})
