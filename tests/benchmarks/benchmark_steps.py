"""Time of a step and iterations of Newton's method, beside Exudyn's own time for the same bodies without gears.

    PYTHONPATH=examples python tests/benchmarks/benchmark_steps.py

Yardsticks: for shafts that only spin, an ObjectGenericODE2 with a single coordinate and constant matrices; for bodies
on bearings, the same bodies and bearings without contact and drive. Each ratio is the median of alternated pairs.
"""

from statistics import median

import exudyn as exu
import exudyn.itemInterface as eii
from benchmark_growth import chain, fourth_order_settings
from benchmark_points import timed
from benchmark_run_up import TORQUE, on_bearings, paper_gearbox
from korta_pair import TOP_SPEED

import exugear

STEP, STEPS, PAIRS = 2.4e-5, 300_000, 5
QUICK = 30_000, 1


def single_coordinate(inertia: float) -> exu.MainSystem:
    """A mass on a spring in a single object: the least that a step of Exudyn can cost."""
    mbs = exu.SystemContainer().AddSystem()
    node = mbs.AddNode(eii.Node1D(referenceCoordinates=[0.0]))
    matrices = {"massMatrix": [[inertia]], "stiffnessMatrix": [[2e6]], "dampingMatrix": [[10.0]]}
    mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=[node], forceVector=[1.0], **matrices))
    mbs.Assemble()
    return mbs


def without_gears(model: exugear.Model) -> exu.MainSystem:
    """The bodies and bearings of a model, which is of no further use; contacts, drive and load are deleted."""
    options = {"deleteDependentItems": False, "suppressWarnings": True}
    for number in (model.drive, *sorted((mesh.contact for mesh in model.meshes), reverse=True)):
        model.mbs.DeleteObject(number, **options)
    model.mbs.DeleteLoad(model.load, deleteDependentMarkers=False, suppressWarnings=True)
    model.mbs.Assemble()
    return model.mbs


def bare_step(mbs: exu.MainSystem, number: int) -> float:
    """Time of one of so many steps without gears [us]."""
    settings = fourth_order_settings(STEP, number)
    return timed(lambda: mbs.SolveDynamic(settings))[1] / number * 1e6


def run_of(model: exugear.Model, number: int) -> exugear.Run:
    """A run-up through the speeds of the paper, in so many steps."""
    options = {"speed": (0, TOP_SPEED), "duration": STEP * number, "load": TORQUE, "checks": 0, "progress": False}
    return exugear.run_up(model, step=exugear.Rule.fourth_order(STEP), **options)


def step_times(box: exugear.Gearbox, plan: exugear.Plan | None, number: int, pairs: int) -> dict[str, float]:
    """Iterations, time of a step [us], of the yardstick [us], and the median of their ratios."""
    model = exugear.build(box, plan=plan)
    spins = all(kind.spin_index == 0 for kind in model.plan.shafts.values())
    bare = single_coordinate(box.driven.inertia) if spins else without_gears(exugear.build(box, plan=plan))
    exugear.run_up(model, speed=TOP_SPEED, duration=100 * STEP, load=TORQUE, progress=False)  # compiles the contact
    runs = [(run_of(model, number), bare_step(bare, number)) for _ in range(pairs)]
    seconds = [run.wall_time / number * 1e6 for run, _ in runs]
    return {
        "iterations": float(runs[0][0].data.attrs["newton_iterations"]),
        "us a step": median(seconds),
        "us of the yardstick": median(floor for _, floor in runs),
        "ratio": median(second / floor for second, (_, floor) in zip(seconds, runs, strict=True)),
    }


def steps(box: exugear.Gearbox, quick: bool = False) -> dict[str, dict[str, float]]:
    """Rows of the benchmark by scene."""
    elastic = on_bearings(box)
    scenes = {"spinning": (box, None), "planar": (elastic, None)}
    scenes["in space"] = elastic, exugear.plan(elastic).with_bodies()
    scenes |= {f"{n} stages": (chain(box, n), None) for n in ((2,) if quick else (2, 4, 8))}
    rows = {name: step_times(*scene, *(QUICK if quick else (STEPS, PAIRS))) for name, scene in scenes.items()}
    for name, row in rows.items():
        print(f"{name:10}", {key: round(value, 2) for key, value in row.items()})
    return rows


if __name__ == "__main__":
    exu.config.printToConsole = False
    steps(paper_gearbox())
