"""A two-stage helical gearbox on elastic bearings: STE maps of both pairs, forces at the start, a run-up.

    python examples/two_stage_helical.py results

Both gears of the middle shaft have the same hand: the first is driven, the second drives, and their axial forces
F_bt tan(beta_b) oppose each other. The maps are coarse: slice mode, half the elements along every direction.
"""

from dataclasses import replace
from math import tan
from pathlib import Path

import numpy as np
import pandas as pd
from command_line import command_line
from matplotlib.image import imsave

import exugear
import fem
from exugear import plots
from fem.units import deg, mm, rpm

LOAD, SPEED, DAMPING, PLAY = 600.0, (300 * rpm, 6000 * rpm), 3000.0, 0.05 * mm
#: Axial positions of bearings and gears.
BEARINGS, FIRST, SECOND = (0.0, 150 * mm), 45 * mm, 105 * mm
TORQUES = {"first": (0, 2, 10, 40, 100, 200, 400), "second": (0, 5, 25, 100, 250, 500, 1000)}
COARSE = fem.Slices(fem.Density().scaled(0.5))


def pairs(hand: int = 1) -> dict[str, fem.GearPair]:
    """Both pairs with backlash; hand +1: equal hands on the middle shaft, -1: opposite hands."""
    first, second = {"m_n": 2.5 * mm, "b": 30 * mm}, {"m_n": 3.5 * mm, "b": 40 * mm}
    pinion = fem.Gear(z=23, beta=-20 * deg, d_bore=25 * mm, x=0.1, **first)
    wheel = fem.Gear(z=61, beta=20 * deg, d_bore=50 * mm, **first)
    second_pinion = fem.Gear(z=21, beta=hand * 12 * deg, d_bore=35 * mm, x=0.1, **second)
    second_wheel = fem.Gear(z=58, beta=-hand * 12 * deg, d_bore=70 * mm, **second)
    tight = fem.GearPair(pinion, wheel), fem.GearPair(second_pinion, second_wheel)
    return {name: replace(pair, a=pair.a + PLAY) for name, pair in zip(TORQUES, tight, strict=True)}


def laws(phases: int = 24) -> dict[str, exugear.MeshForce]:
    """Force laws of both pairs by their STE maps."""
    maps = {
        name: fem.static_transmission_error(pair, TORQUES[name], phases, resolution=COARSE)
        for name, pair in pairs().items()
    }
    return {name: exugear.MeshForce.from_ste(ste, damping=DAMPING) for name, ste in maps.items()}


def gearbox(meshes: dict[str, exugear.MeshForce], geared: dict[str, fem.GearPair]) -> exugear.Gearbox:
    """Three shafts, each on a locating and a floating bearing."""
    locating = exugear.Bearing(radial=3e8, axial=2e8, damping_time=2e-5)
    floating = exugear.Bearing(radial=3e8, damping_time=2e-5)
    bearings = dict(zip(BEARINGS, (locating, floating), strict=True))
    first, second = geared["first"], geared["second"]
    fast = exugear.Shaft("input", bearings | {FIRST: first.pinion})
    middle = exugear.Shaft("middle", bearings | {FIRST: first.wheel, SECOND: second.pinion})
    slow = exugear.Shaft("output", bearings | {SECOND: second.wheel})
    upper = exugear.Stage(middle, slow, meshes["second"], pair=second, angle=60 * deg)
    return exugear.Gearbox([exugear.Stage(fast, middle, meshes["first"], pair=first), upper])


def starting_forces(box: exugear.Gearbox, data) -> list[float]:
    """Mesh forces [N] by the load, and by the inertia of what a run accelerates from its start on."""
    return box.static_forces(LOAD, float(data["speed"].differentiate("time")[0]))


def axial_forces(box: exugear.Gearbox, data) -> dict[str, float]:
    """Axial forces of the bearings on every shaft [N] against F_bt tan(beta_b) of its gears, at a run's start."""
    total = dict.fromkeys((shaft.name for shaft in box.shafts), 0.0)
    for stage, force in zip(box.stages, starting_forces(box, data), strict=True):
        along = box.directions[stage.fast.name] * force * tan(stage.pair.beta_b)
        total[stage.fast.name] -= along
        total[stage.slow.name] += along
    return total


def axial_reactions(data) -> dict[str, float]:
    """The same by the bearings of the model, at a run's start."""
    axial = data["bearing_force"].sel(direction="z").isel(time=0)
    shafts = [str(name).split(" at ")[0] for name in data["bearing"].values]
    return axial.groupby(axial["bearing"].copy(data=shafts)).sum().to_series().to_dict()


def report(model: exugear.Model, opposed: exugear.Gearbox, run: exugear.Run) -> str:
    """Phases of the meshes, axial forces at the start, radial forces at the start and in the run-up."""
    box, data = model.gearbox, run.data
    kinds = axial_forces(box, data), axial_reactions(data), axial_forces(opposed, data)
    axial = dict(zip(("by F_bt tan(beta_b)", "in the model", "with opposite hands"), kinds, strict=True))
    start = np.hypot(*data["bearing_force"].isel(time=0).sel(direction=["x", "y"]).values.T)
    varying = exugear.spectrum.bearing_force_rms(run).max("speed").to_series()
    radial = {"at the start": start, "largest rms of its variation": varying}
    tables = {"axial forces of the bearings [N]": axial, "radial forces of the bearings [N]": radial}
    text = [f"{name}\n{pd.DataFrame(table).to_string(float_format='%.1f')}" for name, table in tables.items()]
    return "\n\n".join(["phases of the meshes at rest: " + ", ".join(f"{phase:.3f}" for phase in box.phases), *text])


def draw(path: Path, run: exugear.Run) -> None:
    """DTE of both stages over their mesh frequencies, and bearing forces over the speed."""
    figure = plots.figure(columns=2)
    for i, stage in enumerate(run.data["stage"].values):
        plots.plot_envelopes({str(stage): run}, figure.axes[0], stage=i, color=plots.DISTINCT[i])
    plots.plot_bearing_forces(run, figure.axes[1])
    figure.savefig(path, dpi=100)


def main(folder: Path, quick: bool = False) -> tuple[exugear.Model, exugear.Gearbox, exugear.Run]:
    folder.mkdir(parents=True, exist_ok=True)
    meshes = laws(12 if quick else 24)
    model, opposed = exugear.build(gearbox(meshes, pairs())), gearbox(meshes, pairs(-1))
    exugear.draw(model)
    imsave(folder / "two_stage_helical_gears.png", exugear.picture(model))
    run = exugear.run_up(model, speed=SPEED, duration=0.2 if quick else 4.0, load=LOAD)
    draw(folder / "two_stage_helical.png", run)
    print(model.plan, report(model, opposed, run), sep="\n\n")
    return model, opposed, run


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
