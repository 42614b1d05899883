"""The conditions of a run in the attributes of its data: numbers and arrays, also in files."""

import numpy as np
import pytest
import xarray as xr

import exugear

POINTS = np.array([[0.0, 2e-3, 5e-3], [100.0, 130.0, 150.0]])


def written_and_read(run: exugear.Run, path) -> xr.Dataset:
    data = exugear.Run.load(run.save(path / "run.nc")).data
    xr.testing.assert_identical(data, run.data)
    return data


@pytest.mark.parametrize(
    ("load", "expected"),
    [(150, {"load": 150.0}), ((100, 150), {"load": [100, 150]}), (POINTS, {"load": POINTS[1], "load_time": POINTS[0]})],
)
def test_speed_and_load_of_a_run_up_are_numbers_and_arrays(spinning, load, expected, tmp_path):
    run = exugear.run_up(spinning, speed=(10, 20), load=load, duration=5e-3, progress=False)
    data = written_and_read(run, tmp_path)
    assert data.attrs["speed"].tolist() == [10.0, 20.0]
    assert {name: np.asarray(data.attrs[name]).dtype.kind for name in expected} == dict.fromkeys(expected, "f")
    assert all(np.array_equal(data.attrs[name], value) for name, value in expected.items())


def test_torques_of_a_run_stand_under_the_names_of_the_shafts(spinning, tmp_path):
    brake = exugear.Torque(of_speed=([0, 10, 20], [0, 50, 150]))
    options = {"duration": 2e-3, "progress": False}
    data = written_and_read(exugear.run(spinning, drives={"fast": 15}, loads={"slow": brake}, **options), tmp_path)
    assert data.attrs["fast_speed"] == 15.0
    assert data.attrs["slow_torque"].tolist() == [0, 50, 150]
    assert data.attrs["slow_torque_speed"].tolist() == [0, 10, 20]
    free = exugear.run(spinning, drives={"fast": exugear.Torque(3)}, start_speed=4, **options).data
    assert (free.attrs["fast_torque"], free.attrs["start_speed"]) == (3.0, 4.0)


def test_long_arrays_do_not_keep_a_run_from_its_file(spinning, tmp_path):
    """HDF5 refuses attributes beyond 64 kB."""
    times = np.linspace(0, 2e-3, 20_000)
    run = exugear.run_up(spinning, speed=10, load=[times, 100 + times], duration=2e-3, progress=False)
    assert written_and_read(run, tmp_path).attrs["load"] == "20000 points"


def test_files_of_version_0_1_0_give_numbers(spinning, tmp_path):
    """It wrote numbers and ramps as text."""
    run = exugear.run_up(spinning, speed=(10, 20), load=150.0, duration=2e-3, progress=False)
    old = run.data.assign_attrs(speed="(10, 20)", load="150.0")
    path = exugear.Run(old, run.wall_time, run.step).save(tmp_path / "old.nc")
    read = exugear.Run.load(path)
    assert read.data.attrs["load"] == 150.0 and read.data.attrs["speed"].tolist() == [10.0, 20.0]
    assert "150 N m" in exugear.report(read, tmp_path / "old.html", model=spinning)[0].read_text(encoding="utf-8")
    named = exugear.Run(old.assign_attrs(load="ramp", speed="3 points"), run.wall_time, run.step)
    assert exugear.Run.load(named.save(path)).data.attrs["load"] == "ramp"
