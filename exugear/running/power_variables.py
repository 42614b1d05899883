"""The variables of a run about power: in and out of its ends, losses, and stored energy."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from exugear.multibody.drive_and_load import ShaftTorques
from exugear.multibody.model import Model
from exugear.operation.conditions import Conditions
from exugear.running.losses import bearing_losses, coupling_losses
from exugear.running.recorded_motion import ShaftMotion, motions
from exugear.running.stored_energy import bearing_energy, coupling_energy, kinetic_energy
from fem.units import mm

#: Ends of shafts by name of their torques in the data: the name of their powers, and words for it.
ENDS = {"drive": ("power_in", "into the gearbox by the drive"), "load": ("power_out", "out of the gearbox by the load")}


def power_variables(
    model: Model, conditions: Conditions, torques: ShaftTorques, data: xr.Dataset, lag: float
) -> dict[str, Any]:
    """Powers [W] and energies [J] over time, from the recorded motion and the torques in the data of a run.

    lag   of the velocities of the integrator [s^2]
    """
    moved = motions(model, conditions, torques, data["time"].values, lag)
    return _powers(model, moved, data) | _losses(model, moved) | _energies(model, moved)


def _powers(model: Model, moved: Mapping[str, ShaftMotion], data: xr.Dataset) -> dict[str, Any]:
    """Power of the torque on each end."""
    variables: dict[str, Any] = {}
    for kind, (name, words) in ENDS.items():
        if f"{kind}_torque" in data:
            ends = data[f"{kind}_end"].values.tolist()
            speeds = [_end_speed(model, moved, end) for end in ends]
            about = {"units": "W", "long_name": f"power {words}"}
            variables[name] = (f"{kind}_end", "time"), data[f"{kind}_torque"].values * np.array(speeds), about
    return variables


def _end_speed(model: Model, moved: Mapping[str, ShaftMotion], end: str) -> np.ndarray:
    """(n,) speed [rad/s] in its sense of motion of what a drive or load acts on, by the name of a shaft or rotor."""
    shaft = model.gearbox.ends[end]
    body = shaft.end if end == shaft.name else end
    return moved[body].speed * model.gearbox.directions[shaft.name]


def _losses(model: Model, moved: Mapping[str, ShaftMotion]) -> dict[str, Any]:
    """Power that damping dissipates in meshes, bearings and couplings."""
    meshes = np.array([mesh.recorder.power["dissipation"] for mesh in model.meshes])
    bearings = {
        f"{shaft.name} at {axial / mm:g} mm": loss
        for shaft in model.gearbox.shafts
        for axial, loss in bearing_losses(shaft, moved[shaft.name]).items()
    }
    couplings = coupling_losses(model, moved)
    about = {"units": "W", "long_name": "power that damping dissipates"}
    variables: dict[str, Any] = {"mesh_loss": (("stage", "time"), meshes, about)}
    for kind, losses in {"bearing": bearings, "coupling": couplings}.items():
        if losses:
            variables[f"{kind}_loss"] = (kind, "time"), np.array(list(losses.values())), about
            variables[kind] = kind, list(losses)
    return variables


def _energies(model: Model, moved: Mapping[str, ShaftMotion]) -> dict[str, Any]:
    """Kinetic energy, and strain energy of meshes, bearings and couplings together."""
    meshes = np.sum([mesh.recorder.power["energy"] for mesh in model.meshes], axis=0)
    bearings = np.sum([bearing_energy(shaft, moved[shaft.name]) for shaft in model.gearbox.shafts], axis=0)
    energies = {
        "kinetic_energy": (kinetic_energy(model, moved), "kinetic energy of shafts and rotors"),
        "strain_energy": (meshes + bearings + coupling_energy(model, moved), "energy of meshes, bearings, couplings"),
    }
    return {name: ("time", x, {"units": "J", "long_name": words}) for name, (x, words) in energies.items()}
