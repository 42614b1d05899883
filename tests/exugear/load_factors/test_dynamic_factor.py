"""The dynamic factor of runs: limits, an oscillator in closed form, the static force of two stages."""

import numpy as np
import pytest
import xarray as xr
from paper_gears import paper_pair
from scenes import INERTIA, K, Oscillator, linear_law, smooth_box, two_stages

import exugear
from fem.units import rpm


def ran(box, **changes) -> exugear.Run:
    options = {"speed": 30 * rpm, "load": 150.0, "duration": 0.4, "progress": False, "checks": 0} | changes
    return exugear.run_up(exugear.build(box), **options)


def test_without_speed_the_dynamic_factor_is_1():
    factor = exugear.dynamic_factor(ran(smooth_box()), windows=10)
    assert factor["K_v"].values == pytest.approx(1, abs=2e-3)
    assert factor["static_force"].values == pytest.approx(150 / paper_pair().pinion.r_b, rel=1e-3)


def test_forced_oscillator_has_the_magnification_of_the_closed_form(measured):
    """m y'' + c y' + k y = F (1 + e sin W t): K_v = 1 + e |H| sqrt(1), the mesh force being k y."""
    scene, share, ratio, load = Oscillator(linear_law()), 0.1, 0.5, 1000.0
    push = lambda x: load * (1 + share * np.sin(2 * np.pi * ratio * x))  # noqa: E731
    time = 150 * 2 * np.pi / scene.omega
    step = 2 * np.pi / scene.omega / 200
    run = exugear.run_up(
        scene.model,
        speed=ratio * scene.omega / scene.teeth,
        load=lambda t: push(t * scene.omega / 2 / np.pi) * scene.r,
        duration=time,
        step=step,
        sample=step,
        progress=False,
    )
    factor = exugear.dynamic_factor(run, windows=10)["K_v"].values[0, -1]
    assert scene.omega == pytest.approx(np.sqrt(K * paper_pair().pinion.r_b ** 2 / INERTIA))
    expected = 1 + share / np.hypot(1 - ratio**2, 2 * 0.05 * ratio)
    measured("dynamic factor of a forced oscillator", abs(factor - expected), 2e-4)


def test_static_force_of_two_stages_follows_a_varying_load():
    """The load torque through the ratios over the base radius, with the inertia torques of the run-up."""
    box, start, end, duration = two_stages(), 300 * rpm, 600 * rpm, 0.5
    load = lambda t: 100.0 + 100.0 * t / duration  # noqa: E731
    factor = exugear.dynamic_factor(ran(box, load=load, speed=(start, end), duration=duration), windows=20)
    acceleration = (end - start) / duration
    times = (factor["speed"].values - start) / acceleration
    expected = np.array([box.static_forces(load(t), acceleration) for t in times.tolist()]).T
    assert factor["static_force"].dims == ("stage", "speed")
    assert factor["static_force"].values == pytest.approx(expected, rel=5e-3)
    assert (factor["K_v"].values >= 1).all()


def test_load_on_the_back_flank_counts_like_that_on_the_driving_one():
    drive, back = (exugear.dynamic_factor(ran(smooth_box(), load=sign * 150.0), windows=5) for sign in (1, -1))
    assert back["static_force"].values == pytest.approx(-drive["static_force"].values, rel=1e-3)
    assert back["K_v"].values == pytest.approx(drive["K_v"].values, abs=2e-3)


def test_the_result_is_written_and_read(tmp_path):
    factor = exugear.dynamic_factor(ran(smooth_box(), duration=0.1), windows=3)
    factor.to_netcdf(tmp_path / "factor.nc", engine="h5netcdf")
    assert all({"units", "long_name"} <= set(values.attrs) for values in factor.data_vars.values())


def test_runs_without_load_and_windows_out_of_range_are_refused():
    run = ran(smooth_box(), duration=0.02)
    with pytest.raises(ValueError, match="windows"):
        exugear.dynamic_factor(run, windows=0)
    for share in (0.0, 1e-12):
        unloaded = run.data.assign(mesh_force=share * run.data["mesh_force"])
        with pytest.raises(ValueError, match="must load the mesh"):
            exugear.dynamic_factor(unloaded, windows=5)


def test_a_load_that_crosses_zero_has_no_factor_there():
    """A ripple of 300 N beside a mean force from -2000 to 2000 N: the ratio to a force that vanishes is NaN."""
    run = ran(smooth_box(), duration=0.2, speed=300 * rpm)
    time = run.data["time"].values
    mean, ripple = 4000 * (time / time[-1] - 0.5), 300 * np.sin(2 * np.pi * 5000 * time)
    crossing = run.data.assign(mesh_force=(("stage", "time"), [mean + ripple]))
    factor = exugear.dynamic_factor(crossing, windows=50)
    unloaded = np.abs(factor["static_force"].values) < 100
    assert np.isnan(factor["K_v"].values[unloaded]).all()
    assert 0 < np.isnan(factor["K_v"].values).mean() < 0.2
    assert np.nanmax(factor["K_v"].values) < 1 + 300 / 100
    assert "load crosses zero" in factor["K_v"].attrs["missing"]


def test_a_stage_without_load_beside_a_loaded_one_has_no_factor():
    run = ran(two_stages(), duration=0.1, speed=300 * rpm).data
    idle = run.assign(mesh_force=run["mesh_force"] * xr.DataArray([1.0, 0.0], dims="stage"))
    factor = exugear.dynamic_factor(idle, windows=5)["K_v"].values
    assert np.isfinite(factor[0]).all()
    assert np.isnan(factor[1]).all()


def test_a_mesh_that_only_turns_a_free_member_has_no_factor():
    """Its forces of inertia are some 1e-4 of those of the loaded mesh: the free sun of a set of Ravigneaux had 28."""
    run = ran(two_stages(), duration=0.1, speed=300 * rpm).data
    free = run.assign(mesh_force=run["mesh_force"] * xr.DataArray([1.0, 2e-4], dims="stage"))
    factor = exugear.dynamic_factor(free, windows=5)["K_v"].values
    assert np.isfinite(factor[0]).all()
    assert np.isnan(factor[1]).all()


def test_steady_states_have_the_factor_of_their_largest_force():
    forces, speeds = np.array([2000.0, 3000.0, 2500.0]), np.array([10.0, 20.0, 15.0])
    states = xr.Dataset({"largest_force": ("point", forces), "speed": ("point", speeds)})
    factor = exugear.dynamic_factor(states, static_force=2000.0)
    assert factor["K_v"].values == pytest.approx([1, 1.5, 1.25])
    assert factor["speed"].identical(states["speed"])
    on_back_flanks = xr.Dataset({"largest_force": ("point", 0 * forces), "smallest_force": ("point", -forces)})
    back = exugear.dynamic_factor(on_back_flanks.assign_attrs(load=-150.0), static_force=2000.0)
    assert back["K_v"].values == pytest.approx([1, 1.5, 1.25])
    with pytest.raises(ValueError, match="static_force must be > 0 N for steady states"):
        exugear.dynamic_factor(states)
    with pytest.raises(ValueError, match="static_force is for steady states"):
        exugear.dynamic_factor(ran(smooth_box(), duration=0.02), static_force=2000.0)
