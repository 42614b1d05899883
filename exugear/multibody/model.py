"""The built model: a gearbox as an assembled Exudyn system, with what follows from its linear equations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Annotated, Any, NamedTuple

import exudyn as exu
import numpy as np

from exugear.gearbox.bearing import Bearing
from exugear.gearbox.bearing_law import has_rolling_law, tangent_stiffness
from exugear.gearbox.elastic_shaft import rigid_motion
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.mesh_damping import mean_stiffness
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.stage import Stage
from exugear.mesh_force.force import MeshForce
from exugear.multibody.addresses import address_of
from exugear.multibody.direct_call import call_path
from exugear.multibody.drive_items import DriveItems
from exugear.multibody.elastic_rings import BuiltRing
from exugear.multibody.elastic_shafts import BuiltShaft, graphics_bodies, set_held
from exugear.multibody.exudyn_objects import quiet
from exugear.multibody.gear_contact import state_of
from exugear.multibody.linearization import disengaged, set_motion
from exugear.multibody.moving_seats import MovingSeats
from exugear.multibody.planet_pins import Pin, pin_matrices, steepest_matrix
from exugear.multibody.recorder import Recorder
from exugear.operation.train_motion import force_per_torque
from exugear.planning.built_plan import BuiltPlan
from exugear.planning.coordinates import Coordinates
from exugear.planning.integrator_and_step import ANGLE_ON_BEARINGS_AT_1E3, BOUND_MARGIN, STABLE
from exugear.planning.linear_train import STRAIN_SHARE_BESIDE_SHAFTS, FreeSystem, LinearTrain
from exugear.planning.plan import Plan
from fem.support.arguments import checked
from fem.support.validation import require, require_kind

#: Key under which a system keeps the motion of its held shafts, which stand.
REST = "held shafts"
#: Longest step [s] of elastic shafts, and ratio of two steps that count as the same.
LONGEST, CLOSE = 4e-5, 0.98


@dataclass(frozen=True, eq=False)
class BuiltMesh:
    """The mesh of a stage in a built system.

    law                        force law with the axes that the scene needs
    contact                    object number of the gear contact
    recorder                   samples of the contact
    frame                      geometry of the contact
    row                        (n_coordinates,) deflection = reference_deflection + row . coordinates, to first order
    reference_deflection       in the reference configuration, by static displacement of the shafts [m]
    opening                    of either flank in the reference configuration [m]
    phase                      in the reference configuration
    """

    stage: Stage
    law: MeshForce
    contact: int
    recorder: Recorder
    frame: np.record
    row: np.ndarray
    reference_deflection: float
    opening: float
    phase: float


@dataclass(frozen=True, eq=False)
class Mesh(BuiltMesh):
    """The mesh of a stage in a model, with what the linear equations of the present system tell about it.

    mobility                   acceleration along the line of action per mesh force [1/kg]; a shaft with imposed speed
                               does not yield
    acceleration_by_bearings   (12,) acceleration along the line of action per displacement of pinion and wheel [1/s^2];
                               0 for a shaft with nonlinear bearings
    force_per_torque           (n_shaft,) mesh force that balances a torque about z on each shaft, the bearings not yet
                               displaced [1/m]
    force_by_loads             mesh force that balances external forces and weight of both shafts [N]; 0 for a shaft
                               with nonlinear bearings
    free_system                the linear system in which the mesh is a spring between free coordinates, the other
                               meshes at their mean stiffness
    """

    mobility: float
    acceleration_by_bearings: np.ndarray
    force_per_torque: np.ndarray
    force_by_loads: float
    free_system: FreeSystem


@dataclass(frozen=True, eq=False)
class BuiltSystem:
    """A gearbox in an assembled Exudyn system `mbs`, open to further items (call mbs.Assemble() after adding).

    scene           plan by which it was built
    contacts        of the stages, as built
    bodies, spins   of each shaft: object number, index of its spin among the system's coordinates
    rotor_spins     of each rotor behind a coupling, by its name: index of its spin
    end_markers     of each shaft: marker on the spin that drive or load acts on, of a rotor if there is a coupling
    pins            of the planets that move in the plane
    elastics        of the elastic shafts: their bodies and coordinates
    rings           of the elastic rings, by the names of their shafts: their amplitudes
    seats           bearings on seats that move, and the housing with coordinates of its own; None without
    drive_items     drive and load as items of Exudyn, which the system has once they are asked for
    built           numbers of objects and loads of the system as built, without those of drive and load

    For exugear itself the system is `bare_mbs`.
    """

    gearbox: Gearbox
    scene: Plan
    bare_mbs: Annotated[Any, partial(require_kind, kind=exu.MainSystem)]
    container: Annotated[Any, partial(require_kind, kind=exu.SystemContainer)]
    contacts: tuple[BuiltMesh, ...]
    bodies: Mapping[str, int]
    spins: Mapping[str, int]
    rotor_spins: Mapping[str, int]
    end_markers: Mapping[str, int]
    drive_items: DriveItems
    built: tuple[int, int]
    pins: tuple[Pin, ...]
    elastics: Mapping[str, BuiltShaft]
    rings: Mapping[str, BuiltRing]
    seats: MovingSeats | None = field(default=None, kw_only=True)

    @property
    def mbs(self) -> Any:
        """The assembled Exudyn system, which has drive and load as items from when it is asked for."""
        return self.drive_items.ask(for_numbers=False).mbs

    @property
    def drive(self) -> int:
        """Object number of the constraint that imposes the speed of the driving shaft."""
        return self.drives[0]

    @property
    def drives(self) -> tuple[int, ...]:
        """Object numbers of all constraints that impose speeds: of the driving shaft, and further ones left free."""
        return self.drive_items.ask().numbers

    @property
    def load(self) -> int | None:
        """Number of the load torque on the driven shaft."""
        return self.drive_items.ask().load

    @property
    def rotors(self) -> dict[str, int]:
        """Of each shaft with a coupling: index of the spin of the rotor that its drive or load acts on."""
        return {shaft.name: self.rotor_spins[shaft.end] for shaft in self.gearbox.shafts if shaft.rotors}

    @property
    def turning(self) -> dict[str, int]:
        """Index of the spin of each shaft and of each rotor, by name."""
        return {**self.spins, **self.rotor_spins}

    @property
    def speed_ratios(self) -> np.ndarray:
        """(n_coordinates,) speed of each coordinate over that of the driving shaft; 0 for all but the spins.

        Of planets on pins also the velocity of their centres in the reference configuration [m].
        """
        return motion_of(self, self.gearbox.nominal_ratios)

    @property
    def spin_motions(self) -> dict[str, np.ndarray]:
        """(n_coordinates,) small motion per angle of each shaft; planets on pins move along with their carrier."""
        motions = {name: np.zeros(self.bare_mbs.systemData.ODE2Size()) for name in self.spins}
        for name, spin in self.spins.items():
            motions[name][[spin, *(self.elastics[name].spins.values() if name in self.elastics else ())]] = 1.0
        for pin in self.pins:
            motions[pin.carrier.name][moving_of(self, pin.planet.name)] = pin.orbit
        return motions

    @property
    def mesh_cycles(self) -> np.ndarray:
        """(n_stage,) mesh cycles per radian of the driving shaft; on a carrier those of the speed in its frame."""
        return np.abs(self.gearbox.cycles @ self.gearbox.nominal_ratios)


@checked
@dataclass(frozen=True, eq=False)
class Model(BuiltSystem):
    """A gearbox in an assembled Exudyn system `mbs`, open to further items (call mbs.Assemble() after adding).

    plan     of the built system, with integrator, step and cost
    meshes   of the stages

    Its further fields are those of the system: gearbox, container, bodies and spins of the shafts, rotor_spins,
    end_markers. `mbs`, `drive` (the constraint that imposes the speed) and `load` are for your own items and solves:
    the system has drive and load as items of Exudyn from when you first ask for one of the three. Runs take longer
    from then on, those on spins 1.2 times as long; a gearbox that is only run needs none of them.
    """

    plan: BuiltPlan
    meshes: tuple[Mesh, ...]

    def __repr__(self) -> str:
        return f"Model of {self.gearbox!r}\n{self.plan}"


def motion_of(model: BuiltSystem, shafts: np.ndarray) -> np.ndarray:
    """(n_coordinates,) speeds, accelerations or small angles of all coordinates from those of the shafts (n_shaft,).

    Rotors turn with their shafts; planets on pins move with their carriers in the reference configuration.
    """
    motion, by_name = np.zeros(model.bare_mbs.systemData.ODE2Size()), by_shaft(model, shafts)
    for name, shaft in model.gearbox.ends.items():
        motion[model.turning[name]] = by_name[shaft.name]
    for name, built in model.elastics.items():
        motion[[*built.spins.values()]] = by_name[name]
    for pin in model.pins:
        motion[moving_of(model, pin.planet.name)] = by_name[pin.carrier.name] * pin.orbit
    return motion


def by_shaft(model: BuiltSystem, values: np.ndarray) -> dict[str, float]:
    """Values (n_shaft,) by the names of the shafts."""
    return dict(zip([shaft.name for shaft in model.gearbox.shafts], values.tolist(), strict=True))


def moving_of(model: BuiltSystem, name: str) -> slice:
    """Indices of the displacements and tilts of a body, all but its spin, by the name of its shaft."""
    spin = model.spins[name]
    return slice(spin - model.scene.shafts[name].spin_index, spin)


def require_model(model) -> None:
    """ValueError for another object than a built gearbox."""
    require(isinstance(model, Model), f"model must be an exugear.Model, got {type(model).__name__}; build(gearbox)")


def further_objects(model: BuiltSystem) -> list[int]:
    """Numbers of the objects that were added to the built system, graphics apart."""
    numbers = range(model.built[0], model.bare_mbs.systemData.NumberOfObjects())
    known = {*map(int, model.drive_items.numbers), *graphics_bodies(model.bare_mbs)}
    return [number for number in numbers if number not in known]


def further_loads(model: BuiltSystem) -> list[int]:
    """Numbers of the loads that were added to the built system."""
    numbers = range(model.built[1], model.bare_mbs.systemData.NumberOfLoads())
    return [number for number in numbers if number not in map(int, model.drive_items.loads)]


def hold_members(system: BuiltSystem) -> None:
    """Let the contacts and pins of held shafts see them at rest, and keep their torques from the coordinates.

    Pins of other shafts forget what a run has imposed.
    """
    motion, _ = system.bare_mbs.variables[REST]
    for mesh in system.contacts:
        state = state_of(system.bare_mbs, mesh.contact)
        for side, shaft in enumerate(mesh.stage.shafts):
            if shaft.name in system.gearbox.held:
                state.imposed[side], state.inertias[side] = address_of(motion), 0.0
    for pin in system.pins:
        pin.record.torque, pin.record.inertia = 0.0, 0.0
        pin.record.imposed = address_of(motion) if pin.carrier.name in system.gearbox.held else 0


def end_coordinate(system: BuiltSystem, name: str) -> int:
    """Index of the spin that drive or load of a shaft acts on: that of a rotor if it has a coupling."""
    return system.rotors.get(name, system.spins[name])


def linearized(system: BuiltSystem, held: Sequence[str], speed: float = 0.0) -> Model:
    """The model of a built system, from its present linear equations, further items included.

    held    names of the shafts whose speeds are imposed
    speed   of the driving shaft [rad/s], at which drag damps and gyroscopic moments act
    """
    for name, elastic in system.elastics.items():
        set_held(system.bare_mbs, elastic, held=name in held)
    train, box = linear_train(system, speed), system.gearbox
    driving, imposed = ([end_coordinate(system, name) for name in names] for names in (box.independent, held))
    twisting = [end_coordinate(system, name) for name in held if box.ends[name].twist]
    omega, omega_mesh = _frequency_bounds(system, train, twisting, held)
    sets = [[box.labels.index(label) for label in labels] for labels in system.scene.set_stages.values()]
    resonances = zip(*(train.mesh_resonances(names, sets).tolist() for names in (driving, ())), strict=True)
    largest = [float(mesh.law.table.head.last_force) * mesh.stage.pair.pinion.r_b for mesh in system.contacts]
    supports = [
        bearing
        for shaft in box.shafts
        if system.scene.shafts[shaft.name].on_bearings
        for bearing in shaft.bearings.values()
    ]
    decay, damping_ratio = train.decay(imposed)
    plan = BuiltPlan(
        **vars(system.scene),
        omega=omega,
        omega_mesh=omega_mesh,
        contact=call_path(),
        mesh_resonances=dict(zip(box.labels, resonances, strict=True)),
        decay=decay,
        damping_ratio=damping_ratio,
        largest_torques=dict(zip(box.labels, largest, strict=True)),
        supports=len(supports),
        rolling=sum(map(has_rolling_law, supports)),
    )
    per_torque = force_per_torque(box, held)
    meshes = tuple(_mesh(system, train, i, imposed, per_torque) for i in range(len(system.contacts)))
    built = {x.name: getattr(system, x.name) for x in fields(BuiltSystem)}
    return Model(**built, plan=plan, meshes=meshes)


def _frequency_bounds(
    system: BuiltSystem, train: LinearTrain, twisting: Sequence[int], held: Sequence[str]
) -> tuple[float, float]:
    """`LinearTrain.frequency_bounds`, elastic shafts as in the longest steps that they and the bounds allow."""
    if not system.elastics:
        return train.frequency_bounds(twisting)
    step, reached = min(system.scene.steps.values(), default=LONGEST), 0.0
    while True:
        mass, _ = added_in_steps(system, step, held)
        in_steps = replace(train, mass=train.mass + mass)
        omega, omega_mesh = in_steps.frequency_bounds(twisting, STRAIN_SHARE_BESIDE_SHAFTS)
        reached = min(step, ANGLE_ON_BEARINGS_AT_1E3 / omega_mesh, BOUND_MARGIN * STABLE / omega)
        if reached > CLOSE * step:
            return omega, omega_mesh
        step = reached


def added_in_steps(system: BuiltSystem, step: float, held: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """(n, n) mass and damping that elastic shafts have beside their own in steps [s] (`modes_in_steps`).

    held   names of the shafts whose speeds are imposed
    """
    added = np.zeros((2, system.bare_mbs.systemData.ODE2Size(), system.bare_mbs.systemData.ODE2Size()))
    for name, built in system.elastics.items():
        part = np.ix_(built.indices, built.indices)
        for matrix, of_shaft in zip(added, built.elastic.added_in_steps(step, held=name in held), strict=True):
            matrix[part] += of_shaft
    return added[0], added[1]


def linear_train(system: BuiltSystem, speed: float) -> LinearTrain:
    """The linear equations of the present system, with the damping at a speed of the driving shaft [rad/s]."""
    mass, stiffness, damping = matrices_without_meshes(system)
    if speed:
        damping = matrices_without_meshes(system, speed)[2]
    rows = np.zeros((len(system.contacts), len(mass)))
    for row, mesh in zip(rows, system.contacts, strict=True):
        row[: mesh.row.size] = mesh.row
    laws = [(mesh.law, mesh.stage.pair) for mesh in system.contacts]
    mean = np.array([mean_stiffness(law, pair) for law, pair in laws])
    largest, of_meshes = np.array([(law.stiffness_max, law.damping) for law, _ in laws]).T
    stiffness = stiffness + nonlinear_bearing_stiffness(system)
    return LinearTrain(mass, stiffness, damping, rows, mean, largest, of_meshes, held_by_joints(system))


def matrices_without_meshes(system: BuiltSystem, speed: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, stiffness and damping matrix of the built system without the meshes, at a speed of the driving shaft."""
    mbs, rest = system.bare_mbs, np.zeros(system.bare_mbs.systemData.ODE2Size())
    contacts = [mesh.contact for mesh in system.contacts]
    with set_motion(mbs, rest, speed * system.speed_ratios), disengaged(mbs, contacts), quiet():
        mass, stiffness, damping = map(np.array, mbs.ComputeLinearizedSystem()[:3])
    return mass, stiffness, damping


