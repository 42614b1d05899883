"""Gear contacts linearized about the present state of their system, at a phase or as mean over the mesh cycle."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import gcd
from typing import NamedTuple

import numpy as np
import scipy

from exugear.mesh_force.kernel_records import changed
from exugear.mesh_force.law_slopes import FORCE
from exugear.multibody.contact_tangent import ContactTangent
from exugear.multibody.exudyn_objects import INITIAL
from exugear.multibody.gear_contact import ContactCopy, Records, records_of, stored_contact
from exugear.multibody.integrator_steps import contact_state

#: Number of phases in a pitch over which stiffness is averaged, and of pitches for which there are so many at most.
PHASES, PITCHES = 48, 8
#: The mean is taken at a mesh force smaller by this share, so that no phase leaves a map that ends there.
MARGIN = 1e-4
#: Share of a map's largest force below which a mesh force is rounding: no teeth are pressed.
ROUNDING = 1e-9
#: First bracket of a deflection [m], factor between the ends of brackets, and tolerance [m].
FIRST, GROWTH, FINEST = 1e-9, 4.0, 1e-16
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

    copy   of the contact, by which it is evaluated
    """

    copy: ContactCopy

    @property
    def forces(self) -> Callable:
        """The function: (*coordinates, *velocities) -> generalized forces."""
        return partial(self.copy.forces, 0.0)

    @property
    def records(self) -> Records:
        """Which the forces read."""
        return self.copy.records

    def force(self, q: np.ndarray, v: np.ndarray | None = None) -> float:
        """Mesh force [N] at coordinates (n,) and velocities (n,), by default at rest."""
        self.forces(*q.tolist(), *(np.zeros_like(q) if v is None else v).tolist())
        return float(self.copy.recorder.force[0])

    def tangent(self, q: np.ndarray) -> ContactTangent:
        """The contact linearized at coordinates (n,), at rest."""
        return self.copy.tangent(q.tolist(), [0.0] * q.size)

    def row(self, q: np.ndarray) -> np.ndarray:
        """(n,) slopes of the deflection by the coordinates, of a contact that carries a force at rest."""
        return -np.array(self.forces(*q.tolist(), *[0.0] * q.size)) / float(self.copy.recorder.force[0])


def contact_of(mbs, number: int, **changes: float) -> Contact:
    """A contact of a system by its object number, with changes of its frame, without torques that a run adds."""
    contact = stored_contact(mbs, number)
    table, frame, _, friction = contact.records
    state = contact_state(contact.ring.record if contact.ring else None)
    records = table, changed(frame, **changes), state, friction
    return Contact(ContactCopy(contact.kernel, records, contact.kinds))


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
        frame = present.records[1]
        # On an elastic ring the mesh stays where it stands, as the planets pull at the modes from there.
        around = np.floor(frame.phase) + averaged_phases(1) if frame.modes else None
        phases = averaged_phases(int(present.records[0].head.pitches)) if around is None else around
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
    """The tangent where the mesh carries a force [N], from the coordinates q (n,) on by a motion of unit deflection."""
    q = _coordinates_at(contact, q, by_wheel, force)
    row, tangent = contact.row(q), contact.tangent(q)
    stiffness = abs(float(tangent.slopes[FORCE] @ tangent.rows @ by_wheel))
    return MeshTangent(row, tangent.by_coordinates, stiffness, tangent.damping)


def _coordinates_at(contact: Contact, q: np.ndarray, by_wheel: np.ndarray, force: float) -> np.ndarray:
    """Coordinates (n,) at which the mesh carries a force [N], from q on by a motion of unit deflection."""

    def excess(deflection: float) -> float:
        """Of the force [N]; beyond the end of the map it is large."""
        try:
            return contact.force(q + deflection * by_wheel) - force
        except ValueError:
            return force

    end, before = FIRST, excess(0.0)
    if before == 0.0:
        return q
    while excess(-np.copysign(end, before)) * before > 0:
        end *= GROWTH
    root = scipy.optimize.brentq(excess, 0.0, -np.copysign(end, before), xtol=FINEST)
    return q + root * by_wheel
