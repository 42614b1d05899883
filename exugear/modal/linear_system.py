"""A loaded system as linear equations: matrices, meshes and elastic elements, and the motions its constraints allow."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from exugear.contact.rotation import by_angles
from exugear.gearbox.bearing import is_isotropic
from exugear.gearbox.housing import seat_coupling
from exugear.gearbox.shaft import Shaft
from exugear.modal.elastic_elements import (
    UNNAMED,
    ElasticElement,
    bearings_and_couplings,
    embedded,
    names_of_nodes,
    pins,
    springs,
)
from exugear.modal.mesh_tangents import mesh_tangent
from exugear.multibody.bearings_and_drags import drag_name, names_of_drags_between
from exugear.multibody.exudyn_objects import INITIAL, current_state
from exugear.multibody.gear_contact import contacts_of
from exugear.multibody.linearization import disengaged, set_velocities
from exugear.multibody.model import Model, further_objects, moving_of
from exugear.planning.eigenmodes import measured_rows, rigid_motions
from fem.support.validation import require

#: Stiffness that no element accounts for, as share of the diagonal, above which it counts as a further element.
UNACCOUNTED = 1e-6
#: Change of the stiffness of a housing as it turns, as share of the diagonal, below which it is the same all around.
UNEVEN = 1e-6
#: J of the velocities W J x in a frame that turns at W.
TURN = np.array([[0.0, -1.0], [1.0, 0.0]])
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
    centrifugal       (n_speed, n, n) stiffness that the turning of a carrier's frame adds at each speed; None without
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
    centrifugal: np.ndarray | None = None

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
    contacts, ratios, speeds = [mesh.contact for mesh in model.meshes], model.speed_ratios, np.array([*speeds], float)
    damping = [_damping_of_gearbox(model, contacts, speed * ratios) for speed in speeds.tolist()]
    with disengaged(model.bare_mbs, contacts):
        elements = [
            *bearings_and_couplings(model),
            *pins(model),
            *springs(model.bare_mbs, [i for i in further_objects(model) if i not in contacts]),
        ]
    labels = dict(zip(contacts, model.gearbox.labels, strict=True))
    held = [model.spins[name] for name in model.gearbox.held]
    system = _linear_system(model.bare_mbs, labels, damping, elements, phase, held)
    return in_carrier_frame(model, system, speeds) if model.pins else system


def _damping_of_gearbox(model: Model, contacts: Collection[int], velocities: np.ndarray) -> np.ndarray:
    """Damping and gyroscopic terms without meshes; at rest without drags, which then act as dry friction."""
    mbs = model.bare_mbs
    damping = _damping_without_meshes(mbs, contacts, velocities)
    if not velocities.any():
        braked = [drag_name(x) for x in model.gearbox.shafts if model.gearbox.braked_on_ground[x.name].drags]
        for name in [*braked, *names_of_drags_between(model.gearbox.drags_between)]:
            number = mbs.GetObjectNumber(name)
            part = mbs.systemData.GetObjectLTGODE2(number)
            q = np.array(mbs.systemData.GetODE2Coordinates(INITIAL))[part].tolist()
            jacobian = mbs.GetObject(number)["jacobianUserFunction"]["function"]
            damping[np.ix_(part, part)] -= jacobian(mbs, 0.0, number, q, [0.0] * len(q), 0.0, 1.0)
    return damping


def in_carrier_frame(model: Model, system: LinearSystem, speeds: np.ndarray) -> LinearSystem:
    """The equations of a set whose planets move in the plane or in space, in the frame that turns with its carrier.

    With displacements x = R u the translations have the gyroscopic terms 2 W m J, J = [[0, -1], [1, 0]], and the
    centrifugal stiffness -W^2 m, W being the speed of the carrier. The tilts of a shaft that spins at w have likewise
    2 W J_t J and W (J w - J_t W) beside their gyroscopic terms. Damping counts by the rates in this frame. Raises
    ValueError for several carriers that turn at different speeds, and for bearings or a housing that are not the same
    in all directions: seen from the carrier they change as it turns.
    """
    box = model.gearbox
    ratios = {name: box.ratios[name] for name in box.carriers_of_pins}
    several = f"planets on pins of the carriers {[*ratios]} turn at different speeds, so that no frame is theirs"
    alike = len({round(x, 12) for x in ratios.values()}) == 1 or not speeds.any()
    require(alike, f"{several}; take speed=0, or leave pin= out in all sets but one")
    ratio = next(iter(ratios.values()))
    damping, centrifugal = system.damping.copy(), np.zeros_like(system.damping)
    turning = [name for name, kind in model.plan.shafts.items() if kind.on_bearings]
    if speeds.any():
        _check_housing(model, turning)
    for name in turning if speeds.any() else ():
        shaft, moving = box.ends[name], moving_of(model, name)
        _check_isotropic(shaft)
        centre, tilts = slice(moving.start, moving.start + 2), slice(moving.start + 3, moving.stop)
        for k, (w, spin) in enumerate(zip(ratio * speeds, box.ratios[name] * speeds, strict=True)):
            for part in (centre, tilts) if moving.stop - moving.start == 5 else (centre,):
                mass = system.mass[part, part]
                damping[k, part, part] += 2 * w * mass @ TURN
                centrifugal[k, part, part] -= w**2 * mass
                if part is tilts:
                    centrifugal[k, part, part] += w * spin * shaft.inertia * np.eye(2)
    return replace(system, damping=damping, centrifugal=centrifugal)


def _check_isotropic(shaft: Shaft) -> None:
    """ValueError for a shaft in a carrier's frame whose bearings are not the same in all directions."""
    unlike = f"bearings of shaft {shaft.name!r} must be the same in x and y, seen from a turning carrier"
    alike = all(is_isotropic(bearing.stiffness) for bearing in shaft.bearings.values())
    require(alike, f"{unlike}; pass Bearing(radial=...), or take speed=0")