def _mesh(system: BuiltSystem, train: LinearTrain, i: int, held: Sequence[int], per_torque: np.ndarray) -> Mesh:
    """The mesh of a stage with the accelerations of its bodies along the line of action, by mesh force and bearings.

    held         indices of the coordinates whose motion is imposed
    per_torque   (n_stage, n_shaft) mesh forces by torques about z [1/m], the bearings rigid
    """
    built, accelerations = system.contacts[i], train.acceleration_by_force(i, held)
    orbits = built.stage.carrier is not None and built.stage.carrier.name in system.gearbox.carriers_of_pins
    mobility = float(train.rows[i] @ accelerations)
    forces_on_bodies, by_bearings, holding = per_torque.T @ train.rows, np.zeros((2, 6)), per_torque[i]
    constant, by_loads = constant_loads(system), 0.0
    for by_displacement, shaft in zip(by_bearings, (built.stage.fast, built.stage.slow), strict=True):
        if all(bearing.linear for bearing in shaft.bearings.values()) and not orbits:
            components = system.scene.shafts[shaft.name].components[:-1]
            spin = gear_spin(system, built.stage, shaft)
            displacements = slice(spin - len(components), spin)
            by_displacement[components] = on_body(system, built.stage, shaft, train.stiffness @ accelerations)
            holding = holding - forces_on_bodies[:, displacements] @ accelerations[displacements] / mobility
            by_loads += float(accelerations[displacements] @ on_body(system, built.stage, shaft, constant)) / mobility
    if built.stage.slow.name in system.rings:
        amplitudes = system.rings[built.stage.slow.name].indices
        holding = holding - forces_on_bodies[:, amplitudes] @ accelerations[amplitudes] / mobility
    of_stage = {x.name: getattr(built, x.name) for x in fields(BuiltMesh)} | {"row": train.rows[i]}
    return Mesh(
        **of_stage,
        mobility=mobility,
        acceleration_by_bearings=by_bearings.ravel(),
        force_per_torque=holding,
        force_by_loads=by_loads,
        free_system=train.around(i, held),
    )


