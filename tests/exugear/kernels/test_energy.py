"""Energy of a pair that turns without damping: one potential keeps it, a force along the rows alone does not."""

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from scenes import INERTIA, paper_pair, smooth_map

import exugear

PAIR, TORQUE = paper_pair(), 150.0


def energies(law: exugear.MeshForce, step: float) -> np.ndarray:
    """Energy of two gears over three mesh cycles, a torque on either [J]: kinetic, U(phase, deflection), the loads'."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0])) for _ in range(2)]
    bodies = [mbs.AddObject(eii.ObjectRotationalMass1D(inertia=INERTIA, nodeNumber=node)) for node in nodes]
    mbs.CreateGearContact(itemNumbers=bodies, pair=PAIR, force=law)
    for node in nodes:
        marker = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        mbs.AddLoad(eii.LoadCoordinate(markerNumber=marker, load=TORQUE))
    kinds = exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t
    sensors = [
        mbs.AddSensor(eii.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind))
        for node in nodes
        for kind in kinds
    ]
    mbs.Assemble()
    lead = law.deflection_at(0.0, TORQUE / PAIR.pinion.r_b)
    mbs.systemData.SetODE2Coordinates([lead / PAIR.pinion.r_b, 0], exu.ConfigurationType.Initial)
    mbs.systemData.SetODE2Coordinates_t([60.0, -60.0], exu.ConfigurationType.Initial)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = step
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = 6e-3, round(6e-3 / step)
    integration.generalizedAlpha.useNewmark = True
    integration.generalizedAlpha.newmarkBeta, integration.generalizedAlpha.newmarkGamma = 1 / 12, 0.5
    integration.newton.relativeTolerance = 1e-10
    exu.config.printToConsole = False
    mbs.SolveDynamic(settings)
    q_1, v_1, q_2, v_2 = (mbs.GetSensorStoredData(sensor)[:, 1] for sensor in sensors)
    deflection = PAIR.pinion.r_b * (q_1 + q_2)
    share = (np.arange(400) + 0.5) / 400
    phase = np.broadcast_to((q_1 * PAIR.pinion.z / (2 * np.pi))[:, None], (q_1.size, share.size))
    stored = (law(phase, deflection[:, None] * share**4) * 4 * share**3).mean(axis=1) * deflection
    kinetic = INERTIA / 2 * (v_1**2 + v_2**2)
    return kinetic + stored - TORQUE * (q_1 + q_2)


def drift(conserves: bool, step: float) -> float:
    """Spread of the total energy [J]."""
    total = energies(exugear.MeshForce.from_ste(smooth_map(), conserves=conserves, backlash=np.inf), step)
    return float(np.ptp(total))


def test_one_potential_keeps_the_energy_to_the_integrators_error():
    coarse, kept, finer, lost = drift(True, 2e-5), drift(True, 1e-5), drift(True, 5e-6), drift(False, 5e-6)
    assert finer < 0.5 * kept < 0.25 * coarse
    assert finer < 2e-3 * lost
