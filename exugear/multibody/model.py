"""The built model: a gearbox as an assembled Exudyn system, with its matrices and frequency bounds."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from math import pi, sqrt
from typing import Annotated, Any, NamedTuple

import exudyn as exu
import numpy as np
import scipy

from exugear.contact.recorder import Recorder
from exugear.gearbox.bearing_law import radial_part
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.mesh_damping import mean_stiffness
from exugear.gearbox.stage import Stage
from exugear.mesh_force.force import MeshForce
from exugear.multibody.exudyn_objects import INITIAL, quiet
from exugear.multibody.gear_contact import state_of
from exugear.operation.train_motion import force_per_torque
from exugear.planning.built_plan import BuiltPlan
from exugear.planning.coordinates import Coordinates
from exugear.planning.vibration_decay import slowest_decay
from fem.support.arguments import checked
from fem.support.validation import require, require_kind

#: Share of a mode's strain energy in the meshes above which the step must resolve the mode.
STRAIN_SHARE = 0.02


class FreeSystem(NamedTuple):
    """Matrices of the coordinates that neither joints nor an imposed speed hold, and the indices of these."""

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    free: np.ndarray


@dataclass(frozen=True, eq=False)
class Mesh:
    """The mesh of a stage in the built system.

    law                        force law with the axes that the scene needs
    contact                    object number of the gear contact
    recorder                   samples of the contact
    frame                      geometry of the contact
    row                        (n_coordinates,) deflection = reference_deflection + row . coordinates, to first order
    reference_deflection       in the reference configuration, by static displacement of the shafts [m]
    opening                    of either flank in the reference configuration [m]
    phase                      in the reference configuration
    mobility                   acceleration along the line of action per mesh force [1/kg]; a shaft with imposed speed
                               does not yield
    acceleration_by_bearings   (12,) acceleration along the line of action per displacement of pinion and wheel [1/s^2];
                               0 for a shaft with nonlinear bearings
    free_system                the linear system in which the mesh is a spring between free coordinates, the other
                               meshes at their mean stiffness
    force_per_torque           (n_shaft,) mesh force that balances a torque about z on each shaft, the bearings not yet
                               displaced [1/m]
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
    mobility: float = 0.0
    acceleration_by_bearings: np.ndarray = field(default_factory=lambda: np.zeros(12))
    force_per_torque: np.ndarray = field(default_factory=lambda: np.zeros(0))
    free_system: FreeSystem | None = None


@checked
@dataclass(frozen=True, eq=False)
class Model:
    """A gearbox in an assembled Exudyn system `mbs`, open to further items (call mbs.Assemble() after adding).

    bodies, spins   of each shaft: object number, index of its spin among the system's coordinates
    rotor_spins     of each rotor behind a coupling, by its name: index of its spin
    end_markers     of each shaft: marker on the spin that drive or load acts on, of a rotor if there is a coupling
    drive, load     object number of the constraint that imposes the speed, number of the load torque
    """

    gearbox: Gearbox
    plan: BuiltPlan
    mbs: Annotated[Any, partial(require_kind, kind=exu.MainSystem)]
    container: Annotated[Any, partial(require_kind, kind=exu.SystemContainer)]
    bodies: Mapping[str, int]
    spins: Mapping[str, int]
    rotor_spins: Mapping[str, int]
    meshes: tuple[Mesh, ...]
    end_markers: Mapping[str, int]
    drive: int
    load: int

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
        """(n_coordinates,) speed of each coordinate over that of the driving shaft; 0 for all but the spins."""
        ratios = np.zeros(self.mbs.systemData.ODE2Size())
        for name, shaft in self.gearbox.ends.items():
            ratios[self.turning[name]] = self.gearbox.ratios[shaft.name]
        return ratios

    @property
    def mesh_cycles(self) -> np.ndarray:
        """(n_stage,) mesh cycles per radian of the driving shaft."""
        box = self.gearbox
        return np.array([abs(box.ratios[s.fast.name]) * s.pair.pinion.z / (2 * pi) for s in box.stages])

    def __repr__(self) -> str:
        return f"Model of {self.gearbox!r}\n{self.plan}"


def require_model(model) -> None:
    """ValueError for another object than a built gearbox."""
    require(isinstance(model, Model), f"model must be an exugear.Model, got {type(model).__name__}; build(gearbox)")


def further_objects(model: Model) -> range:
    """Numbers of the objects that were added to the built system, whose last object is the drive."""
    return range(int(model.drive) + 1, model.mbs.systemData.NumberOfObjects())


def further_loads(model: Model) -> range:
    """Numbers of the loads that were added to the built system."""
    return range(int(model.load) + 1, model.mbs.systemData.NumberOfLoads())


def end_coordinate(model: Model, name: str) -> int:
    """Index of the spin that drive or load of a shaft acts on: that of a rotor if it has a coupling."""
    return model.rotors.get(name, model.spins[name])


