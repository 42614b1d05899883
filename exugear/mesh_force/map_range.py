"""Messages for a deflection or an offset beyond the map of a force law, with the torque or the offsets to map."""

from math import floor, isfinite, log10, nan

import numpy as np

from exugear.mesh_force.force_kernels import ends_of
from exugear.mesh_force.layout import OFFSETS
from fem.pair.offsets import ANGLES, LARGEST_ANGLE
from fem.units import um

#: Range to map, over the value at which a run left its map: the run may go beyond that value.
MARGIN = 1.5
#: Number of values of an offset's axis to map.
AXIS_VALUES = 5


def beyond_map(table, reason: tuple[float, ...], r_b: float = nan) -> str:
    """Message for a deflection beyond the map, or an offset beyond its axis.

    table    head of the law's table
    reason   arguments of the kernels' ValueError: (deflection, largest deflection) [m], or (offset, low, high, number
             of the axis), after them the side of the flank, -1 of a coast flank with a table of its own
    r_b      base radius of the pinion [m], where it is known
    """
    deflection, largest, high, axis, side = *(*reason, nan, nan)[:4], -1 if reason[4:] == (-1.0,) else 1
    if isfinite(axis):
        name = OFFSETS[int(axis)]
        if side < 0 and name != "a":
            deflection, largest, high = -deflection, -high, -largest
        ends = f"the map's axis from {largest:.6g} to {high:.6g}"
        return f"{name} {deflection:.6g} lies beyond {ends}; {wider_offsets(name, deflection, largest, high)}"
    if not isfinite(deflection):
        return f"deflection must be finite, got {deflection}; use a smaller step"
    last_force, last_stiffness = ends_of(table, side)
    needed = last_force + last_stiffness * (deflection - largest)
    ends = f"the map, which ends at {side * largest / um:.4g} um at this phase"
    return f"deflection {side * deflection / um:.4g} um lies beyond {ends}; {larger_torque(table, needed, r_b, side)}"


def larger_torque(table, force: float, r_b: float, side: int = 1) -> str:
    """Remedy for a force [N] that a law does not reach: the torque to map.

    side   -1: on a coast flank with a table of its own
    """
    last, sign = ends_of(table, side)[0], "-" if side < 0 else ""
    if not isfinite(r_b):
        up_to = f"to {sign}{_rounded_up(MARGIN * force / 1e3)} kN (it ends at {sign}{last / 1e3:.4g} kN)"
        return f"extend the map to a larger torque, or the table's deflection, {up_to}"
    ends = f"the map ends at a pinion torque of {sign}{last * r_b:.4g} N m, {sign}{force * r_b:.4g} N m are needed"
    further = f"a larger torque, {sign}{_rounded_up(MARGIN * force * r_b)} N m or {'below' if side < 0 else 'more'}"
    return f"{ends}; extend the map to {further}"


def wider_offsets(name: str, value: float, low: float, high: float) -> str:
    """Remedy for an offset beyond an axis from low to high: the axis to map, where `fem.Offsets` can hold it."""
    values = wider_axis(value, low, high)
    if name in ANGLES and max(map(abs, values)) >= LARGEST_ANGLE:
        return f"maps end at {LARGEST_ANGLE} rad: let bearings and shafts be stiffer, or the load smaller"
    return f"extend the axis: fem.Offsets({name}=({', '.join(f'{x:.6g}' for x in values)}))"


def wider_axis(value: float, low: float, high: float) -> list[float]:
    """Values of an axis from low to high that reaches a value beyond it, with margin, and keeps 0 within it."""
    middle = (low + high) / 2
    reach = float(f"{middle + MARGIN * (value - middle):.3g}" if middle == 0 else middle + MARGIN * (value - middle))
    low, high = min(low, reach), max(high, reach)
    values = np.linspace(low, high, AXIS_VALUES)
    if low < 0 < high:
        values = np.r_[low, low / 2, 0.0, high / 2, high]
    return values.tolist()


def _rounded_up(value: float) -> str:
    """A value rounded up to two digits."""
    unit = 10.0 ** (floor(log10(abs(value))) - 1)
    return f"{np.ceil(value / unit * (1 - 1e-9)) * unit:g}"
