"""How planets share their load: displaced pins and phases shift it, which equal mesh forces leave out."""

from collections.abc import Sequence
from math import isfinite
from typing import NamedTuple

import numpy as np

from exugear.gearbox.gearbox import forces_of_motion
from exugear.multibody.carrier_turns import turned_with_carriers
from exugear.multibody.first_order_statics import (
    CONVERGED,
    ITERATIONS,
    deflection_under_force,
    of_least_potential,
    row_of_flank,
    state_of_mesh,
)
from exugear.multibody.model import (
    Mesh,
    Model,
    constant_loads,
    end_coordinate,
    held_by_joints,
    matrices_without_meshes,
    motion_of,
    pin_coordinates,
)
from exugear.multibody.planet_pins import pin_matrices
from exugear.multibody.static_loads import torques_at_start
from exugear.operation.conditions import Conditions

#: Share of the largest mesh force below which a force is rounding.
ROUNDING = 1e-9
#: Gap at which a member that carries nothing stands beside teeth without back flanks [m].
LEAST_GAP = 1e-7


class SecantSpring(NamedTuple):
    """A mesh under a force: deflection [m] at which the flank begins to touch, and stiffness from there [N/m]."""

    touch: float
    stiffness: float


class TrainWithoutMeshes(NamedTuple):
    """What the meshes load.

    stiffness     (n, n) without pins whose law is nonlinear
    loads         (n,) torques at the start, inertia torques and drags [N m], constant forces [N]
    free          indices of the coordinates that neither anchors nor joints hold
    nonlinear     whether the law of a pin is nonlinear
    """

    stiffness: np.ndarray
    loads: np.ndarray
    free: np.ndarray
    nonlinear: bool


class Flanks(NamedTuple):
    """The flanks that torques press, one of each mesh.

    sides         (n_mesh,) 1: driving flank, -1: back flank
    rows          (n_mesh, n) slopes of their advance by the coordinates
    forces        (n_mesh,) [N]
    pressed       (n_mesh,) whether they touch
    deflections   (n_mesh,) of the driving flanks, those by the coordinates taken off [m]
    openings      (n_mesh,) of either flank [m]
    """

    sides: np.ndarray
    rows: np.ndarray
    forces: np.ndarray
    pressed: np.ndarray
    deflections: np.ndarray
    openings: np.ndarray


def shared_among_planets(
    model: Model, q: np.ndarray, conditions: Conditions, accelerations: np.ndarray
) -> tuple[np.ndarray, list[str]]:
    """Coordinates in equilibrium near q: displaced pins shift load, which equal mesh forces leave out.

    accelerations   (n_shaft,) of the shafts [rad/s^2], whose inertia torques decide which flanks carry, too

    Meshes have their secant stiffness; those that would pull are taken out, and the rest is solved again. Where planets
    move on pins, or turn about axes that lie beside their carrier's, each iteration takes the deflections at the
    coordinates of the last: to first order alone they miss more than light loads press.

    Also returns the names of planets, and of other members beside pins, that carry nothing, each turned to the middle
    between the gears that it meshes with.
    """
    train = _without_meshes(model, conditions, accelerations)
    flanks = _pressed_by_torques(model, conditions, accelerations)
    may_be_open = flanks.pressed | bool(model.pins)
    by_position = bool(model.pins) or any(mesh.frame.fixed.any() for mesh in model.meshes)
    for _ in range(ITERATIONS if by_position else 1):
        before = q
        q, flanks = _on_secant_springs(model, train, flanks, q)
        if not by_position or np.abs(q - before).max() < CONVERGED + 2 * np.spacing(np.abs(q).max()):
            break
        flanks = _at_coordinates(model, flanks, q)
    unloaded = _members_without_load(model, conditions, ~flanks.pressed & may_be_open)
    for name in unloaded:
        spin, of_member = model.spins[name], _meshes_of(model, name)
        limits = [
            (model.meshes[i].law.backlash + 2 * flanks.openings[i], flanks.deflections[i] + flanks.rows[i] @ q)
            for i in of_member
        ]
        q[spin] += _middle_of_gaps(limits, flanks.rows[of_member, spin])
    return q, unloaded


