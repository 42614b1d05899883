"""Runs in files: labelled, whole, read back, refused."""

import numpy as np
import pytest
import xarray as xr
from run_ups import run
from scenes import smooth_map

import exugear


def test_data_are_labelled_and_saved_whole(spinning, tmp_path):
    done = run(spinning, duration=0.1)
    path = done.save(tmp_path / "run.nc")
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert data["dte"].dims == ("stage", "time")
        assert data["dte"].units == "m" and data["mesh_force"].units == "N"
        assert data["mesh_frequency"].values[0, -1] == pytest.approx(57 * 175 / 60)
        assert data.attrs["duration"] == 0.1 and data.attrs["fast_inertia"] == pytest.approx(8.527e-3, rel=1e-3)
        assert np.isfinite(data["dte"].values).all()
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.nc"]


def test_saved_runs_are_read_back(spinning_stages, tmp_path):
    done = run(spinning_stages, speed=5.0, duration=0.01)
    same = exugear.Run.load(done.save(tmp_path / "run.nc"))
    xr.testing.assert_identical(same.data, done.data)
    assert same.data["stage"].dtype.kind == "U"
    assert (same.wall_time, same.step) == (done.wall_time, done.step)
    done.data.to_netcdf(tmp_path / "older.nc", engine="h5netcdf")
    assert np.isnan(exugear.Run.load(tmp_path / "older.nc").wall_time)


def test_a_file_takes_less_than_half_of_the_numbers_in_it(spinning, tmp_path):
    done = run(spinning, speed=100.0, duration=2.0)
    assert done.save(tmp_path / "run.nc").stat().st_size < 0.5 * done.data.nbytes


def test_files_with_a_single_mesh_frequency_are_read_for_a_single_stage(spinning_stages, spinning, tmp_path):
    """Older versions saved the mesh frequency of the first stage alone."""
    done, several = run(spinning, duration=0.01), run(spinning_stages, duration=0.01)
    path = tmp_path / "older.nc"
    done.data.assign(mesh_frequency=done.data["mesh_frequency"][0]).to_netcdf(path, engine="h5netcdf")
    assert exugear.Run.load(path).data["mesh_frequency"].dims == ("stage", "time")
    several.data.assign(mesh_frequency=several.data["mesh_frequency"][0]).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(ValueError, match=r"mesh frequency of the first stage alone; run it again"):
        exugear.Run.load(path)


def test_files_without_a_run_are_refused(tmp_path):
    smooth_map().to_netcdf(tmp_path / "map.nc", engine="h5netcdf")
    (tmp_path / "text.nc").write_text("no netCDF")
    for name, message in (("map.nc", "holds no run, it lacks"), ("text.nc", "damaged or no netCDF file; run it again")):
        with pytest.raises(ValueError, match=message):
            exugear.Run.load(tmp_path / name)
    with pytest.raises(FileNotFoundError):
        exugear.Run.load(tmp_path / "missing.nc")
