"""Run-ups: equilibrium, power, reduced against unreduced scenes, damping, refusals."""

import _thread
import gc
import threading
import weakref
from dataclasses import replace

import exudyn as exu
import numpy as np
import pytest
from run_ups import LOAD, run, with_bearings
from scenes import INERTIA, K, Oscillator, linear_law, paper_gear, paper_pair, smooth_box, smooth_map, smooth_stage

import exugear
from fem.units import mm, rpm, um


@pytest.mark.parametrize("build", [lambda: exugear.build(smooth_box()), with_bearings])
def test_a_gearbox_without_speed_stays_in_equilibrium(build):
    data = run(build(), speed=0.0, duration=0.01).data
    assert data["mesh_force"].values == pytest.approx(LOAD / paper_pair().wheel.r_b, rel=1e-4)
    assert np.ptp(data["dte"].values) < 1e-4 * um * 10


def test_slow_running_follows_the_static_transmission_error(spinning):
    data = run(spinning, speed=2 * rpm, duration=0.6).data
    phase = (data["time"].values * 2 * rpm * 57 / (2 * np.pi)) % 1
    law = spinning.meshes[0].stage.force
    static = np.array([law.deflection_at(p, LOAD / paper_pair().wheel.r_b) for p in phase[2500::1000]])
    assert data["dte"].values[0, 2500::1000] == pytest.approx(static, abs=0.05 * um)


def test_segments_do_not_perturb_the_run(spinning, monkeypatch):
    parts = run(spinning, tolerance=1e-4, checks=0)
    monkeypatch.setattr("exugear.multibody.time_integration.SEGMENTS", 1)
    whole = run(spinning, tolerance=1e-4, checks=0)
    assert np.abs(whole.data["dte"] - parts.data["dte"]).max() < 1e-4 * np.ptp(whole.data["dte"].values)


def test_reduced_and_unreduced_scenes_agree(spinning):
    box = spinning.gearbox
    unreduced = exugear.build(box, plan=exugear.plan(box).with_joints())
    conditions = {"speed": (1000 * rpm, 1100 * rpm), "duration": 0.5}
    dte_reduced, dte_unreduced = (run(model, **conditions).data["dte"].values for model in (spinning, unreduced))
    assert np.abs(dte_reduced - dte_unreduced).max() < 1e-4 * np.ptp(dte_reduced)


def test_forced_vibration_from_rest_has_its_closed_form():
    oscillator, w = Oscillator(linear_law(), zeta=0.0), 0.6
    y, x = oscillator.run(lambda x: 0.0, lambda x: 2000 + 500 * np.sin(2 * np.pi * w * x), 20.0)
    angle = 2 * np.pi * x
    textbook = 2000 + 500 * (np.sin(w * angle) - w * np.sin(angle)) / (1 - w**2)
    assert y * K == pytest.approx(textbook, abs=0.05)


def test_damped_resonance_has_its_closed_form():
    """Newmark's velocities without correction would reduce it by (omega h)^2 / 12, 1.3 %."""
    zeta = 0.05
    c = 2 * zeta * np.sqrt(K * INERTIA) / paper_pair().pinion.r_b
    oscillator = Oscillator(replace(linear_law(), damping=c), zeta=0.0)
    steps = 2 * np.pi / 0.4
    y, x = oscillator.run(lambda x: 0.0, lambda x: 2000 + 100 * np.sin(2 * np.pi * x), 40.0, steps)
    angle = 2 * np.pi * x[x > 30]
    _, *parts = np.linalg.lstsq(np.c_[np.ones(angle.size), np.sin(angle), np.cos(angle)], y[x > 30])[0]
    assert np.hypot(*parts) == pytest.approx(100 / K / (2 * zeta), rel=1e-3)


@pytest.mark.parametrize("load", [150.0, lambda t: 150 + t])
@pytest.mark.parametrize("speed", [(10.0, 20.0), lambda t: 10 + t])
def test_systems_that_are_no_longer_used_are_freed(speed, load):
    model = exugear.build(smooth_box())
    run(model, speed=speed, load=load, duration=0.01, progress=True)
    system = weakref.ref(model.mbs)
    del model
    gc.collect()
    assert system() is None


