"""Time of a step of Exudyn with an inactive constraint and with a load of 0, over that of the same system without them.

    python tests/benchmarks/benchmark_drive.py

Two masses of a single coordinate each, as of shafts that spin. The reason why a run takes the drive and the load of a
model out of the system (`exugear.multibody.drive_and_load`). Ratios are medians of alternated runs.
"""

from os import times
from statistics import median

import exudyn as exu
import exudyn.itemInterface as eii

STEP, STEPS, ROUNDS = 2.4e-5, 400_000, 5


def masses(*, constraint: bool = False, load: bool = False) -> exu.MainSystem:
    """Two masses on springs, with an inactive constraint and a load of 0 on the second one, if asked."""
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
    matrices = {"massMatrix": [[1e-2]], "stiffnessMatrix": [[2e4]], "dampingMatrix": [[1.0]]}
    for _ in range(2):
        node = mbs.AddNode(eii.Node1D(referenceCoordinates=[0.0]))
        mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=[node], forceVector=[1.0], **matrices))
    marker = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    if constraint:
        mbs.AddObject(eii.CoordinateConstraint(markerNumbers=[ground, marker], activeConnector=False))
    if load:
        mbs.AddLoad(eii.LoadCoordinate(markerNumber=marker, load=0.0))
    mbs.Assemble()
    return mbs


def step_time(mbs: exu.MainSystem) -> float:
    """Processor time of a step [us]."""
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = STEPS, STEPS * STEP
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.generalizedAlpha.useNewmark = True
    settings.timeIntegration.generalizedAlpha.newmarkBeta = 1 / 12
    began = times().user
    mbs.SolveDynamic(settings)
    return (times().user - began) / STEPS * 1e6


def main() -> None:
    systems = {
        "without": masses(),
        "inactive constraint": masses(constraint=True),
        "load of 0": masses(load=True),
        "both": masses(constraint=True, load=True),
    }
    rounds = [{name: step_time(mbs) for name, mbs in systems.items()} for _ in range(ROUNDS)]
    for name in systems:
        ratio = median(times_of[name] / times_of["without"] for times_of in rounds)
        print(f"{name}: {min(times_of[name] for times_of in rounds):.2f} us, {ratio:.2f} times")


if __name__ == "__main__":
    main()
