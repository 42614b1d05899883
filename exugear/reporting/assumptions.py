"""What a run assumes, what its plan left out, and the estimates of its errors."""

import platform
from importlib.metadata import version

import numpy as np
import xarray as xr

from exugear.reporting.sections import Section, Table
from fem.support.version import __version__

#: Assumptions of every run.
ALWAYS = (
    "Gears and shafts are rigid; the compliance of gear bodies, teeth and contact lies in the force law of each mesh.",
    "The mesh force follows the static law at each instant: inertia of the teeth and waves in them are left out.",
    "Coast flanks are the mirror images of driving flanks where the map of a stage has no torques < 0.",
)
NO_FRICTION = "Teeth touch without friction: the force acts along the line of action."
NO_DRAG = "No shaft is braked by drag of bearings, seals or oil."
IDEAL_BEARINGS = "No bearing yields: each shaft turns about an ideal axis."
#: Lines of a plan about run times, which say nothing about the model.
OF_THE_COMPUTER = ("tolerance 1e-3", "contact")
PACKAGES = ("exudyn", "numpy", "scipy", "numba", "xarray", "scikit-fem", "matplotlib")


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
