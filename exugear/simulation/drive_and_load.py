"""Speed and load of a built system while it is solved."""

from collections.abc import Callable
from contextlib import contextmanager
from math import isfinite

from exudyn.utilities import CreateSymbolicUserFunction

from exugear.elements.gear_contact import state_of
from exugear.simulation.model import Model
from exugear.simulation.time_functions import Curve, Line
from fem.support.validation import number, require

OFFSETS = "offsetUserFunction", "offsetUserFunction_t"


@contextmanager
def imposed(model: Model, speed_of: Line | Curve, load_of: Callable[[float], float]):
    """Speed [rad/s] of the driving shaft and load [N m] on the driven one, which stay on the system afterwards.

    Meanwhile Exudyn evaluates a line by expressions of its own, without Python. Those would keep the system in memory
    for ever.
    """
    mbs, drive, turned = model.mbs, model.drive, functions(speed_of)
    if isinstance(speed_of, Line):
        own = [CreateSymbolicUserFunction(mbs, f, name, drive) for f, name in zip(turned, OFFSETS, strict=True)]
        drive_by(mbs, drive, own)
    else:
        drive_by(mbs, drive, turned)
    _load(model, load_of)
    mbs.Assemble()
    try:
        yield
    finally:
        drive_by(mbs, drive, turned)


def functions(speed_of: Line | Curve):
    """Angle and its rate as Exudyn calls them."""

    def angle(mbs, t, item, offset):
        return speed_of.integral(t)

    def rate(mbs, t, item, offset):
        return speed_of(t)

    return angle, rate


def drive_by(mbs, drive: int, turned) -> None:
    """Let a constraint follow angle and rate."""
    for name, function in zip(OFFSETS, turned, strict=True):
        mbs.SetObjectParameter(drive, name, function)


def _load(model: Model, load_of: Callable[[float], float]) -> None:
    mbs, sign = model.mbs, -model.gearbox.directions[model.gearbox.driven.name]
    states = [(state_of(mbs, mesh.contact), mesh.held) for mesh in model.meshes]

    def torque(mbs, t, load):
        now = finite(load_of(t), t)
        for state, held in states:
            state.holding_force = held * now
        return sign * now

    steady = isinstance(load_of, Line) and load_of.b == 0
    mbs.SetLoadParameter(model.load, "load", torque(mbs, 0.0, 0.0) if steady else 0.0)
    mbs.SetLoadParameter(model.load, "loadUserFunction", 0 if steady else torque)


def finite(load: float, t: float) -> float:
    """The load [N m]; ValueError where it is none."""
    load = number("load(t)", load)
    require(isfinite(load), f"load(t) must be finite, got {load} at t = {t:.6g} s")
    return load
