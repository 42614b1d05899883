"""What a user function says of coordinates at which no gears stand: the solve that asks for them has diverged."""

from math import isfinite, nan

from exugear.force import beyond_map
from exugear.law import OFFSETS
from fem.units import mm, um

#: Distance from an axis [m, rad], and multiple of a map's largest deflection, at which no gears stand.
FAR, TIMES = 0.01, 20
DIVERGED = "the solve diverged: hold bodies that are free to turn, tilt or move, or use smaller steps or less load"


def stopped(deflection: float, largest: float, high: float = nan, axis: float = nan) -> str:
    """What stops a solve whose deflection [m] leaves the map, or whose offset its axis: (offset, low, high, number)."""
    if isfinite(axis) and max(largest - deflection, deflection - high) > FAR:
        far = f"{OFFSETS[int(axis)]} {deflection:.4g} lies far beyond the map's axis from {largest:.6g} to {high:.6g}"
        return f"{far}; {DIVERGED}"
    if isfinite(axis) or not isfinite(deflection):
        return beyond_map(deflection, largest, high, axis)
    if deflection < largest:
        return (
            f"a must stay above {largest / mm:.6g} mm, the base radii's sum, got {deflection / mm:.6g} mm; {DIVERGED}"
        )
    if deflection > TIMES * largest:
        return f"deflection {deflection / um:.4g} um lies far beyond the map's {largest / um:.4g} um; {DIVERGED}"
    return beyond_map(deflection, largest)
