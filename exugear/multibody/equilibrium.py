"""Static equilibrium of a built gearbox under its load, from which a run starts."""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import cos, isfinite, sin

import exudyn.itemInterface as eii
import numpy as np

from exugear.contact.reference_configuration import is_spatial, state_at_coordinates
from exugear.gearbox.bearing import Bearing, radial_points
from exugear.gearbox.bearing_law import potential, tangent_stiffness
from exugear.gearbox.gearbox import anchors_of, forces_of_motion
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.shaft_dynamics import elastic_displacement, of_least_energy, static_displacement
from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.map_range import larger_torque
from exugear.multibody.carrier_turns import rigid_motion, turned_with_carriers, velocities_by_turning
from exugear.multibody.exudyn_objects import INITIAL, node_of
from exugear.multibody.guarded_solves import exudyn_settings
from exugear.multibody.model import (
    Mesh,
    Model,
    bearings_of,
    by_shaft,
    constant_loads,
    end_coordinate,
    gear_spin,
    held_by_joints,
    matrices_without_meshes,
    motion_of,
    moving_of,
    pin_coordinates,
)
from exugear.multibody.planet_pins import Pin, pin_matrices, pin_potential
from exugear.multibody.user_function_errors import Diverged, OutOfRange, user_errors_raised
from exugear.operation.conditions import Conditions
from exugear.planning.map_axes import static_offsets
from exugear.planning.plan import UNDAMPED
from exugear.rolling_bearings.statics import NotCarried
from fem.support.validation import require
from fem.units import mm, rpm, um

#: Duration of the static solve, in which the spins do not advance [s].
STATIC_SOLVE_TIME = 1e-12
NO_EQUILIBRIUM = (
    "no static equilibrium; try another load: a larger one where teeth or bearings hardly touch, "
    "a smaller one or stiffer bearings where these yield far"
)
NOT_CARRIED = "turn or pair the bearings so that they press against the load, or load the other flanks"
#: Residual of a static solve that counts as 0 [N, N m], and the rounding of its coordinates in units in the last place.
ABSOLUTE_TOLERANCE, ROUNDED_UNITS = 1e-10, 10
#: Angular frequency of a planet that carries nothing on the spring that makes static solves regular [rad/s].
WEAK_OMEGA = 1.0
#: Gap at which a member that carries nothing stands beside teeth without back flanks [m].
LEAST_GAP = 1e-7
#: Share of the largest mesh force below which a force is rounding.
ROUNDING = 1e-9
#: Iterations for the phases of meshes, and their tolerance [m, rad].
ITERATIONS, CONVERGED = 30, 1e-14
#: Static displacement of a shaft [m, rad] and twist of a coupling [rad] that suggest data in another unit.
LARGEST_SHIFT, LARGEST_TILT, LARGEST_TWIST = 0.01, 0.05, 2.0
STIFFNESS_UNIT_HINT = "(in N/m: 200 N/um are 200e6)"
#: Share of a map's largest force below which the mesh force by inertia torques is neglected.
LEAST_INERTIA_SHARE = 1e-6


#: How Exudyn names the kind of a user function that failed.
USER_FUNCTION = r"USER FUNCTION '([^']*)'"


class NoEquilibrium(ValueError, RuntimeError):
    """A load beyond the maps or the tables of bearings, under which bearings yield too far, or a failed static solve.

    As ValueError the load is out of the range of the gearbox, as RuntimeError a solve has failed.
    """


