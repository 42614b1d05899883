"""What stands behind the results of a run: inputs as data sheets, assumptions, plan, error estimates, versions."""

import platform
import re
from collections.abc import Mapping
from importlib.metadata import version

import numpy as np
import xarray as xr

from exugear.mesh_force.force import DAMPING_RAMP
from exugear.reporting.document import Section, Table
from fem.pair.pair import GearPair
from fem.ste.ste_map import pair_of
from fem.support.representation import quantity
from fem.support.version import __version__
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
#: Assumptions of every run.
ALWAYS = (
    "The compliance of gear bodies, teeth and contact lies in the force law of each mesh.",
    "Shafts are rigid but for those that the plan calls elastic.",
    "The mesh force follows the static law at each instant: inertia of the teeth and waves in them are left out.",
    "Coast flanks are the mirror images of driving flanks where the map of a stage has no torques < 0.",
)
NO_FRICTION = "Teeth touch without friction: the force acts along the line of action."
NO_DRAG = "No shaft is braked by drag of bearings, seals or oil."
IDEAL_BEARINGS = "No bearing yields: each shaft turns about an ideal axis."
#: Lines of a plan about run times, which say nothing about the model.
OF_THE_COMPUTER = ("tolerance 1e-3", "contact")
PACKAGES = ("exudyn", "numpy", "scipy", "numba", "xarray", "scikit-fem", "matplotlib")


def inputs(data: xr.Dataset) -> Section:
    """Operating conditions, shafts, meshes and gears of a run."""
    tables = [_conditions(data), _shafts(data.attrs), _parts(data.attrs), _meshes(data)]
    pairs: dict[GearPair | None, list[str]] = {}
    for stage in data["stage"].values.tolist():
        pairs.setdefault(stage_pair(data, stage), []).append(stage)
    for pair, stages in pairs.items():
        if pair is not None:
            tables += [_gears(", ".join(stages), pair), _pair(", ".join(stages), pair)]
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
    return position, re.sub(r"(?<=[a-z])(?=[A-Z])", " ", kind).lower(), values.replace("=", " ").replace("_", " ")


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


def _gears(stages: str, pair: GearPair) -> Table:
    pinion, wheel = pair.pinion.data_sheet(), pair.wheel.data_sheet()
    rows = [(row.meaning, symbol, str(row), str(wheel.get(symbol, ""))) for symbol, row in pinion.items()]
    rows += [(row.meaning, symbol, "", str(row)) for symbol, row in wheel.items() if symbol not in pinion]
    rows.append(("modifications of the flanks", "", _flank(pair.pinion.flank), _flank(pair.wheel.flank)))
    return Table(f"Gears of {stages}", ("quantity", "symbol", "pinion", "wheel"), tuple(rows))


def _flank(flank) -> str:
    """Modifications in words, none for an involute."""
    parts = flank if isinstance(flank, tuple | list) else (flank,)
    return "; ".join(map(repr, parts)) or "none"


def _pair(stages: str, pair: GearPair) -> Table:
    rows = tuple((row.meaning, symbol, str(row)) for symbol, row in pair.data_sheet().items())
    return Table(f"Pair of {stages}", ("quantity", "symbol", "value"), rows)


def assumptions(data: xr.Dataset) -> Section:
    """Assumptions of a run, and its plan with the reason for each reduction."""
    absent = {NO_FRICTION: "friction_loss", NO_DRAG: "drag_loss", IDEAL_BEARINGS: "bearing_force"}
    items = [*ALWAYS, *(text for text, name in absent.items() if name not in data)]
    lines = (_split(line) for line in str(data.attrs.get("plan", "")).splitlines())
    rows = tuple((part, choice) for part, choice in lines if not part.startswith(OF_THE_COMPUTER))
    tables = (Table("Plan of the model", ("part", "choice"), rows),) if rows else ()
    return Section("Assumptions and plan", tuple(items), tables)


def _split(line: str) -> tuple[str, str]:
    """A line of the plan as part and choice."""
    part, _, choice = line.partition(": ")
    return part, choice


def errors(data: xr.Dataset, wall_time: float) -> Section:
    """Estimates of the errors of a run, and its numerical settings."""
    attributes = data.attrs
    rows = [
        ("integrator", str(attributes["integrator"])),
        ("step", f"{float(attributes['step']) * 1e6:.4g} µs"),
        ("interval of the samples", f"{float(attributes['sample']) * 1e6:.4g} µs"),
        ("tolerance", f"{float(attributes['tolerance']):.3g} of the rms of the DTE"),
    ]
    if "newton_iterations" in attributes:
        rows.append(("Newton iterations a step", f"{float(attributes['newton_iterations']):.3g}"))
    if np.isfinite(wall_time):
        rows.append(("wall time of the integration", f"{wall_time:.3g} s"))
    return Section("Error estimates", _estimates(data), (Table("Integration", ("setting", "value"), tuple(rows)),))


def _estimates(data: xr.Dataset) -> tuple[str, ...]:
    """Errors by the step, the seams and the ends of the maps in words."""
    items = []
    if "step_error" in data:
        for stage, error in data["step_error"].max("checked").to_series().items():
            items.append(
                f"Step: at half the step, the rms of the DTE of {stage} changes by {100 * error:.2g} % at most."
            )
    else:
        items.append("Step: no part of the run was repeated at half the step.")
    if "seam_error" in data:
        error = 100 * float(data["seam_error"].max())
        items.append(f"Seams: the states of neighbouring parts differ by {error:.2g} % of the rms of the vibration.")
    if "beyond_map_time" in data:
        for stage, time in data["beyond_map_time"].to_series().items():
            items.append(f"Map: {stage} was beyond its map for {time:.3g} s of the run.")
    if "stopped" in data.attrs:
        items.append(f"The run stopped early: {data.attrs['stopped']}.")
    return tuple(items)


def versions() -> Section:
    """Versions of the software."""
    rows = [("exugear", __version__), *((name, version(name)) for name in PACKAGES)]
    rows += [("Python", platform.python_version()), ("system", f"{platform.system()} {platform.machine()}")]
    return Section("Versions", tables=(Table("Software", ("package", "version"), tuple(rows)),))
