"""Loads and springs that stand for motion in a static solve, which Exudyn does without velocities.

Inertia torques and drags act as torques; centrifugal forces and gyroscopic moments of planets on pins as forces and as
a stiffness; weak springs hold planets that carry nothing.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import exudyn.itemInterface as eii
import numpy as np

from exugear.multibody.exudyn_objects import node_of
from exugear.multibody.model import Model, moving_of
from exugear.multibody.planet_pins import Pin
from exugear.operation.conditions import Conditions
from fem.support.validation import require
from fem.units import rpm

#: Angular frequency of a planet that carries nothing on the spring that makes static solves regular [rad/s].
WEAK_OMEGA = 1.0


def torques_at_start(model: Model, conditions: Conditions, accelerations: np.ndarray) -> dict[int, float]:
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


def with_centrifugal_forces(
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
def softened_by_rotation(model: Model, speeds: Mapping[str, float]) -> Iterator[None]:
    """Give planets on pins the stiffness of `_stiffness_by_rotation` at speeds of the shafts by name [rad/s]."""
    items = []
    for pin in model.pins:
        stiffness, node = _stiffness_by_rotation(pin, speeds), node_of(model.bare_mbs, model.bodies[pin.planet.name])
        if stiffness.any():
            items.append(eii.ObjectGenericODE2(nodeNumbers=[node], stiffnessMatrix=np.diag([*stiffness, 0.0])))
    with _added(model, items):
        yield


@contextmanager
def held_between_teeth(model: Model, q: np.ndarray, planets: Sequence[str]) -> Iterator[None]:
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


@contextmanager
def applied_torques(model: Model, torques: Mapping[int, float]) -> Iterator[None]:
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
