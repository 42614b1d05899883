"""The intermediate shaft of an electric axle, thin to thick: noise, life of its bearings, load over the faces.

    python examples/e_axle_shaft.py results

The two-stage reducer of `ev_reducer.py`, its intermediate shaft drawn by sections on a ball and a roller bearing of a
catalogue. A thin shaft bends under both meshes: its gears tilt, its rollers press on their edges, and its modes lie
elsewhere. Noise is the level of the varying bearing forces at the loudest speed of a run-up; K_Hbeta the largest over
the mean line load of each mesh, in statics, with the teeth of the finite elements. All data are chosen here.
"""

from dataclasses import replace
from pathlib import Path

import ev_reducer
import numpy as np
import pandas as pd
import xarray as xr
from command_line import command_line

import exugear
import fem
from exugear import plots
from fem.units import mm, rpm

DIAMETERS, QUICK = (22 * mm, 30 * mm, 40 * mm), (22 * mm, 40 * mm)
SPEED, LOAD = (2000 * rpm, 12000 * rpm), 450.0
ENDS = ev_reducer.BEARINGS
#: Bearings on the intermediate shaft: 6306, which locates it, and the light NU 1006.
CATALOGUE = exugear.RollingBearing.from_catalogue
BALLS = CATALOGUE("deep groove", d=30 * mm, D=72 * mm, B=19 * mm, C=29.6e3, C_0=16e3, damping_time=1e-5)
ROLLERS = CATALOGUE("cylindrical roller", d=30 * mm, D=55 * mm, B=13 * mm, C=17.9e3, C_0=17.3e3, damping_time=1e-5)


def with_shaft(box: exugear.Gearbox, d: float) -> exugear.Gearbox:
    """The reducer with an intermediate shaft of a diameter [m] between its gears and bearings."""
    upper, lower = box.stages
    seats, between = 30 * mm, ENDS[1] - ENDS[0] - 20 * mm
    middle = exugear.Shaft(
        "middle",
        lower.fast.gears | dict(zip(ENDS, (BALLS, ROLLERS), strict=True)),
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


def variants(box: exugear.Gearbox, diameters: tuple[float, ...], duration: float, **contact):
    """Table of noise, life and K_Hbeta over the diameter, the runs, and the loads over the faces by their contact."""
    rows, runs, loads = {}, [], []
    for d in diameters:
        drawn = with_shaft(box, d)
        run = exugear.run_up(exugear.build(drawn), speed=SPEED, load=LOAD, duration=duration, displacement=True)
        life = exugear.bearing_life(run, drawn)["hours"]
        faces = exugear.load_distribution(drawn, LOAD, progress=False, **contact)
        loudest = float(forces(run).idxmax("speed")) / rpm
        balls, rollers = life.values.tolist()
        rows[d / mm] = {"noise [dB]": noise(run), "at [rpm]": loudest, "balls [h]": balls, "rollers [h]": rollers}
        rows[d / mm] |= {f"K_Hbeta {mesh}": float(k) for mesh, k in zip(box.labels, faces["K_H_beta"], strict=True)}
        runs.append(run)
        loads.append(faces)
    return pd.DataFrame(rows).T.rename_axis("d [mm]"), runs, loads


def main(folder: Path, quick: bool = False) -> pd.DataFrame:
    """The table over the diameter of the intermediate shaft."""
    folder.mkdir(parents=True, exist_ok=True)
    box = ev_reducer.gearbox(12 if quick else 24)
    coarse = {"phases": 4, "resolution": fem.Resolution().scaled(0.5)}
    table, runs, loads = variants(box, QUICK, 0.1, **coarse) if quick else variants(box, DIAMETERS, 2.0)
    figure = plots.figure(columns=3)
    figure.set_size_inches(14, 4.2)
    drawing, over_speed, over_face = figure.axes
    plots.plot_gearbox(with_shaft(box, DIAMETERS[0]), drawing)
    for d, run, faces in zip(table.index, runs, loads, strict=True):
        varying, label = forces(run), f"{d:.0f} mm"
        over_speed.plot(varying["speed"] / rpm, varying, label=label)
        first = faces.isel(mesh=0)
        over_face.plot(first["axial_position"] / mm, first["line_load"] / 1e3, label=label)
    over_speed.set(xlabel="speed [rpm]", ylabel="varying bearing forces, rms [N]")
    over_face.set(xlabel="z on the input shaft [mm]", ylabel="line load of the first mesh [N/mm]")
    over_face.legend(title="intermediate shaft", loc="upper center")
    figure.savefig(folder / "e_axle_shaft.png", dpi=100, bbox_inches="tight")
    print(table.to_string(float_format="%.4g"))
    return table


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