def constant_loads(system: BuiltSystem) -> np.ndarray:
    """(n_coordinates,) external forces and weight of the shafts on their bearings."""
    loads = np.zeros(system.bare_mbs.systemData.ODE2Size())
    for shaft in system.gearbox.shafts:
        kind, built = system.scene.shafts[shaft.name], system.elastics.get(shaft.name)
        if built:
            loads[built.indices] += built.elastic.constant_load
        elif kind.on_bearings and shaft.is_loaded:
            loads[moving_of(system, shaft.name)] += shaft.constant_load[kind.components[:-1]]
    return loads


def gear_spin(system: BuiltSystem, stage: Stage, shaft: Shaft) -> int:
    """Index of the spin of the body that carries the gear of a shaft in a stage."""
    if shaft.name not in system.elastics:
        return system.spins[shaft.name]
    return system.elastics[shaft.name].spins[dict(stage.ends)[shaft.name]]


def is_first(system: BuiltSystem, stage: Stage, shaft: Shaft) -> bool:
    """Whether the gear of a shaft in a stage is that whose spin is the spin of the shaft."""
    return shaft.name not in system.elastics or gear_spin(system, stage, shaft) == system.spins[shaft.name]


def on_body(system: BuiltSystem, stage: Stage, shaft: Shaft, forces: np.ndarray) -> np.ndarray:
    """Forces (n_coordinates,) on a shaft as those on the displacements of the body with its gear in a stage.

    The other coordinates of an elastic shaft follow the body as in statics.
    """
    number = len(system.scene.shafts[shaft.name].components) - 1
    if shaft.name not in system.elastics or number == 0:
        return forces[system.spins[shaft.name] - number : system.spins[shaft.name]]
    built = system.elastics[shaft.name]
    return (built.following(dict(stage.ends)[shaft.name]).T @ forces[built.indices])[:number]


