"""What drive and load cost a step as items of Exudyn that act on nothing, over the same system without them.

    python tests/benchmarks/benchmark_drive.py

Two masses of a single coordinate each, as of shafts that spin; then a run of a pair on spins, whose model was asked for
drive and load or not. The reason why a model has them only once they are asked for, and why they stand on the ground
while a run is solved (`exugear.multibody.drive_items`). Ratios are medians of alternated runs.
"""

from resource import RUSAGE_SELF, getrusage
from statistics import median

import exudyn as exu
import exudyn.itemInterface as eii
from scenes import paper_gear, smooth_map

import exugear
from fem.units import mm, rpm

STEP, STEPS, ROUNDS = 2.4e-5, 400_000, 5
DURATION = 10.0


def masses(*, constraint: bool = False, load: bool = False, on_ground: bool = False) -> exu.MainSystem:
    """Two masses on springs, with an inactive constraint and a load of 0 on the second one or on the ground."""
    mbs = exu.SystemContainer().AddSystem()
    stands = {"nodeNumber": mbs.AddNode(eii.NodePointGround()), "coordinate": 0}
    ground, aside = (mbs.AddMarker(eii.MarkerNodeCoordinate(**stands)) for _ in range(2))
    matrices = {"massMatrix": [[1e-2]], "stiffnessMatrix": [[2e4]], "dampingMatrix": [[1.0]]}
    for _ in range(2):
        node = mbs.AddNode(eii.Node1D(referenceCoordinates=[0.0]))
        mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=[node], forceVector=[1.0], **matrices))
    marker = aside if on_ground else mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    if constraint:
        mbs.AddObject(eii.CoordinateConstraint(markerNumbers=[ground, marker], activeConnector=False))
    if load:
        mbs.AddLoad(eii.LoadCoordinate(markerNumber=marker, load=0.0))
    mbs.Assemble()
    return mbs


def processor_time() -> float:
    """Time that the processor has worked for this process [s]."""
    return getrusage(RUSAGE_SELF).ru_utime


def step_time(mbs: exu.MainSystem) -> float:
    """Processor time of a step [us]."""
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = STEPS, STEPS * STEP
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.generalizedAlpha.useNewmark = True
    settings.timeIntegration.generalizedAlpha.newmarkBeta = 1 / 12
    began = processor_time()
    mbs.SolveDynamic(settings)
    return (processor_time() - began) / STEPS * 1e6


def run_time(model: exugear.Model) -> float:
    """Processor time of a step of a run [us]."""
    began = processor_time()
    run = exugear.run_up(model, speed=(0, 3500 * rpm), load=150.0, duration=DURATION, progress=False, checks=0)
    return (processor_time() - began) / DURATION * run.step * 1e6


def pair_on_spins() -> exugear.Model:
    shafts = [exugear.Shaft(name, {0 * mm: paper_gear()}) for name in ("fast", "slow")]
    return exugear.build(exugear.Gearbox([exugear.Stage(*shafts, smooth_map(), damping=3600)]))


def compared(title: str, cases: dict, time_of) -> None:
    """Print the least time of each case, and the median of its ratios to the first one."""
    for case in cases.values():
        time_of(case)
    rounds = [{name: time_of(case) for name, case in cases.items()} for _ in range(ROUNDS)]
    first = next(iter(cases))
    for name in cases:
        ratio = median(times[name] / times[first] for times in rounds)
        print(f"{title}, {name}: {min(times[name] for times in rounds):.2f} us, {ratio:.2f} times")


def main() -> None:
    both = {"constraint": True, "load": True}
    systems = {
        "without": masses(),
        "inactive constraint": masses(constraint=True),
        "load of 0": masses(load=True),
        "both": masses(**both),
        "both on the ground": masses(**both, on_ground=True),
    }
    compared("step of two masses", systems, step_time)
    models = {"not asked": pair_on_spins(), "asked for drive and load": pair_on_spins()}
    assert models["asked for drive and load"].mbs.systemData.NumberOfLoads() == 1
    compared("step of a run", models, run_time)


if __name__ == "__main__":
    main()
