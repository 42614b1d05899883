"""The imposed speed of a shaft: a constraint for static solves, and a known function of time while a run is solved.

Contacts evaluate the imposed motion themselves (`exugear.contact.imposed_motion`), which needs no constraint, no
algebraic equation and no function in Python. Where an item of the user or a drag acts on the system beside them, the
constraint stays, since it alone keeps other forces from the imposed motion.
"""

from exudyn.utilities import CreateSymbolicUserFunction

from exugear.contact.imposed_motion import imposed_motion
from exugear.gearbox.shaft import Rotor, Shaft
from exugear.mesh_force.kernel_records import address_of
from exugear.multibody.exudyn_objects import node_of
from exugear.multibody.gear_contact import state_of
from exugear.multibody.model import Model, end_coordinate
from exugear.multibody.shaft_bodies import add_driven_coupling
from exugear.operation.conditions import Conditions
from exugear.operation.time_functions import Line

#: Parameters of the constraint that a run sets.
CONSTRAINT = "offsetUserFunction", "offsetUserFunction_t", "markerNumbers", "activeConnector"
OFFSETS = CONSTRAINT[:2]
#: Key under which the system keeps the imposed motion while contacts read it, and name of a coupling that does.
MOTION, COUPLING = "imposed motion", "driven coupling"
#: Key under which it keeps the deleted constraint and load.
DELETED = "constraint and load"


def hold(model: Model, conditions: Conditions) -> None:
    """Let the constraint hold the anchor at rest at its angle at the start, where the static equilibrium is solved."""
    mbs, drive = model.mbs, model.drive
    markers = [mbs.GetObjectParameter(drive, "markerNumbers")[0], model.end_markers[conditions.anchor]]
    mbs.SetObjectParameter(drive, "markerNumbers", markers)
    mbs.SetObjectParameter(drive, "activeConnector", True)
    mbs.SetObjectParameter(
        drive, "offset", float(conditions.initial_angle * model.speed_ratios[end_coordinate(model, conditions.anchor)])
    )
    _set_offsets(model, (0, 0))


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


def needs_constraint(model: Model, conditions: Conditions, added: int) -> bool:
    """Whether an item of the user needs constraint or load, or forces beside those of meshes act on the held shaft.

    added   number of objects that the run has added to the system
    """
    mbs, system, held = model.mbs, model.mbs.systemData, _held_shaft(model, conditions)
    drive, load = int(model.drive), int(model.load)
    further = system.NumberOfObjects() > drive + 1 + added or system.NumberOfLoads() > load + 1
    sensors = [mbs.GetSensor(i) for i in range(system.NumberOfSensors())]
    on_drive = any(int(sensor.get("objectNumber", -1)) == drive for sensor in sensors)
    on_load = any(int(sensor.get("loadNumber", -1)) == load for sensor in sensors)
    braked = held is not None and held.coupling is None and bool(held.drags)
    return further or on_drive or on_load or braked


def drive_by_constraint(model: Model, conditions: Conditions) -> None:
    """Let the constraint impose the speed; a linear one by symbolic expressions, which Exudyn evaluates itself."""
    functions = angle_and_rate(conditions)
    if isinstance(conditions.speed_of, Line):
        named = zip(functions, OFFSETS, strict=True)
        functions = [CreateSymbolicUserFunction(model.mbs, f, name, model.drive) for f, name in named]
    _set_offsets(model, functions)


def drive_by_contacts(model: Model, conditions: Conditions) -> None:
    """Delete constraint and load, and let the contacts of the held shaft, or its coupling, read its imposed motion."""
    mbs, held = model.mbs, _held_shaft(model, conditions)
    mbs.variables[DELETED] = mbs.GetObject(model.drive), mbs.GetLoad(model.load)
    mbs.DeleteObject(model.drive, deleteDependentItems=False, suppressWarnings=True)
    mbs.DeleteLoad(model.load, deleteDependentMarkers=False, suppressWarnings=True)
    if held is None:
        return
    knots, coefficients = conditions.speed_of.angle_pieces
    coefficients[:, 0] += conditions.start_angle
    motion, arrays = imposed_motion(knots, model.gearbox.directions[held.name] * coefficients)
    mbs.variables[MOTION] = motion, arrays
    if held.coupling:
        mbs.SetObjectParameter(_spring_of(model, held), "activeConnector", False)
        rotor, end = mbs.GetMarker(model.end_markers[held.name])["nodeNumber"], end_rotor(held)
        inner = model.bodies[held.name] if end.body == held.name else mbs.GetObjectNumber(end.body)
        add_driven_coupling(mbs, COUPLING, (rotor, node_of(mbs, inner)), end.coupling, motion)
    else:
        _impose_in_contacts(model, held, address_of(motion))


def _impose_in_contacts(model: Model, held: Shaft, address: int) -> None:
    """Let the contacts of a shaft read its imposed motion; the first of them accelerates its coordinate."""
    inertia = held.inertia
    for mesh in model.meshes:
        state = state_of(model.mbs, mesh.contact)
        for side, shaft in enumerate((mesh.stage.fast, mesh.stage.slow)):
            if shaft.name == held.name:
                state.imposed[side], state.inertias[side], inertia = address, inertia, 0.0


def restore_constraint(model: Model, conditions: Conditions) -> None:
    """Restore constraint and load where `drive_by_contacts` has deleted them; symbolic expressions become functions.

    Expressions would keep the system in memory for ever. Torques of the run are removed before.
    """
    mbs, held = model.mbs, _held_shaft(model, conditions)
    mbs.variables.pop(MOTION, None)
    for mesh in model.meshes:
        state = state_of(mbs, mesh.contact)
        state.imposed[:], state.inertias[:] = 0, 0.0
    if DELETED in mbs.variables:
        if held and held.coupling:
            mbs.DeleteObject(mbs.GetObjectNumber(COUPLING), deleteDependentItems=False, suppressWarnings=True)
            mbs.SetObjectParameter(_spring_of(model, held), "activeConnector", True)
        constraint, load = mbs.variables.pop(DELETED)
        mbs.AddObject(constraint)
        mbs.AddLoad(load)
    hold(model, conditions)
    if held:
        _set_offsets(model, angle_and_rate(conditions))
    else:
        mbs.SetObjectParameter(model.drive, "activeConnector", False)


def driven_by_contacts(model: Model) -> bool:
    """Whether contacts, or a coupling, read the imposed motion of the held shaft."""
    return MOTION in model.mbs.variables


def _held_shaft(model: Model, conditions: Conditions) -> Shaft | None:
    """The shaft whose speed is imposed, if any."""
    return next((shaft for shaft in model.gearbox.shafts if shaft.name == conditions.held), None)


def _spring_of(model: Model, shaft: Shaft) -> int:
    """Number of the spring between the rotor at the end of a shaft and the body beside it."""
    return model.mbs.GetObjectNumber(end_rotor(shaft).spring)


def end_rotor(shaft: Shaft) -> Rotor:
    """The rotor at the end of a shaft with couplings."""
    return next(rotor for rotor in shaft.rotors if rotor.name == shaft.end)


def _set_offsets(model: Model, functions) -> None:
    for name, function in zip(OFFSETS, functions, strict=True):
        model.mbs.SetObjectParameter(model.drive, name, function)
