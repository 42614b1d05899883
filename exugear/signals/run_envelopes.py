"""Envelope of the DTE of a run, and the varying forces of its bearings over speed."""

import numpy as np
import scipy
import xarray as xr

from exugear.running.run_data import stage_data
from exugear.signals.envelope import Envelope, envelope
from fem.support.arguments import checked
from fem.support.validation import require


@checked
def dte_envelope(run, stage: int | str = 0, windows: int = 280) -> Envelope:
    """Envelope of the DTE of a stage [m] over its mesh frequency [Hz]; each window holds a whole cycle of every mesh.

    run         an `exugear.Run` or its data
    windows     number of windows of equal length, joined where the gears turn too slowly for a mesh cycle

    Raises ValueError for a stage that the run lacks, and for fewer than one window.
    """
    data = stage_data(run, stage)
    time, frequency = data["time"].values, data["mesh_frequency"].values
    every_mesh = (run if isinstance(run, xr.Dataset) else run.data)["mesh_frequency"]
    cycles = scipy.integrate.cumulative_trapezoid(every_mesh.min("stage").values, time, initial=0)
    return envelope(frequency, data["dte"].values, _at_most(windows, time.size), cycles=cycles)


@checked
def bearing_force_rms(run, windows: int = 150) -> xr.DataArray:
    """Root mean square of the varying part of the radial force of each bearing [N], (bearing, speed [rad/s]).

    run         an `exugear.Run` on bearings, or its data
    windows     of equal length, over which speed and force are averaged

    Raises ValueError for a run without bearings, and for fewer than one window.
    """
    data = stage_data(run)
    bearings = "run must have bearings, whose forces it records; the shafts of this run only spin"
    require("bearing_force" in data, bearings)
    speed, force = data["speed"].values, data["bearing_force"].transpose("bearing", "direction", "time")
    windows = _at_most(windows, speed.size)
    axes = force.sel(direction=["x", "y"]).values
    values = [np.hypot(*(envelope(speed, part, windows).rms for part in radial)) for radial in axes]
    grid = {"bearing": data["bearing"].values, "speed": envelope(speed, speed, windows).place}
    return xr.DataArray(np.array(values), grid, ("bearing", "speed"), attrs={"units": "N"})


def _at_most(windows: int, samples: int) -> int:
    """The number of windows, or as many as hold two of the samples each."""
    require(windows >= 1, f"windows must be at least 1, got {windows}")
    require(samples >= 2, f"run must hold at least 2 samples, got {samples}; let it last longer")
    return min(windows, samples // 2)
