"""Recorded samples of a contact: converged values, refused intervals, samples that were not written, copies."""

import copy
import pickle

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
from paper_gears import paper_pair
from scenes import INERTIA

import exugear
from fem.units import um

PAIR = paper_pair()


def recorded_spins(mbs, law, recorder, lead: float) -> list[np.ndarray]:
    """Spins of two bodies of which the pinion starts ahead [m], with a contact that records every step, 100 in 1 ms."""
    nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0])) for _ in range(2)]
    bodies = [mbs.AddObject(eii.ObjectRotationalMass1D(inertia=INERTIA, nodeNumber=node)) for node in nodes]
    mbs.CreateGearContact(itemNumbers=bodies, pair=PAIR, force=law, recorder=recorder)
    types = {"outputVariableType": exu.OutputVariableType.Coordinates, "storeInternal": True}
    sensors = [mbs.AddSensor(eii.SensorNode(nodeNumber=node, **types)) for node in nodes]
    mbs.Assemble()
    mbs.systemData.SetODE2Coordinates([lead / PAIR.pinion.r_b, 0], exu.ConfigurationType.Initial)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 1e-5
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = 1e-3, 100
    mbs.SolveDynamic(settings)
    return [mbs.GetSensorStoredData(sensor)[:, 1] for sensor in sensors]


@pytest.mark.usefixtures("way")
def test_recorder_keeps_the_converged_values(mbs, law):
    recorder = exugear.Recorder()
    recorder.start(1e-5, 101)
    spins = recorded_spins(mbs, law, recorder, 7 * um)
    lead = PAIR.pinion.r_b * spins[0] + PAIR.wheel.r_b * spins[1]
    assert np.ptp(lead) > 5 * um
    assert np.abs(recorder.deflection - lead).max() < 1e-6 * np.ptp(lead)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda recorder: pickle.loads(pickle.dumps(recorder))])
def test_copies_of_a_recorder_record_by_themselves(mbs, law, copied):
    recorder = exugear.Recorder()
    recorder.start(1e-5, 101, motion=True)
    recorded_spins(mbs, law, recorder, 8 * um)
    before = recorder.deflection.copy()
    twin = copied(recorder)
    np.testing.assert_array_equal(twin.deflection, before)
    mbs.Reset()
    twin.start(1e-5, 101)
    recorded_spins(mbs, law, twin, 3 * um)
    np.testing.assert_array_equal(recorder.deflection, before)
    assert twin.deflection[0] == pytest.approx(3 * um, rel=1e-6)
    assert before[0] == pytest.approx(8 * um, rel=1e-6)


def test_a_start_that_finds_no_memory_leaves_the_samples_of_before(mbs, law):
    recorder = exugear.Recorder()
    recorder.start(1e-5, 101)
    with pytest.raises((MemoryError, ValueError)):
        recorder.start(1e-5, 10**15)
    recorded_spins(mbs, law, recorder, 7 * um)
    assert recorder.force.shape == (101,)
    assert np.isfinite(recorder.force).all()


def test_recorder_refuses_bad_intervals_and_numbers():
    recorder = exugear.Recorder()
    with pytest.raises(ValueError, match="start it before the solve"):
        _ = recorder.force
    with pytest.raises(ValueError, match="interval must be > 0"):
        recorder.start(0.0, 10)
    with pytest.raises(ValueError, match="number of samples"):
        recorder.start(1e-5, 0)


def test_samples_are_nan_until_they_are_written():
    """A solve that ends early leaves no forces of 0 behind that look like those of an unloaded mesh."""
    recorder = exugear.Recorder()
    recorder.start(1e-5, 3, power=True)
    assert all(np.isnan(values).all() for values in (recorder.deflection, recorder.force, recorder.power["energy"]))
    recorder.start(1e-5, 3, zeroed=True)
    assert np.isnan(recorder.deflection).all()
    assert not recorder.force.any()
