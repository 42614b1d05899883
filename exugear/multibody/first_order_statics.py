"""Statics to first order: coordinates in which meshes, bearings and couplings carry torques, before Exudyn solves.

The mesh forces of a train follow from the torques alone. Under them shafts are displaced on their bearings and
couplings twist; then each shaft turns until its meshes have the deflections of their forces.
"""

from collections.abc import Mapping, Sequence
from math import cos, isfinite, sin
from typing import NamedTuple

import numpy as np

from exugear.contact.reference_configuration import is_spatial, state_at_coordinates
from exugear.gearbox.bearing import Bearing, radial_points
from exugear.gearbox.bearing_law import potential, tangent_stiffness
from exugear.gearbox.gearbox import forces_of_motion
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.shaft_dynamics import elastic_displacement, of_least_energy, static_displacement
from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.map_range import larger_torque
from exugear.multibody.model import (
    Mesh,
    Model,
    bearings_of,
    by_shaft,
    constant_loads,
    gear_spin,
    held_by_joints,
    matrices_without_meshes,
    motion_of,
    pin_coordinates,
)
from exugear.multibody.planet_pins import pin_potential
from exugear.multibody.solve_errors import NO_EQUILIBRIUM, STIFFNESS_UNIT_HINT, NoEquilibrium
from exugear.operation.conditions import Conditions
from exugear.planning.map_axes import static_offsets
from exugear.rolling_bearings.statics import NotCarried
from fem.support.validation import require
from fem.units import mm

NOT_CARRIED = "turn or pair the bearings so that they press against the load, or load the other flanks"
#: Iterations for the phases of meshes, and their tolerance [m, rad].
ITERATIONS, CONVERGED = 30, 1e-14
#: Static displacement of a shaft [m, rad] and twist of a coupling [rad] that suggest data in another unit.
LARGEST_SHIFT, LARGEST_TILT, LARGEST_TWIST = 0.01, 0.05, 2.0


class MeshState(NamedTuple):
    """Deflection of the driving flank, opening of either flank [m] and phase of a mesh."""

    deflection: float
    opening: float
    phase: float


def loaded_coordinates(model: Model, conditions: Conditions, accelerations: np.ndarray) -> np.ndarray:
    """Coordinates in which meshes, bearings and couplings carry the torques and the inertia torques, to first order.

    accelerations   (n_shaft,) of the shafts [rad/s^2]
    """
    box, anchors, drags = model.gearbox, conditions.anchors, conditions.initial_drags
    by_name = by_shaft(model, accelerations)
    forces = forces_of_motion(box, conditions.initial_torques + drags, accelerations, anchors)
    rigid = motion_of(model, conditions.initial_angles)
    q = _displaced_on_bearings(model, forces) + rigid
    on_rotors = {end.body: conditions.initial_torque(end) for end in conditions.ends}
    for shaft in box.shafts:
        for rotor in shaft.rotors:
            on_rotors[rotor.name] = on_rotors.get(rotor.name, 0.0) - rotor.coupling.inertia * by_name[shaft.name]
    by_meshes = -forces @ np.array([mesh.row for mesh in model.meshes])
    twisted: dict[str, dict[str, float]] = {}
    for held in (shaft for shaft in box.shafts if shaft.name in anchors and shaft.rotors):
        inertia_torque = box.inertias[held.name] * by_name[held.name]
        on_shaft = float(by_meshes @ model.spin_motions[held.name]) + drags[box.shafts.index(held)] - inertia_torque
        twisted[held.name] = _twisted(held, held.end, on_rotors | {held.name: on_shaft})
        q += twisted[held.name][held.name] * model.spin_motions[held.name]
    q = _with_mesh_forces(model, forces, q, anchors)
    for shaft in box.shafts:
        spin = model.spins[shaft.name]
        fixed = rigid[spin] if shaft.name in twisted else q[spin]
        angles = twisted.get(shaft.name) or _twisted(shaft, shaft.name, on_rotors)
        for rotor in shaft.rotors:
            q[model.rotor_spins[rotor.name]] = fixed + angles[rotor.name]
    return q