def test_reversed_load_acts_on_the_back_flank(spinning):
    forward, back = (run(spinning, speed=0.0, duration=0.01, load=load).data for load in (LOAD, -LOAD))
    assert back["mesh_force"].values == pytest.approx(-forward["mesh_force"].values, rel=1e-3)
    assert (back["dte"].values < -paper_pair().backlash).all()


@pytest.mark.parametrize("load", [LOAD, -LOAD])
def test_heavily_damped_gears_on_bearings_rest_on_either_flank(load):
    """The shafts tilt by 1e-3 rad, which changes the lever arms by its square."""
    soft = exugear.Bearing(radial=5e7, axial=1e7, tilt=1e5)
    box = smooth_box(soft, damping=40000.0)
    data = run(exugear.build(box), speed=0.0, duration=0.01, load=load).data
    wanted = load / paper_pair().wheel.r_b
    assert data["mesh_force"].values == pytest.approx(np.full_like(data["mesh_force"], wanted), rel=1e-5)


@pytest.mark.parametrize("load", [LOAD, -LOAD])
def test_rotation_under_load_shifts_the_phase_of_the_next_stage(spinning_stages, load):
    """A gear that crosses its backlash turns by some hundredths of a pitch; the start is still exact."""
    forces = run(spinning_stages, speed=0.0, duration=0.01, load=load).data["mesh_force"].values
    wanted = np.array([[load], [load]]) / paper_pair().wheel.r_b
    assert np.ptp(forces, axis=1) == pytest.approx(0, abs=1e-9 * abs(wanted[0, 0]))
    assert forces[1] == pytest.approx(np.broadcast_to(wanted[1], forces[1].shape), rel=1e-9)
    assert forces[0, 0] == pytest.approx(wanted[0, 0], rel=2e-5), "the phase of the second mesh loads the first"


def test_two_stages_transmit_the_load(spinning_stages):
    data = run(spinning_stages, speed=5.0, duration=0.1).data
    assert data["stage"].values.tolist() == ["fast-middle", "middle-slow"]
    assert data["mesh_force"].values.mean(axis=1) == pytest.approx(LOAD / paper_pair().wheel.r_b, rel=0.02)


@pytest.mark.parametrize("bearing", [None, exugear.Bearing(radial=1e9, axial=1e9, tilt=1e6, damping_time=1e-5)])
def test_two_paths_share_the_load_at_rest_and_in_slow_motion(bearing):
    """Four equal gears in a square; with bearings on two of the shafts only."""
    held = {30 * mm: paper_gear()} | ({0.0: bearing} if bearing else {})
    a, d = (exugear.Shaft(name, {30 * mm: paper_gear()}) for name in "ad")
    b, c = (exugear.Shaft(name, held) for name in "bc")
    ends = [(a, b, 0.0), (a, c, np.pi / 2), (b, d, np.pi / 2), (c, d, 0.0)]
    stages = [smooth_stage(*pair, damping=2700.0, angle=angle) for *pair, angle in ends]
    model = exugear.build(exugear.Gearbox(stages))
    half = LOAD / paper_pair().wheel.r_b / 2
    rest = run(model, speed=0.0, duration=0.005).data["mesh_force"].values
    assert np.ptp(rest, axis=1) == pytest.approx(0, abs=1e-3 * half)
    slow = run(model, speed=5.0, duration=0.1).data["mesh_force"].values
    mean = slow[:, slow.shape[1] // 2 :].mean(axis=1)
    for (ab, ac, bd, cd), rel in ((rest[:, 0], 1e-4), (mean, 1e-2)):
        assert (ab, ac) == pytest.approx((bd, cd), rel=rel)
        assert bd + cd == pytest.approx(2 * half, rel=rel)
    if not bearing:
        assert mean == pytest.approx(half, rel=0.05)


def test_speed_as_line_and_as_function_are_the_same(spinning):
    lines = run(spinning, duration=0.2).data
    curves = run(spinning, duration=0.2, speed=lambda t: 175 * rpm * t / 0.2, load=lambda t: LOAD).data
    assert np.abs(lines["dte"] - curves["dte"]).max() < 1e-4 * um


def test_power_in_equals_power_out_and_damping(spinning):
    data = run(spinning, speed=600 * rpm, duration=0.5).data
    force = data["mesh_force"].values[0, 5000:]
    assert force.mean() == pytest.approx(LOAD / paper_pair().wheel.r_b, rel=2e-3)


def test_data_of_a_run_stay_as_they_are_when_the_model_is_solved_again(spinning):
    options = {"speed": 1000 * rpm, "duration": 0.01, "progress": False}
    data = exugear.run_up(spinning, load=150.0, **options).data
    before = data.copy(deep=True)
    exugear.run_up(spinning, load=50.0, **options)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    spinning.mbs.SolveStatic(settings)
    assert data.identical(before)


def test_a_load_that_becomes_nan_is_named(spinning):
    with pytest.raises(ValueError, match=r"load\(t\) must be finite, got nan at 0.03"):
        run(spinning, load=lambda t: np.nan if t > 0.03 else 50.0)


def test_leaving_the_map_is_reported_with_time_speed_and_remedy(spinning):
    ste = smooth_map((0, 1, 20, 100, 350, 400))
    shafts = spinning.gearbox.shafts
    model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, ste, damping=500.0)]))
    with pytest.raises(RuntimeError, match=r"at t = .* s \(.* rpm\): deflection .* um .* larger torque"):
        run(model, speed=(0, 3000 * rpm))
    with pytest.raises(ValueError, match="extend the map to a larger torque"):
        run(model, load=500.0)


