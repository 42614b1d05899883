"""Friction between the teeth of bodies in Exudyn."""

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
from friction_cases import SPUR, N, friction_for
from scenes import INERTIA, K, linear_law

import exugear


def run_with_friction(mbs, pair, law, friction, torque: float, speed: float, cycles: int, steps: int):
    """Drive two spins; (times, spins (2), speeds (2), recorder)."""
    nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0])) for _ in range(2)]
    bodies = [mbs.AddObject(eii.ObjectRotationalMass1D(inertia=INERTIA, nodeNumber=node)) for node in nodes]
    recorder, mesh = exugear.Recorder(), {"itemNumbers": bodies, "pair": pair, "force": law}
    mbs.CreateGearContact(**mesh, recorder=recorder, friction=friction)
    for node, load in zip(nodes, (torque * (1 + friction.loss(pair)), torque), strict=True):
        marker = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        mbs.AddLoad(eii.LoadCoordinate(markerNumber=marker, load=load))
    kinds = exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t
    data = {"storeInternal": True, "writeToFile": False}
    sensors = [
        mbs.AddSensor(eii.SensorNode(nodeNumber=node, outputVariableType=kind, **data))
        for kind in kinds
        for node in nodes
    ]
    mbs.Assemble()
    mbs.systemData.SetODE2Coordinates([torque / K / pair.pinion.r_b**2, 0], exu.ConfigurationType.Initial)
    mbs.systemData.SetODE2Coordinates_t([speed, -speed], exu.ConfigurationType.Initial)
    duration = cycles * 2 * np.pi / pair.pinion.z / speed
    recorder.start(duration / steps, steps + 1)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = duration / steps
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = duration, steps
    settings.timeIntegration.newton.useModifiedNewton = False
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    q_1, q_2, v_1, v_2 = (mbs.GetSensorStoredData(sensor)[:, 1] for sensor in sensors)
    return duration, (q_1, q_2), (v_1, v_2), recorder.force


def test_input_less_output_power_is_the_loss_in_a_run():
    container = exu.SystemContainer()
    friction, torque, speed = friction_for(SPUR, 0.1), 150.0, 100.0
    drive = torque * (1 + friction.loss(SPUR))
    run = run_with_friction(container.AddSystem(), SPUR, linear_law(), friction, torque, speed, 4, 4000)
    duration, q, v, force = run
    stored = (INERTIA * (v[0] ** 2 + v[1] ** 2) + force**2 / K) / 2
    lost = drive * (q[0][-1] - q[0][0]) + torque * (q[1][-1] - q[1][0]) - (stored[-1] - stored[0])
    phase = (q[0] * SPUR.pinion.z / (2 * np.pi)) % 1.0
    lever = np.interp(phase, np.arange(N) / N, friction.lever, period=1.0)
    rolling = SPUR.pinion.r_b * np.tan(SPUR.alpha_wt) * (v[0] + v[1])
    pull = np.interp(phase, np.arange(N) / N, friction.pull, period=1.0)
    power = friction.coefficient * force * (lever * (v[0] - v[1]) + pull * rolling)
    assert power.min() > 0
    assert lost == pytest.approx(np.trapezoid(power, dx=duration / (power.size - 1)), rel=1e-6)
    assert lost == pytest.approx(friction.loss(SPUR) * torque * speed * duration, rel=5e-3)
    assert v[0].mean() == pytest.approx(speed, rel=1e-4)
