"""The intermediate shaft of an electric axle, thin to thick: noise, and life of its bearings.

    python examples/e_axle_shaft.py results

The two-stage reducer of `ev_reducer.py`, its intermediate shaft drawn by sections on deep groove bearings of a
catalogue. A thin shaft bends under both meshes: its gears tilt, its balls carry unevenly, and its modes lie lower.
Noise is the level of the varying bearing forces at the loudest speed of a run-up. All data are chosen here.
"""

from dataclasses import replace
from pathlib import Path

import ev_reducer
import numpy as np
import pandas as pd
import xarray as xr
from command_line import command_line

import exugear
from exugear import plots
from fem.units import mm, rpm

DIAMETERS, QUICK = (22 * mm, 30 * mm, 40 * mm), (22 * mm, 40 * mm)
SPEED, LOAD = (2000 * rpm, 12000 * rpm), 450.0
ENDS = ev_reducer.BEARINGS
#: Sizes of the bearings on the intermediate shaft: 6306.
BEARING = {"d": 30 * mm, "D": 72 * mm, "B": 19 * mm, "C": 29.6e3, "C_0": 16e3}


def with_shaft(box: exugear.Gearbox, d: float) -> exugear.Gearbox:
    """The reducer with an intermediate shaft of a diameter [m] between its gears and bearings."""
    upper, lower = box.stages
    rolling = exugear.RollingBearing.from_catalogue("deep groove", **BEARING, damping_time=1e-5)
    seats, between = 30 * mm, ENDS[1] - ENDS[0] - 20 * mm
    middle = exugear.Shaft(
        "middle",
        lower.fast.gears | dict.fromkeys(ENDS, rolling),
        start=ENDS[0] - 10 * mm,
        sections=[(seats, 20 * mm), (d, between), (seats, 20 * mm)],
    )
    return exugear.Gearbox([replace(upper, slow=middle), replace(lower, fast=middle)])


def forces(run: exugear.Run) -> xr.DataArray:
    """Sum of the varying bearing forces, rms over the speed [N]."""
    return exugear.spectrum.bearing_force_rms(run, windows=40).sum("bearing")


def noise(run: exugear.Run) -> float:
    """Level of the varying bearing forces at the loudest speed of the run-up [dB re 1 N]."""
    return float(20 * np.log10(forces(run).max()))


def variants(box: exugear.Gearbox, diameters: tuple[float, ...], duration: float) -> tuple[pd.DataFrame, list]:
    """Table of noise and life over the diameter, and the runs."""
    rows, runs = {}, []
    for d in diameters:
        drawn = with_shaft(box, d)
        run = exugear.run_up(exugear.build(drawn), speed=SPEED, load=LOAD, duration=duration, displacement=True)
        life = exugear.bearing_life(run, drawn)["hours"]
        loudest = float(forces(run).idxmax("speed")) / rpm
        rows[d / mm] = {"noise [dB]": noise(run), "at [rpm]": loudest, "life [h]": float(life.min())}
        runs.append(run)
    return pd.DataFrame(rows).T.rename_axis("d [mm]"), runs


def main(folder: Path, quick: bool = False) -> pd.DataFrame:
    """The table over the diameter of the intermediate shaft."""
    folder.mkdir(parents=True, exist_ok=True)
    box = ev_reducer.gearbox(12 if quick else 24)
    table, runs = variants(box, QUICK if quick else DIAMETERS, 0.1 if quick else 2.0)
    figure = plots.figure(columns=2)
    figure.set_size_inches(10, 4.2)
    plots.plot_gearbox(with_shaft(box, DIAMETERS[0]), figure.axes[0])
    for d, run in zip(table.index, runs, strict=True):
        varying = forces(run)
        figure.axes[1].plot(varying["speed"] / rpm, varying, label=f"{d:.0f} mm")
    figure.axes[1].set(xlabel="speed [rpm]", ylabel="varying bearing forces, rms [N]")
    figure.axes[1].legend(title="intermediate shaft")
    figure.savefig(folder / "e_axle_shaft.png", dpi=100, bbox_inches="tight")
    print(table.to_string(float_format="%.4g"))
    return table


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
