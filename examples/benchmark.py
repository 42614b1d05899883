"""Run time against error: STE by several methods, run-ups by step, integrator and reduction, growth with the scene.

    python examples/benchmark.py results            (some 15 minutes on two cores; --quick: a minute)

Every error is against a run that is several times finer, every time stands beside a yardstick's: a compiled loop
without Exudyn, and Exudyn with a spring of its own instead of the mesh.
"""

import argparse
import json
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from pathlib import Path

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from korta_run_up import MAP_PHASES, MAP_TORQUES, gearbox, paper_pair
from matplotlib import rc_context
from numba import njit
from skfem import ElementHex1

import exugear
import fem
from exugear import plots
from exugear.mesh_force.force_kernels import damping, spinning_force
from exugear.plan.integrator import BETA, TRAPEZOIDAL_BETA, Rule
from exugear.post.spectrum import Resonances
from exugear.simulation.solver_settings import settings_for
from fem import nonlinear
from fem.elasticity.mesh_density import Density
from fem.units import mm, rpm

TORQUE, TOP_SPEED, LONG = 150.0, 3500 * rpm, 70.0
#: A whole multiple of all steps, so that all windows hold the same times [s].
SAMPLE = 6e-5
#: Implicit static and explicit dynamic STE, run-up of the paper [s].
PAPER = {"implicit FE": 150 * 60.0, "explicit FE": 3330 * 60.0, "run-up": 36 * 60.0}


@dataclass
class Points:
    """Errors [%], times [s] and what else was seen of some variants of each method."""

    found: dict[str, list[tuple[str, float, float, dict[str, float]]]] = field(default_factory=dict)

    def add(self, method: str, variant: str, error: float, seconds: float, **beside: float) -> None:
        self.found.setdefault(method, []).append((variant, error, seconds, beside))
        more = "".join(f"{value:10.4f} % {name.replace('_', ' ')}" for name, value in beside.items())
        print(f"{method:34s}{variant:>14s}{error:10.4f} %{seconds:10.2f} s{more}", flush=True)

    def draw(self, ax) -> None:
        for (method, rows), marker in zip(self.found.items(), "os^Dvp<>*hX", strict=False):
            ax.plot([row[2] for row in rows], [row[1] for row in rows], marker + "-", ms=5, label=method)
        ax.set(xscale="log", yscale="log")


def timed(call: Callable):
    """What a call returns, and its wall time [s]."""
    start = time.perf_counter()
    result = call()
    return result, time.perf_counter() - start


