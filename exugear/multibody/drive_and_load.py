"""Imposed speed and torques of a run, applied to the built system while it is solved."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from exugear.multibody import imposed_speed
from exugear.multibody.exudyn_objects import CURRENT, INITIAL, node_of, set_state_of_system, state_of_system
from exugear.multibody.gear_contact import state_of
from exugear.multibody.model import Model
from exugear.multibody.shaft_torque import ShaftTorque, add_torque
from exugear.operation.conditions import Conditions, ShaftEnd
from exugear.operation.piecewise_cubics import constant
from exugear.operation.shaft_ends import Torque
from exugear.operation.torque_tables import TIME, TorqueTable

NO_TORQUE = TorqueTable(TIME, constant(0.0))
#: Position of the Lagrange multipliers in Exudyn's system state.
MULTIPLIERS = 3

#: Tabulated torques and recorded motions of a run, by the name of the shaft or rotor.
ShaftTorques = dict[str, ShaftTorque]


@contextmanager
def applied(model: Model, conditions: Conditions) -> Iterator[ShaftTorques]:
    """Apply the imposed speed and the torques; afterwards the system keeps the speed and the load of the driven shaft.

    Until `released` the torques have their values at the start, and where all shafts are free the anchor is held, so
    that the static equilibrium can be solved.
    """
    torques: ShaftTorques = {}
    imposed_speed.hold(model, conditions)
    model.mbs.SetLoadParameter(model.load, "load", 0.0)
    model.mbs.SetLoadParameter(model.load, "loadUserFunction", 0)
    set_holding_forces(model, conditions.initial_torques + conditions.initial_drags)
    try:
        for end in conditions.ends:
            _apply(model, conditions, end, torques)
        _record_rotors(model, conditions, torques)
        model.mbs.Assemble()
        yield torques
    finally:
        _remove(model, conditions, torques)


def released(model: Model, conditions: Conditions, torques: ShaftTorques) -> None:
    """Let the torques vary and free shafts turn; the initial state of the system stays."""
    for shaft_torque in torques.values():
        shaft_torque.record.held = 0
    if not imposed_speed.needs_constraint(model, conditions, len(torques)):
        imposed_speed.drive_by_contacts(model, conditions)
    elif conditions.held:
        imposed_speed.drive_by_constraint(model, conditions)
    else:
        model.mbs.SetObjectParameter(model.drive, "activeConnector", False)
    assemble_in_state(model)


def assemble_in_state(model: Model) -> None:
    """Assemble the system without a change of its states; the multiplier of the drive is the last one."""
    mbs = model.mbs
    states = {configuration: state_of_system(mbs, configuration) for configuration in (INITIAL, CURRENT)}
    mbs.Assemble()
    number = mbs.systemData.GetAECoordinates(INITIAL).size
    for configuration, (coordinates, accelerations) in states.items():
        multipliers = np.append(coordinates[MULTIPLIERS], np.zeros(number))[:number]
        coordinates = [*coordinates[:MULTIPLIERS], multipliers, *coordinates[MULTIPLIERS + 1 :]]
        set_state_of_system(mbs, (coordinates, accelerations), configuration)


def set_holding_forces(model: Model, torques: np.ndarray) -> None:
    """Mesh forces that balance torques about z (n_shaft,) [N m], by which contacts correct their damping."""
    for mesh in model.meshes:
        state_of(model.mbs, mesh.contact).holding_force = float(mesh.force_per_torque @ torques)


def _apply(model: Model, conditions: Conditions, end: ShaftEnd, torques: ShaftTorques) -> None:
    """Apply the torque of an end: a constant on a shaft by a contact of the shaft, others by their tables."""
    table = conditions.tables[end.name]
    if end.body in model.rotor_spins or not table.constant:
        torques[end.body] = _add_torque(model, conditions, end, table)
        return
    about_z = end.sense * model.gearbox.directions[end.shaft] * float(table(0.0, 0.0, 0.0))
    mesh, side = next(
        (mesh, side)
        for mesh in model.meshes
        for side, shaft in enumerate((mesh.stage.fast, mesh.stage.slow))
        if shaft.name == end.shaft
    )
    state_of(model.mbs, mesh.contact).torques[side] = about_z


def _add_torque(model: Model, conditions: Conditions, end: ShaftEnd, table: TorqueTable) -> ShaftTorque:
    """Add a tabulated torque on the end of a shaft, with its value at the start."""
    names = [shaft.name for shaft in model.gearbox.shafts]
    column, node = names.index(end.shaft), _node_of(model, end.body)
    states = [state_of(model.mbs, mesh.contact) for mesh in model.meshes]
    factors = [float(mesh.force_per_torque[column]) for mesh in model.meshes]
    directions = {"direction": model.gearbox.directions[end.shaft], "sense": end.sense}
    name = f"torque on {end.body}"
    shaft_torque = add_torque(model.mbs, name, node, table, **directions, states=states, factors=factors)
    shaft_torque.record.held = 1
    shaft_torque.record.torque = 0.0 if table is NO_TORQUE else conditions.initial_torque(end)
    return shaft_torque


def _record_rotors(model: Model, conditions: Conditions, torques: ShaftTorques) -> None:
    """Record the motion of the rotors behind couplings where it is needed; the meshes record that of their bodies."""
    everywhere = conditions.held is None or conditions.power
    for shaft in model.gearbox.shafts:
        held_ends = [rotor for rotor in shaft.rotors if shaft.name == conditions.held and rotor.name == shaft.end]
        beside_held = [rotor.body for rotor in held_ends]
        for rotor in shaft.rotors:
            if rotor.name not in torques and (everywhere or rotor.name in beside_held):
                end = ShaftEnd(rotor.name, shaft.name, rotor.name, 1, Torque(0.0))
                torques[rotor.name] = _add_torque(model, conditions, end, NO_TORQUE)


def _node_of(model: Model, body: str):
    """Node of a shaft, or of a rotor, by its name."""
    mbs, number = model.mbs, model.bodies.get(body)
    return node_of(mbs, mbs.GetObjectNumber(body) if number is None else number)


def _remove(model: Model, conditions: Conditions, torques: ShaftTorques) -> None:
    """Remove what a run has added to the system; its state stays, and the constant torque of the driven shaft."""
    mbs, driven = model.mbs, model.gearbox.driven.name
    for shaft_torque in torques.values():
        number = mbs.GetObjectNumber(shaft_torque.name)
        mbs.DeleteObject(number, deleteDependentItems=False, suppressWarnings=True)
    for mesh in model.meshes:
        state_of(mbs, mesh.contact).torques[:] = 0.0
    imposed_speed.restore_constraint(model, conditions)
    for end in conditions.ends:
        if end.name == driven and conditions.tables[driven].constant:
            about_z = end.sense * model.gearbox.directions[driven] * float(conditions.tables[driven](0.0, 0.0, 0.0))
            mbs.SetLoadParameter(model.load, "load", about_z)
    assemble_in_state(model)
