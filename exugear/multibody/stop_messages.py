"""Messages of user functions for coordinates so far out of mesh that only a diverged solve reaches them."""

from math import isfinite, nan

from exugear.mesh_force.layout import OFFSETS
from exugear.mesh_force.map_range import beyond_map
from fem.units import mm, um

#: Distance beyond the end of a map's axis [m, rad], and multiple of its largest deflection, that mean divergence.
FAR, MULTIPLE = 0.01, 20
DIVERGED = "the solve diverged: hold bodies that are free to turn, tilt or move, or use smaller steps or less load"


def stopped(table, frame, error: ValueError) -> RuntimeError:
    """The error of a user function whose kernel raised this one; table of the mesh force, contact frame."""
    return RuntimeError(stop_message(table.head, error.args, float(frame.pinion.r_b)))


def stop_message(table, reason: tuple[float, ...], r_b: float = nan) -> str:
    """Message for a solve that leaves a map or has diverged; arguments as those of `beyond_map`."""
    value, largest, high, axis = (*reason, nan, nan)[:4]
    if isfinite(axis) and max(largest - value, value - high) > FAR:
        far = f"{OFFSETS[int(axis)]} {value:.4g} lies far beyond the map's axis from {largest:.6g} to {high:.6g}"
        return f"{far}; {DIVERGED}"
    if isfinite(axis) or not isfinite(value):
        return beyond_map(table, reason, r_b)
    if value < largest:
        return f"a must stay above {largest / mm:.6g} mm, the base radii's sum, got {value / mm:.6g} mm; {DIVERGED}"
    if value > MULTIPLE * largest:
        return f"deflection {value / um:.4g} um lies far beyond the map's {largest / um:.4g} um; {DIVERGED}"
    return beyond_map(table, reason, r_b)
