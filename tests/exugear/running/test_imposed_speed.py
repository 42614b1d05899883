"""A run whose contacts know the imposed speed equals that whose constraint imposes it, which items of the user keep."""

import exudyn as exu
import numpy as np
import pytest
from exudyn.itemInterface import (
    CoordinateConstraint,
    CoordinateSpringDamper,
    MarkerNodeCoordinate,
    Node1D,
    ObjectRotationalMass1D,
    SensorObject,
)
from scenes import paper_gear, ran, smooth_stage

import exugear
from fem.units import mm, rpm

BEARINGS = {0 * mm: exugear.Bearing(2e8, 1e8, damping_time=2e-5), 60 * mm: exugear.Bearing(2e8, damping_time=2e-5)}
COUPLING = {90 * mm: exugear.Coupling(5e3, inertia=0.02, damping=0.5)}
SCENES = {
    "spin": ({}, {}),
    "planar": (BEARINGS, BEARINGS),
    "driving rotor": (COUPLING, {}),
    "driving rotor, planar": (BEARINGS | COUPLING, BEARINGS),
    "both rotors": (COUPLING, COUPLING),
}
SPEEDS = {"ramp": (600 * rpm, 900 * rpm), "function": lambda t: 80 + 10 * np.sin(40 * t)}


def box_of(fast: dict, slow: dict) -> exugear.Gearbox:
    shafts = [exugear.Shaft(n, {30 * mm: paper_gear()} | p) for n, p in (("fast", fast), ("slow", slow))]
    return exugear.Gearbox([smooth_stage(*shafts, damping_ratio=0.06)])


def with_further_item(model: exugear.Model) -> exugear.Model:
    """The model with an item of the user, beside which the constraint stays."""
    node = model.mbs.AddNode(Node1D(referenceCoordinates=[0.0]))
    model.mbs.AddObject(ObjectRotationalMass1D(inertia=1.0, nodeNumber=node))
    marker = model.mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    fixed = model.mbs.GetObjectParameter(model.drive, "markerNumbers")[0]
    model.mbs.AddObject(CoordinateSpringDamper(markerNumbers=[fixed, marker], stiffness=1.0))
    model.mbs.Assemble()
    return model


@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("scene", SCENES)
def test_contacts_and_constraint_impose_the_same_motion(scene, speed):
    """Within Newton's tolerance; drive torque and end state as well."""
    boxes = [box_of(*SCENES[scene]) for _ in range(2)]
    models = exugear.build(boxes[0]), with_further_item(exugear.build(boxes[1]))
    options = {"speed": SPEEDS[speed], "load": 150.0, "duration": 0.1, "tolerance": 1e-5, "step": 1e-5, "checks": 0}
    by_contacts, by_constraint = (ran(model, **options) for model in models)
    for name in ("dte", "mesh_force", "drive_torque", "speed"):
        size = float(np.abs(by_constraint[name]).max())
        assert by_contacts[name].values == pytest.approx(by_constraint[name].values, abs=2e-6 * size), name
    ends = by_contacts["end_state"].values, by_constraint["end_state"].values[:, :-1]
    for row in range(2):
        assert ends[0][row] == pytest.approx(ends[1][row], abs=1e-6 * np.abs(ends[1][row]).max())


def test_shafts_in_space_differ_by_the_square_of_their_tilts():
    gear, bearings = paper_gear(), {0 * mm: BEARINGS[0 * mm], 80 * mm: BEARINGS[60 * mm]}
    shafts = [exugear.Shaft(name, {30 * mm: gear} | bearings) for name in ("fast", "slow")]
    box = exugear.Gearbox([smooth_stage(*shafts, damping_ratio=0.06)])
    models = exugear.build(box), with_further_item(exugear.build(box))
    options = {"load": 150.0, "duration": 0.05, "tolerance": 1e-5, "step": 1e-5, "checks": 0}
    by_contacts, by_constraint = (ran(model, **options)["dte"].values for model in models)
    assert by_contacts == pytest.approx(by_constraint, abs=1e-5 * np.ptp(by_constraint))


