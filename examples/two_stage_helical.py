"""A two-stage helical gearbox on elastic bearings: STE maps of both pairs, forces at the start, a run-up.

    python examples/two_stage_helical.py results

Both gears of the middle shaft have the same hand: one is driven, the other drives, so that their axial forces oppose
each other. Gears, bearings and damping are an example of no particular machine; the maps are coarse: slice mode, half
the elements along every direction.
"""

import argparse
import time
from math import tan
from pathlib import Path

import numpy as np
from matplotlib.image import imsave

import exugear
import fem
from exugear import plots
from fem.elasticity.mesh_density import Density
from fem.units import deg, mm, rpm, um

LOAD, SPEED, DAMPING = 600.0, (300 * rpm, 6000 * rpm), 3000.0
PLAY = 0.05 * mm
#: Shortest part of the run that is shown as one value [s].
WINDOW = 0.01
#: Rotation of the view [rad].
VIEW = [0.4, 0.6, 0.0]
#: Axial places of the bearings of every shaft, and of the gears of the first and second stage
BEARINGS, FIRST, SECOND = (0.0, 150 * mm), 45 * mm, 105 * mm
TORQUES = {"first": (0, 2, 10, 40, 100, 200, 400), "second": (0, 5, 25, 100, 250, 500, 1000)}
COARSE = fem.Slices(Density().scaled(0.5))


def pairs(hand: int = 1) -> dict[str, fem.GearPair]:
    """Both pairs with some backlash; hand +1: equal hands on the middle shaft, -1: opposite ones."""
    first = {"m_n": 2.5 * mm, "b": 30 * mm}
    second = {"m_n": 3.5 * mm, "b": 40 * mm}
    pinion = fem.Gear(z=23, beta=-20 * deg, d_bore=25 * mm, x=0.1, **first)
    wheel = fem.Gear(z=61, beta=20 * deg, d_bore=50 * mm, **first)
    second_pinion = fem.Gear(z=21, beta=hand * 12 * deg, d_bore=35 * mm, x=0.1, **second)
    second_wheel = fem.Gear(z=58, beta=-hand * 12 * deg, d_bore=70 * mm, **second)
    ends = {"first": (pinion, wheel), "second": (second_pinion, second_wheel)}
    return {name: fem.GearPair(*gears, a=fem.GearPair(*gears).a + PLAY) for name, gears in ends.items()}


def ste_maps(phases: int = 24) -> dict:
    """STE over torque and phase of both pairs."""
    return {
        name: fem.static_transmission_error(pair, TORQUES[name], phases, resolution=COARSE)
        for name, pair in pairs().items()
    }


def gearbox(meshes: dict, made: dict[str, fem.GearPair]) -> exugear.Gearbox:
    """Three shafts, each on a locating and a floating bearing."""
    locating = exugear.Bearing(radial=3e8, axial=2e8, damping=2e-5)
    floating = exugear.Bearing(radial=3e8, damping=2e-5)
    held = dict(zip(BEARINGS, (locating, floating), strict=True))
    one, two = made["first"], made["second"]
    fast = exugear.Shaft("input", held | {FIRST: one.pinion})
    middle = exugear.Shaft("middle", held | {FIRST: one.wheel, SECOND: two.pinion})
    slow = exugear.Shaft("output", held | {SECOND: two.wheel})
    first = exugear.Stage(fast, middle, meshes["first"], pair=one)
    return exugear.Gearbox([first, exugear.Stage(middle, slow, meshes["second"], pair=two, angle=60 * deg)])


def laws(maps: dict) -> dict[str, exugear.MeshForce]:
    return {name: exugear.MeshForce.from_ste(ste, damping=DAMPING) for name, ste in maps.items()}


def axial_forces(box: exugear.Gearbox, data) -> dict[str, float]:
    """Of the bearings on every shaft [N]: against the sum of F_bt tan(beta_b) of its gears, at a run's start."""
    found = dict.fromkeys((shaft.name for shaft in box.shafts), 0.0)
    for stage, force in zip(box.stages, starting_forces(box, data), strict=True):
        along = box.turns[stage.fast.name] * force * tan(stage.pair.beta_b)
        found[stage.fast.name] -= along
        found[stage.slow.name] += along
    return found


def starting_forces(box: exugear.Gearbox, data) -> list[float]:
    """Mesh forces [N] by the load, and by the inertia of what a run accelerates from its start on."""
    return box.static_forces(LOAD, float(data["speed"].differentiate("time")[0]))


def axial_reactions(data) -> dict[str, float]:
    """The same, of a run, at its start."""
    axial = data["bearing_force"].sel(direction="z").isel(time=0)
    names = [str(name).split(" at ")[0] for name in data["bearing"].values]
    return {
        name: float(sum(f for f, other in zip(axial.values, names, strict=True) if other == name)) for name in names
    }


