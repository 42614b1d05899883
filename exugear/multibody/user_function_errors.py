"""Errors of user functions: what they say, and the slot of a system in which they wait for whoever solves it.

Exudyn passes on the text of an error, not always the error itself. So a user function leaves its exception in a slot of
its system, and `user_errors_raised`, around a solve, raises that in place of Exudyn's.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from math import isfinite, nan
from types import SimpleNamespace

from exugear.mesh_force.layout import OFFSETS
from exugear.mesh_force.map_range import beyond_map
from fem.units import mm, um

#: Distance beyond the end of a map's axis [m, rad], and multiple of its largest deflection, that mean divergence.
FAR, MULTIPLE = 0.01, 20
DIVERGED = "the solve diverged: hold bodies that are free to turn, tilt or move, or use smaller steps or less load"
#: Key of mbs.variables under which a system keeps the slot.
SLOT = "error of a user function"


class OutOfRange(RuntimeError):
    """A user function of ours has no force at these coordinates: they leave a map or the table of a bearing."""


class Diverged(OutOfRange):
    """Coordinates so far out that only a diverged solve reaches them.

    reason   of the failure, without the remedy that the message adds: a solver may know a better one
    """

    def __init__(self, reason: str):
        super().__init__(f"{reason}; {DIVERGED}")
        self.reason = reason


def slot_of(mbs) -> SimpleNamespace:
    """The slot of a system: its `error` is the exception of a user function of ours, or None."""
    return mbs.variables.setdefault(SLOT, SimpleNamespace(error=None))


def errors_kept(mbs, function: Callable) -> Callable:
    """The user function, which leaves its exceptions in the slot of the system."""
    slot = slot_of(mbs)

    @wraps(function)
    def keeping(*arguments):
        try:
            return function(*arguments)
        except Exception as error:
            slot.error = error
            raise

    return keeping


@contextmanager
def user_errors_raised(mbs) -> Iterator[None]:
    """Context of a solve: where it fails with an exception in the slot, that is raised in place of Exudyn's."""
    slot = slot_of(mbs)
    slot.error = None
    try:
        yield
    except Exception:
        error, slot.error = slot.error, None
        if error is None:
            raise
        raise error from None


def stopped(table, frame, error: ValueError) -> RuntimeError:
    """The error of a user function whose kernel raised this one; table of the mesh force, contact frame."""
    return stop_error(table.head, error.args, float(frame.pinion.r_b))


def stop_error(table, reason: tuple[float, ...], r_b: float = nan) -> RuntimeError:
    """The error of a solve that leaves a map or has diverged; arguments as those of `beyond_map`."""
    value, largest, high, axis = (*reason, nan, nan)[:4]
    if isfinite(axis) and max(largest - value, value - high) > FAR:
        axis_range = f"the map's axis from {largest:.6g} to {high:.6g}"
        return Diverged(f"{OFFSETS[int(axis)]} {value:.4g} lies far beyond {axis_range}")
    if isfinite(axis) or not isfinite(value):
        return OutOfRange(beyond_map(table, reason, r_b))
    if value < largest:
        return Diverged(f"a must stay above {largest / mm:.6g} mm, the base radii's sum, got {value / mm:.6g} mm")
    if value > MULTIPLE * largest:
        return Diverged(f"deflection {value / um:.4g} um lies far beyond the map's {largest / um:.4g} um")
    return OutOfRange(beyond_map(table, reason, r_b))
