"""What a run recorded: read from a file, of one stage, the envelope of its transmission error."""

from bisect import bisect_left
from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr

from exugear.plan.time_steps import Steps
from exugear.simulation.equilibrium import UNIT
from exugear.simulation.model import Model, on_bearings
from fem.ste.ste_map import read
from fem.support.validation import require
from fem.units import mm

#: What every run holds.
VARIABLES = ("time", "stage", "speed", "mesh_frequency", "dte", "mesh_force")


def stage_data(run, stage: int = 0) -> xr.Dataset:
    """The data of a stage, by its number; run: an `exugear.Run` or its data.

    Raises ValueError for what is neither, and for stages that the run does not have.
    """
    data = run if isinstance(run, xr.Dataset) else getattr(run, "data", xr.Dataset())
    is_run = isinstance(data, xr.Dataset) and set(VARIABLES) <= set(data.variables)
    kind = f"run must be an exugear.Run or its data, got {type(run).__name__}"
    require(is_run, f"{kind}; pass what exugear.run_up returns")
    names = data["stage"].values.tolist()
    remedy = f"the stages are {names}"
    require(stage in range(-len(names), len(names)), f"stage must be 0 to {len(names) - 1}, got {stage}; {remedy}")
    return data.isel(stage=stage)


def stored(path) -> xr.Dataset:
    """The data of a run that `exugear.Run.save` wrote; ValueError for a file of none."""
    data = read(path, "run it again")
    missing = [name for name in VARIABLES if name not in data.variables] + ["step"] * ("step" not in data.attrs)
    require(not missing, f"{path} holds no run, it lacks {missing}; pass what exugear.Run.save wrote")
    if "stage" not in data["mesh_frequency"].dims:
        several = f"{path} is of an older version, with the mesh frequency of the first stage alone; run it again"
        require(data["stage"].size == 1, several)
        data["mesh_frequency"] = data["mesh_frequency"].expand_dims(stage=data["stage"])
    names = {name: at.astype(str) for name, at in data.coords.items() if at.dtype == object}
    return data.assign_coords(names)


def keep_valid(model: Model, steps: Steps, stop: BaseException | None) -> BaseException | None:
    """Cut the samples from what stopped the run on, which may be that bearings yielded."""
    blocks = [mesh.recorder.samples for mesh in model.meshes]
    lost = np.isnan([samples[0]["deflection"] for samples in blocks]).any(axis=0)
    if stop:
        lost |= steps.time >= model.mbs.systemData.GetTime()
    number = int(lost.argmax()) if lost.any() else lost.size
    apart, words = _out_of_mesh(model, number)
    number, stop = (apart, RuntimeError(f"at t = {steps.time[apart]:.6g} s: {words}")) if words else (number, stop)
    for samples in blocks:
        samples[:] = [block[:number] for block in samples]
    return stop


def _out_of_mesh(model: Model, number: int) -> tuple[int, str]:
    """The first of so many samples whose bearings yielded until the teeth no longer hand over, and words; or none."""
    for mesh in model.meshes:
        if on_bearings(model, mesh):
            pair, peaks = mesh.stage.pair, np.maximum.accumulate(mesh.recorder.a[:number])
            apart = bisect_left(peaks, True, key=partial(_is_apart, pair))
            if apart < number:
                far = f"bearings of {mesh.stage.name} yield to a centre distance of {peaks[apart] / mm:.6g} mm"
                return apart, f"{far}, where the pair cannot run; try less load or stiffer bearings {UNIT}"
    return number, ""


def _is_apart(pair, a: float) -> bool:
    """Whether a pair cannot be mounted at a centre distance [m] that is no smaller than its own."""
    try:
        replace(pair, a=max(float(a), pair.a))
    except ValueError:
        return True
    return False
