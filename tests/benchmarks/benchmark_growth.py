"""How run times grow with the scene, and the yardsticks beside which they stand.

    PYTHONPATH=examples python tests/benchmarks/benchmark_growth.py

Yardsticks are a compiled loop without a multibody code, and Exudyn with a built-in spring instead of the mesh.
"""

from functools import partial
from itertools import pairwise

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from benchmark_points import Points, cold, timed
from benchmark_run_up import LONG, TORQUE, paper_gearbox
from korta_pair import TOP_SPEED, paper_pair
from numba import njit

import exugear
import fem
from exugear.mesh_force.force_kernels import damping, spinning_force
from exugear.multibody.solver_settings import settings_for
from fem.units import mm


@njit
def compiled_loop(table, mobility, load, steps, h, turns):
    """Deflection of one rotational pair after a run-up, by velocity Verlet: the floor without a multibody code."""
    y, v, a = 1e-5, 0.0, 0.0
    for i in range(steps):
        t = i * h
        y += h * v + 0.5 * h * h * a
        static = spinning_force(table, turns * t * t, y)
        b = mobility * (load - static.force - damping(table, static.penetration) * (v + 0.5 * h * a))
        v, a = v + 0.5 * h * (a + b), b
    return y


def fourth_order_settings(step: float, steps: int) -> exu.SimulationSettings:
    """Settings of Exudyn for so many steps of the integrator that runs use [s]."""
    return settings_for(exugear.Rule.fourth_order(step), step * steps, 1e-3)


def exudyn_spring(inertia: float):
    """Two spinning masses on a spring that is built into Exudyn, the first held as by a drive."""
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
    """Times of 70 s [s] in equal steps: the compiled loop, Exudyn with a built-in spring, and with the mesh."""
    stage, steps = box.stages[0], round(LONG / step / 10)
    mobility = stage.pair.wheel.r_b**2 / box.driven.inertia
    turns = stage.pair.pinion.z * TOP_SPEED / (4 * np.pi * LONG)
    arguments = stage.force.table.head, mobility, TORQUE / stage.pair.wheel.r_b, steps, step, turns
    compiled_loop(*arguments[:3], 10, *arguments[4:])
    _, loop = timed(lambda: compiled_loop(*arguments))
    _container, spring = exudyn_spring(box.driven.inertia)
    _, bare = timed(lambda: spring.SolveDynamic(fourth_order_settings(step, steps)))
    model, conditions = exugear.build(box), {"speed": (0, TOP_SPEED), "duration": LONG / 10, "load": TORQUE}
    _, run = timed(lambda: exugear.run_up(model, **conditions, step=step, checks=0, progress=False))
    return {"compiled loop": 10 * loop, "Exudyn's spring": 10 * bare, "exugear": 10 * run}


def chain(box: exugear.Gearbox, stages: int) -> exugear.Gearbox:
    """A chain of equal stages, each in its axial plane."""
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
        options = {"speed": 60.0, "duration": 0.5, "load": TORQUE, "step": 1e-5, "checks": 0, "progress": False}
        seconds.append(timed(partial(exugear.run_up, model, **options))[1] / 5e4)
    counts = (3, 9) if quick else (3, 9, 33, 129)
    slices(misalignments=3, phases=4)  # compiles the contact states
    tilts = [cold(partial(slices, misalignments=n))[1] for n in counts]
    phases, torques = (15, 30, 60, 120), (4, 8, 16, 32)
    slices()  # from here on its finite elements are cached
    rows = runs.rows["spinning, tolerance chosen"]
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
    """Exponent of the power law that fits times over sizes."""
    return float(np.polyfit(np.log(sizes), np.log(times), 1)[0])


if __name__ == "__main__":
    print(yardsticks(paper_gearbox(), 2.4e-5))