def cold(call: Callable):
    """The same with an empty cache."""
    before = os.environ.get("EXUGEAR_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["EXUGEAR_CACHE"] = folder
        try:
            return timed(call)
        finally:
            os.environ.pop("EXUGEAR_CACHE")
            os.environ |= {} if before is None else {"EXUGEAR_CACHE": before}


def ste_points(quick: bool) -> Points:
    """STE of the paper's pair over a cycle: error of its rms about the finest curve, time of 30 phases."""
    pair, points, n = paper_pair(), Points(), 10 if quick else 30
    phases, best = np.arange(n) / n, fem.Resolution().scaled(1.5 if quick else 2.0)

    def curve(resolution):
        options = {"resolution": resolution, "progress": False}
        ste, seconds = cold(lambda: fem.static_transmission_error(pair, TORQUE, phases, **options))
        return ste["te"].values.squeeze(), seconds * 30 / n

    finest, seconds = curve(best)
    error = lambda te, at=slice(None): 100 * float(np.sqrt(np.mean((te - finest[at]) ** 2)) / finest.mean())  # noqa: E731
    for mode, default in (("slices", fem.Slices()), ("resolved", fem.Resolution())):
        for scale in (0.5, 0.75, 1.0) if quick else (0.4, 0.6, 0.8, 1.0, 1.3):
            te, seconds = curve(default.scaled(scale))
            points.add(mode, f"mesh x {scale:g}", error(te), seconds)
    every = slice(None, None, 5)
    for density in (Density(flank=16, width=3), Density(flank=30, width=4))[: 1 if quick else 2]:
        solve = lambda d=density: nonlinear.static_transmission_error(  # noqa: E731
            pair, TORQUE, phases[every], density=d, element=ElementHex1(), progress=False
        )
        ste, seconds = timed(solve)
        count = phases[every].size
        te = ste["te"].values.squeeze()
        points.add("nonlinear, 8-node hexahedra", f"flank {density.flank}", error(te, every), seconds * 30 / count)
    return points


def outline(run: exugear.Run) -> tuple[np.ndarray, Resonances]:
    """rms of the DTE about its mean in windows of time; resonances of its envelope over the mesh frequency."""
    time, dte = run.data["time"].values, run.data["dte"].values[-1]
    wide, narrow = (np.split(dte, np.searchsorted(time, np.linspace(0, time[-1], n + 1)[1:-1])) for n in (56, 281))
    frequency = np.interp((np.arange(281) + 0.5) / 281 * time[-1], time, run.data["mesh_frequency"].values[-1])
    return np.array([x.std() for x in wide]), exugear.resonances(frequency, [np.ptp(x) / 2 for x in narrow])


def errors(run: exugear.Run, finest: tuple[np.ndarray, Resonances]) -> dict[str, float]:
    """Median of the windows, 95th percentile, largest of the resonances' frequencies and heights [%]."""
    (rms, found), (true_rms, true) = outline(run), finest
    off = np.abs(rms / true_rms - 1)
    nearest = np.abs(found.place[:, None] - true.place).argmin(axis=0)
    places, heights = (np.abs(a[nearest] / b - 1).max() for a, b in zip(found, true, strict=True))
    named = {"at_95": np.percentile(off, 95), "of_resonances": places, "of_peaks": heights}
    return {"error": 100 * float(np.median(off))} | {name: 100 * float(value) for name, value in named.items()}


def bearings() -> dict:
    """Two bearings beside a gear."""
    return {-30 * mm: exugear.Bearing(5e8, 1e8, damping=2e-6), 30 * mm: exugear.Bearing(5e8, damping=2e-6)}


def on_bearings(box: exugear.Gearbox) -> exugear.Gearbox:
    """The same pair on two bearings each."""
    stage = box.stages[0]
    shafts = [exugear.Shaft(s.name, {0.0: stage.pair.pinion} | bearings()) for s in (stage.fast, stage.slow)]
    return exugear.Gearbox([exugear.Stage(*shafts, stage.force, pair=stage.pair)])


def run_up_points(box: exugear.Gearbox, quick: bool) -> Points:
    """Run-ups through all resonances: median error of windows, time of 70 s."""
    duration, points = (2.0 if quick else 14.0), Points()
    elastic = on_bearings(box)
    scenes = {
        "spinning": (box, exugear.plan(box)),
        "planar on bearings": (elastic, exugear.plan(elastic)),
        "in space on bearings": (elastic, exugear.plan(elastic).with_bodies()),
        "in space on joints": (box, exugear.plan(box).with_joints()),
    }

    def ran(scene, step, **options):
        model = exugear.build(scene[0], plan=scene[1])
        conditions = {
            "speed": (0, TOP_SPEED),
            "duration": duration,
            "load": TORQUE,
            "sample": SAMPLE,
            "progress": False,
        }
        return exugear.run_up(model, **(conditions | {"step": step} | options))

    def add(label, variant, name, step, **options):
        run = ran(scenes[name], step, **options)
        points.add(label, variant, seconds=run.wall_time * LONG / duration, **errors(run, finest[name]))

    finest = {name: outline(ran(scene, 5e-6, tolerance=1e-5)) for name, scene in scenes.items() if "joints" not in name}
    finest["in space on joints"] = finest["spinning"]
    steps = (2e-5,) if quick else (6e-5, 3e-5, 2e-5, 1.5e-5, 1e-5)
    cases = [(name, name, lambda h: h) for name in scenes]
    cases += [
        ("spinning", "trapezoidal rule", lambda h: Rule(TRAPEZOIDAL_BETA, h)),
        ("spinning", "generalized-alpha 0.9", lambda h: Rule(BETA, h, 0.9)),
    ]
    for name, label, rule in cases:
        for h in steps if quick or label == "spinning" else steps[1:4]:
            add(label, f"{h / 1e-6:g} us", name, rule(h))
    for tolerance in (1e-2, 1e-3) if quick else (1e-2, 1e-3, 1e-4):
        add("spinning, tolerance chosen", f"{tolerance:g}", "spinning", None, tolerance=tolerance)
    for tolerance in () if quick else (1e-2, 1e-3, 1e-5):
        add("20 us, Newton's tolerance", f"{tolerance:g}", "spinning", 2e-5, tolerance=tolerance)
    return points


@njit
def compiled_loop(law, mobility, load, steps, h, turns):
    """Deflection of one rotational pair after a run-up, by velocity Verlet: the floor without a multibody code."""
    y, v, a = 1e-5, 0.0, 0.0
    for i in range(steps):
        t = i * h
        y += h * v + 0.5 * h * h * a
        penetration, force, _ = spinning_force(law, turns * t * t, y)
        b = mobility * (load - force - damping(law, penetration) * (v + 0.5 * h * a))
        v, a = v + 0.5 * h * (a + b), b
    return y


def own_spring(inertia: float):
    """Two spinning masses on a spring that is built into Exudyn, one of them held like a drive."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0.0])) for _ in range(2)]
    for node in nodes:
        mbs.AddObject(eii.ObjectRotationalMass1D(inertia=inertia, nodeNumber=node))
    ends = [mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0)) for node in nodes]
    fixed = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
    mbs.AddObject(eii.CoordinateConstraint(markerNumbers=[fixed, ends[0]]))
    mbs.AddObject(eii.CoordinateSpringDamper(markerNumbers=ends, stiffness=2e6, damping=10.0))
    mbs.AddLoad(eii.LoadCoordinate(markerNumber=ends[1], load=1.0))
    mbs.Assemble()
    return container, mbs


def yardsticks(box: exugear.Gearbox, step: float) -> dict[str, float]:
    """Times of 70 s [s] in equal steps: the compiled loop, Exudyn with a spring of its own, and with the mesh."""
    stage, steps = box.stages[0], round(LONG / step / 10)
    mobility = stage.pair.wheel.r_b**2 / box.driven.inertia
    turns = stage.pair.pinion.z * TOP_SPEED / (4 * np.pi * LONG)
    arguments = stage.force.law, mobility, TORQUE / stage.pair.wheel.r_b, steps, step, turns
    compiled_loop(*arguments[:3], 10, *arguments[4:])
    _, loop = timed(lambda: compiled_loop(*arguments))
    _container, spring = own_spring(box.driven.inertia)
    _, bare = timed(lambda: spring.SolveDynamic(settings_for(Rule(BETA, step), steps * step, 1e-3)))
    run = exugear.run_up(
        exugear.build(box), speed=(0, TOP_SPEED), duration=LONG / 10, load=TORQUE, step=step, progress=False
    )
    return {"compiled loop": 10 * loop, "Exudyn's own spring": 10 * bare, "exugear": 10 * run.wall_time}


def chain(box: exugear.Gearbox, stages: int) -> exugear.Gearbox:
    """So many equal stages one after the other, each in a plane of its own."""
    pair, law = box.stages[0].pair, box.stages[0].force
    planes = [i * 80 * mm for i in range(stages)]
    parts = [dict.fromkeys((planes[max(i - 1, 0)], planes[min(i, stages - 1)]), pair.pinion) for i in range(stages + 1)]
    shafts = [exugear.Shaft(f"shaft {i}", gears) for i, gears in enumerate(parts)]
    return exugear.Gearbox([exugear.Stage(a, b, law, pair=pair) for a, b in pairwise(shafts)])


def growth(box: exugear.Gearbox, runs: Points, quick: bool) -> dict[str, tuple[list[float], list[float]]]:
    """Times over what grows: stages of a scene (per step), a map's states, phases and torques (slice mode)."""
    stages = (1, 2) if quick else (1, 2, 3, 4, 6, 8)
    seconds = []
    for n in stages:
        model = exugear.build(chain(box, n))
        run = exugear.run_up(model, speed=60.0, duration=0.5, load=TORQUE, step=1e-5, progress=False)
        seconds.append(run.wall_time / 5e4)
    counts = (3, 9) if quick else (3, 9, 33, 129)
    tilts = [cold(partial(slices, misalignments=n))[1] for n in counts]
    phases, torques = (15, 30, 60, 120), (4, 8, 16, 32)
    slices()  # from here on its finite elements are cached
    rows = runs.found["spinning, tolerance chosen"]
    return {
        "run-up over 1/tolerance": ([1 / float(row[0]) for row in rows], [row[2] for row in rows]),
        "step over stages": (list(stages), seconds),
        "map over states": ([60 * n for n in counts], tilts),
        "curve over phases": (phases, [timed(partial(slices, phases=n))[1] for n in phases]),
        "map over torques": (torques, [timed(partial(slices, torques=n))[1] for n in torques]),
    }


def slices(misalignments: int = 1, phases: int = 15, torques: int = 4):
    """A map of the paper's pair in slice mode."""
    offsets = fem.Offsets(misalignment=np.linspace(-1, 1, misalignments) * 1e-4 if misalignments > 1 else 1e-4)
    options = {"offsets": offsets, "resolution": fem.Slices(), "progress": False}
    return fem.static_transmission_error(paper_pair(), np.linspace(50, 400, torques), phases, **options)


def exponent(sizes, times) -> float:
    """Of a power law through times over sizes."""
    return float(np.polyfit(np.log(sizes), np.log(times), 1)[0])


def mark_times(ax, seconds: dict[str, float]) -> None:
    """Dotted lines at the times of others."""
    frame = ax.get_xaxis_transform()
    for name, at in seconds.items():
        ax.axvline(at, color="0.6", ls=":")
        ax.text(at, 0.02, name, rotation=90, fontsize=8, ha="right", transform=frame)


def draw_growth(ax, grown: dict) -> None:
    """Time over size, both over the smallest."""
    for name, (sizes, times) in grown.items():
        label = f"{name}: {exponent(sizes, times):.2f}"
        ax.loglog(np.array(sizes) / sizes[0], np.array(times) / times[0], "o-", ms=5, label=label)
    ax.set(xlabel="size over the smallest", ylabel="time over the smallest")
    ax.set_yticks([1, 2, 4, 8], ["1", "2", "4", "8"])
    ax.minorticks_off()


def draw_legends(ax, panels: dict) -> None:
    """Those of all panels below one another, instead of a panel."""
    ax.axis("off")
    top = 1.0
    for title, panel in panels.items():
        handles, labels = panel.get_legend_handles_labels()
        options = {"loc": "upper left", "labelspacing": 0.15, "borderpad": 0, "alignment": "left", "frameon": False}
        ax.add_artist(ax.legend(handles, labels, title=title, bbox_to_anchor=(0, top), **options))
        top -= (len(labels) + 1.3) / 19.5


def draw(path: Path, ste: Points, runs: Points, floor: dict[str, float], grown: dict) -> None:
    """Error over time of STE and run-up, and the growth; 9 pt where it is printed 18 cm wide."""
    with rc_context({"font.size": 9}):
        figure = plots.figure(rows=2, columns=2)
        figure.set_size_inches(7.1, 6.6)
        upper, beside, lower, legends = figure.axes
        ste.draw(upper)
        mark_times(upper, {f"paper, {name}": PAPER[name] for name in ("implicit FE", "explicit FE")})
        upper.set(xlabel="time of 30 phases, cold [s]", ylabel="error of the STE [% of its mean]")
        runs.draw(beside)
        mark_times(beside, {name: x for name, x in (floor | {"paper": PAPER["run-up"]}).items() if name != "exugear"})
        beside.set(xlabel="time of a 70 s run-up [s]", ylabel="error of the rms of the DTE [%], median")
        draw_growth(lower, grown)
        draw_legends(legends, {"STE": upper, "run-up": beside, "growth, exponent": lower})
        figure.savefig(path, dpi=200)


def main() -> None:
    exu.config.printToConsole = False
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="for the figure (PNG) and the numbers (JSON)")
    parser.add_argument("--quick", action="store_true", help="fewer points, for a look")
    chosen = parser.parse_args()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    ste_map = fem.static_transmission_error(paper_pair(), MAP_TORQUES, MAP_PHASES, progress=False)
    box = gearbox(ste_map, damping_ratio=0.08)
    ste, runs = ste_points(chosen.quick), run_up_points(box, chosen.quick)
    floor, grown = yardsticks(box, 2.4e-5), growth(box, runs, chosen.quick)
    print({name: round(seconds, 2) for name, seconds in floor.items()})
    print({name: round(exponent(*rows), 2) for name, rows in grown.items()})
    numbers = {"STE": ste.found, "run-up": runs.found, "70 s in equal steps": floor, "growth": grown}
    (chosen.folder / "benchmark.json").write_text(json.dumps(numbers, indent=1), encoding="utf-8")
    draw(chosen.folder / "benchmark.png", ste, runs, floor, grown)


if __name__ == "__main__":
    main()