def linearized(model: Model, held: str | None, speed: float = 0.0) -> Model:
    """The model with the rows, frequency bounds and mobilities of its present system, further items included.

    held    name of the shaft whose speed is imposed, None if all are free
    speed   of the driving shaft [rad/s], at which drag damps and gyroscopic moments act
    """
    added = model.mbs.systemData.ODE2Size() - model.meshes[0].row.size
    meshes = tuple(replace(mesh, row=np.append(mesh.row, np.zeros(added))) for mesh in model.meshes)
    model = replace(model, meshes=meshes)
    mass, stiffness, damping = matrices_without_meshes(model)
    if speed:
        damping = matrices_without_meshes(model, speed)[2]
    omega, omega_mesh = _frequency_bounds(model, mass, stiffness)
    meshes = tuple(_with_mobility(model, mesh, mass, stiffness, held) for mesh in meshes)
    meshes = tuple(replace(m, free_system=_free_system(model, m, mass, stiffness, damping, held)) for m in meshes)
    resonances = _mesh_resonances(model, mass, stiffness)
    decay = _decay(model, mass, stiffness, damping, held)
    plan = replace(model.plan, omega=omega, omega_mesh=omega_mesh, mesh_resonances=resonances, decay=decay)
    plan = replace(plan, largest_torques=_largest_torques(model))
    return replace(model, plan=plan, meshes=meshes)