def held_by_joints(system: BuiltSystem) -> np.ndarray:
    """Indices of the coordinates that ideal joints constrain, and of the spins of held shafts."""
    spins = [system.spins[name] for name, kind in system.scene.shafts.items() if kind is Coordinates.JOINT]
    held = [system.spins[name] for name in system.gearbox.held]
    return np.array([*(spin - k for spin in spins for k in range(1, 6)), *held], int)


def nonlinear_bearing_stiffness(system: BuiltSystem) -> np.ndarray:
    """Stiffness matrix of the nonlinear bearings at their steepest slopes."""
    total = np.zeros((system.bare_mbs.systemData.ODE2Size(),) * 2)
    for pin in system.pins:
        if pin.law is not None:
            between, n = pin_coordinates(system, pin)
            total[np.ix_(between, between)] += steepest_matrix(pin, np.zeros(len(between)).tolist(), n)
    for rows, bearing, indices in bearings_of(system):
        if not bearing.linear:
            k = bearing.stiffness - tangent_stiffness(bearing, 0.0, np.zeros(6))
            total[np.ix_(indices, indices)] += rows.T @ k @ rows
    return total


class BearingInSystem(NamedTuple):
    """A bearing with the rows (6, k) that measure the motion in it by coordinates with indices (k,) in the system."""

    rows: np.ndarray
    bearing: Bearing | RollingBearing
    indices: np.ndarray