def solve_initial_equilibrium(model: Model, conditions: Conditions, lag: float = 0.0) -> None:
    """Put the system into static equilibrium under the torques at the start, all shafts turning at their ratios.

    lag   of the velocities of the integrator [s^2] (`Rule.lag`): those of orbiting planets start with it, without which
          they begin to vibrate

    The inertia torques of all shafts and rotors at the initial acceleration take part in the equilibrium. Their
    gyroscopic moments do not, as the axes stand still, tilted by some 1e-4 rad. Raises NoEquilibrium.
    """
    accelerations, system = conditions.initial_accelerations, model.bare_mbs.systemData
    speeds = by_shaft(model, conditions.initial_speeds)
    considered = accelerations if _inertia_matters(model, conditions) else 0.0 * accelerations
    try:
        q = _loaded_coordinates(model, conditions, considered)
    except NoEquilibrium as error:
        acceleration = considered[model.gearbox.shafts.index(model.gearbox.driving)]
        inertia = f"it includes inertia torques at {acceleration:.4g} rad/s^2"
        remedy = f"; {inertia}: let the speed rise more slowly at the start" if considered.any() else ""
        raise NoEquilibrium(f"{error}{remedy}") from None
    unloaded: list[str] = []
    if _needs_static_solve(model):
        if model.gearbox.planets:
            q, unloaded = _shared_among_planets(model, q, conditions, considered)
            q = turned_with_carriers(model, q)
        torques = _torques_at_start(model, conditions, rigid_motion(model, q, considered))
        torques = {i: x for i, x in torques.items() if i not in [model.spins[name] for name in unloaded]}
        held_in_gaps = _held_between_teeth(model, q, unloaded)
        with model.drive_items.holding(), _softened_by_rotation(model, speeds), held_in_gaps:
            q = _statically_solved(model, q, conditions, _with_centrifugal_forces(model, torques, speeds))
    velocities = rigid_motion(model, q, conditions.initial_speeds)
    system.SetODE2Coordinates(q, INITIAL)
    centripetal = velocities_by_turning(model, velocities, speeds)
    system.SetODE2Coordinates_t(velocities + lag * velocities_by_turning(model, centripetal, speeds), INITIAL)
    at_start = rigid_motion(model, q, accelerations) + centripetal
    for name in unloaded:
        drag = conditions.initial_drags[[shaft.name for shaft in model.gearbox.shafts].index(name)]
        at_start[model.spins[name]] = drag / model.gearbox.body_inertias[name]
    system.SetODE2Coordinates_tt(at_start, INITIAL)


def _inertia_matters(model: Model, conditions: Conditions) -> bool:
    """Whether inertia loads a mesh by more than a static solve can resolve."""
    box, accelerations = model.gearbox, conditions.initial_accelerations
    anchors = anchors_of(box, box.independent)
    forces = np.abs(forces_of_motion(box, np.zeros(len(box.shafts)), accelerations, anchors))
    return any(
        f > LEAST_INERTIA_SHARE * mesh.law.force_table.max() for f, mesh in zip(forces, model.meshes, strict=True)
    )


def _loaded_coordinates(model: Model, conditions: Conditions, accelerations: np.ndarray) -> np.ndarray:
    """Coordinates in which meshes, bearings and couplings carry the torques and the inertia torques, to first order.

    accelerations   (n_shaft,) of the shafts [rad/s^2]
    """
    box, anchors, torques, drags = (
        model.gearbox,
        conditions.anchors,
        conditions.initial_torques,
        conditions.initial_drags,
    )
    by_name = by_shaft(model, accelerations)
    forces = forces_of_motion(box, torques + drags, accelerations, anchors)
    rigid = motion_of(model, conditions.initial_angles)
    q = _displaced_on_bearings(model, forces) + rigid
    on_rotors = {end.body: conditions.initial_torque(end) for end in conditions.ends}
    for shaft in box.shafts:
        on_rotors |= {
            rotor.name: on_rotors.get(rotor.name, 0.0) - rotor.coupling.inertia * by_name[shaft.name]
            for rotor in shaft.rotors
        }
    twisted: dict[str, dict[str, float]] = {}
    for held in (shaft for shaft in box.shafts if shaft.name in anchors and shaft.rotors):
        spin = model.spins[held.name]
        by_meshes = -forces @ np.array([mesh.row for mesh in model.meshes])
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


