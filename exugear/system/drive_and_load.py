"""Imposed speed and torques of a run, applied to the built system while it is solved."""

from collections.abc import Iterator
from contextlib import contextmanager

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.utilities import CreateSymbolicUserFunction

from exugear.elements.exudyn_objects import set_state_of_system, state_of_system
from exugear.elements.gear_contact import state_of
from exugear.elements.shaft_torque import ShaftTorque, add_torque
from exugear.operation.conditions import Conditions, ShaftEnd
from exugear.operation.piecewise_cubics import constant
from exugear.operation.shaft_ends import Torque
from exugear.operation.time_functions import Line
from exugear.operation.torque_tables import TIME, TorqueTable
from exugear.system.model import Model

#: Parameters of the constraint that a run sets.
CONSTRAINT = "offsetUserFunction", "offsetUserFunction_t", "markerNumbers", "activeConnector"
OFFSETS = CONSTRAINT[:2]
NO_TORQUE = TorqueTable(TIME, constant(0.0))
INITIAL = exu.ConfigurationType.Initial


#: Tabulated torques and recorded motions of a run, by the name of the shaft, or `rotor_name` of it.
ShaftTorques = dict[str, ShaftTorque]


def rotor_name(shaft: str) -> str:
    """Name of the rotor behind the coupling of a shaft."""
    return f"{shaft} rotor"


@contextmanager
def applied(model: Model, conditions: Conditions) -> Iterator[ShaftTorques]:
    """Apply the imposed speed and the torques; afterwards the system keeps the speed and the load of the driven shaft.

    Until `released` the torques have their values at the start, and where all shafts are free the anchor is held, so
    that the static equilibrium can be solved.
    """
    torques: ShaftTorques = {}
    loads: list[int] = []
    functions = _hold(model, conditions)
    model.mbs.SetLoadParameter(model.load, "load", 0.0)
    model.mbs.SetLoadParameter(model.load, "loadUserFunction", 0)
    set_holding_forces(model, conditions.initial_torques + conditions.initial_drags)
    try:
        for end in conditions.ends:
            loads += _apply(model, conditions, end, torques)
        _record_rotors(model, conditions, torques)
        model.mbs.Assemble()
        yield torques
    finally:
        _remove(model, torques, loads)
        if functions:
            # Symbolic expressions would keep the system in memory for ever.
            _set_offsets(model, functions)


def released(model: Model, conditions: Conditions, torques: ShaftTorques) -> None:
    """Let the torques vary and free shafts turn; the initial state of the system stays."""
    for shaft_torque in torques.values():
        shaft_torque.record.held = 0
    if conditions.held is None:
        model.mbs.SetObjectParameter(model.drive, "activeConnector", False)
    if conditions.held is None or torques:
        assemble_in_state(model)


def assemble_in_state(model: Model) -> None:
    """Assemble the system without a change of its initial state."""
    state = state_of_system(model.mbs, INITIAL)
    model.mbs.Assemble()
    set_state_of_system(model.mbs, state, INITIAL)


def _hold(model: Model, conditions: Conditions):
    """Let the constraint hold the anchor at its imposed speed, or at rest; returns its functions in Python if any.

    While the system is solved, Exudyn evaluates a linear speed by its symbolic expressions, without Python.
    """
    mbs, drive, speed_of = model.mbs, model.drive, conditions.speed_of
    markers = [mbs.GetObjectParameter(drive, "markerNumbers")[0], model.end_markers[conditions.anchor]]
    mbs.SetObjectParameter(drive, "markerNumbers", markers)
    mbs.SetObjectParameter(drive, "activeConnector", True)
    functions = angle_and_rate(conditions) if speed_of else None
    if functions is None:
        for name in OFFSETS:
            mbs.SetObjectParameter(drive, name, 0)
    elif isinstance(speed_of, Line):
        named = zip(functions, OFFSETS, strict=True)
        _set_offsets(model, [CreateSymbolicUserFunction(mbs, function, name, drive) for function, name in named])
    else:
        _set_offsets(model, functions)
    return functions


