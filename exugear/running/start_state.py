"""State from which a run starts: static equilibrium, or the end of another run."""

from dataclasses import replace

import numpy as np
import xarray as xr

from exugear.multibody.equilibrium import solve_initial_equilibrium
from exugear.multibody.exudyn_objects import INITIAL
from exugear.multibody.model import Model, end_coordinate
from exugear.operation.conditions import Conditions
from exugear.planning.integrator_and_step import Rule
from fem.support.validation import require

#: Difference of an imposed speed from that at the end of the other run over the speed that counts as vibration.
LARGEST_JUMP = 0.01


def end_state_of(model: Model, conditions: Conditions, data: xr.Dataset) -> np.ndarray:
    """(3, n_coordinates) end state of another run; ValueError unless this model can go on from there."""
    ended = "initial must be a run that came to its end, this one was stopped by an error"
    require("end_state" in data, f"{ended}, or saved by an older version; run it again")
    state, number = data["end_state"].values, model.bare_mbs.systemData.ODE2Size()
    stages, labels = data["stage"].values.tolist(), list(model.gearbox.labels)
    same = state.shape[1] == number and stages == labels
    unlike = f"initial is a run of {stages} with {state.shape[1]} coordinates, the model has {labels}, {number}"
    require(same, f"{unlike}; pass a run of the same gearbox and plan")
    for label, stage in zip(labels, model.gearbox.stages, strict=True):
        gears = {"a": stage.pair.a, "pinion_z": stage.pair.pinion.z, "wheel_z": stage.pair.wheel.z}
        of_run, of_model = [data.attrs.get(f"{label}_{name}", x) for name, x in gears.items()], [*gears.values()]
        unlike = f"initial is a run with a, z = {of_run} in {label!r}, the model has {of_model}"
        require(of_run == of_model, f"{unlike}; continue with the same gears")
    for imposed, speed_of in zip(conditions.imposed, conditions.speeds_of, strict=True):
        shaft, direction = imposed.shaft, model.gearbox.directions[imposed.shaft]
        ended_at, starts_at = direction * float(state[1, end_coordinate(model, shaft)]), float(speed_of(0.0))
        jump = f"initial ends with shaft {shaft!r} at {ended_at:.6g} rad/s, the imposed speed starts at"
        near = abs(starts_at - ended_at) <= LARGEST_JUMP * max(abs(starts_at), abs(ended_at))
        require(near, f"{jump} {starts_at:.6g}; let it start there")
    return state


def continued(model: Model, conditions: Conditions, state: np.ndarray) -> Conditions:
    """The conditions of a run that goes on from a state (3, n_coordinates): its shafts keep their angles."""
    directions = model.gearbox.directions
    angles = [directions[name] * float(state[0, end_coordinate(model, name)]) for name in conditions.held]
    imposed = [replace(x, start_angle=angle) for x, angle in zip(conditions.imposed, angles, strict=True)]
    return replace(conditions, imposed=tuple(imposed))


def set_start_state(model: Model, conditions: Conditions, state: np.ndarray | None, rule: Rule) -> None:
    """Put the system into a state (3, n_coordinates), or without it into static equilibrium; rule: of the run."""
    if state is None:
        solve_initial_equilibrium(model, conditions, rule)
        return
    system = model.bare_mbs.systemData
    system.SetODE2Coordinates(state[0], INITIAL)
    system.SetODE2Coordinates_t(state[1], INITIAL)
    system.SetODE2Coordinates_tt(state[2], INITIAL)
