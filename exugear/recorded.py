"""What a run recorded: read from a file, of one stage, the envelope of its transmission error."""

import scipy
import xarray as xr

from exugear.spectrum import Envelope, envelope
from fem.arguments import checked
from fem.gear import require
from fem.ste import read

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


@checked
def dte_envelope(run, stage: int = 0, windows: int = 280) -> Envelope:
    """Envelope of the DTE of a stage [m] over its mesh frequency [Hz]; every window holds a whole mesh cycle.

    run         an `exugear.Run` or its data
    windows     equally long ones, joined where the gears turn too slowly
    """
    data = stage_data(run, stage)
    time, frequency = data["time"].values, data["mesh_frequency"].values
    cycles = scipy.integrate.cumulative_trapezoid(frequency, time, initial=0)
    return envelope(frequency, data["dte"].values, min(windows, time.size // 2), cycles=cycles)


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