def _shared_among_planets(
    model: Model, q: np.ndarray, conditions: Conditions, accelerations: np.ndarray
) -> tuple[np.ndarray, list[str]]:
    """Coordinates in equilibrium near q: displaced pins shift load, which equal mesh forces leave out.

    accelerations   (n_shaft,) of the shafts [rad/s^2], whose inertia torques decide which flanks carry, too

    Meshes have their secant stiffness; those that would pull are taken out, and the rest is solved again. Where planets
    move on pins, or turn about axes that lie beside their carrier's, the deflections of the next iteration are those at
    the coordinates of this one: to first order alone they miss more than light loads press.

    Also returns the names of planets, and of other members beside pins, that carry nothing, each turned to the middle
    between the gears that it meshes with.
    """
    box = model.gearbox
    torques = _torques_at_start(model, conditions, motion_of(model, accelerations))
    applied = conditions.initial_torques + conditions.initial_drags
    forces = forces_of_motion(box, applied, accelerations, conditions.anchors)
    loads = constant_loads(model)
    for end in conditions.ends:
        loads[model.turning[end.body]] += conditions.initial_torque(end)
    for index, torque in torques.items():
        loads[index] += torque
    stiffness = matrices_without_meshes(model)[1]
    rolling = [pin_coordinates(model, pin) for pin in model.pins if pin.law is not None]
    for (part, n), pin in zip(rolling, [pin for pin in model.pins if pin.law is not None], strict=True):
        stiffness[np.ix_(part, part)] -= pin_matrices(pin, np.zeros(len(part)).tolist(), n, 0.0)[0]
    standing = [*(end_coordinate(model, name) for name in conditions.anchors), *held_by_joints(model)]
    free = np.setdiff1d(np.arange(q.size), standing)
    sides, openings = np.sign(forces), np.array([mesh.opening for mesh in model.meshes])
    rows = np.array([_row_of_flank(model, mesh, side) for mesh, side in zip(model.meshes, sides, strict=True)])
    driving = np.array([mesh.reference_deflection for mesh in model.meshes])
    loaded = np.abs(forces) > ROUNDING * np.abs(forces).max()
    pressed = loaded.copy()
    by_position = bool(model.pins) or any(mesh.frame.fixed.any() for mesh in model.meshes)
    for _ in range(ITERATIONS if by_position else 1):
        before = q
        contacts = [_secant(model, *each, q) for each in zip(model.meshes, forces.tolist(), openings, strict=True)]
        touches, secants = np.array(contacts).T
        reference = driving - touches
        for _ in model.meshes:
            springs = np.where(pressed, secants, 0.0)
            total = stiffness + rows.T @ (springs[:, None] * rows)
            on_all, moved = loads - rows.T @ (springs * reference), q.copy()
            if rolling:
                moved = _minimum(model, q, free, total, on_all)
            else:
                moved[free] += np.linalg.lstsq(total[np.ix_(free, free)], (on_all - total @ q)[free])[0]
            pulling = pressed & (sides * (reference + rows @ moved) < 0)
            if not pulling.any():
                q = moved
                break
            pressed &= ~pulling
        forces = np.where(pressed, springs * (reference + rows @ q), forces)
        if not by_position or np.abs(q - before).max() < CONVERGED + 2 * np.spacing(np.abs(q).max()):
            break
        states = [_state_at(model, mesh, turned_with_carriers(model, q)) for mesh in model.meshes]
        driving, openings = np.array([(deflection, opening) for deflection, opening, _ in states]).T
        driving = driving - rows @ q
    open_meshes = ~pressed & (loaded | bool(model.pins))
    members = [x.name for x in box.shafts if x.name in box.planets or (model.pins and not x.rotors)]
    idle = [name for name in members if name not in (*conditions.anchors, *box.reaction_members)]
    unloaded = [name for name in idle if (of_member := _meshes_of(model, name)) and open_meshes[of_member].all()]
    for name in unloaded:
        of_member = _meshes_of(model, name)
        limits = [(model.meshes[i].law.backlash + 2 * openings[i], driving[i] + rows[i] @ q) for i in of_member]
        q[model.spins[name]] += _middle_of_gaps(limits, rows[of_member, model.spins[name]])
    return q, unloaded


def _minimum(model: Model, q: np.ndarray, free: np.ndarray, linear: np.ndarray, loads: np.ndarray) -> np.ndarray:
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


def _row_of_flank(model: Model, mesh: Mesh, side: float) -> np.ndarray:
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


