"""Gearboxes on rolling bearings: equilibrium, energy books, modes, drag, loads that are not carried."""

from functools import cache

import numpy as np
import pytest
from bearing_boxes import SPUR, box_of
from rolling_bearings import ANGULAR, ROLLER, deep_groove

import exugear
from fem.units import mm, um

LOAD, DAMPED = 150.0, {"damping_time": 2e-5}
DRAG = exugear.BearingDrag(43.5 * mm, 2.0, 20e-6, 3e-4)


@cache
def gearbox() -> exugear.Gearbox:
    """The paper's pair on a ball bearing, which brakes, and a roller bearing a shaft."""
    roller = exugear.RollingBearing.cylindrical_roller(**ROLLER, clearance=10 * um, **DAMPED)
    parts = {0.0: deep_groove(10 * um, **DAMPED, drag=DRAG), 60 * mm: roller}
    return box_of(fast=parts, slow=parts)


@cache
def run_on_balls_and_rollers() -> exugear.Run:
    """A short run of that gearbox."""
    model = exugear.build(gearbox())
    return exugear.run_up(model, speed=(60.0, 70.0), load=LOAD, duration=0.03, power=True, displacement=True, checks=0)


def test_a_run_closes_its_energy_books():
    balance = run_on_balls_and_rollers().energy_balance()
    assert balance.losses["bearing_loss"] > 0
    assert balance.relative < 2e-6


def test_a_run_starts_with_bearings_that_balance_the_mesh():
    data = run_on_balls_and_rollers().data.isel(time=0)
    force, of_fast = float(data["mesh_force"][0]), data["bearing_force"].values[:2]
    assert np.linalg.norm(of_fast.sum(axis=0)) == pytest.approx(force, rel=1e-3)
    assert force > 0.9 * LOAD / SPUR.wheel.r_b


def test_life_and_pressure_along_a_run_are_those_of_its_mean_load():
    run = run_on_balls_and_rollers()
    parts = {shaft.name: shaft for shaft in gearbox().shafts}
    data = exugear.bearing_life(run, gearbox())
    assert data["bearing"].values.tolist() == run.data["bearing"].values.tolist()
    mean = -run.data["bearing_force"].sel(bearing="fast at 0 mm").mean("time").values
    loaded = parts["fast"].bearings[0.0].under((*mean, 0, 0))
    assert data["life"].values[0] == pytest.approx(loaded.life, rel=0.05)
    assert data["pressure"].values[0] == pytest.approx(loaded.pressures[0].max(), rel=0.05)
    hours = data["life"] / (65.0 / (2 * np.pi)) / 3600
    assert data["hours"].values == pytest.approx(hours.values, rel=1e-3)


def test_a_duty_cycle_wears_as_its_runs_together():
    run = run_on_balls_and_rollers()
    early, late = (run.data.isel(time=part) for part in (slice(0, 1000), slice(1000, 2000)))
    alone = [exugear.bearing_life(part, gearbox())["hours"] for part in (early, late)]
    together = exugear.bearing_life([early, late], gearbox(), shares=[3.0, 1.0])["hours"]
    assert (1 / together).values == pytest.approx((0.75 / alone[0] + 0.25 / alone[1]).values, rel=1e-3)
    cycle = exugear.LoadSpectrum(
        [exugear.LoadCase("early", 61.0, LOAD, 3.0), exugear.LoadCase("late", 64.0, LOAD, 1.0)]
    )
    by_cycle = exugear.bearing_life([early, late], gearbox(), shares=cycle)["hours"]
    assert by_cycle.values.tolist() == together.values.tolist()


def test_runs_in_another_order_than_their_load_cases_are_refused():
    """A run of 60 to 70 rad/s under 150 N m is not that of another speed or load."""
    for speed, load, words in ((90.0, LOAD, "speed of 60 to 70"), (65.0, 40.0, "load_torque of 150 to 150")):
        cycle = exugear.LoadSpectrum([exugear.LoadCase("another", speed, load)])
        with pytest.raises(ValueError, match=f"run 0 has a {words}.*pass the runs in the order of the load cases"):
            exugear.bearing_life(run_on_balls_and_rollers(), gearbox(), shares=cycle)
    with pytest.raises(ValueError, match=r"shares must be \(n_run,\) >= 0 and finite"):
        exugear.bearing_life(run_on_balls_and_rollers(), gearbox(), shares=[np.inf])