@pytest.mark.parametrize(("scene", "most"), [("spin", 1.05), ("planar", 1.3)])
def test_newton_needs_one_iteration_a_step(scene, most):
    data = ran(exugear.build(box_of(*SCENES[scene])), speed=(0, 3500 * rpm), duration=0.5, checks=0)
    assert 1 <= data.attrs["newton_iterations"] < most


def test_the_system_of_the_user_is_restored():
    """Constraint and load keep their numbers and parameters; a sensor on the constraint keeps it in the run."""
    model = exugear.build(box_of({}, {}))
    model.mbs.SetObjectParameter(model.drive, "Vshow", False)
    ran(model, duration=0.01)
    drive, load = model.mbs.GetObject(model.drive), model.mbs.GetLoad(model.load)
    assert (drive["name"], drive["Vshow"], drive["activeConnector"]) == ("drive", False, True)
    assert (load["name"], abs(load["load"])) == ("load", 150.0)
    sensor = model.mbs.AddSensor(
        SensorObject(objectNumber=model.drive, outputVariableType=exu.OutputVariableType.Force, storeInternal=True)
    )
    model.mbs.Assemble()
    data = ran(model, duration=0.01)
    torque = np.abs(model.mbs.GetSensorStoredData(sensor)[-1, 1])
    assert torque == pytest.approx(abs(float(data["drive_torque"][-1])), rel=1e-3)


@pytest.mark.parametrize("asked", [False, True], ids=["bare", "asked"])
@pytest.mark.parametrize("scene", ["spin", "planar", "both rotors"])
def test_a_run_changes_no_items_of_the_system(scene, asked):
    """Names of objects and loads before, in the steps of and after a run, beside couplings and torques of its own."""
    model, seen = exugear.build(box_of(*SCENES[scene])), []
    numbers = (int(model.drive), int(model.load)) if asked else None

    def items() -> tuple[list[str], list[str]]:
        mbs, data = model.bare_mbs, model.bare_mbs.systemData
        objects = [mbs.GetObject(i)["name"] for i in range(data.NumberOfObjects())]
        return objects, [mbs.GetLoad(i)["name"] for i in range(data.NumberOfLoads())]

    def look(mbs, t) -> bool:
        objects, loads = items()
        if t > 1e-9:  # the static solve before has constraints and loads of its own
            seen.append(([x for x in objects if not x.startswith(("driven coupling", "torque on"))], loads))
        return True

    before = items()
    model.bare_mbs.SetPreStepUserFunction(look)
    ran(model, duration=2e-3)
    assert len(seen) > 10 and all(each == before for each in seen) and items() == before
    assert ("drive" in before[0], before[1]) == (asked, ["load"] * asked)
    assert numbers is None or (int(model.drive), int(model.load)) == numbers


@pytest.mark.parametrize("scene", SCENES)
def test_drive_and_load_that_are_asked_for_change_no_run(scene):
    """Before a run and after one; what is asked for late is as if it had been there from the beginning."""
    bare, before, after = (exugear.build(box_of(*SCENES[scene])) for _ in range(3))
    assert before.mbs.GetLoad(before.load)["load"] == 0.0
    options = {"speed": SPEEDS["ramp"], "duration": 0.02, "checks": 0}
    runs = [ran(model, **options) for model in (bare, before, after)]
    assert int(after.drive) == int(before.drive) and after.mbs.GetObject(after.drive)["name"] == "drive"
    runs.append(ran(after, **options))
    for name in ("dte", "mesh_force", "drive_torque", "speed"):
        for data in runs[1:]:
            size = float(np.abs(runs[0][name]).max())
            assert data[name].values == pytest.approx(runs[0][name].values, abs=1e-7 * size), name
    late = exugear.build(box_of(*SCENES[scene]))
    ran(late, **options)
    functions = [
        model.mbs.GetObjectParameter(model.drive, "offsetUserFunction")["function"] for model in (before, late)
    ]
    assert functions[0](None, 0.01, 0, 0.0) == functions[1](None, 0.01, 0, 0.0) != 0.0
    assert before.mbs.GetLoad(before.load)["load"] == late.mbs.GetLoad(late.load)["load"] != 0.0


