"""Gear contacts linearized about the present state of their system, at a phase or as mean over the mesh cycle."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import exudyn as exu
import numpy as np
import scipy

from exugear.elements.gear_contact import DIFFERENCE_STEPS, contact_key, records_of
from exugear.elements.gear_sensor import ANY_TIME
from exugear.force_table.kernel_records import address_of, changed
from exugear.kernels.difference_jacobian import jacobian
from exugear.kernels.recorder import Recorder

#: Number of phases of the mean over the mesh cycle.
PHASES = 48
#: Steps of differences: of the deflection by coordinates [m, rad], and of the force by its rate [m/s].
GEOMETRIC_STEP, RATE = 1e-6, 1e-3
#: Factor between the ends of brackets of a deflection, and its tolerance [m].
GROWTH, FINEST = 4.0, 1e-16
BEYOND = "the mesh leaves its map within the mesh cycle; extend the map to a larger torque, or take less load"


@dataclass(frozen=True, eq=False)
class MeshTangent:
    """A gear contact as a linear element between the coordinates of its bodies.

    coordinates   (n,) their indices in the system
    row           (n,) slopes of the deflection by them
    matrix        (n, n) tangent stiffness, the geometric part by the mesh force included
    force         mesh force [N], > 0 on the driving flank
    stiffness     slope of the mesh force by the deflection [N/m]
    damping       along the line of action [N s/m]
    """

    coordinates: np.ndarray
    row: np.ndarray
    matrix: np.ndarray
    force: float
    stiffness: float
    damping: float


class Sample(NamedTuple):
    """Deflection [m] and mesh force [N]."""

    deflection: float
    force: float


@dataclass(frozen=True, eq=False)
class Contact:
    """A contact that is evaluated beside its system.

    forces     (*coordinates, *velocities) -> generalized forces
    recorder   of which the only sample is that of the last evaluation
    frame      contact frame, which the forces read by its address
    """

    forces: Callable
    recorder: Recorder
    frame: np.record

    def sample(self, q: np.ndarray, v: np.ndarray | None = None) -> Sample:
        """Deflection and mesh force at coordinates (n,) and velocities (n,), by default at rest."""
        self.forces(*q.tolist(), *(np.zeros_like(q) if v is None else v).tolist())
        return Sample(float(self.recorder.deflection[0]), float(self.recorder.force[0]))


def contact_of(mbs, number: int, **changes: float) -> Contact:
    """A contact of a system by its object number, with changes of its frame."""
    kernel, recorder = mbs.variables[contact_key(number)], Recorder()
    recorder.start(ANY_TIME, 1)
    frame = changed(records_of(mbs, number)[1], **changes)
    table, _, *further = kernel.args
    forces = partial(kernel.func, table, address_of(frame), *further, address_of(recorder.header), 0.0)
    return Contact(forces, recorder, frame)


def over_the_cycle(mbs, number: int) -> Iterator[Contact]:
    """A contact at phases of its mesh cycle, which stay as the bodies turn: their mean does not tell positions apart."""
    for phase in np.arange(PHASES) / PHASES:
        yield contact_of(mbs, number, phase=phase, pitches_per_radian=0.0)


def mesh_tangent(mbs, number: int, phase: float | None) -> MeshTangent:
    """A contact linearized about the initial state of its system, at rest.

    phase   share of a pitch by which it is moved on from its present phase; None: mean over the mesh cycle, at its
            present force
    """
    coordinates = np.array(mbs.systemData.GetObjectLTGODE2(number), int)
    q = np.array(mbs.systemData.GetODE2Coordinates(exu.ConfigurationType.Initial))[coordinates]
    present = contact_of(mbs, number)
    row, force = _row_of(present, q), present.sample(q).force
    if force == 0.0:
        return MeshTangent(coordinates, row, np.zeros((q.size, q.size)), 0.0, 0.0, 0.0)
    by_wheel = _motion_of_wheel(mbs, number, row)
    if phase is None:
        contacts = over_the_cycle(mbs, number)
    else:
        contacts = iter([contact_of(mbs, number, phase=float(records_of(mbs, number)[1].phase) + phase)])
    try:
        tangents = [_tangent(contact, q, by_wheel, force) for contact in contacts]
    except ValueError:
        raise ValueError(f"load: {BEYOND}") from None
    matrix, stiffness, damping = (np.mean(values, axis=0) for values in zip(*tangents, strict=True))
    return MeshTangent(coordinates, row, matrix, force, float(stiffness), float(damping))


def _row_of(contact: Contact, q: np.ndarray) -> np.ndarray:
    """(n,) slopes of the deflection by the coordinates of the bodies."""
    steps = GEOMETRIC_STEP * np.eye(q.size)
    differences = [contact.sample(q + h).deflection - contact.sample(q - h).deflection for h in steps]
    return np.array(differences) / (2 * GEOMETRIC_STEP)


def _motion_of_wheel(mbs, number: int, row: np.ndarray) -> np.ndarray:
    """(n,) a motion of the wheel alone with unit deflection: the phase, which follows the pinion, stays."""
    pinion, wheel = (len(mbs.GetNode(n)["referenceCoordinates"]) for n in mbs.GetObject(number)["nodeNumbers"][:2])
    motion = np.zeros_like(row)
    motion[pinion : pinion + wheel] = row[pinion : pinion + wheel]
    return motion / (motion @ motion)


def _tangent(contact: Contact, q: np.ndarray, by_wheel: np.ndarray, force: float) -> tuple[np.ndarray, float, float]:
    """(stiffness matrix (n, n), stiffness [N/m], damping [N s/m]) where the mesh carries a force [N]."""
    q = _coordinates_at(contact, q, by_wheel, force)
    matrix = jacobian(contact.forces, q.tolist(), [0.0] * q.size, (1.0, 0.0), DIFFERENCE_STEPS)
    damping = (contact.sample(q, RATE * by_wheel).force - contact.sample(q).force) / RATE
    h = DIFFERENCE_STEPS[0] * by_wheel
    stiffness = (contact.sample(q + h).force - contact.sample(q - h).force) / (2 * DIFFERENCE_STEPS[0])
    return matrix, stiffness, damping


def _coordinates_at(contact: Contact, q: np.ndarray, by_wheel: np.ndarray, force: float) -> np.ndarray:
    """Coordinates (n,) at which the mesh carries a force [N], from q on by a motion of unit deflection."""

    def excess(deflection: float) -> float:
        try:
            return contact.sample(q + deflection * by_wheel).force - force
        except ValueError:
            return float(np.copysign(force, deflection))

    end, before = DIFFERENCE_STEPS[0], excess(0.0)
    if before == 0.0:
        return q
    while excess(-np.copysign(end, before)) * before > 0:
        end *= GROWTH
    root = scipy.optimize.brentq(excess, 0.0, -np.copysign(end, before), xtol=FINEST)
    return q + root * by_wheel
