"""Bearings whose seat another shaft carries: an output shaft that runs on a pilot bearing of the coaxial input."""

from math import pi

import numpy as np
import pytest
from paper_gears import paper_gear, paper_pair
from scenes import smooth_law

import exugear
import fem
from fem.units import mm

BALL = exugear.Bearing(radial=2e8, axial=1e8, damping_time=1e-5)
STIFF = exugear.Bearing(radial=5e12, axial=5e12)
PILOT = {("out", 130 * mm): ("fast", 130 * mm)}
OPTIONS = {"load": 100.0, "progress": False, "checks": 0, "step": 1e-5, "sample": 1e-5}


def rolling() -> exugear.RollingBearing:
    d = 11.5 * mm
    inner = {"Z": 7, "D_w": d, "D_pw": 43.5 * mm, "r_i": 0.52 * d, "r_e": 0.53 * d}
    return exugear.RollingBearing.deep_groove(**inner, clearance=0.0, damping_time=1e-5)


def reverted(pilot=BALL, on_fast=BALL, between=PILOT, sections: bool = False) -> exugear.Gearbox:
    """An input and an output shaft on one axis beside a countershaft."""
    along = {"sections": [(45 * mm, 130 * mm), (40 * mm, 10 * mm)]} if sections else {}
    fast = exugear.Shaft("fast", {0.0: on_fast, 40 * mm: paper_gear(), 100 * mm: on_fast}, **along)
    lay = exugear.Shaft("lay", {0.0: BALL, 40 * mm: paper_gear(), 170 * mm: paper_gear(), 210 * mm: BALL})
    out = exugear.Shaft("out", {130 * mm: pilot, 170 * mm: paper_gear(), 210 * mm: BALL})
    law = smooth_law(damping=2700.0)
    stages = [
        exugear.Stage(fast, lay, law, pair=paper_pair()),
        exugear.Stage(lay, out, law, pair=paper_pair(), angle=pi),
    ]
    return exugear.Gearbox(stages, between=between)


def unlike(pilot, on_fast=BALL) -> exugear.Gearbox:
    """The same with 50 and 70 teeth in the second stage, so that the output is slower than the input."""
    lay_gear, out_gear = (fem.Gear(z=z, m_n=2.5 * mm, b=23 * mm, d_bore=60 * mm) for z in (50, 70))
    fast = exugear.Shaft("fast", {40 * mm: paper_gear()} | ({0.0: on_fast, 100 * mm: on_fast} if on_fast else {}))
    lay = exugear.Shaft("lay", {0.0: BALL, 40 * mm: paper_gear(), 170 * mm: lay_gear, 210 * mm: BALL})
    out = exugear.Shaft("out", {130 * mm: pilot, 170 * mm: out_gear, 210 * mm: BALL})
    law = smooth_law(damping=2700.0)
    line = [0.0, 3e8 * mm]
    second = exugear.MeshForce([0.0, 0.5], [0.0, 1 * mm], [line, line], damping=2700.0)
    pair = fem.GearPair(lay_gear, out_gear, a=150 * mm)
    stages = [
        exugear.Stage(fast, lay, law, pair=paper_pair()),
        exugear.Stage(lay, out, second, pair=pair, angle=pi),
    ]
    return exugear.Gearbox(stages, between=PILOT)


def run_of(box: exugear.Gearbox, **options) -> exugear.Run:
    return exugear.run_up(exugear.build(box), **OPTIONS | {"speed": (60.0, 80.0), "duration": 0.02} | options)


def test_on_a_shaft_that_stands_the_seat_stands():
    short = {"duration": 2e-4, "step": 5e-7}
    on_shaft, on_ground = (run_of(reverted(on_fast=STIFF, between=x), **short).data for x in (PILOT, {}))
    others = [label for label in on_ground["bearing"].values if not label.startswith("fast")]
    on_shaft, on_ground = (x["bearing_force"].sel(bearing=others) for x in (on_shaft, on_ground))
    np.testing.assert_allclose(on_shaft, on_ground, atol=5e-4 * float(abs(on_ground).max()))


@pytest.mark.parametrize("sections", [False, True])
@pytest.mark.parametrize("pilot", [BALL, rolling(), rolling().rolling(0.1)])
def test_books_are_closed_and_the_bearing_loads_both_shafts(pilot, sections):
    run = run_of(reverted(pilot, sections=sections), power=True)
    balance = run.energy_balance()
    assert abs(balance.residual) < 2e-6 * abs(balance.work_in)
    start = run.data["bearing_force"].isel(time=0)
    on_ground = [label for label in start["bearing"].values if label != "out at 130 mm"]
    np.testing.assert_allclose(start.sel(bearing=on_ground).sum("bearing"), 0.0, atol=1e-4)
    assert float(abs(start.sel(bearing="out at 130 mm")).max()) > 100.0


def test_runs_and_statics_bear_alike():
    box = reverted(rolling())
    data = exugear.load_distribution(box, 100.0, mesh_stiffness=2e7)
    run = run_of(box, speed=10.0, duration=0.1, displacement=True).data.isel(time=slice(5000, None)).mean("time")
    for name in ("bearing_force", "bearing_displacement"):
        values = data[name].sel(bearing=run["bearing"])
        np.testing.assert_allclose(run[name], values, atol=0.01 * np.abs(values).max())


