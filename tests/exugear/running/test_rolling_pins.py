"""Planets on needle bearings: balance of forces and energy, life, words for what is not built."""

import numpy as np
import pytest
from planetary_boxes import GEAR, NEEDLE, helical_box, planar_box, planetary

import exugear
from exugear import RollingBearing
from fem.units import mm, um

OPTIONS = {"progress": False, "checks": 0}


@pytest.mark.parametrize(("held", "driving"), [("ring", "sun"), ("carrier", "sun"), ("ring", "carrier")])
@pytest.mark.parametrize("box_of", [planar_box, helical_box], ids=["spur", "helical"])
def test_energy_is_balanced_on_needle_bearings(box_of, held, driving):
    model = exugear.build(box_of(pin=NEEDLE, held=held, driving=driving))
    run = exugear.run_up(model, speed=(50.0, 60.0), load=200.0, duration=0.004, power=True, **OPTIONS)
    assert run.energy_balance().relative < 1e-8
    assert float(run.data["mesh_force"].min()) > 0


def test_needle_bearings_push_the_planets_by_the_torque_of_the_carrier():
    box = planar_box(pin=NEEDLE)
    run = exugear.run_up(exugear.build(box), speed=20.0, load=200.0, duration=2e-3, displacement=True, **OPTIONS)
    data = run.data.sel(bearing=[x for x in run.data["bearing"].values if "planet" in x])
    tangential = data["bearing_force"].sel(direction="y").sum("bearing").mean("time")
    assert -float(tangential) * 90 * mm == pytest.approx(200.0, rel=0.01)
    each = data["bearing_force"].isel(bearing=0, time=0).values
    moved = data["bearing_displacement"].isel(bearing=0, time=0).values
    on_pin = NEEDLE.on_pin().under((*-each[:2], 0.0, 0.0, 0.0))
    assert moved[:2] == pytest.approx(on_pin.displacement[:2], rel=1e-3, abs=1e-9)
    assert np.hypot(*moved[:2]) > 5 * um


def test_the_life_of_needles_is_that_of_their_load():
    box = planar_box(pin=NEEDLE)
    run = exugear.run_up(exugear.build(box), speed=20.0, load=200.0, duration=2e-3, displacement=True, **OPTIONS)
    lives = exugear.bearing_life(run, box)
    label = lives["bearing"].values[0]
    force = -run.data["bearing_force"].sel(bearing=label).mean("time").values
    assert float(lives["life"][0]) == pytest.approx(NEEDLE.on_pin().under((*force[:2], 0, 0, 0)).life, rel=0.05)
    against_carrier = box.ratios[label.split(" at")[0]] - box.ratios["carrier"]
    hours = lives["life"] / (20.0 * abs(against_carrier) / (2 * np.pi)) / 3600
    assert lives["hours"].values == pytest.approx(hours.values, rel=1e-3)


def test_hours_of_life_count_the_speeds_of_the_run_where_several_are_free():
    """Needles that turn at 6 instead of 9 rad/s against the carrier live 1.5 times as many hours under one load."""
    box = exugear.Gearbox([planetary(pin=NEEDLE)], speeds={"sun": 1.0, "ring": -0.2})
    model, hours, lives = exugear.build(box), [], []
    for speeds in ({"sun": 10.0, "ring": 2.0}, {"sun": 10.0, "ring": -2.0}):
        conditions = {"drives": speeds, "loads": {"carrier": 200.0}, "duration": 2e-3, "displacement": True}
        of_run = exugear.bearing_life(exugear.run(model, **conditions, power=True, **OPTIONS), box)
        hours, lives = [*hours, of_run["hours"].values], [*lives, of_run["life"].values]
    against_carrier = np.array([10.0 - (30 * 10.0 - 90 * 2.0) / 120, 10.0 - (30 * 10.0 + 90 * 2.0) / 120])
    expected = np.array(lives) / (against_carrier[:, None] / (2 * np.pi)) / 3600
    assert np.array(hours) == pytest.approx(expected, rel=1e-3)
    with pytest.raises(ValueError, match="run it with power=True"):
        exugear.bearing_life(exugear.run(model, **conditions, **OPTIONS), box)


def test_a_sun_on_a_preloaded_bearing_carries_nothing_under_equal_planets():
    """The forces of the planets add up to their rounding, which is no load that a bearing has to carry."""
    tight = RollingBearing.deep_groove(Z=9, D_w=15 * mm, D_pw=60 * mm, clearance=-2 * um, damping_time=2e-5)
    model = exugear.build(planar_box(sun_bearing=tight))
    run = exugear.run_up(model, speed=20.0, load=200.0, duration=2e-3, **OPTIONS)
    assert np.abs(run.data["bearing_force"].sel(bearing="sun at 0 mm").values).max() < 1e-6
    assert float(run.data["mesh_force"].sel(stage="sun-planet 1").mean()) == pytest.approx(
        200.0 / 4 / 3 / GEAR.r_b, rel=0.01
    )


def test_a_sun_that_its_bearing_leaves_loose_is_told():
    """Equal planets do not load the sun: nothing presses the balls."""
    with_play = RollingBearing.deep_groove(Z=9, D_w=15 * mm, D_pw=60 * mm, clearance=5 * um, damping_time=2e-5)
    model = exugear.build(planar_box(sun_bearing=with_play))
    with pytest.raises(ValueError, match=r"bearings of 'sun' .* loose .* preload \(clearance < 0\)"):
        exugear.run_up(model, speed=20.0, load=200.0, duration=2e-3, **OPTIONS)


def test_modes_of_a_set_on_needles_lie_below_those_on_stiff_pins():
    modes = [
        exugear.modes(exugear.build(planar_box(pin=pin)), load=200.0)["frequency"].values
        for pin in (NEEDLE, exugear.Bearing(1e9, 1e9, 1e6))
    ]
    assert modes[0][:6].max() < modes[1][:6].max()
    assert (modes[0] > 0).all()


@pytest.mark.parametrize(
    ("pin", "remedy"),
    [
        (RollingBearing.needle(Z=18, D_w=3 * mm, D_pw=25 * mm, L_we=20 * mm), "guidance= of its washers"),
        (NEEDLE.rolling(), "leave rolling"),
    ],
)
def test_what_pins_cannot_have_is_refused_in_words(pin, remedy):
    with pytest.raises(ValueError, match=remedy):
        planar_box(pin=pin, planet=GEAR)