def _displaced_on_bearings(model: Model, forces: np.ndarray) -> np.ndarray:
    """Coordinates of the shafts on their bearings under mesh forces (n_stage,) [N], spins 0."""
    rows = [row_of_flank(model, mesh, force) for mesh, force in zip(model.meshes, forces, strict=True)]
    on_coordinates = -forces @ np.array(rows)
    q = np.zeros(on_coordinates.size)
    for shaft in model.gearbox.shafts:
        kind, spin, built = model.scene.shafts[shaft.name], model.spins[shaft.name], model.elastics.get(shaft.name)
        if not (kind.on_bearings or (built and built.elastic.spatial)):
            continue
        try:
            if built and built.elastic.spatial:
                q[built.indices], radial_forces = elastic_displacement(built.elastic, on_coordinates[built.indices])
            else:
                moving, free, on_centre = slice(spin - kind.spin_index, spin), kind.components[:-1], np.zeros(6)
                on_centre[free] = on_coordinates[moving]
                displacement, radial_forces = static_displacement(shaft, on_centre, free)
                q[moving] = displacement[free]
        except NotCarried as error:
            raise NoEquilibrium(f"{error}; {NOT_CARRIED}") from None
        _check_tables(shaft, radial_forces)
    if model.seats:
        q = _on_moving_seats(model, q, on_coordinates)
    _check_yield(model, forces, q)
    return q