def matrices_without_meshes(model: Model, speed: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, stiffness and damping matrix of the built system without the meshes, at a speed of the driving shaft."""
    system = model.mbs.systemData
    before = system.GetODE2Coordinates(INITIAL), system.GetODE2Coordinates_t(INITIAL)
    states = [state_of(model.mbs, mesh.contact) for mesh in model.meshes]
    try:
        system.SetODE2Coordinates(np.zeros(system.ODE2Size()), INITIAL)
        system.SetODE2Coordinates_t(speed * model.speed_ratios, INITIAL)
        for state in states:
            state.engaged = 0.0
        with quiet():
            matrices = model.mbs.ComputeLinearizedSystem()
    finally:
        system.SetODE2Coordinates(before[0], INITIAL)
        system.SetODE2Coordinates_t(before[1], INITIAL)
        for state in states:
            state.engaged = 1.0
    mass, stiffness, damping = map(np.array, matrices[:3])
    return mass, stiffness, damping


def _with_mobility(model: Model, mesh: Mesh, mass: np.ndarray, stiffness: np.ndarray, held: str | None) -> Mesh:
    """The mesh with the accelerations of its bodies along the line of action, by the mesh force and by bearings."""
    accelerations = _acceleration_by_force(model, mesh, mass, held)
    mobility = float(mesh.row @ accelerations)
    static_forces = force_per_torque(model.gearbox, held)
    forces_on_bodies = static_forces.T @ np.array([each.row for each in model.meshes])
    by_bearings, per_torque = np.zeros((2, 6)), static_forces[model.meshes.index(mesh)]
    for by_displacement, shaft in zip(by_bearings, (mesh.stage.fast, mesh.stage.slow), strict=True):
        if all(bearing.linear for bearing in shaft.bearings.values()):
            components = model.plan.shafts[shaft.name].components[:-1]
            displacements = slice(model.spins[shaft.name] - len(components), model.spins[shaft.name])
            by_displacement[components] = (stiffness @ accelerations)[displacements]
            per_torque = per_torque - forces_on_bodies[:, displacements] @ accelerations[displacements] / mobility
    mesh = replace(mesh, mobility=mobility, force_per_torque=per_torque)
    return replace(mesh, acceleration_by_bearings=by_bearings.ravel())


def _acceleration_by_force(model: Model, mesh: Mesh, mass: np.ndarray, held: str | None) -> np.ndarray:
    """(n_coordinates,) accelerations by a unit mesh force [1/kg, 1/(kg m)], the held shaft fixed."""
    free = _free_coordinates(model, held)
    accelerations = np.zeros(len(mass))
    accelerations[free] = np.linalg.solve(mass[np.ix_(free, free)], mesh.row[free])
    return accelerations


def _free_coordinates(model: Model, held: str | None) -> np.ndarray:
    """Indices of the coordinates that neither ideal joints nor an imposed speed constrain."""
    constrained = held_by_joints(model)
    if held:
        constrained = np.append(constrained, end_coordinate(model, held))
    return np.setdiff1d(np.arange(model.meshes[0].row.size), constrained)


def _free_system(model: Model, mesh: Mesh, mass, stiffness, damping, held: str | None) -> FreeSystem:
    """The linear system in which a mesh is a spring, from the matrices of the system without meshes."""
    stiffness, damping = stiffness + nonlinear_bearing_stiffness(model), damping.copy()
    for other_mesh in model.meshes:
        if other_mesh.contact != mesh.contact:
            law, product = other_mesh.law, np.outer(other_mesh.row, other_mesh.row)
            stiffness += mean_stiffness(law, other_mesh.stage.pair) * product
            damping += law.damping * product
    free = _free_coordinates(model, held)
    part = np.ix_(free, free)
    return FreeSystem(mass[part], stiffness[part], damping[part], free)


def _mesh_resonances(model: Model, mass: np.ndarray, stiffness: np.ndarray) -> dict[str, tuple[float, float]]:
    """For each stage the frequency [Hz] of the mode that strains its mesh most: driving speed imposed, and free.

    Each mesh has its mean stiffness at the largest torque of its map.
    """
    stiffness, rows = stiffness + nonlinear_bearing_stiffness(model), _stiff_rows(model)
    frequencies = []
    for held in (model.gearbox.driving.name, None):
        free = _free_coordinates(model, held)
        total = stiffness[np.ix_(free, free)] + rows[:, free].T @ rows[:, free]
        squares, modes = scipy.linalg.eigh((total + total.T) / 2, mass[np.ix_(free, free)])
        strain_share = (rows[:, free] @ modes) ** 2 / np.maximum(squares, 1.0)
        frequencies.append(np.sqrt(np.maximum(squares, 0.0))[strain_share.argmax(axis=1)] / (2 * pi))
    return {label: (float(h), float(f)) for label, h, f in zip(model.gearbox.labels, *frequencies, strict=True)}


def _largest_torques(model: Model) -> dict[str, float]:
    """Largest torque on the pinion [N m] that each law reaches, by the label of the stage."""
    torques = [float(mesh.law.table.head.last_force) * mesh.stage.pair.pinion.r_b for mesh in model.meshes]
    return dict(zip(model.gearbox.labels, torques, strict=True))


def _stiff_rows(model: Model) -> np.ndarray:
    """(n_stage, n_coordinates) rows of the meshes times the roots of their mean stiffnesses at the largest torques."""
    roots = np.sqrt([mean_stiffness(mesh.law, mesh.stage.pair) for mesh in model.meshes])
    return roots[:, None] * np.array([mesh.row for mesh in model.meshes])


def _decay(model: Model, mass: np.ndarray, stiffness: np.ndarray, damping: np.ndarray, held: str | None) -> float:
    """Rate of decay [1/s] of the slowest mode that the meshes excite; the damping of nonlinear bearings counts not."""
    free, rows = _free_coordinates(model, held), _stiff_rows(model)
    damped_rows = np.array([np.sqrt(mesh.law.damping) * mesh.row for mesh in model.meshes])
    total = stiffness + nonlinear_bearing_stiffness(model) + rows.T @ rows
    part = np.ix_(free, free)
    return slowest_decay(mass[part], total[part], (damping + damped_rows.T @ damped_rows)[part], rows[:, free])


def _frequency_bounds(model: Model, mass: np.ndarray, stiffness: np.ndarray) -> tuple[float, float]:
    """Upper bounds of all eigenfrequencies, and of those of the modes in which meshes deform [rad/s].

    Each mesh and nonlinear bearing has its largest stiffness; the driving shaft is free to turn.
    """
    stiffness = stiffness + nonlinear_bearing_stiffness(model)
    free = _free_coordinates(model, None)
    mass, stiffness = mass[np.ix_(free, free)], stiffness[np.ix_(free, free)]
    rows = np.array([np.sqrt(mesh.law.stiffness_max) * mesh.row[free] for mesh in model.meshes])
    stiffness += rows.T @ rows
    squares, modes = scipy.linalg.eigh((stiffness + stiffness.T) / 2, mass)
    strained = ((rows @ modes) ** 2).sum(axis=0) > STRAIN_SHARE * np.maximum(squares, 0)
    return sqrt(squares[-1]), sqrt(squares[strained][-1])


def held_by_joints(model: Model) -> np.ndarray:
    """Indices of the coordinates that ideal joints constrain."""
    spins = [model.spins[name] for name, kind in model.plan.shafts.items() if kind is Coordinates.JOINT]
    return np.array([spin - k for spin in spins for k in range(1, 6)], int)


def nonlinear_bearing_stiffness(model: Model, secants: Mapping[str, Mapping[float, float]] | None = None) -> np.ndarray:
    """Stiffness matrix of the nonlinear bearings, at their steepest slopes or by secants.

    secants   secant stiffness [N/m] of each bearing, by shaft and axial position
    """
    total = np.zeros((model.mbs.systemData.ODE2Size(),) * 2)
    for shaft in model.gearbox.shafts:
        first = model.spins[shaft.name] - 5
        for axial, bearing in shaft.bearings.items():
            if not bearing.linear:
                k = float(bearing.stiffness[0, 0]) if secants is None else secants[shaft.name][axial]
                total[first : first + 6, first : first + 6] += radial_part(k, axial - shaft.centre)
    return total


def on_bearings(model: Model, mesh: Mesh) -> bool:
    """Whether a shaft of a mesh stands on elastic bearings."""
    return any(model.plan.shafts[shaft.name].on_bearings for shaft in (mesh.stage.fast, mesh.stage.slow))
