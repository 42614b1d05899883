"""Gear contacts linearized about the present state of their system, at a phase or as mean over the mesh cycle."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import gcd
from typing import NamedTuple

import numpy as np
import scipy

from exugear.contact.contact_tangent import tangent_of_spins
from exugear.contact.recorder import Recorder
from exugear.contact.reference_configuration import is_spatial
from exugear.mesh_force.kernel_records import changed
from exugear.multibody.difference_jacobian import jacobian
from exugear.multibody.exudyn_objects import INITIAL
from exugear.multibody.gear_contact import DIFFERENCE_STEPS, ContactCopy, Records, records_of, stored_contact
from exugear.multibody.integrator_steps import contact_state

#: Number of phases in a pitch over which stiffness is averaged, and of pitches for which there are so many at most.
PHASES, PITCHES = 48, 8
#: The mean is taken at a mesh force smaller by this share, so that differences do not leave a map that ends there.
MARGIN = 1e-4
#: Share of a map's largest force below which a mesh force is rounding: no teeth are pressed.
ROUNDING = 1e-9
#: Share of the penetration of the flanks up to which a difference stays on the side of contact, on which the law is
#: smooth: across the kink at loss of contact a difference gives half the stiffness.
WITHIN_CONTACT = 0.25
#: Step of the rate in the difference of the damping force [m/s].
RATE = 1e-3
#: Angles of pinion and wheel against their carrier by those of the three bodies, without it by the first two.
SPINS_ON_CARRIER = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, -1.0]])
#: Factor between the ends of brackets of a deflection, and its tolerance [m].
GROWTH, FINEST = 4.0, 1e-16
BEYOND = "load: a mesh leaves its map within the mesh cycle; extend the map to a larger torque, or take less load"


class MeshTangent(NamedTuple):
    """A gear contact as a linear element between the n coordinates of its bodies.

    row         (n,) generalized forces of a unit mesh force, signs changed: slopes of the deflection by the coordinates
    matrix      (n, n) tangent stiffness, the geometric part by the mesh force included
    stiffness   slope of the mesh force by the deflection [N/m]
    damping     along the line of action [N s/m]
    """

    row: np.ndarray
    matrix: np.ndarray
    stiffness: float
    damping: float


@dataclass(frozen=True, eq=False)
class Contact:
    """A contact that is evaluated beside its system.

    forces     (*coordinates, *velocities) -> generalized forces
    recorder   whose only sample is that of the last evaluation
    records    which the forces read by their addresses
    """

    forces: Callable
    recorder: Recorder
    records: Records

    def force(self, q: np.ndarray, v: np.ndarray | None = None) -> float:
        """Mesh force [N] at coordinates (n,) and velocities (n,), by default at rest."""
        self.forces(*q.tolist(), *(np.zeros_like(q) if v is None else v).tolist())
        return float(self.recorder.force[0])

    def step(self, q: np.ndarray) -> float:
        """Change of the deflection [m] at coordinates (n,) within which differences do not leave the contact."""
        force = abs(self.force(q))
        penetration = 2 * float(self.recorder.power["energy"][0]) / force
        return min(DIFFERENCE_STEPS[0], WITHIN_CONTACT * penetration)

    def row(self, q: np.ndarray) -> np.ndarray:
        """(n,) slopes of the deflection by the coordinates, of a contact that carries a force at rest."""
        return -np.array(self.forces(*q.tolist(), *[0.0] * q.size)) / float(self.recorder.force[0])


def contact_of(mbs, number: int, **changes: float) -> Contact:
    """A contact of a system by its object number, with changes of its frame, without torques that a run adds."""
    contact = stored_contact(mbs, number)
    table, frame, _, friction = contact.records
    copy = ContactCopy(contact.kernel, (table, changed(frame, **changes), contact_state(), friction))
    return Contact(partial(copy.forces, 0.0), copy.recorder, copy.records)


def mesh_tangent(mbs, number: int, phase: float | None) -> tuple[float, MeshTangent]:
    """(Mesh force [N], tangent) of a contact in the initial state of its system, at rest.

    phase   share of a pitch by which it is moved on from its present phase; None: mean over the mesh cycle, at its
            present force
    """
    q = np.array(mbs.systemData.GetODE2Coordinates(INITIAL))
    q = q[mbs.systemData.GetObjectLTGODE2(number)]
    try:
        present = contact_of(mbs, number)
        force = present.force(q)
        if abs(force) <= ROUNDING * float(present.records[0].head.last_force):
            return 0.0, MeshTangent(np.zeros(q.size), np.zeros((q.size, q.size)), 0.0, 0.0)
        by_wheel = _motion_of_wheel(mbs, number, present.row(q))
        if phase is not None:
            moved = float(records_of(mbs, number)[1].phase) + phase
            row = _tangent(contact_at_fixed_phase(mbs, number, moved), q, by_wheel, force).row
            return force, _tangent(contact_of(mbs, number, phase=moved), q, by_wheel, force)._replace(row=row)
        phases = averaged_phases(int(present.records[0].head.pitches))
        contacts = [contact_at_fixed_phase(mbs, number, x) for x in phases]
        tangents = [_tangent(contact, q, by_wheel, (1 - MARGIN) * force) for contact in contacts]
    except ValueError:
        raise ValueError(BEYOND) from None
    row, matrix, stiffness, damping = (np.mean(values, axis=0) for values in zip(*tangents, strict=True))
    return force, MeshTangent(row, matrix, float(stiffness), float(damping))


def averaged_phases(pitches: int, in_pitch: int = PHASES) -> np.ndarray:
    """(n,) phases evenly spaced over the pitches of a law; each of many pitches has some of the phases alone.

    Their number then has no common divisor with that of the pitches, so that all lie at different shares of a pitch.

    in_pitch   number of phases in a pitch
    """
    number = in_pitch * min(pitches, PITCHES)
    while pitches > PITCHES and gcd(number, pitches) > 1:
        number += 1
    return np.arange(number) * pitches / number


def contact_at_fixed_phase(mbs, number: int, phase: float) -> Contact:
    """A contact that stays at a phase as its bodies turn, so that no position of the bodies differs from another."""
    return contact_of(mbs, number, phase=phase, pitches_per_radian=0.0)


def _motion_of_wheel(mbs, number: int, row: np.ndarray) -> np.ndarray:
    """(n,) a motion of the wheel alone with unit deflection: the phase, which follows the pinion, stays."""
    pinion, wheel = (len(mbs.GetNode(n)["referenceCoordinates"]) for n in mbs.GetObject(number)["nodeNumbers"][:2])
    motion = np.zeros_like(row)
    motion[pinion : pinion + wheel] = row[pinion : pinion + wheel]
    return motion / (motion @ motion)


def _tangent(contact: Contact, q: np.ndarray, by_wheel: np.ndarray, force: float) -> MeshTangent:
    """The tangent where the mesh carries a force [N], from the coordinates q (n,) on by a motion of unit deflection.

    Exact for bodies that spin; else by differences that stay on the side of contact.
    """
    q = _coordinates_at(contact, q, by_wheel, force)
    row, (table, frame, *_) = contact.row(q), contact.records
    if not is_spatial(frame):
        relative = SPINS_ON_CARRIER[:, : q.size]
        tangent = tangent_of_spins(table.head, frame, *(relative @ q).tolist(), 0.0, 0.0)
        matrix = relative.T @ tangent.by_angles @ relative
        return MeshTangent(row, matrix, tangent.slopes.by_advance, tangent.slopes.by_rate)
    h = contact.step(q)
    steps = h / max(1.0, float(np.abs(row).max())), DIFFERENCE_STEPS[1]
    matrix = jacobian(contact.forces, q.tolist(), [0.0] * q.size, (1.0, 0.0), steps)
    damping = (contact.force(q, RATE * by_wheel) - contact.force(q)) / RATE
    stiffness = (contact.force(q + h * by_wheel) - contact.force(q - h * by_wheel)) / (2 * h)
    return MeshTangent(row, matrix, stiffness, damping)


def _coordinates_at(contact: Contact, q: np.ndarray, by_wheel: np.ndarray, force: float) -> np.ndarray:
    """Coordinates (n,) at which the mesh carries a force [N], from q on by a motion of unit deflection."""

    def excess(deflection: float) -> float:
        """Of the force [N]; beyond the end of the map it is large."""
        try:
            return contact.force(q + deflection * by_wheel) - force
        except ValueError:
            return force

    end, before = DIFFERENCE_STEPS[0], excess(0.0)
    if before == 0.0:
        return q
    while excess(-np.copysign(end, before)) * before > 0:
        end *= GROWTH
    root = scipy.optimize.brentq(excess, 0.0, -np.copysign(end, before), xtol=FINEST)
    return q + root * by_wheel