def _on_moving_seats(model: Model, q: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Coordinates of least potential of shafts and housing under forces (n,), from q of shafts whose seats stand."""
    stiffness, rest = matrices_without_meshes(model)[1], np.zeros(q.size)
    for rows, bearing, indices in bearings_of(model):
        if not bearing.linear:
            stiffness[np.ix_(indices, indices)] -= rows.T @ tangent_stiffness(bearing, 0.0, rows @ rest[indices]) @ rows
    fixed = [*model.spins.values(), *model.rotor_spins.values(), *held_by_joints(model)]
    free = np.setdiff1d(np.arange(q.size), fixed)
    return of_least_potential(model, q, free, stiffness, forces + constant_loads(model))


def of_least_potential(
    model: Model, q: np.ndarray, free: np.ndarray, linear: np.ndarray, loads: np.ndarray
) -> np.ndarray:
    """Coordinates (n,) of least potential of nonlinear bearings and a linear rest, from q.

    free     indices of the coordinates that move
    linear   (n, n) stiffness of the rest
    loads    (n,) at coordinates 0 [N, N m]
    """
    pins = [(pin, *pin_coordinates(model, pin)) for pin in model.pins if pin.law is not None]
    nonlinear = [each for each in bearings_of(model) if not each[1].linear] if model.seats else []

    def potential_of(q: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        strained, hessian = linear @ q, linear.copy()
        energy, gradient = float(q @ strained) / 2 - float(loads @ q), strained - loads
        for pin, part, n in pins:
            of_pin = pin_potential(pin, q[part], n)
            energy, among = energy + of_pin[0], np.ix_(part, part)
            gradient[part] += of_pin[1]
            hessian[among] += of_pin[2]
        for rows, bearing, indices in nonlinear:
            of_bearing, among = potential(bearing, 0.0, rows[:5] @ q[indices]), np.ix_(indices, indices)
            energy = energy + of_bearing[0]
            gradient[indices] += rows[:5].T @ of_bearing[1]
            hessian[among] += rows[:5].T @ of_bearing[2] @ rows[:5]
        return energy, gradient, hessian

    return of_least_energy(potential_of, q, free, lambda matrix, right: np.linalg.lstsq(matrix, right)[0])


def _check_tables(shaft: Shaft, radial_forces: Mapping[float, float]) -> None:
    """NoEquilibrium where a nonlinear bearing carries more than its table; forces [N] by axial position."""
    for axial, force in radial_forces.items():
        bearing = shaft.bearings[axial]
        end = radial_points(bearing)[1, -1] if isinstance(bearing, Bearing) else np.inf
        if not force <= end:
            beyond = f"bearing of shaft {shaft.name!r} at {axial:g} m carries {force:.4g} N, its table ends at"
            raise NoEquilibrium(f"{beyond} {end:.4g} N; extend it")


def _check_yield(model: Model, forces: np.ndarray, q: np.ndarray) -> None:
    """NoEquilibrium where bearings yield so far under forces (n_stage,) [N] that their unit must be wrong."""
    for mesh, force in zip(model.meshes, forces, strict=True):
        shafts = [s.name for s in (mesh.stage.fast, mesh.stage.slow) if model.plan.shafts[s.name].on_bearings]
        displaced = [q[model.spins[s] - model.plan.shafts[s].spin_index : model.spins[s]] for s in shafts]
        shift = max((np.abs(x[:3]).max() for x in displaced), default=0.0)
        tilt = max((np.abs(x[3:]).max(initial=0.0) for x in displaced), default=0.0)
        if shift > LARGEST_SHIFT or tilt > LARGEST_TILT:
            external = sum(np.linalg.norm(x.wrench[:3]) for s in mesh.stage.shafts for _, x in s.forces)
            under = f"{abs(force):.4g} N" + f" and external forces of {external:.4g} N" * bool(external)
            far = f"bearings of {mesh.stage.name} yield by {shift / mm:.3g} mm, {tilt:.2g} rad under {under}"
            raise NoEquilibrium(f"{far}; try less load or stiffer bearings {STIFFNESS_UNIT_HINT}")


def _twisted(shaft: Shaft, fixed: str, torques: Mapping[str, float]) -> dict[str, float]:
    """Angles [rad] of a shaft and of its rotors beside a fixed one of them, under torques about z [N m], by name.

    Raises NoEquilibrium for a coupling that twists beyond `LARGEST_TWIST`.
    """
    names = [shaft.name, *(rotor.name for rotor in shaft.rotors)]
    stiffness = np.zeros((len(names), len(names)))
    for rotor in shaft.rotors:
        pair = [names.index(rotor.body), names.index(rotor.name)]
        stiffness[np.ix_(pair, pair)] += rotor.coupling.torsion * np.array([[1.0, -1.0], [-1.0, 1.0]])
    free = [i for i, name in enumerate(names) if name != fixed]
    angles = np.zeros(len(names))
    if free:
        angles[free] = np.linalg.solve(stiffness[np.ix_(free, free)], [torques.get(names[i], 0.0) for i in free])
    by_name = dict(zip(names, angles.tolist(), strict=True))
    for rotor in shaft.rotors:
        twist = (1 if fixed == shaft.name else -1) * (by_name[rotor.name] - by_name[rotor.body])
        of_chain = f" to {rotor.name!r}" if len(shaft.rotors) > 1 else ""
        under = f"{twist:.3g} rad under {twist * rotor.coupling.torsion:.4g} N m"
        far = f"the coupling of shaft {shaft.name!r}{of_chain} twists by {under}"
        if not abs(twist) < LARGEST_TWIST:
            raise NoEquilibrium(f"{far}; pass its torsion in N m/rad (8 kN m/rad are 8e3), or less load")
    return by_name


def _with_mesh_forces(model: Model, forces: np.ndarray, q: np.ndarray, anchors: Sequence[str]) -> np.ndarray:
    """The coordinates with spins at which the meshes carry forces (n_stage,) [N]; phases follow the spins."""
    rounding = 2 * np.spacing(np.abs(q).max())
    for _ in range(ITERATIONS):
        before = q
        deflections = [
            deflection_under_force(model, mesh, f, before) - _beyond_first_order(model, mesh, before)
            for mesh, f in zip(model.meshes, forces, strict=True)
        ]
        q = with_deflections(model, deflections, before, anchors)
        if np.abs(q - before).max() < CONVERGED + rounding:
            return q
    raise NoEquilibrium(NO_EQUILIBRIUM)


def _beyond_first_order(model: Model, mesh: Mesh, q: np.ndarray) -> float:
    """What displacements and tilts add to the deflection [m] of a mesh beside its slopes: idle teeth touch within it.

    0 on carriers, whose planets go on to share the load.
    """
    if mesh.stage.carrier:
        return 0.0
    return state_of_mesh(model, mesh, q).deflection - mesh.reference_deflection - float(mesh.row @ q)


def with_deflections(model: Model, deflections, coordinates: np.ndarray, anchors: Sequence[str]) -> np.ndarray:
    """The coordinates with spins at which the meshes have deflections (n_stage,) [m], to first order.

    The shafts named anchors keep their spins; in loops the spins are the least-squares solution.
    """
    q, rows = coordinates.copy(), np.array([mesh.row for mesh in model.meshes])
    standing = *anchors, *model.gearbox.reaction_members
    motions = np.array([motion for name, motion in model.spin_motions.items() if name not in standing]).T
    reference = np.array([mesh.reference_deflection for mesh in model.meshes])
    q += motions @ np.linalg.lstsq(rows @ motions, deflections - reference - rows @ q)[0]
    for shaft in model.gearbox.shafts:
        for rotor in shaft.rotors:
            q[model.rotor_spins[rotor.name]] = q[model.spins[shaft.name]]
    return q


def deflection_under_force(model: Model, mesh: Mesh, force: float, q: np.ndarray) -> float:
    """Static deflection [m] of a mesh under a force [N] at coordinates q; NoEquilibrium for loads beyond the map."""
    law = mesh.law
    spin = q[gear_spin(model, mesh.stage, mesh.stage.fast)]
    if mesh.stage.carrier:
        spin -= q[model.spins[mesh.stage.carrier.name]]
    phase = mesh.phase + mesh.frame.direction * mesh.frame.pitches_per_radian * spin
    side = 1 if force >= 0 else -1
    static = static_offsets(model.gearbox, mesh.stage, side) if law.offsets else {}
    of_flank = law.flank_at(side, **{n: x for n, x in static.items() if n in law.offsets})
    if force >= 0:
        return _deflection_under(mesh, of_flank, phase, force, side)
    back = f"backlash must be finite for a load on the back flank of stage {mesh.stage.name}, got {law.backlash}"
    no_contact = f"{back}; give it by the pair, the MeshForce or Stage(backlash=...), or drive another shaft"
    require(isfinite(law.backlash), no_contact)
    opening = mesh.opening if mesh.stage.carrier else state_of_mesh(model, mesh, q).opening
    backlash = law.backlash + 2 * opening
    return -backlash - _deflection_under(mesh, of_flank, law.back_phase - phase, -force, side)


def _deflection_under(mesh: Mesh, of_flank: MeshForce, phase: float, force: float, side: int) -> float:
    """Static deflection [m] of a flank under a force >= 0 [N]; NoEquilibrium with the torque to map beyond its law."""
    try:
        return of_flank.deflection_at(phase, force)
    except ValueError:
        law = mesh.law
        reason = larger_torque(law.table.head, force, mesh.stage.pair.pinion.r_b, side if law.coast else 1)
        raise NoEquilibrium(f"load: in stage {mesh.stage.name} {reason}") from None


def row_of_flank(model: Model, mesh: Mesh, side: float) -> np.ndarray:
    """(n,) slopes of the advance by which the flank of a side is pressed; of back flanks a smaller distance presses."""
    row, frame = mesh.row.copy(), mesh.frame
    if side >= 0 or not is_spatial(frame):
        return row
    by_distance = 2 * sin(mesh.stage.pair.alpha_wt)
    for sense, shaft in ((-1, mesh.stage.fast), (1, mesh.stage.slow)):
        components, spin = model.plan.shafts[shaft.name].components, gear_spin(model, mesh.stage, shaft)
        if len(components) > 1:
            x = spin - len(components) + 1
            row[x : x + 2] += sense * by_distance * np.array([frame.e_x, frame.e_y])
    return row


def state_of_mesh(model: Model, mesh: Mesh, q: np.ndarray) -> MeshState:
    """State of a mesh at coordinates q (n,).

    To first order in coordinates beside those of the bodies, as of rings that bend.
    """
    stage, on_bodies, beside = mesh.stage, np.zeros((2, 6)), mesh.row.copy()
    for six, shaft in zip(on_bodies, (stage.fast, stage.slow), strict=True):
        components, spin = model.plan.shafts[shaft.name].components, gear_spin(model, stage, shaft)
        six[components] = q[spin - len(components) + 1 : spin + 1]
        beside[spin - len(components) + 1 : spin + 1] = 0.0
    if stage.carrier and stage.carrier.name not in model.gearbox.carriers_of_pins:
        turned = q[model.spins[stage.carrier.name]]
        on_bodies[:, 5] -= turned
        beside[model.spins[stage.carrier.name]] = 0.0
        back = np.array([[cos(turned), -sin(turned)], [sin(turned), cos(turned)]])
        for part, fixed in zip((slice(0, 2), slice(3, 5)), np.split(mesh.frame.fixed, 2, axis=1), strict=True):
            on_bodies[:, part] += fixed @ back - fixed
    if is_spatial(mesh.frame):
        deflection, opening, phase = state_at_coordinates(mesh.law.table.head, mesh.frame, *on_bodies)
        return MeshState(deflection + beside @ q, opening, phase)
    return MeshState(mesh.reference_deflection + mesh.row @ q, mesh.opening, 0.0)
