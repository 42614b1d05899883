"""Section of a report on the vibration modes of the loaded gearbox."""

from typing import Any

import numpy as np
import xarray as xr

from exugear.modal.campbell import campbell
from exugear.modal.modes import modes
from exugear.multibody.model import Model
from exugear.reporting.figures import campbell_figure
from exugear.reporting.sections import Section, Table
from fem.support.validation import require
from fem.units import rpm

#: Least amplification for a crossing to be listed, and the largest number of rows.
LEAST_AMPLIFICATION, MOST_ROWS = 0.2, 24


def vibration(model: Model, data: xr.Dataset) -> Section:
    """Modes of the gearbox at the load of a run, and the speeds at which orders excite them."""
    loads, stages = _loads(model, data), data["stage"].values.tolist()
    labels = list(model.gearbox.labels)
    require(labels == stages, f"model has the stages {labels}, the run {stages}; pass the model of the run")
    at_rest = modes(model, **loads)
    state = "Meshes have their mean tangent stiffness at the load, bearings theirs; the driving shaft is held."
    if at_rest.attrs["idle_stages"]:
        state += f" Stages {', '.join(at_rest.attrs['idle_stages'])} carry no load: their teeth are open."
    top = float(np.abs(data["speed"]).max())
    if top == 0:
        return Section("Vibration modes", (state,), (_modes(at_rest),))
    diagram = campbell(model, speed=(0.0, top), **loads)
    text = (
        state,
        "Amplification is the DTE of a stage in the mode over its STE of the order: share of the strain energy in the "
        f"mesh over twice the damping ratio. Crossings from {LEAST_AMPLIFICATION:g} on are listed.",
    )
    tables = [table for table in (_modes(at_rest), _crossings(diagram)) if table.rows]
    return Section("Vibration modes", text, tuple(tables), (campbell_figure(diagram),))


def _loads(model: Model, data: xr.Dataset) -> dict[str, Any]:
    """Constant load on the driven shaft, or loads of several shafts [N m], as arguments; ValueError without them."""
    given = data.attrs.get("load", "no load on the driven shaft alone")
    if not isinstance(given, str) and np.size(given) == 1:
        return {"load": float(given)}
    driven_alone = "drive_end" in data.dims and data["drive_end"].values.tolist() == [model.gearbox.driving.name]
    if driven_alone and "load_end" in data.dims:
        torque = data["load_torque"].transpose("load_end", "time").values
        if bool((np.ptp(torque, axis=1) == 0).all()) and torque.any():
            return {"loads": dict(zip(data["load_end"].values.tolist(), torque[:, 0].tolist(), strict=True))}
    remedy = "leave out model, and use exugear.modes at loads of your choice"
    raise ValueError(f"run must have a constant load for its vibration modes, got {given}; {remedy}")


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
    """Crossings of mesh orders with the largest amplifications, by rising speed."""
    gain = _amplifications(diagram)
    listed = np.sort(np.argsort(-gain, kind="stable")[:MOST_ROWS])
    rows = []
    for number in listed[gain[listed] >= LEAST_AMPLIFICATION]:
        crossing = diagram.isel(crossing=int(number))
        numbers = f"{float(crossing['crossing_speed']) / rpm:.0f}", f"{float(crossing['crossing_frequency']):.1f}"
        order, mode = str(crossing["crossing_order"].item()), str(crossing["crossing_mode"].item())
        share = f"{float(crossing['crossing_energy_share']):.0%}"
        rows.append((*numbers, order, mode, share, f"{gain[number]:.2f}" if np.isfinite(gain[number]) else "undamped"))
    places = "driving shaft [rpm]", "frequency [Hz]", "order", "mode"
    columns = (*places, "strain energy in the mesh", "amplification")
    return Table("Crossings of mesh orders and modes", columns, tuple(rows))


def _amplifications(diagram: xr.Dataset) -> np.ndarray:
    """(n_crossing,) amplification at every crossing, 0 of shaft orders."""
    modes_met = xr.DataArray(diagram["crossing_mode"].values, dims="crossing")
    speeds_met = xr.DataArray(diagram["crossing_speed"].values, dims="crossing")
    damping = diagram["damping_ratio"].sel(mode=modes_met).sel(speed=speeds_met, method="nearest")
    of_mesh = diagram["order_stage"].sel(order=diagram["crossing_order"]).values != ""
    share = np.where(of_mesh, np.maximum(diagram["crossing_energy_share"].values, 0.0), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(share / (2 * damping.values), posinf=np.inf)
