"""What a mesh of a planetary set costs in a run, beside the mesh of a single pair.

    PYTHONPATH=. python tests/benchmarks/benchmark_planetary.py

Processor time of the integration over the number of meshes, in the same steps, on maps of the same finite elements: of
a set with three planets, and of a pair under the same kind of plan. The time of a short run, which is as long to set
up, is subtracted. Each ratio is the median of alternated runs.
"""

from functools import cache
from statistics import median

import exudyn as exu
import numpy as np
from benchmark_points import timed

import exugear
import fem
from fem.units import deg, mm, rpm

STEP, STEPS, REPEATS = 1.4e-5, 100_000, 3
QUICK = 4_000, 1
#: Steps of the run that is set up and not integrated.
SHORT = 100
SIZES = {"m_n": 3 * mm, "alpha_n": 20 * deg, "b": 25 * mm}
GEAR = fem.Gear(z=30, d_bore=30 * mm, **SIZES)
RING = fem.Gear(z=-90, d_a=-266 * mm, d_rim=320 * mm, **SIZES)
PAIRS = fem.GearPair(GEAR, GEAR), fem.GearPair(GEAR, RING)
#: On the pinion [N m]: of the maps, and of the run.
TORQUES, TORQUE = np.array([0, 20, 60, 120, 240, 480]), 100.0
BEARING = exugear.Bearing(radial=1e8, axial=1e8, tilt=1e6, damping_time=2e-5)
#: Speed of the sun where it drives the carrier [rad/s].
SPEED = 1350 * rpm, 1650 * rpm
#: By the member that drives and what the carrier does: held member, driving, driven; turns of the driving member in a
#: turn of that sun, by which all meshes have one frequency; torque on the driven member over that on the pinion of a
#: mesh.
DRIVES = {
    "sun drives": ("ring", "sun", "carrier", 1.0, 12.0),
    "carrier drives": ("ring", "carrier", "sun", 0.25, 3.0),
    "carrier held": ("carrier", "sun", "ring", 0.75, 9.0),
}
PAIR_TURNS = 0.75
KINDS = "spin only", "planar", "in space"


@cache
def maps():
    """Maps of the sun's and of the ring's mesh."""
    return [fem.static_transmission_error(pair, TORQUES, 30, progress=False) for pair in PAIRS]


def parts(kind: str, *gears) -> dict:
    """Gears of a member, and its bearing unless it only spins."""
    on_it = [*gears, *([] if kind == "spin only" else [BEARING])]
    return {0.0: on_it} if on_it else {}


def pair(kind: str) -> exugear.Gearbox:
    """Two equal gears on a bearing each."""
    shafts = [exugear.Shaft(name, parts(kind, GEAR)) for name in ("fast", "slow")]
    return exugear.Gearbox([exugear.Stage(*shafts, maps()[0], damping_ratio=0.05)])


def planetary(kind: str, held: str, driving: str, driven: str) -> exugear.Gearbox:
    """Three planets; where members move in bearings, planets stand on elastic pins."""
    sun, ring = exugear.Shaft("sun", parts(kind, GEAR)), exugear.Shaft("ring", parts(kind, RING))
    carrier = exugear.Shaft("carrier", parts(kind), inertia=0.02, mass=5.0)
    meshes = {"sun_mesh": maps()[0], "ring_mesh": maps()[1], "damping_ratio": 0.05}
    pin = None if kind == "spin only" else BEARING
    gears = exugear.Planetary(sun=sun, ring=ring, carrier=carrier, pin=pin, **meshes)
    return exugear.Gearbox([gears], held=held, driving=driving, driven=driven)


def built(box: exugear.Gearbox, kind: str) -> exugear.Model:
    """The model of a gearbox, whose planar bodies move in space where the kind says so."""
    plan = exugear.plan(box)
    return exugear.build(box, plan=plan.with_bodies() if kind == "in space" else plan)


def run_of(model: exugear.Model, turns: float, load: float, number: int) -> exugear.Run:
    """A run in so many steps; turns of the driving member in a turn of the sun, torque on the driven one [N m]."""
    speeds = tuple(turns * speed for speed in SPEED)
    options = {"duration": STEP * number, "load": load, "checks": 0, "progress": False}
    return exugear.run_up(model, speed=speeds if number > SHORT else speeds[0], step=STEP, **options)


def times(scene: tuple, number: int) -> tuple[exugear.Run, float]:
    """The run of a scene, and processor time of a step and a mesh [us]."""
    model, turns, load = scene
    before = timed(lambda: run_of(model, turns, load, SHORT))[1]
    run, seconds = timed(lambda: run_of(model, turns, load, number))
    return run, (seconds - before) / (number - SHORT) / len(model.meshes) * 1e6


def cost(kind: str, drive: str, number: int, repeats: int) -> dict[str, float]:
    """Iterations, time of a step and a mesh [us] of a set, of a pair, and the median of their ratios."""
    held, driving, driven, turns, torques = DRIVES[drive]
    of_set = built(planetary(kind, held, driving, driven), kind), turns, torques * TORQUE
    of_pair = built(pair(kind), kind), PAIR_TURNS, TORQUE
    for model, turning, load in (of_set, of_pair):
        run_of(model, turning, load, SHORT)  # compiles the contact
    runs = [(times(of_set, number), times(of_pair, number)) for _ in range(repeats)]
    iterations = [float(run.data.attrs["newton_iterations"]) for run, _ in runs[0]]
    return {
        "iterations": iterations[0],
        "of a pair": iterations[1],
        "us a step and mesh": median(of_set for (_, of_set), _ in runs),
        "us of a pair": median(of_pair for _, (_, of_pair) in runs),
        "ratio": median(of_set / of_pair for (_, of_set), (_, of_pair) in runs),
    }


def costs(quick: bool = False) -> dict[tuple[str, str], dict[str, float]]:
    """Rows of the benchmark by kind of plan and drive."""
    rows = {}
    for kind in KINDS:
        for drive in DRIVES:
            row = cost(kind, drive, *(QUICK if quick else (STEPS, REPEATS)))
            print(f"{kind:10}{drive:16}", {name: round(value, 2) for name, value in row.items()}, flush=True)
            rows[kind, drive] = row
    return rows


if __name__ == "__main__":
    exu.config.printToConsole = False
    costs()