def test_elements_pass_the_load_of_a_pilot_bearing_by_the_speeds_of_both_rings():
    """The force turns with the load, which stands: balls pass it Z times per turn of the cage."""
    rings = {"fast": 300.0, "out": 300.0 * 50 / 70}
    run = run_of(unlike(rolling().rolling()), speed=rings["fast"], duration=0.4, displacement=True)
    moved = run.data["bearing_displacement"].sel(bearing="out at 130 mm").isel(time=slice(10000, None))
    radial = np.hypot(*(moved.sel(direction=x).values for x in "xy"))
    gamma = 11.5 / 43.5
    passing = 7 * ((1 - gamma) / 2 * rings["out"] + (1 + gamma) / 2 * rings["fast"]) / (2 * pi)
    spectrum = np.abs(np.fft.rfft((radial - radial.mean()) * np.hanning(radial.size)))
    frequencies = np.fft.rfftfreq(radial.size, float(moved["time"][1] - moved["time"][0]))
    near = np.abs(frequencies / passing - 1) < 0.3
    assert frequencies[near][spectrum[near].argmax()] == pytest.approx(passing, abs=2 * frequencies[1])


def test_life_counts_turns_of_the_rings_against_each_other():
    alike, differing = reverted(rolling()), unlike(rolling())
    lives = [exugear.bearing_life(run_of(box, displacement=True), box) for box in (alike, differing)]
    turning = 70.0 * (1 - 50 / 70) / (2 * pi)
    assert np.isnan(lives[0]["hours"].item())
    assert lives[1]["life"].item() / lives[1]["hours"].item() / 3600 == pytest.approx(turning, rel=1e-3)


def test_modes_are_lower_on_the_shaft_than_on_ground():
    on_shaft, on_ground = (exugear.modes(exugear.build(reverted(between=x)), load=100.0) for x in (PILOT, {}))
    assert float(on_shaft["frequency"][1]) < float(on_ground["frequency"][1])
    np.testing.assert_allclose(on_shaft["energy_share"].sum("element"), 1.0, atol=1e-6)


@pytest.mark.parametrize("sections", [False, True])
def test_drag_between_shafts_acts_by_the_difference_of_their_speeds(sections):
    """At a ratio of 1 there is no difference but by vibrations; on ground the same bearing brakes."""
    drag = exugear.Drag(viscous=1e-2)
    braked = exugear.Bearing(radial=2e8, axial=1e8, damping_time=1e-5, drag=drag)
    alike, on_ground = (run_of(reverted(braked, between=x, sections=sections), power=True) for x in (PILOT, {}))
    lost = [run.data["drag_loss"].sum("shaft").mean("time").item() for run in (alike, on_ground)]
    assert 0 < lost[0] < 0.01 * lost[1]
    assert abs(alike.energy_balance().residual) < 2e-6 * abs(alike.energy_balance().work_in)


def test_drag_between_shafts_of_unlike_speeds_is_lost_in_the_books():
    drag = exugear.Drag(constant=2.0, viscous=1e-3, speed=0.5)
    pilot = exugear.Bearing(radial=2e8, axial=1e8, damping_time=1e-5, drag=drag)
    run = run_of(unlike(pilot), power=True, duration=0.05)
    data, balance = run.data, run.energy_balance()
    against = data["shaft_speed"].sel(shaft="out") - data["shaft_speed"].sel(shaft="fast")
    assert float(abs(against).min()) > 10.0
    lost = 2.0 * np.tanh(abs(against) / 0.5) + 1e-3 * abs(against)
    np.testing.assert_allclose(data["drag_loss"].sum("shaft"), lost * abs(against), rtol=1e-9)
    torque = data["drag_torque"]
    np.testing.assert_allclose(torque.sel(shaft="out"), -torque.sel(shaft="fast"), rtol=1e-9)
    assert abs(balance.residual) < 2e-6 * abs(balance.work_in)


@pytest.mark.slow
def test_efficiency_counts_drag_between_shafts():
    drag = exugear.Drag(constant=2.0, viscous=1e-3, speed=0.5)
    pilot = exugear.Bearing(radial=2e8, axial=1e8, damping_time=1e-5, drag=drag)
    table = exugear.efficiency(unlike(pilot), speeds=[70.0], loads=[100.0], tolerance=1e-4, progress=False)
    against = 70.0 * (1 - 50 / 70)
    loss = float(table["loss"].sel(kind="drag").squeeze())
    assert loss == pytest.approx((2.0 + 1e-3 * against) * against, rel=1e-3)


@pytest.mark.parametrize(
    ("between", "words"),
    [
        ({("out", 140 * mm): ("fast", 130 * mm)}, "no bearing is out at 140 mm"),
        ({("lay", 0.0): ("fast", 0.0)}, "needs one axis"),
        ({("out", 130 * mm): ("input", 0.0)}, "no shafts"),
        ({("out", 130 * mm): ("out", 0.0)}, "its own shaft"),
        ({("fast", x * mm): ("out", x * mm) for x in (0, 100)} | {("out", x * mm): ("fast", 0.1) for x in (130, 210)},
         "carry one another alone"),
        ([("out", "fast")], "between must map"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_in_words(between, words):
    with pytest.raises(ValueError, match=words):
        reverted(between=between)


def test_a_cage_does_not_roll_on_a_shaft_that_only_spins():
    with pytest.raises(ValueError, match="rolls on shaft 'fast', too, which only spins; give 'fast' bearings"):
        exugear.build(unlike(rolling().rolling(), on_fast=None))


def test_an_elastic_shaft_needs_an_end_of_a_section_at_the_seat():
    with pytest.raises(ValueError, match="divide its section there"):
        reverted(between={("out", 130 * mm): ("fast", 123.456 * mm)}, sections=True)
