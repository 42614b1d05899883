"""Signals of runs, of sensors of Exudyn and of arrays."""

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
import xarray as xr
from scenes import smooth_box

import exugear
from fem.units import mm

TEETH = 57


@pytest.fixture(scope="module")
def recorded():
    """A run-up on bearings with a sensor of the wheel's acceleration; the run and what the sensor stored."""
    ball = exugear.Bearing(radial=2e8, axial=1e8, damping_time=2e-5)
    model = exugear.build(smooth_box(parts={0 * mm: ball, 60 * mm: ball}))
    body = list(model.bodies.values())[1]
    kind = {"outputVariableType": exu.OutputVariableType.Acceleration, "storeInternal": True}
    sensor = model.mbs.AddSensor(eii.SensorBody(bodyNumber=body, localPosition=[0, 0, 0], **kind))
    model.mbs.Assemble()
    run = exugear.run_up(model, speed=(50.0, 60.0), load=100.0, duration=0.05, progress=False, checks=0)
    return run, model.mbs.GetSensorStoredData(sensor)


def test_a_signal_is_the_variable_with_speed_angle_and_mesh_order(recorded):
    run, _ = recorded
    dte = exugear.signal(run, "dte")
    assert dte.dims == ("time",)
    assert set(dte.coords) == {"time", "speed", "angle", "mesh_order"}
    assert dte.attrs == run.data["dte"].attrs
    assert dte.values == pytest.approx(run.data["dte"].values[0])
    time = dte["time"].values
    assert dte["speed"].values == pytest.approx(50 + 200 * time)
    assert dte["angle"].values == pytest.approx(50 * time + 100 * time**2)
    assert float(dte["mesh_order"]) == TEETH
    assert exugear.signal(run.data, "dte").identical(dte)


def test_labels_select_channels_and_wrong_ones_are_refused(recorded):
    run, _ = recorded
    bearings = run.data["bearing"].values.tolist()
    force = exugear.signal(run, "bearing_force")
    assert force.dims == ("bearing", "direction", "time")
    single = exugear.signal(run, "bearing_force", bearing=bearings[1], direction="y")
    assert single.dims == ("time",)
    assert single.values == pytest.approx(force.values[1, 1])
    assert exugear.signal(run, "bearing_force", direction=["x", "y"]).sizes["direction"] == 2
    for name, labels, words in (
        ("torque", {}, "name must be a variable over time of the run"),
        ("bearing_force", {"bearing": "none"}, "bearing='none' is no label of bearing_force, which has"),
        ("dte", {"direction": "x"}, "direction='x' is no label of dte"),
        ("bearing_force", {"bearing": []}, r"bearing=\[\] is no label of bearing_force"),
    ):
        with pytest.raises(ValueError, match=words):
            exugear.signal(run, name, **labels)


def test_a_sensor_of_exudyn_gives_a_signal_with_the_speed_of_the_run(recorded):
    run, stored = recorded
    across = exugear.sensor_signal(run, stored, 1, units="m/s^2", long_name="acceleration of the wheel")
    assert across["time"].values[-1] == pytest.approx(0.05, abs=1e-4)
    assert across["speed"].values == pytest.approx(50 + 200 * across["time"].values, rel=1e-6)
    assert across.values[-1] == stored[-1, 2]
    assert float(across["mesh_order"]) == TEETH
    assert float(exugear.level(across.std(keep_attrs=True))) > 0
    with pytest.raises(ValueError, match="component must be 0 to 2, got 3"):
        exugear.sensor_signal(run, stored, 3)
    with pytest.raises(ValueError, match="stored must be"):
        exugear.sensor_signal(run, stored[:, 0])
    with pytest.raises(ValueError, match=r"stored must be of the run, which ends at 0.05 s, got times up to 0.1"):
        exugear.sensor_signal(run, stored * [2, 1, 1, 1])


def test_orders_of_a_stage_and_its_side_bands(recorded):
    run, _ = recorded
    assert exugear.mesh_orders(run, harmonics=2).tolist() == [57, 114]
    assert exugear.mesh_orders(run, harmonics=2, side_bands=1).tolist() == [56, 57, 58, 113, 114, 115]
    with pytest.raises(ValueError, match=r"harmonics must lie in \[1, 1000\], got 0"):
        exugear.mesh_orders(run, harmonics=0)


def test_orders_of_a_second_stage_count_revolutions_of_the_driving_shaft():
    """20/40 and 25/50 teeth: the second pinion turns half as fast as the driving shaft, the last wheel a quarter."""
    time = np.linspace(0, 1, 101)
    speed = 2 * np.pi * (10 + time)
    frequency = np.outer([20, 12.5], speed / (2 * np.pi))
    zero = ("stage", "time"), np.zeros((2, 101))
    run = xr.Dataset(
        {"speed": ("time", speed), "mesh_frequency": (("stage", "time"), frequency), "dte": zero, "mesh_force": zero},
        {"time": time, "stage": ["a-b", "b-c"]},
        {"a-b_pinion_z": 20, "a-b_wheel_z": 40, "b-c_pinion_z": 25, "b-c_wheel_z": 50},
    )
    assert float(exugear.signal(run, "dte", stage=1)["mesh_order"]) == 12.5
    assert exugear.signal(run, "dte", stage="b-c").identical(exugear.signal(run, "dte", stage=1))
    assert exugear.mesh_orders(run, "b-c", harmonics=2).tolist() == [12.5, 25]
    assert exugear.dte_envelope(run, "b-c", windows=1).abscissa == exugear.dte_envelope(run, 1, windows=1).abscissa
    with pytest.raises(ValueError, match="stage must be 0 to 1, or a label, got 'c-d'; the stages are"):
        exugear.signal(run, "dte", stage="c-d")
    assert exugear.mesh_orders(run, 1, harmonics=2, side_bands=0).tolist() == [12.5, 25]
    assert exugear.mesh_orders(run, 1, harmonics=1, side_bands=1).tolist() == [12, 12.25, 12.5, 12.75, 13]


def test_arrays_are_checked():
    time = np.linspace(0, 1, 11)
    for columns, words in (
        ((time[::-1], time, time), "time must increase"),
        ((time, time[1:], time), "equally long"),
        ((time, time, np.full(11, np.nan)), "values must be finite"),
    ):
        with pytest.raises(ValueError, match=words):
            exugear.recorded_signal(*columns)
    bare = exugear.recorded_signal(time, time, time).drop_vars("angle")
    with pytest.raises(ValueError, match=r"signal must be over time, speed and angle; pass what exugear\.signal"):
        exugear.order_cut(bare, [1])