def windows(run: exugear.Run) -> int:
    """Number of windows that each hold some mesh cycles, at most 150."""
    return min(150, round(float(run.data["time"][-1]) / WINDOW))


def varying(run: exugear.Run) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Speeds [rad/s], and by bearing the rms of what varies of its radial force [N] in windows of time."""
    data, found = run.data, {}
    for name in data["bearing"].values:
        x, y = (data["bearing_force"].sel(bearing=name, direction=d).values for d in "xy")
        across = [exugear.envelope(data["speed"].values, f, windows(run)) for f in (x, y)]
        found[str(name)] = np.hypot(across[0].rms, across[1].rms)
    return across[0].place, found


def report(model: exugear.Model, opposed: exugear.Gearbox, done: exugear.Run) -> str:
    """Phases, forces at the start, forces in the run-up."""
    box, data = model.gearbox, done.data
    lines = ["phases of the meshes at rest: " + ", ".join(f"{phase:.3f}" for phase in box.phases)]
    lines += ["", "axial force of the bearings [N]  by F_bt tan(beta_b)  in the model  with opposite hands"]
    measured, other = axial_reactions(data), axial_forces(opposed, data)
    for name, force in axial_forces(box, data).items():
        lines.append(f"{name:30s}{force:16.1f}{measured[name]:18.1f}{other[name]:18.1f}")
    _, radial = varying(done)
    lines += ["", "radial force of the bearings [N]  at the start   largest rms of its variation"]
    start = data["bearing_force"].isel(time=0)
    for name, rms in radial.items():
        at_rest = np.hypot(*start.sel(bearing=name).values[:2])
        lines.append(f"{name:30s}{at_rest:16.1f}{rms.max():18.1f}")
    return "\n".join(lines)


def draw(path: Path, done: exugear.Run) -> None:
    """DTE of both stages and bearing forces over the speed."""
    figure = plots.figure(columns=2)
    left, right = figure.axes
    data = done.data
    for stage in data["stage"].values:
        found = exugear.envelope(data["speed"].values, data["dte"].sel(stage=stage).values, windows(done))
        left.plot(found.place / rpm, found.amplitude / um, label=str(stage))
    left.set(ylabel="amplitude of the dynamic transmission error [µm]")
    speed, radial = varying(done)
    for name, rms in radial.items():
        right.plot(speed / rpm, rms, label=name, linewidth=1)
    right.set(ylabel="rms of the varying radial bearing force [N]")
    for ax in figure.axes:
        ax.set_xlabel("speed of the input shaft [rpm]")
        ax.set_ylim(bottom=0)
        ax.grid(alpha=0.3)
        ax.legend(frameon=False)
    figure.savefig(path, dpi=110)


def picture(model: exugear.Model, path: Path) -> None:
    """The gearbox as Exudyn's renderer shows it, here by its raytracer, which needs no screen."""
    exugear.draw(model)
    settings, renderer = model.container.visualizationSettings, model.container.renderer
    settings.view0.window.renderWindowSize = [1200, 800]
    settings.raytracer.imageSizeFactor, settings.raytracer.multiSampling = 1, 4
    settings.loads.show = settings.view0.scene.drawCoordinateSystem = settings.raytracer.advanced.showText = False
    renderer.ZoomAll()
    whole = renderer.GetState()
    renderer.SetModelView(whole["zoom"], VIEW, list(whole["centerPoint"]))
    imsave(path, renderer.RedrawAndGetImage(useRaytracer=True))


def main(arguments: list[str] | None = None) -> tuple[exugear.Model, exugear.Gearbox, exugear.Run]:
    """The model, the same gearbox with opposite hands on the middle shaft, and the run-up."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="for the figure")
    parser.add_argument("--quick", action="store_true", help="fewer phases, a shorter run-up")
    chosen, began = parser.parse_args(arguments), time.perf_counter()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    maps = ste_maps(12 if chosen.quick else 24)
    print(f"maps: {time.perf_counter() - began:.1f} s", flush=True)
    meshes = laws(maps)
    model, opposed = exugear.build(gearbox(meshes, pairs())), gearbox(meshes, pairs(-1))
    print(model.plan, flush=True)
    picture(model, chosen.folder / "two_stage_helical_gears.png")
    done = exugear.run_up(model, speed=SPEED, duration=0.2 if chosen.quick else 4.0, load=LOAD)
    draw(chosen.folder / "two_stage_helical.png", done)
    print("", report(model, opposed, done), f"all: {time.perf_counter() - began:.1f} s", sep="\n\n")
    return model, opposed, done


if __name__ == "__main__":
    main()
