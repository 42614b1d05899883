"""Speed and load of a run, applied to the built system while it is solved."""

from collections.abc import Iterator
from contextlib import contextmanager

from exudyn.utilities import CreateSymbolicUserFunction

from exugear.elements.gear_contact import state_of
from exugear.simulation.model import Model
from exugear.simulation.time_functions import Conditions, Curve, Line

OFFSETS = "offsetUserFunction", "offsetUserFunction_t"


@contextmanager
def applied(model: Model, conditions: Conditions) -> Iterator[None]:
    """Apply the speed of the driving shaft and the load on the driven shaft; the system keeps them afterwards.

    While the system is solved, Exudyn evaluates a linear speed by its symbolic expressions, without Python. Afterwards
    functions of Python replace them, because symbolic expressions would keep the system in memory for ever.
    """
    mbs, drive, functions = model.mbs, model.drive, angle_and_rate(conditions.speed_of)
    if isinstance(conditions.speed_of, Line):
        named = zip(functions, OFFSETS, strict=True)
        set_drive(mbs, drive, [CreateSymbolicUserFunction(mbs, function, name, drive) for function, name in named])
    else:
        set_drive(mbs, drive, functions)
    _set_load(model, conditions)
    mbs.Assemble()
    try:
        yield
    finally:
        set_drive(mbs, drive, functions)


def angle_and_rate(speed_of: Line | Curve):
    """Angle of the driving shaft and its rate as user functions of Exudyn."""

    def angle(mbs, t, item, offset):
        return speed_of.integral(t)

    def rate(mbs, t, item, offset):
        return speed_of(t)

    return angle, rate


def set_drive(mbs, drive: int, angle_and_rate) -> None:
    """Let the constraint of the drive follow an angle and its rate (user functions)."""
    for name, function in zip(OFFSETS, angle_and_rate, strict=True):
        mbs.SetObjectParameter(drive, name, function)


def _set_load(model: Model, conditions: Conditions) -> None:
    """Set the load torque on the driven shaft; a constant torque needs no call of Python."""
    mbs, sign = model.mbs, -model.gearbox.directions[model.gearbox.driven.name]
    states = [(state_of(mbs, mesh.contact), mesh.force_per_load) for mesh in model.meshes]

    def torque(mbs, t, load):
        load_torque = conditions.load_at(t)
        for state, force_per_load in states:
            state.holding_force = force_per_load * load_torque
        return sign * load_torque

    constant = conditions.constant_load
    mbs.SetLoadParameter(model.load, "load", torque(mbs, 0.0, 0.0) if constant else 0.0)
    mbs.SetLoadParameter(model.load, "loadUserFunction", 0 if constant else torque)