def _check_housing(model: Model, on_bearings: Sequence[str]) -> None:
    """ValueError for a housing under the shafts of a set on pins that is not the same in all directions, or vibrates.

    on_bearings   names of the shafts that move on their bearings
    """
    box = model.gearbox
    if box.housing is None:
        return
    seen, remedy = "seen from a turning carrier", "take exugear.run, or modes at speed=0"
    alone = f"housing must be a stiffness alone, as its coordinates turn {seen}, got {model.plan.housing}"
    require(model.seats is None, f"{alone}; leave out mass= and take linear bearings on its seats, or {remedy}")
    members = [name for name in on_bearings if name not in box.planets]
    stiffness = seat_coupling(box.housing, box.shafts, members).stiffness
    turn = np.kron(np.eye(len(stiffness) // 3), by_angles((0.0, 0.0, 1.0, 0.0)))
    scale = np.sqrt(np.maximum(np.diagonal(stiffness), np.finfo(float).tiny))
    share = float((np.abs(turn.T @ stiffness @ turn - stiffness) / np.outer(scale, scale)).max())
    uneven = f"housing must be the same in x and y, {seen}; its seats with their bearings differ by {100 * share:.2g} %"
    require(share < UNEVEN, f"{uneven}; pass the mean of both directions, or {remedy}")


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


def _linear_system(
    mbs, labels: dict[int, str], damping, elements, phase: float | None, held: Sequence[int] = ()
) -> LinearSystem:
    """The equations from the damping (n_speed, n, n) and the elements beside the meshes.

    held   indices of coordinates that stand, beside those that constraints hold
    """
    n = mbs.systemData.ODE2Size()
    with disengaged(mbs, list(labels)), set_velocities(mbs, np.zeros(n)):
        mass, stiffness, _, *constrained = mbs.ComputeLinearizedSystem(returnConstraintNullspace=True)
    motions = np.array(constrained[1]).T if constrained else np.eye(n)
    motions = motions[:, ~motions[list(held)].any(axis=0)]
    forces, meshes = zip(*(mesh_tangent(mbs, number, phase) for number in labels), strict=True)
    require(any(forces), NOT_PRESSED)
    rows, in_meshes = np.zeros((len(meshes), n)), []
    for row, number, mesh in zip(rows, labels, meshes, strict=True):
        coordinates = mbs.systemData.GetObjectLTGODE2(number)
        row[coordinates] = mesh.row
        in_meshes.append(ElasticElement(labels[number], "mesh", embedded(mesh.matrix, coordinates, n)))
    elements = [*in_meshes, *elements, *_unaccounted(np.array(stiffness), elements, held)]
    elements = [element._replace(stiffness=(element.stiffness + element.stiffness.T) / 2) for element in elements]
    total = np.sum([element.stiffness for element in elements], axis=0)
    further = [measured_rows(element.stiffness) for element in elements[len(labels) :]]
    rigid = rigid_motions([rows, *further], motions)
    damping = np.array(damping) + rows.T @ np.diag([mesh.damping for mesh in meshes]) @ rows
    names, k = list(labels.values()), np.array([mesh.stiffness for mesh in meshes])
    return LinearSystem(np.array(mass), total, damping, motions, elements, names, np.array(forces), k, rows, rigid)


def _unaccounted(
    stiffness: np.ndarray, elements: Sequence[ElasticElement], held: Sequence[int]
) -> Iterator[ElasticElement]:
    """An element for the stiffness without meshes (n, n) that no other element accounts for, if there is any.

    held   indices of coordinates that stand, by whatever stiffness
    """
    rest = stiffness - sum((element.stiffness for element in elements), np.zeros_like(stiffness))
    for coordinate in held:
        rest[coordinate], rest[:, coordinate] = 0.0, 0.0
    if np.abs(rest).max(initial=0.0) > UNACCOUNTED * np.abs(stiffness).max(initial=0.0):
        yield ElasticElement("further", "further", rest)
