"""A loaded system as linear equations: matrices, meshes and elastic elements, and the motions its constraints allow."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from exugear.modal.elastic_elements import (
    UNNAMED,
    ElasticElement,
    bearings_and_couplings,
    embedded,
    names_of_nodes,
    springs,
)
from exugear.modal.mesh_tangents import mesh_tangent
from exugear.multibody.bearings_and_drags import drag_name
from exugear.multibody.exudyn_objects import INITIAL, current_state
from exugear.multibody.gear_contact import contacts_of
from exugear.multibody.linearization import disengaged, set_velocities
from exugear.multibody.model import Model, further_objects
from exugear.planning.eigenmodes import measured_rows, rigid_motions
from fem.support.validation import require

#: Stiffness that no element accounts for, as share of the diagonal, above which it counts as a further element.
UNACCOUNTED = 1e-6
NOT_PRESSED = (
    "load: no teeth are pressed in the initial state; take a larger load, of a hand-built system solve for its "
    "equilibrium with mbs.SolveStatic(updateInitialValues=True), which makes the solution its initial state"
)


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """Equations M q'' + D q' + K q = 0 about a static equilibrium.

    mass, stiffness   (n, n), symmetric parts
    damping           (n_speed, n, n) with gyroscopic terms, at each speed
    motions           (n, n_free) columns of motions that the constraints allow
    elements          meshes, then bearings, couplings and springs
    stages            names of the meshes
    mesh_force        (n_stage,) [N]
    mesh_stiffness    (n_stage,) [N/m]
    rows              (n_stage, n) slopes of the deflections of the meshes by the coordinates
    rigid             (n_free, r) motions that the constraints allow and that no element resists
    """

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    motions: np.ndarray
    elements: list[ElasticElement]
    stages: list[str]
    mesh_force: np.ndarray
    mesh_stiffness: np.ndarray
    rows: np.ndarray
    rigid: np.ndarray

    @property
    def idle_stages(self) -> list[str]:
        """Names of the meshes that carry nothing, whose teeth are open."""
        return [name for name, force in zip(self.stages, self.mesh_force, strict=True) if force == 0]

    def reduced(self, matrix: np.ndarray) -> np.ndarray:
        """A matrix over the motions that the constraints allow (n_free, n_free)."""
        return self.motions.T @ matrix @ self.motions


def linear_gearbox(model: Model, speeds: Iterable[float], phase: float | None) -> LinearSystem:
    """The equations of a gearbox in the equilibrium of `in_loaded_equilibrium`, at speeds of the driving shaft [rad/s].

    phase   as in `mesh_tangent`
    """
    contacts, ratios = [mesh.contact for mesh in model.meshes], model.speed_ratios
    damping = [_damping_of_gearbox(model, contacts, float(speed) * ratios) for speed in speeds]
    with disengaged(model.mbs, contacts):
        elements = [
            *bearings_and_couplings(model),
            *springs(model.mbs, [i for i in further_objects(model) if i not in contacts]),
        ]
    return _linear_system(model.mbs, dict(zip(contacts, model.gearbox.labels, strict=True)), damping, elements, phase)


def _damping_of_gearbox(model: Model, contacts: Collection[int], velocities: np.ndarray) -> np.ndarray:
    """Damping and gyroscopic terms without meshes; at rest without drags, which then act as dry friction."""
    mbs = model.mbs
    damping = _damping_without_meshes(mbs, contacts, velocities)
    for shaft in model.gearbox.shafts if not velocities.any() else ():
        if shaft.drags:
            number = mbs.GetObjectNumber(drag_name(shaft))
            part = mbs.systemData.GetObjectLTGODE2(number)
            q = np.array(mbs.systemData.GetODE2Coordinates(INITIAL))[part].tolist()
            jacobian = mbs.GetObject(number)["jacobianUserFunction"]["function"]
            damping[np.ix_(part, part)] -= jacobian(mbs, 0.0, number, q, [0.0] * len(q), 0.0, 1.0)
    return damping


def linear_assembly(mbs, phase: float | None) -> LinearSystem:
    """The equations of a hand-built system about its initial state, gyroscopic terms at its initial velocities."""
    contacts = contacts_of(mbs)
    require(bool(contacts), "model holds no gear contact; add one with mbs.CreateGearContact(...)")
    velocities = np.array(mbs.systemData.GetODE2Coordinates_t(INITIAL))
    with current_state(mbs):
        damping = _damping_without_meshes(mbs, contacts, velocities)
        with set_velocities(mbs, np.zeros_like(velocities)), disengaged(mbs, contacts):
            objects = [i for i in range(mbs.systemData.NumberOfObjects()) if i not in contacts]
            elements = list(springs(mbs, objects))
        return _linear_system(mbs, _stage_names(mbs, contacts), [damping], elements, phase)


def _stage_names(mbs, contacts: Collection[int]) -> dict[int, str]:
    """Name of each contact: that of its object, or those of its bodies."""
    of_nodes, names = names_of_nodes(mbs), dict[int, str]()
    for number in contacts:
        item = mbs.GetObject(number)
        by_bodies = "-".join(of_nodes[int(node)] for node in item["nodeNumbers"][:2])
        name = by_bodies if UNNAMED.fullmatch(item["name"]) else item["name"]
        names[number] = f"{name} ({number})" if name in names.values() else name
    return names


def _damping_without_meshes(mbs, contacts: Collection[int], velocities: np.ndarray) -> np.ndarray:
    """(n, n) damping and gyroscopic terms of a system that moves with these velocities (n,)."""
    with disengaged(mbs, contacts), set_velocities(mbs, velocities):
        return np.array(mbs.ComputeLinearizedSystem()[2])


def _linear_system(mbs, labels: dict[int, str], damping, elements, phase: float | None) -> LinearSystem:
    """The equations from the damping (n_speed, n, n) and the elements beside the meshes."""
    n = mbs.systemData.ODE2Size()
    with disengaged(mbs, list(labels)), set_velocities(mbs, np.zeros(n)):
        mass, stiffness, _, *constrained = mbs.ComputeLinearizedSystem(returnConstraintNullspace=True)
    motions = np.array(constrained[1]).T if constrained else np.eye(n)
    forces, meshes = zip(*(mesh_tangent(mbs, number, phase) for number in labels), strict=True)
    require(any(forces), NOT_PRESSED)
    rows, in_meshes = np.zeros((len(meshes), n)), []
    for row, number, mesh in zip(rows, labels, meshes, strict=True):
        coordinates = mbs.systemData.GetObjectLTGODE2(number)
        row[coordinates] = mesh.row
        in_meshes.append(ElasticElement(labels[number], "mesh", embedded(mesh.matrix, coordinates, n)))
    elements = [*in_meshes, *elements, *_unaccounted(np.array(stiffness), elements)]
    elements = [element._replace(stiffness=(element.stiffness + element.stiffness.T) / 2) for element in elements]
    total = np.sum([element.stiffness for element in elements], axis=0)
    further = [measured_rows(element.stiffness) for element in elements[len(labels) :]]
    rigid = rigid_motions([rows, *further], motions)
    damping = np.array(damping) + rows.T @ np.diag([mesh.damping for mesh in meshes]) @ rows
    names, k = list(labels.values()), np.array([mesh.stiffness for mesh in meshes])
    return LinearSystem(np.array(mass), total, damping, motions, elements, names, np.array(forces), k, rows, rigid)


def _unaccounted(stiffness: np.ndarray, elements: Sequence[ElasticElement]) -> Iterator[ElasticElement]:
    """An element for the stiffness without meshes (n, n) that no other element accounts for, if there is any."""
    rest = stiffness - sum((element.stiffness for element in elements), np.zeros_like(stiffness))
    if np.abs(rest).max(initial=0.0) > UNACCOUNTED * np.abs(stiffness).max(initial=0.0):
        yield ElasticElement("further", "further", rest)
