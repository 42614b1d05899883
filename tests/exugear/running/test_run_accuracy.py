"""Accuracy of runs: order of the integrator, estimated errors, windows of the whole run-up."""

import numpy as np
import pytest
from run_ups import run, with_bearings
from scenes import smooth_box

import exugear
from fem.units import rpm


def windows(run: exugear.Run, width: float = 0.25) -> np.ndarray:
    """rms of the DTE about its mean in windows of time."""
    time, dte = run.data["time"].values[:-1], run.data["dte"].values[0, :-1]
    window = np.floor(time / width * (1 + 1e-9)).astype(int)
    mean = np.bincount(window, dte) / np.bincount(window)
    return np.sqrt(np.bincount(window, (dte - mean[window]) ** 2) / np.bincount(window))


def test_stiff_bearings_come_close_to_ideal_ones(spinning):
    hard = exugear.build(smooth_box(exugear.Bearing(radial=1e11, axial=1e11, tilt=1e9, damping_time=1e-6)))
    conditions = {"speed": 300 * rpm, "duration": 0.5}
    ideal, stiff = (windows(run(model, **conditions), 0.1) for model in (spinning, hard))
    assert stiff == pytest.approx(ideal, rel=0.02)


def test_windows_are_converged_at_the_default_tolerance(spinning):
    conditions = {"speed": (500 * rpm, 700 * rpm), "duration": 2.0}
    rough = run(spinning, **conditions)
    fine = run(spinning, **conditions, step=rough.step / 4)
    error = np.abs(windows(rough) / windows(fine) - 1)
    assert np.median(error) < 1e-3


def fall(box, speed: float) -> float:
    """Power of the step with which the error of the DTE falls, from 24 to 12 us."""
    conditions = {"speed": speed, "duration": 0.048, "sample": 4.8e-5, "tolerance": 1e-6}
    coarse, half, fine = (
        run(exugear.build(box), step=h, **conditions).data["dte"].values for h in (24e-6, 12e-6, 15e-7)
    )
    return float(np.log2(np.std(coarse - fine) / np.std(half - fine)))


@pytest.mark.parametrize("damping", [0.0, 2700.0])
@pytest.mark.parametrize("part", [None, exugear.Bearing(radial=3e8, axial=1e8, tilt=1e5)])
def test_error_falls_with_the_fourth_power_of_the_step(part, damping, measured):
    power = fall(smooth_box(part, damping=damping), 600 * rpm)
    measured.number("DTE at 600 rpm against the step, 24 and 12 µs", power, "falls with its power {}")
    assert power == pytest.approx(4, abs=0.3)


def test_contact_loss_makes_the_error_fall_more_slowly():
    assert 0 < fall(smooth_box(), 2100 * rpm) < 3


@pytest.mark.slow
@pytest.mark.parametrize(
    "build", [lambda: exugear.build(smooth_box()), pytest.param(with_bearings, marks=pytest.mark.slow)]
)
def test_estimated_errors_match_true_errors(build, monkeypatch):
    """All hundred segments of a run-up through the resonances, against a sixth of the step; above Newton's error."""
    everything = lambda model, scheme, segments, number: segments  # noqa: E731
    monkeypatch.setattr("exugear.running.step_error.representative", everything)
    monkeypatch.setattr("exugear.running.step_error.jumps_of", lambda model, scheme, segments: [])
    conditions = {"speed": (500 * rpm, 3500 * rpm), "duration": 4.0, "load": 150.0, "tolerance": 4e-3}
    rough = run(build(), **conditions, progress=True)
    finer = {"step": rough.step / 6, "sample": rough.data.attrs["sample"], "tolerance": 1e-5, "checks": 0}
    fine = run(build(), **conditions | finer)
    rough_parts, fine_parts = (np.array_split(x.data["dte"].values[0, :-1], 100) for x in (rough, fine))
    true = np.array([np.abs(a.std() / b.std() - 1) for a, b in zip(rough_parts, fine_parts, strict=True)])
    ratio = rough.data["step_error"].values[0] / true
    assert np.mean((ratio > 1 / 3) & (ratio < 3)) >= 0.9
    assert np.median(ratio) == pytest.approx(1, abs=0.3)


def test_checks_do_not_change_the_run():
    runs = [run(exugear.build(smooth_box()), progress=True, checks=checks) for checks in (0, 3)]
    plain, checked = (x.data for x in runs)
    assert "step_error" not in plain
    assert 1 < checked["checked"].size <= 3
    assert (checked["step_error"] < 1e-3).all()
    assert plain["dte"].identical(checked["dte"].drop_vars("checked", errors="ignore"))


RUN_UP = {"speed": (0, 3500 * rpm), "duration": 70.0}


@pytest.fixture(scope="module")
def run_up(spinning) -> exugear.Run:
    return run(spinning, **RUN_UP)


@pytest.mark.slow
def test_seventy_seconds_to_3500_rpm_are_converged(spinning, run_up, measured):
    fine = run(spinning, **RUN_UP, step=run_up.step / 4)
    error = np.abs(windows(run_up) / windows(fine) - 1)
    measured("rms of the DTE in 0.25 s windows, median", np.median(error), 1e-3)
    measured("rms of the DTE in 0.25 s windows, 95th percentile", np.percentile(error, 95), 5e-3)


@pytest.mark.slow
def test_a_run_up_in_space_on_revolute_joints(spinning, measured):
    box, conditions = spinning.gearbox, RUN_UP | {"duration": 7.0}
    unreduced = exugear.build(box, plan=exugear.plan(box).with_joints())
    in_space, reduced = (windows(run(model, **conditions), 0.025) for model in (unreduced, spinning))
    error = np.median(np.abs(in_space / reduced - 1))
    measured("a run-up of 7 s with 3D bodies on revolute joints, median of 0.025 s windows", error, 1e-3)


@pytest.mark.parametrize("tau", [0.0, 1e-6])
def test_bodies_on_bearings_are_damped_as_well(tau):
    """Near a resonance, with damping of the mesh and hardly any of the bearings."""
    box = smooth_box(exugear.Bearing(radial=3e8, axial=1e8, tilt=1e5, damping_time=tau))
    model = exugear.build(box, plan=exugear.plan(box).with_bodies())
    conditions = {"speed": (1900 * rpm, 2000 * rpm), "duration": 1.0, "tolerance": 1e-6}
    coarse, fine = (windows(run(model, **conditions, step=step), 0.1) for step in (2e-5, 5e-6))
    assert coarse == pytest.approx(fine, rel=1e-3)