def angle_and_rate(conditions: Conditions):
    """Angle about z of the held shaft and its rate as user functions of Exudyn."""
    speed_of, start_angle = conditions.speed_of, conditions.start_angle
    direction = conditions.gearbox.directions[conditions.anchor]

    def angle(mbs, t, item, offset):
        return speed_of.integral(t)

    def rate(mbs, t, item, offset):
        return speed_of(t)

    def angle_about_z(mbs, t, item, offset):
        return direction * (start_angle + speed_of.integral(t))

    def rate_about_z(mbs, t, item, offset):
        return direction * speed_of(t)

    return (angle_about_z, rate_about_z) if start_angle or direction < 0 else (angle, rate)


def _set_offsets(model: Model, functions) -> None:
    for name, function in zip(OFFSETS, functions, strict=True):
        model.mbs.SetObjectParameter(model.drive, name, function)


def set_holding_forces(model: Model, torques: np.ndarray) -> None:
    """Mesh forces that balance torques about z (n_shaft,) [N m], by which contacts correct their damping."""
    for mesh in model.meshes:
        state_of(model.mbs, mesh.contact).holding_force = float(mesh.force_per_torque @ torques)


def _apply(model: Model, conditions: Conditions, end: ShaftEnd, torques: ShaftTorques) -> list:
    """Apply the torque of an end, constant as a load, else by its table; returns the numbers of added loads."""
    mbs, name = model.mbs, end.shaft
    sign = end.sense * model.gearbox.directions[name]
    if end.of_time is None and not conditions.tables[name].constant:
        key = rotor_name(name) if name in model.rotors else name
        torques[key] = _add_torque(model, conditions, end, conditions.tables[name])
        return []
    if name == model.gearbox.driven.name:
        load, added = model.load, []
    else:
        load = mbs.AddLoad(eii.LoadCoordinate(markerNumber=model.end_markers[name], load=0.0))
        added = [load]
    if end.of_time is None:
        mbs.SetLoadParameter(load, "load", sign * float(conditions.tables[name](0.0, 0.0, 0.0)))
    else:
        mbs.SetLoadParameter(load, "loadUserFunction", _called(model, conditions, end))
    return added


def _called(model: Model, conditions: Conditions, end: ShaftEnd):
    """User function of a load that calls a function of time."""
    sign, shafts = end.sense * model.gearbox.directions[end.shaft], [shaft.name for shaft in model.gearbox.shafts]
    column = shafts.index(end.shaft)
    states = [(state_of(model.mbs, mesh.contact), mesh.force_per_torque[column]) for mesh in model.meshes]

    def torque(mbs, t, load):
        value = sign * conditions.called(end, t)
        for state, factor in states:
            state.holding_force = factor * value
        return value

    return torque


def _add_torque(model: Model, conditions: Conditions, end: ShaftEnd, table: TorqueTable) -> ShaftTorque:
    """Add a tabulated torque on the end of a shaft, with its value at the start."""
    names = [shaft.name for shaft in model.gearbox.shafts]
    column, node = names.index(end.shaft), model.mbs.GetMarker(model.end_markers[end.shaft])["nodeNumber"]
    states = [state_of(model.mbs, mesh.contact) for mesh in model.meshes]
    factors = [float(mesh.force_per_torque[column]) for mesh in model.meshes]
    directions = {"direction": model.gearbox.directions[end.shaft], "sense": end.sense}
    shaft_torque = add_torque(model.mbs, node, table, **directions, states=states, factors=factors)
    shaft_torque.record.held = 1
    shaft_torque.record.torque = 0.0 if table is NO_TORQUE else conditions.initial_torques[column]
    return shaft_torque


def _record_rotors(model: Model, conditions: Conditions, torques: ShaftTorques) -> None:
    """Record the motion of the rotors behind couplings where it is needed; the meshes record that of their bodies."""
    if conditions.held is None or conditions.power:
        for name in model.rotors:
            if rotor_name(name) not in torques:
                end = ShaftEnd(name, 1, Torque(0.0))
                torques[rotor_name(name)] = _add_torque(model, conditions, end, NO_TORQUE)


def _remove(model: Model, torques: ShaftTorques, loads: list) -> None:
    """Remove what a run has added to the system, the last first; its state stays."""
    for shaft_torque in sorted(torques.values(), key=lambda each: -each.number):
        model.mbs.DeleteObject(shaft_torque.number, deleteDependentItems=False, suppressWarnings=True)
    for load in reversed(loads):
        model.mbs.DeleteLoad(load, deleteDependentMarkers=False, suppressWarnings=True)
    if loads or torques:
        assemble_in_state(model)
