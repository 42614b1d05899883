"""Turning carriers of planets on pins: what a rigid train does at finite angles, and displacements that turn with it.

Linear equations of a set count from its reference configuration, in which the planets move along tangents of their
orbits. Seen from a carrier they hold at any angle: the displacements turn about the carrier's axis n, with the matrix
R, and the velocities are n x r. A member that another stage loads too, from a direction that stands, does not turn.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from exugear.gearbox.shaft import Shaft
from exugear.multibody.model import BuiltSystem, by_shaft, motion_of, moving_of
from exugear.multibody.planet_pins import Pin


class TurningSet(NamedTuple):
    """A carrier of planets on pins, these, and the members on bearings whose displacements turn with it."""

    carrier: Shaft
    pins: list[Pin]
    members: list[str]


def turning_sets(model: BuiltSystem) -> Iterator[TurningSet]:
    """The carriers of planets on pins with what turns with them."""
    box = model.gearbox
    for name in sorted(box.carriers_of_pins):
        on_carrier = [stage for stage in box.stages if stage.carrier and stage.carrier.name == name]
        names = {shaft.name for stage in on_carrier for shaft in stage.shafts if shaft.name not in box.planets}
        beside = {shaft.name for stage in box.stages if stage not in on_carrier for shaft in stage.shafts}
        members = [x for x in sorted(names - beside) if model.scene.shafts[x].on_bearings]
        yield TurningSet(box.ends[name], [pin for pin in model.pins if pin.carrier.name == name], members)


def velocities_by_turning(model: BuiltSystem, q: np.ndarray, speeds: Mapping[str, float]) -> np.ndarray:
    """(n,) velocities of displacements q (n,) that turn with their carriers, else 0; speeds: of shafts by name [rad/s].

    Likewise the velocities that accelerations of the shafts add per time.
    """
    velocities = np.zeros(q.size)
    for carrier, pins, members in turning_sets(model):
        speed, axis, centre = speeds[carrier.name], carrier.offset.axis, moving_of(model, carrier.name)
        for name in members:
            part = moving_of(model, name)
            velocities[part] = speed * _turning(axis, q[part])
        for pin in pins:
            part = moving_of(model, pin.planet.name)
            apart = q[part] - _like(q[centre], part)
            velocities[part] = speed * _turning(axis, apart) + _like(velocities[centre], part)
    return velocities


def rigid_motion(model: BuiltSystem, q: np.ndarray, shafts: np.ndarray) -> np.ndarray:
    """(n,) velocities in a state q (n,) of a train that turns as a rigid body, at speeds of the shafts (n_shaft,)."""
    return motion_of(model, shafts) + velocities_by_turning(model, q, by_shaft(model, shafts))


def turned_with_carriers(model: BuiltSystem, q: np.ndarray) -> np.ndarray:
    """Coordinates at the angles of the carriers, from those (n,) of the linear equations, along the tangents."""
    turned = q.copy()
    for carrier, pins, members in turning_sets(model):
        angle, axis, centre = q[model.spins[carrier.name]], carrier.offset.axis, moving_of(model, carrier.name)
        for name in members:
            part = moving_of(model, name)
            turned[part] = _turned(axis, angle, q[part])
        for pin in pins:
            part = moving_of(model, pin.planet.name)
            rho = pin.arm
            displaced = q[part] - angle * pin.orbit - _like(q[centre], part)
            turned[part] = _turned(axis, angle, rho + displaced) - rho + _like(turned[centre], part)
    return turned


def rigid_coordinates(model: BuiltSystem, angles: np.ndarray) -> np.ndarray:
    """(n,) coordinates of a train that has turned as a rigid body, at angles of the shafts (n_shaft,) [rad]."""
    return turned_with_carriers(model, motion_of(model, angles))


def _like(motion: np.ndarray, part: slice) -> np.ndarray:
    """Displacements of a carrier as those of a planet with the coordinates of a slice: 0 of a carrier that spins."""
    return motion if motion.size else np.zeros(part.stop - part.start)


def _turning(axis: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """Rates (2 or 5) of displacements [m] and tilts [rad] that turn about an axis (3), per radian."""
    full = np.zeros(5)
    full[: displacement.size] = displacement
    x, y, z = np.cross(axis, full[:3])
    return np.array([x, y, z, -full[4], full[3]])[: displacement.size]


def _turned(axis: np.ndarray, angle: float, displacement: np.ndarray) -> np.ndarray:
    """Displacements [m] and tilts [rad] (2 or 5), turned about an axis (3) by an angle [rad]."""
    along = np.zeros(5)
    along[: displacement.size] = displacement
    along = np.r_[(along[:3] @ axis) * axis, 0.0, 0.0][: displacement.size]
    across = displacement - along
    return along + np.cos(angle) * across + np.sin(angle) * _turning(axis, across)
