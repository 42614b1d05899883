"""Inputs of a run as data sheets, read from the attributes of its data."""

import re
from collections.abc import Mapping

import numpy as np
import xarray as xr

from exugear.mesh_force.force import DAMPING_RAMP
from exugear.reporting.sections import Section, Table
from fem.pair.pair import GearPair
from fem.ste.ste_map import pair_of
from fem.support.representation import quantity
from fem.units import rpm

#: Attributes of what acts on the shafts, and their meanings; name of a function without a name.
ENDS = {"load": "load on the driven shaft", "drives": "drives by shaft", "loads": "loads by shaft"}
FUNCTION = re.compile("<lambda>|<function .*?>")
#: Attributes of a shaft: name, unit, meaning.
SHAFT = {
    "mass": ("kg", "mass [kg]"),
    "inertia": ("kg m²", "inertia about the axis [kg m²]"),
    "transverse": ("kg m²", "about a transverse axis [kg m²]"),
}


def inputs(data: xr.Dataset) -> Section:
    """Operating conditions, shafts, meshes and gears of a run."""
    tables = [_conditions(data), _shafts(data.attrs), _parts(data.attrs), _meshes(data)]
    for stage in data["stage"].values.tolist():
        pair = stage_pair(data, stage)
        if pair is not None:
            tables += [_gears(stage, pair), _pair(stage, pair)]
    return Section("Inputs", tables=tuple(table for table in tables if table.rows))


def stage_pair(data: xr.Dataset, stage: str) -> GearPair | None:
    """The gear pair of a stage, None where the attributes hold no external gears."""
    prefix = f"{stage}_"
    attributes = {name.removeprefix(prefix): x for name, x in data.attrs.items() if name.startswith(prefix)}
    try:
        return pair_of(xr.Dataset(attrs=attributes))
    except ValueError:
        return None


def speed_range(data: xr.Dataset) -> str:
    """Speed of the driving shaft, from start to end where it changes."""
    speed = data["speed"].values / rpm
    if np.ptp(speed) < 1e-3 * np.abs(speed).max():
        return f"{speed.mean():.5g} rpm"
    return f"{speed[0]:.5g} to {speed[-1]:.5g} rpm"


def _conditions(data: xr.Dataset) -> Table:
    attributes = data.attrs
    rows = [("speed of the driving shaft", speed_range(data)), ("duration", quantity(attributes["duration"], "s"))]
    for name, meaning in ENDS.items():
        if name in attributes:
            rows.append((meaning, _load(attributes[name])))
    if "stopped_by" in attributes:
        rows.append(("ended by", str(attributes["stopped_by"])))
    return Table("Operating conditions", ("condition", "value"), tuple(rows))


def _load(value) -> str:
    """A load with its unit, from start to end where it changes, or as the run names it; several by their shafts."""
    if isinstance(value, str):
        return FUNCTION.sub("a function", value.strip("{}").replace("'", "")) or "none"
    values = np.ravel(value)
    if values.size > 2:
        return f"{values.size} points, {quantity(values.min())} to {quantity(values.max(), 'N m')}"
    return " to ".join([*(quantity(x) for x in values[:-1]), quantity(values[-1], "N m")])


def _shafts(attributes: Mapping) -> Table:
    names = [name.removesuffix("_inertia") for name in attributes if name.endswith("_inertia")]
    rows = [(name, *(f"{float(attributes[f'{name}_{part}']):.4g}" for part in SHAFT)) for name in names]
    return Table("Shafts", ("shaft", *(meaning for _, meaning in SHAFT.values())), tuple(rows))


def _parts(attributes: Mapping) -> Table:
    """Bearings, discs, couplings and drags of the shafts with their values."""
    lists = {name.removesuffix("_parts"): text for name, text in attributes.items() if name.endswith("_parts")}
    rows = [(shaft, *_part(line)) for shaft, text in lists.items() for line in text.splitlines()]
    columns = ("shaft", "axial position", "part", "data")
    return Table("Parts of the shafts beside their gears", columns, tuple(rows))


def _part(line: str) -> tuple[str, str, str]:
    """Axial position, kind and data of a part, from the line of an attribute: '0 mm: Bearing(radial=2e8 N/m)'."""
    position, _, text = line.partition(": ")
    kind, _, values = text.removesuffix(")").partition("(")
    return position, re.sub(r"(?<=[a-z])(?=[A-Z])", " ", kind).lower(), values.replace("=", " ")


def _meshes(data: xr.Dataset) -> Table:
    rows = []
    for stage in data["stage"].values.tolist():
        damping, backlash = (float(data.attrs[f"{stage}_{name}"]) for name in ("damping", "backlash"))
        given = f"{backlash * 1e6:.4g}" if np.isfinite(backlash) else "no coast flank"
        friction = str(data.attrs.get(f"{stage}_friction", "none"))
        share = damping / float(data.attrs.get(f"{stage}_critical_damping", np.nan))
        ratio = f"{share:.3g}" if np.isfinite(share) else "not recorded"
        ramp = f"{float(data.attrs.get(f'{stage}_damping_ramp', DAMPING_RAMP)) * 1e6:.3g}"
        rows.append((stage, f"{damping:.4g}", ratio, ramp, given, friction))
    damped = (
        "damping along the line of action [N s/m]",
        "damping ratio, shafts free to spin",
        "ramps in over [µm], assumed",
    )
    columns = ("stage", *damped, "backlash [µm]", "friction")
    return Table("Meshes", columns, tuple(rows))


def _gears(stage: str, pair: GearPair) -> Table:
    pinion, wheel = pair.pinion.data_sheet(), pair.wheel.data_sheet()
    rows = [(row.meaning, symbol, str(row), str(wheel.get(symbol, ""))) for symbol, row in pinion.items()]
    rows += [(row.meaning, symbol, "", str(row)) for symbol, row in wheel.items() if symbol not in pinion]
    rows.append(("modifications of the flanks", "", _flank(pair.pinion.flank), _flank(pair.wheel.flank)))
    return Table(f"Gears of {stage}", ("quantity", "symbol", "pinion", "wheel"), tuple(rows))


def _flank(flank) -> str:
    """Modifications in words, none for an involute."""
    parts = flank if isinstance(flank, tuple | list) else (flank,)
    return "; ".join(map(repr, parts)) or "none"


def _pair(stage: str, pair: GearPair) -> Table:
    rows = tuple((row.meaning, symbol, str(row)) for symbol, row in pair.data_sheet().items())
    return Table(f"Pair of {stage}", ("quantity", "symbol", "value"), rows)