def _middle_of_gaps(limits: Sequence[tuple[float, float]], slopes: np.ndarray) -> float:
    """Angle [rad] by which a member turns to the middle of what its open teeth leave it.

    limits   gap between the flanks and deflection of the driving one of each mesh [m]
    slopes   of the deflections by the angle [m/rad]
    """
    ends = [
        sorted([-deflection / slope, (-gap - deflection) / slope])
        for (gap, deflection), slope in zip(limits, slopes.tolist(), strict=True)
    ]
    low, high = max(end[0] for end in ends), min(end[1] for end in ends)
    if isfinite(low) and isfinite(high):
        return (low + high) / 2
    apart = LEAST_GAP / float(np.abs(slopes).max())
    return high - apart if isfinite(high) else low + apart


def _state_at(model: Model, mesh: Mesh, q: np.ndarray) -> tuple[float, float, float]:
    """Deflection of the driving flank, opening of either [m] and phase of a mesh at coordinates q (n,).

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
        return deflection + beside @ q, opening, phase
    return mesh.reference_deflection + mesh.row @ q, mesh.opening, 0.0


def _meshes_of(model: Model, name: str) -> list[int]:
    """Numbers of the meshes of a shaft, by its name."""
    return [i for i, mesh in enumerate(model.meshes) if name in (mesh.stage.fast.name, mesh.stage.slow.name)]


@contextmanager
def _held_between_teeth(model: Model, q: np.ndarray, planets: Sequence[str]) -> Iterator[None]:
    """Hold the spins of planets that carry nothing at q by weak springs: a static solve needs a regular matrix.

    Nothing else acts on them: their inertia torques press teeth only once these have crossed their gaps.
    """
    with _added(model, [_weak_spring(model, name, float(q[model.spins[name]])) for name in planets]):
        yield


def _weak_spring(model: Model, name: str, angle: float) -> eii.ObjectGenericODE2:
    """A spring at the spin of a planet, whose torque vanishes at an angle [rad]."""
    n = len(model.scene.shafts[name].components)
    matrix, torque = np.zeros((n, n)), np.zeros(n)
    matrix[-1, -1] = WEAK_OMEGA**2 * model.gearbox.body_inertias[name]
    torque[-1] = matrix[-1, -1] * angle
    node = node_of(model.bare_mbs, model.bodies[name])
    return eii.ObjectGenericODE2(nodeNumbers=[node], stiffnessMatrix=matrix, forceVector=torque)


@contextmanager
def _added(model: Model, items: Sequence[eii.ObjectGenericODE2]) -> Iterator[None]:
    """Add items to the system for a while."""
    mbs, numbers = model.bare_mbs, [model.bare_mbs.AddObject(item) for item in items]
    try:
        if numbers:
            mbs.Assemble()
        yield
    finally:
        for number in reversed(numbers):
            mbs.DeleteObject(number, deleteDependentItems=False, suppressWarnings=True)
        if numbers:
            mbs.Assemble()


def _secant(model: Model, mesh: Mesh, force: float, opening: float, q: np.ndarray) -> tuple[float, float]:
    """Deflection [m] at which the flank that a force [N] presses begins to touch, and secant stiffness [N/m].

    opening   of either flank [m]
    """
    deflection = _deflection(model, mesh, force, q) + (2 * (mesh.opening - opening) if force < 0 else 0.0)
    touch = 0.0 if force >= 0 or not isfinite(mesh.law.backlash) else -mesh.law.backlash - 2 * opening
    pressed = deflection - touch
    return touch, force / pressed if pressed else 0.0


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


def _needs_static_solve(model: Model) -> bool:
    """Whether bearings, couplings, loops or several meshes need a static solve for the equilibrium.

    Between two meshes a shaft bears the torque by which the potential of a mesh changes with the phase.
    """
    elastic = any(kind.on_bearings for kind in model.plan.shafts.values())
    return elastic or bool(model.rotor_spins) or len(model.meshes) > 1


def _statically_solved(model: Model, q: np.ndarray, conditions: Conditions, torques: Mapping[int, float]) -> np.ndarray:
    """Coordinates in equilibrium with further torques [N m] on spins, by their indices; the solve starts at q."""
    system = model.bare_mbs.systemData
    settings = exudyn_settings()
    settings.staticSolver.newton.relativeTolerance = 1e-8
    settings.staticSolver.newton.absoluteTolerance = max(ABSOLUTE_TOLERANCE, _rounding_of_forces(model, q))
    settings.staticSolver.loadStepStart = conditions.start_time
    settings.staticSolver.loadStepDuration = STATIC_SOLVE_TIME
    cause = _jammed(model, q) or NO_EQUILIBRIUM
    at_start = explained(model, cause, lambda t: conditions.initial_speed, NoEquilibrium)
    with _applied_torques(model, torques), at_start:
        system.SetODE2Coordinates(q, INITIAL)
        system.SetODE2Coordinates_t(np.zeros(q.size), INITIAL)
        model.bare_mbs.SolveStatic(settings, updateInitialValues=True)
        return system.GetODE2Coordinates(INITIAL)


def _jammed(model: Model, q: np.ndarray) -> str:
    """The mesh whose backlash displaced gears use up most at coordinates q, and the remedy; "" where none does."""
    gaps = {}
    for mesh in model.meshes:
        if isfinite(mesh.law.backlash) and is_spatial(mesh.frame):
            gaps[mesh.stage.name] = mesh.law.backlash + 2 * _state_at(model, mesh, q)[1], mesh.law.backlash
    name = min(gaps, key=lambda x: gaps[x][0], default="")
    if not name or gaps[name][0] >= 0:
        return ""
    gap, backlash = gaps[name]
    moved = f"its forces move gears of {name} so close that their backlash of {backlash / um:.4g} um is used up"
    both = "a tooth would touch both flanks"
    enough = (
        f"stiffer pins or bearings, or a backlash above {(backlash - gap) / um:.3g} um (Gear(s_n=...), backlash=...)"
    )
    return f"{moved}, {both}; take {enough}, less load, or let the speed rise more slowly"


def _rounding_of_forces(model: Model, q: np.ndarray) -> float:
    """Mesh force by a few units in the last place of the coordinates q, which is large after many turns [N].

    Of sets also by those of the positions of the planets: their solve starts so near that this is all that is left.
    """
    largest = max(mesh.law.stiffness_max * np.abs(mesh.row).max() for mesh in model.meshes)
    positions = max(m.law.stiffness_max * np.spacing(abs(m.stage.pair.a)) for m in model.meshes)
    by_positions = positions if model.gearbox.planets else 0.0
    return ROUNDED_UNITS * float(max(largest * np.spacing(np.abs(q).max()), by_positions))


def _torques_at_start(model: Model, conditions: Conditions, accelerations: np.ndarray) -> dict[int, float]:
    """Inertia torques at accelerations (n_coordinates,) and drags [N m], by the index of the spin, unless they are 0.

    Also the inertia forces [N] and moments [N m] of planets on pins, by the indices of their coordinates.

    A static solve, without velocities, leaves them out.
    """
    torques: dict[int, float] = {}
    for shaft, drag in zip(model.gearbox.shafts, conditions.initial_drags, strict=True):
        spin = model.spins[shaft.name]
        torques[spin] = drag - model.gearbox.body_inertias[shaft.name] * accelerations[spin]
        for rotor in shaft.rotors:
            index = model.rotor_spins[rotor.name]
            torques[index] = -rotor.coupling.inertia * accelerations[index]
    for pin in model.pins:
        moving, planet = moving_of(model, pin.planet.name), pin.planet
        masses = np.array([planet.mass] * 3 + [planet.transverse] * 2)[: pin.recorder.components]
        torques |= dict(enumerate(-masses * accelerations[moving], start=moving.start))
    return {spin: float(torque) for spin, torque in torques.items() if torque}


def _with_centrifugal_forces(
    model: Model, torques: Mapping[int, float], speeds: Mapping[str, float]
) -> dict[int, float]:
    """Torques with the centrifugal forces [N] of planets on pins at speeds of the shafts by name [rad/s].

    Also their gyroscopic moments [N m] where their pins are tilted (`_stiffness_by_rotation`).
    """
    total = dict(torques)
    for pin in model.pins:
        forces = -_stiffness_by_rotation(pin, speeds) * pin.arm
        for index, value in enumerate(forces.tolist(), start=moving_of(model, pin.planet.name).start):
            total[index] = total.get(index, 0.0) + value
    return total


def _stiffness_by_rotation(pin: Pin, speeds: Mapping[str, float]) -> np.ndarray:
    """(2 or 5,) stiffness of a planet's displacements [N/m] and tilts [N m/rad] that turn with the carrier.

    At the speed W of the carrier and w of the planet: -m W^2 by centrifugal forces, W (J w - J_t W) by gyroscopic
    moments.

    speeds   of the shafts by name [rad/s]
    """
    planet, omega, spin = pin.planet, speeds[pin.carrier.name], speeds[pin.planet.name]
    softening, gyroscopic = planet.mass * omega**2, omega * (planet.inertia * spin - planet.transverse * omega)
    fast = f"planet {planet.name!r} flies off its pin at {abs(omega) / rpm:.4g} rpm of the carrier"
    held = softening < 0.5 * float(pin.stiffness[0, 0]) and (
        pin.recorder.components == 2 or -gyroscopic < 0.5 * float(pin.stiffness[3, 3])
    )
    require(held, f"{fast}; take a stiffer pin, or a lower speed")
    return np.array([-softening, -softening, 0.0, gyroscopic, gyroscopic])[: pin.recorder.components]


@contextmanager
def _softened_by_rotation(model: Model, speeds: Mapping[str, float]) -> Iterator[None]:
    """Give planets on pins the stiffness of `_stiffness_by_rotation` at speeds of the shafts by name [rad/s]."""
    items = []
    for pin in model.pins:
        stiffness, node = _stiffness_by_rotation(pin, speeds), node_of(model.bare_mbs, model.bodies[pin.planet.name])
        if stiffness.any():
            items.append(eii.ObjectGenericODE2(nodeNumbers=[node], stiffnessMatrix=np.diag([*stiffness, 0.0])))
    with _added(model, items):
        yield


@contextmanager
def _applied_torques(model: Model, torques: Mapping[int, float]) -> Iterator[None]:
    """Apply torques [N m] as loads on the spins with these indices among all coordinates."""
    mbs, loads = model.bare_mbs, []
    first = {mbs.GetNodeODE2Index(n): n for n in range(mbs.systemData.NumberOfNodes())}
    for spin, torque in torques.items():
        start = max(index for index in first if index <= spin)
        marker = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=first[start], coordinate=spin - start))
        loads.append(mbs.AddLoad(eii.LoadCoordinate(markerNumber=marker, load=torque)))
    try:
        if loads:
            mbs.Assemble()
        yield
    finally:
        for load in reversed(loads):
            mbs.DeleteLoad(load, suppressWarnings=True)
        if loads:
            mbs.Assemble()


def _displaced_on_bearings(model: Model, forces: np.ndarray) -> np.ndarray:
    """Coordinates of the shafts on their bearings under mesh forces (n_stage,) [N], spins 0."""
    on_coordinates = -forces @ np.array([mesh.row for mesh in model.meshes])
    q = np.zeros(on_coordinates.size)
    for shaft in model.gearbox.shafts:
        kind, spin, built = model.scene.shafts[shaft.name], model.spins[shaft.name], model.elastics.get(shaft.name)
        if built and built.elastic.spatial:
            try:
                q[built.indices], radial_forces = elastic_displacement(built.elastic, on_coordinates[built.indices])
            except NotCarried as error:
                raise NoEquilibrium(f"{error}; {NOT_CARRIED}") from None
            _check_tables(shaft, radial_forces)
        elif kind.on_bearings:
            moving, on_centre = slice(spin - kind.spin_index, spin), np.zeros(6)
            on_centre[kind.components[:-1]] = on_coordinates[moving]
            try:
                displacement, radial_forces = static_displacement(shaft, on_centre, kind.components[:-1])
            except NotCarried as error:
                raise NoEquilibrium(f"{error}; {NOT_CARRIED}") from None
            _check_tables(shaft, radial_forces)
            q[moving] = displacement[kind.components[:-1]]
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
    return _minimum(model, q, free, stiffness, forces + constant_loads(model))


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


def _with_mesh_forces(model: Model, forces: np.ndarray, q: np.ndarray, anchors: Sequence[str]) -> np.ndarray:
    """The coordinates with spins at which the meshes carry forces (n_stage,) [N]; phases follow the spins."""
    rounding = 2 * np.spacing(np.abs(q).max())
    for _ in range(ITERATIONS):
        before = q
        deflections = [_deflection(model, mesh, f, before) for mesh, f in zip(model.meshes, forces, strict=True)]
        q = with_deflections(model, deflections, before, anchors)
        if np.abs(q - before).max() < CONVERGED + rounding:
            return q
    raise NoEquilibrium(NO_EQUILIBRIUM)


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


def _deflection(model: Model, mesh: Mesh, force: float, q: np.ndarray) -> float:
    """Static deflection [m] of a mesh under a force [N] at coordinates q; NoEquilibrium for loads beyond the map."""
    law = mesh.law
    spin = q[gear_spin(model, mesh.stage, mesh.stage.fast)]
    if mesh.stage.carrier:
        spin -= q[model.spins[mesh.stage.carrier.name]]
    phase = mesh.phase + mesh.frame.direction * mesh.frame.pitches_per_radian * spin
    side = 1 if force >= 0 else -1
    static = static_offsets(model.gearbox, mesh.stage, side)
    of_flank = law.flank_at(side, **{n: x for n, x in static.items() if n in law.offsets})
    if force >= 0:
        return _deflection_under(mesh, of_flank, phase, force, side)
    back = f"backlash must be finite for a load on the back flank of stage {mesh.stage.name}, got {law.backlash}"
    no_contact = f"{back}; give it by the pair, the MeshForce or Stage(backlash=...), or drive another shaft"
    require(isfinite(law.backlash), no_contact)
    backlash = law.backlash + 2 * mesh.opening
    return -backlash - _deflection_under(mesh, of_flank, law.back_phase - phase, -force, side)


def _deflection_under(mesh: Mesh, of_flank: MeshForce, phase: float, force: float, side: int) -> float:
    """Static deflection [m] of a flank under a force >= 0 [N]; NoEquilibrium with the torque to map beyond its law."""
    try:
        return of_flank.deflection_at(phase, force)
    except ValueError:
        law = mesh.law
        reason = larger_torque(law.table.head, force, mesh.stage.pair.pinion.r_b, side if law.coast else 1)
        raise NoEquilibrium(f"load: in stage {mesh.stage.name} {reason}") from None


@contextmanager
def explained(model: Model, remedy: str, speed_of, kind: type[RuntimeError] = RuntimeError) -> Iterator[None]:
    """Turn the exceptions of a solve into a kind of RuntimeError with time, speed and remedy; Ctrl-C passes."""
    try:
        with user_errors_raised(model.bare_mbs):
            yield
    except Exception as error:
        if isinstance(error.__cause__, KeyboardInterrupt):
            raise KeyboardInterrupt from None
        if isinstance(error, AttributeError | NameError | ImportError | LookupError):
            raise  # a mistake in the code, of which Newton's iteration knows nothing
        t = model.bare_mbs.systemData.GetTime()
        where = f"at t = {t:.6g} s ({float(speed_of(t)) / rpm:.5g} rpm)"
        raise kind(f"{where}: {_reason(error, remedy)}{damping_remark(model, t)}") from None


def _reason(error: Exception, remedy: str) -> str:
    """Reason of a failed solve: a force that is not known, a user function of the user, or Newton's iteration."""
    if isinstance(error, Diverged):
        return f"{error.reason}; {remedy}"
    if isinstance(error, OutOfRange):
        return str(error)
    if error.__cause__ is not None:
        named = re.search(USER_FUNCTION, str(error))
        cause = f"{type(error.__cause__).__name__}: {error.__cause__}"
        return f"user function {named.group(1) if named else ''} failed, {cause}"
    return f"Newton's iteration failed; {remedy}"


def damping_remark(model: Model, t: float) -> str:
    """Remark on a run that fails at t [s] where no mesh, bearing or coupling is damped; else empty."""
    return f" ({UNDAMPED})" if model.scene.undamped and t > STATIC_SOLVE_TIME else ""