def bearings_of(system: BuiltSystem) -> list[BearingInSystem]:
    """The bearings of all shafts that move on them, without pins: those on ground, then those on moving seats."""
    on_seats = [x.seat for x in system.seats.seats] if system.seats else []
    listed = []
    for shaft in system.gearbox.shafts:
        kind, built = system.scene.shafts[shaft.name], system.elastics.get(shaft.name)
        if not kind.on_bearings or shaft.name in system.gearbox.planets:
            continue
        spin = system.spins[shaft.name]
        indices = built.indices if built else np.arange(spin - kind.spin_index, spin + 1)
        for axial, bearing in shaft.bearings.items():
            if (shaft.name, axial) not in on_seats:
                rigid = rigid_motion(axial - shaft.centre)[:, kind.components]
                listed.append(BearingInSystem(built.elastic.at_bearing(axial) if built else rigid, bearing, indices))
    moving = system.seats.seats if system.seats else ()
    return [*listed, *(BearingInSystem(x.rows, x.bearing, system.seats.indices) for x in moving if system.seats)]


def pin_coordinates(system: BuiltSystem, pin: Pin) -> tuple[list[int], int]:
    """Indices of the coordinates of the carrier of a pin, then of its planet, and the number of the former."""
    carrier, planet = system.spins[pin.carrier.name], system.spins[pin.planet.name]
    n, m = (len(system.scene.shafts[shaft.name].components) for shaft in (pin.carrier, pin.planet))
    return [*range(carrier - n + 1, carrier + 1), *range(planet - m + 1, planet + 1)], n


