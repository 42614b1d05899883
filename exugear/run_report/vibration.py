"""Section of a report on the vibration modes of the loaded gearbox."""

import numpy as np
import xarray as xr

from exugear.modes.campbell import campbell
from exugear.modes.modes import modes
from exugear.run_report.figures import campbell_figure
from exugear.run_report.sections import Section, Table
from exugear.system.model import Model
from fem.units import rpm

#: Least share of a mode's strain energy in a mesh for a crossing to be listed, and the largest number of rows.
LEAST_SHARE, MOST_ROWS = 0.1, 20


def vibration(model: Model, data: xr.Dataset) -> Section:
    """Modes of the gearbox at the load of a run, and the speeds at which orders excite them."""
    load = _load(data)
    at_rest = modes(model, load=load)
    diagram = campbell(model, load, (0.0, float(np.abs(data["speed"]).max())))
    text = (
        "Meshes have their mean tangent stiffness at the load, bearings theirs; the driving shaft is held.",
        f"Crossings with at least {LEAST_SHARE:.0%} of the strain energy in the mesh of the order are listed.",
    )
    tables = [table for table in (_modes(at_rest), _crossings(diagram)) if table.rows]
    return Section("Vibration modes", text, tuple(tables), (campbell_figure(diagram),))


def _load(data: xr.Dataset) -> float:
    """Constant load on the driven shaft [N m]; ValueError for a run without it."""
    given = data.attrs.get("load", "no load on the driven shaft alone")
    try:
        return float(given)
    except ValueError:
        remedy = "leave out model, and use exugear.modes at a load of your choice"
        raise ValueError(f"run must have a constant load for its vibration modes, got {given}; {remedy}") from None


def _modes(at_rest: xr.Dataset) -> Table:
    rows = []
    for number in range(min(at_rest.sizes["mode"], MOST_ROWS)):
        mode = at_rest.isel(mode=number)
        share = mode["energy_share"]
        strained = f"{share.idxmax('element').item()} ({float(share.max()):.0%})"
        numbers = f"{float(mode['frequency']):.1f}", f"{float(mode['damping_ratio']):.4f}"
        rows.append((str(number + 1), *numbers, strained if float(share.max()) > 0 else "none: rigid-body motion"))
    columns = ("mode", "frequency [Hz]", "damping ratio", "most of the strain energy in")
    return Table("Natural frequencies at rest under the load", columns, tuple(rows))


def _crossings(diagram: xr.Dataset) -> Table:
    """Crossings with a large share of strain energy in the mesh, by rising speed."""
    share = diagram["crossing_energy_share"].values
    listed = np.sort(np.argsort(-share)[:MOST_ROWS])
    rows = []
    for number in listed[share[listed] >= LEAST_SHARE]:
        crossing = diagram.isel(crossing=int(number))
        numbers = f"{float(crossing['crossing_speed']) / rpm:.0f}", f"{float(crossing['crossing_frequency']):.1f}"
        order, mode = str(crossing["crossing_order"].item()), str(crossing["crossing_mode"].item())
        rows.append((*numbers, order, mode, f"{share[number]:.0%}"))
    columns = ("driving shaft [rpm]", "frequency [Hz]", "order", "mode", "strain energy in the mesh")
    return Table("Crossings of orders and modes", columns, tuple(rows))