def test_the_drag_follows_the_force_of_the_bearing():
    data = run_on_balls_and_rollers().data
    radial = np.hypot(*data["bearing_force"].values[0, :2])
    omega, torque = data["shaft_speed"].values[0], data["drag_torque"].values[0]
    assert torque == pytest.approx(DRAG.torque(omega, radial), rel=0.02)
    assert (torque > 1.1 * DRAG.torque(omega)).all()


def test_modes_are_those_on_the_tangent_stiffness():
    ball = deep_groove(10 * um)
    bearings = {0.0: ball, 60 * mm: ball}
    model = exugear.build(box_of(fast=bearings, slow=bearings))
    start = exugear.run_up(model, speed=60.0, load=LOAD, duration=1e-4, checks=0).data.isel(time=0)
    frequency = exugear.modes(model, load=LOAD)["frequency"].values
    tangents = [np.pad(ball.under((*-force, 0, 0)).stiffness, (0, 1)) for force in start["bearing_force"].values]
    ends = [{z: exugear.Bearing(matrix=k) for z, k in zip(bearings, tangents[i : i + 2], strict=True)} for i in (0, 2)]
    linear = exugear.modes(exugear.build(box_of(fast=ends[0], slow=ends[1])), load=LOAD)["frequency"].values
    assert np.abs(linear[:, None] / frequency - 1).min(axis=1).max() < 2e-3


def test_the_plan_tells_whether_a_load_leaves_the_linear_range():
    pair = exugear.RollingBearing.angular_contact(**ANGULAR).paired("O", spacing=15 * mm, preload=3000.0)
    for bearing, load, words in (
        (pair, 1.0, "linear to"),
        (pair, 4000.0, "not linear: the displacement is"),
        (pair, 3e6, "not linear: the displacement is"),  # twice that is not carried
        (deep_groove(10 * um), 10.0, "do not hold the shaft at rest"),
    ):
        parts = {0.0: bearing, 60 * mm: bearing}
        printed = exugear.plan(box_of(fast=parts, slow=parts), load=load).bearings["fast"]
        assert words in printed
    at_rest = pair.displaced(np.zeros(5))
    assert at_rest.linear.stiffness[:5, :5] == pytest.approx(at_rest.stiffness, abs=1e-3)


def test_runs_take_linear_bearings_where_the_load_keeps_to_them():
    """Bearings, DTE and life are those of the nonlinear bearings; the plan says so, and a user may keep these."""
    pair = exugear.RollingBearing.angular_contact(**ANGULAR, **DAMPED).paired("O", spacing=15 * mm, preload=2e4)
    parts = {0.0: pair, 60 * mm: pair}
    box = box_of(fast=parts, slow=parts)
    chosen, nonlinear = exugear.plan(box, load=LOAD), exugear.plan(box, load=LOAD, linear_bearings=[])
    assert chosen.linear == ("fast", "slow")
    assert "they are linear in runs" in chosen.bearings["fast"]
    assert nonlinear.linear == ()
    options = {"speed": (60.0, 120.0), "load": LOAD, "duration": 0.05, "displacement": True, "power": True, "checks": 0}
    by_run = [exugear.run_up(exugear.build(box, plan=plan), **options) for plan in (chosen, nonlinear)]
    lives = [exugear.bearing_life(run, box)["life"].values for run in by_run]
    assert lives[0] == pytest.approx(lives[1], rel=1e-3)
    linear, exact = (run.data.isel(time=run.data["time"] > 0.02) for run in by_run)
    assert float(linear["dte"].std()) == pytest.approx(float(exact["dte"].std()), rel=2e-3)
    forces, of_exact = (data["bearing_force"].sel(direction=["x", "y"]).std("time").values for data in (linear, exact))
    assert forces == pytest.approx(of_exact, rel=3e-3)
    assert by_run[0].energy_balance().relative < 2e-6


def test_only_rolling_bearings_of_plain_stages_can_be_taken_as_linear():
    assert exugear.plan(gearbox()).linear == ()
    with pytest.raises(ValueError, match=r"linear_bearings must name shafts on rolling bearings, got \['other'\]"):
        exugear.plan(gearbox(), linear_bearings=["other"])


def test_a_load_that_pulls_bearings_apart_is_refused_in_words():
    ball = exugear.RollingBearing.angular_contact(**ANGULAR)
    parts = {0.0: ball, 60 * mm: ball}
    model = exugear.build(box_of(fast=parts, slow=parts))
    with pytest.raises(ValueError, match="apart"):
        exugear.run_up(model, speed=(60.0, 70.0), load=LOAD, duration=0.01)