class BearingTangents(NamedTuple):
    """Changes (n, n) of the stiffness and damping matrix of the linear system by nonlinear bearings in a state."""

    stiffness: np.ndarray
    damping: np.ndarray


def bearing_tangents(system: BuiltSystem, q: np.ndarray) -> BearingTangents:
    """What the tangents of nonlinear bearings at coordinates q (n,) add to the linear system, which has their steepest.

    The damping of the linear system is that at rest.
    """
    stiffness, damping = -nonlinear_bearing_stiffness(system), np.zeros((q.size, q.size))
    for pin in system.pins:
        if pin.law is not None:
            between, n = pin_coordinates(system, pin)
            loaded = pin_matrices(pin, q[between].tolist(), n, float(q[between[n - 1]]))
            unloaded = pin_matrices(pin, np.zeros(len(between)).tolist(), n, 0.0)
            stiffness[np.ix_(between, between)] += loaded[0] - unloaded[0]
            damping[np.ix_(between, between)] += loaded[1] - unloaded[1]
    for rows, bearing, indices in bearings_of(system):
        if not bearing.linear:
            at_rest, now = (tangent_stiffness(bearing, 0.0, x) for x in (np.zeros(6), rows @ q[indices]))
            change, among = rows.T @ (now - at_rest) @ rows, np.ix_(indices, indices)
            stiffness[among] += change
            damping[among] += bearing.damping_time * change
    return BearingTangents(stiffness, damping)


def on_bearings(model: BuiltSystem, mesh: BuiltMesh) -> bool:
    """Whether a shaft of a mesh stands on elastic bearings."""
    return any(model.scene.shafts[shaft.name].on_bearings for shaft in (mesh.stage.fast, mesh.stage.slow))