def _without_meshes(model: Model, conditions: Conditions, accelerations: np.ndarray) -> TrainWithoutMeshes:
    """The `TrainWithoutMeshes` under the torques at the start, at accelerations of the shafts (n_shaft,) [rad/s^2]."""
    loads = constant_loads(model)
    for end in conditions.ends:
        loads[model.turning[end.body]] += conditions.initial_torque(end)
    for index, torque in torques_at_start(model, conditions, motion_of(model, accelerations)).items():
        loads[index] += torque
    stiffness, nonlinear = matrices_without_meshes(model)[1], [pin for pin in model.pins if pin.law is not None]
    for pin in nonlinear:
        part, n = pin_coordinates(model, pin)
        stiffness[np.ix_(part, part)] -= pin_matrices(pin, np.zeros(len(part)).tolist(), n, 0.0)[0]
    standing = [*(end_coordinate(model, name) for name in conditions.anchors), *held_by_joints(model)]
    return TrainWithoutMeshes(stiffness, loads, np.setdiff1d(np.arange(loads.size), standing), bool(nonlinear))


def _pressed_by_torques(model: Model, conditions: Conditions, accelerations: np.ndarray) -> Flanks:
    """The `Flanks` in the reference configuration, under the forces by which planets share equally."""
    torques = conditions.initial_torques + conditions.initial_drags
    forces = forces_of_motion(model.gearbox, torques, accelerations, conditions.anchors)
    sides, pressed = np.sign(forces), np.abs(forces) > ROUNDING * np.abs(forces).max()
    rows = np.array([row_of_flank(model, mesh, side) for mesh, side in zip(model.meshes, sides, strict=True)])
    reference = np.array([(mesh.reference_deflection, mesh.opening) for mesh in model.meshes]).T
    return Flanks(sides, rows, forces, pressed, *reference)


def _on_secant_springs(
    model: Model, train: TrainWithoutMeshes, flanks: Flanks, q: np.ndarray
) -> tuple[np.ndarray, Flanks]:
    """Coordinates in which secant springs carry the loads, and the flanks that press then, from coordinates q."""
    meshes = zip(model.meshes, flanks.forces.tolist(), flanks.openings, strict=True)
    touches, secants = np.array([secant_spring(model, *mesh, q) for mesh in meshes]).T
    rows, pressed, reference = flanks.rows, flanks.pressed, flanks.deflections - touches
    for _ in model.meshes:
        springs = np.where(pressed, secants, 0.0)
        stiffness = train.stiffness + rows.T @ (springs[:, None] * rows)
        loads, moved = train.loads - rows.T @ (springs * reference), q.copy()
        if train.nonlinear:
            moved = of_least_potential(model, q, train.free, stiffness, loads)
        else:
            of_free = np.ix_(train.free, train.free)
            moved[train.free] += np.linalg.lstsq(stiffness[of_free], (loads - stiffness @ q)[train.free])[0]
        pulling = pressed & (flanks.sides * (reference + rows @ moved) < 0)
        if not pulling.any():
            q = moved
            break
        pressed = pressed & ~pulling
    forces = np.where(pressed, springs * (reference + rows @ q), flanks.forces)
    return q, flanks._replace(forces=forces, pressed=pressed)


def _at_coordinates(model: Model, flanks: Flanks, q: np.ndarray) -> Flanks:
    """The flanks with the deflections and openings that meshes have at coordinates q, turned with the carriers."""
    states = [state_of_mesh(model, mesh, turned_with_carriers(model, q)) for mesh in model.meshes]
    deflections, openings = np.array([(state.deflection, state.opening) for state in states]).T
    return flanks._replace(deflections=deflections - flanks.rows @ q, openings=openings)


def _members_without_load(model: Model, conditions: Conditions, open_meshes: np.ndarray) -> list[str]:
    """Names of planets, and of members beside pins, all of whose meshes are open (n_mesh,), if they turn freely."""
    box = model.gearbox
    members = [x.name for x in box.shafts if x.name in box.planets or (model.pins and not x.rotors)]
    idle = [name for name in members if name not in (*conditions.anchors, *box.reaction_members)]
    return [name for name in idle if (of_member := _meshes_of(model, name)) and open_meshes[of_member].all()]


def secant_spring(model: Model, mesh: Mesh, force: float, opening: float, q: np.ndarray) -> SecantSpring:
    """The spring of the flank that a force [N] presses at coordinates q; opening: of either flank [m]."""
    deflection = deflection_under_force(model, mesh, force, q) + (2 * (mesh.opening - opening) if force < 0 else 0.0)
    touch = 0.0 if force >= 0 or not isfinite(mesh.law.backlash) else -mesh.law.backlash - 2 * opening
    pressed = deflection - touch
    return SecantSpring(touch, force / pressed if pressed else 0.0)


def _meshes_of(model: Model, name: str) -> list[int]:
    """Numbers of the meshes of a shaft, by its name."""
    return [i for i, mesh in enumerate(model.meshes) if name in (mesh.stage.fast.name, mesh.stage.slow.name)]


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