@pytest.mark.usefixtures("listening_to_ctrl_c")
def test_interrupted_run_raises_and_can_be_repeated(spinning):
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        run(spinning, duration=60.0)
    timer.join()
    assert np.isfinite(run(spinning, duration=0.1).data["dte"].values).all()


def test_console_stays_silent(spinning, capfd):
    run(spinning, duration=0.1)
    out, err = capfd.readouterr()
    assert (out, err) == ("", "")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"duration": 0.0}, "duration must lie in"),
        ({"duration": np.nan}, "duration must lie in"),
        ({"speed": np.nan}, "speed must be finite"),
        ({"speed": (0, 1, 2)}, "speed must be a number"),
        ({"speed": lambda t: np.nan}, "speed.t. must be finite"),
        ({"speed": 1e6}, "pass 3500.rpm"),
        ({"load": np.inf}, "load must be finite"),
        ({"load": lambda t: np.nan}, "load.t. must be finite"),
        ({"load": 1e5}, "extend the map"),
        ({"tolerance": 0.0}, "tolerance must lie in"),
        ({"step": -1.0}, "step must be > 0"),
        ({"step": 2e-4}, r"step must be below .* stability"),
        ({"step": exugear.Rule.fourth_order(2e-4)}, r"step must be below .* stability"),
        ({"sample": 0.0}, "sample must lie in"),
        ({"sample": 2.0}, "sample must lie in"),
        ({"sensor_period": 2.0}, "sensor_period must lie in"),
    ],
)
def test_bad_conditions_are_refused(spinning, changes, message):
    with pytest.raises(ValueError, match=message):
        run(spinning, **changes)


def test_the_run_is_stable_up_to_the_stated_limit():
    oscillator = Oscillator(linear_law(backlash=np.inf, reach=9e-3))
    limit = 6**0.5 / oscillator.omega
    assert oscillator.model.plan.largest_step == pytest.approx(limit / 2**0.5, rel=1e-3)
    assert oscillator.c == pytest.approx(0.1 * (K * INERTIA) ** 0.5 / oscillator.r)


BALL = exugear.Bearing(radial=2e8, axial=1e8, damping_time=2e-5)


@pytest.mark.parametrize("parts", [{0.0: exugear.Drag(20.0)}, {0 * mm: BALL, 60 * mm: BALL}], ids=["drag", "planar"])
def test_a_run_does_not_depend_on_runs_before_it(parts):
    """Drag that is steep at standstill and flat in the run; bearings whose last forces contacts remember."""
    model, options = exugear.build(smooth_box(parts=parts)), {"load": 150.0, "duration": 0.1, "progress": False}
    first, second = (exugear.run_up(model, speed=(90.0, 130.0), **options, checks=0).data for _ in range(2))
    assert second.equals(first)
    exact = exugear.run_up(
        model, speed=(90.0, 130.0), **options, checks=0, tolerance=1e-7, step=first.attrs["step"]
    ).data
    assert np.abs(first["dte"] - exact["dte"]).max() < 2e-4 * np.ptp(exact["dte"].values)