def test_drive_and_load_are_not_added_while_the_system_is_solved():
    """The thread that solves is told so; the system itself may be looked at."""
    model = exugear.build(box_of({}, {}))

    def ask(mbs, t) -> bool:
        assert model.mbs.systemData.NumberOfLoads() == 0
        return int(model.drive) > 0

    model.bare_mbs.SetPreStepUserFunction(ask)
    with pytest.raises(exugear.RunStopped, match=r"ask for model.mbs, drive or load before"):
        ran(model, duration=1e-3)
    model.bare_mbs.SetPreStepUserFunction(0)
    ran(model, duration=1e-3)
    assert int(model.drive) > 0


def test_a_spring_of_the_user_on_the_held_shaft_loads_the_constraint():
    """Asked for after a run: the constraint bears the torque of the drive and that of the spring, k angle."""
    model, k = exugear.build(box_of({}, {})), 500.0
    ran(model, duration=1e-3)
    fixed = model.mbs.GetObjectParameter(model.drive, "markerNumbers")[0]
    spring = CoordinateSpringDamper(markerNumbers=[fixed, model.end_markers["fast"]], stiffness=k)
    model.mbs.AddObject(spring)
    sensor = model.mbs.AddSensor(
        SensorObject(objectNumber=model.drive, outputVariableType=exu.OutputVariableType.Force, storeInternal=True)
    )
    model.mbs.Assemble()
    data = ran(model, speed=600 * rpm, duration=0.01)
    t, torque = model.mbs.GetSensorStoredData(sensor)[-1]
    borne = float(data["drive_torque"][-1]) + k * 600 * rpm * t
    assert abs(torque) == pytest.approx(borne, rel=1e-3)


def test_a_function_of_time_is_not_called_while_the_system_is_solved():
    """Its calls do not grow with the number of steps."""
    calls = []

    def speed(t):
        calls.append(t)
        return 80 + 10 * t

    numbers = []
    for step in (2e-5, 1e-5):
        calls.clear()
        ran(exugear.build(box_of({}, {})), speed=speed, step=step, duration=0.1)
        numbers.append(len(calls))
    assert numbers[0] == numbers[1] < 4000


def test_a_torque_on_the_free_end_and_further_constraints_still_hold():
    """A constraint of the user on the slow shaft stops it: the contact must carry whatever that takes."""
    model = exugear.build(box_of({}, {}))
    fixed = model.mbs.GetObjectParameter(model.drive, "markerNumbers")[0]
    model.mbs.AddObject(CoordinateConstraint(markerNumbers=[fixed, model.end_markers["slow"]]))
    model.mbs.Assemble()
    data = ran(model, speed=0.0, duration=0.01)
    assert np.isfinite(data["mesh_force"].values).all()


@pytest.mark.parametrize("scene", ["spin", "planar", "both rotors"])
def test_the_predictor_changes_the_iterations_and_not_the_run(scene, monkeypatch):
    """Through contact loss: lightly damped gears at their resonance."""
    options = {"speed": (480 * rpm, 520 * rpm), "duration": 0.2, "tolerance": 1e-6, "step": 2e-5, "checks": 0}
    guided = ran(exugear.build(box_of(*SCENES[scene])), **options)
    monkeypatch.setattr("exugear.multibody.contact_steps.set_predictor", lambda *_: None)
    unguided = ran(exugear.build(box_of(*SCENES[scene])), **options)
    assert guided["dte"].values == pytest.approx(unguided["dte"].values, abs=1e-5 * np.ptp(unguided["dte"].values))
