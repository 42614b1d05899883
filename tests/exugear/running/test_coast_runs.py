"""Runs on unlike flanks: drive and coast in one run, against the pair mirrored by hand; what plan and run say."""

from dataclasses import replace

import numpy as np
import pytest
from coarse_maps import COARSE
from helical_gears import helical
from paper_gears import paper_gear

import exugear
import fem
from fem.units import mm, rpm, um

LOADS = [0, 20, 60, 120, 250, 500]
SLICES = fem.Slices(COARSE.density, 8)
SPUR = fem.GearPair(paper_gear(flank=fem.Sides((), (fem.TipRelief(20 * um, 3 * mm),))), paper_gear(), a=150 * mm)
HELICAL = fem.GearPair(helical(1, flank=(fem.HelixSlope(12 * um),)), helical(-1), a=150 * mm)


def by_hand(pair: fem.GearPair) -> fem.GearPair:
    """The pair in a mirror in the plane of its axes."""
    gears = (
        replace(gear, beta=-gear.beta, flank=fem.Sides(gear.coast_flank, gear.drive_flank))
        for gear in (pair.pinion, pair.wheel)
    )
    return fem.GearPair(*gears, a=pair.a)


def ste_of(pair, torque, phases):
    return fem.static_transmission_error(pair, torque, phases, resolution=SLICES, progress=False)


def model_of(ste) -> exugear.Model:
    pair = fem.pair_of(ste)
    fast, slow = exugear.Shaft("fast", {0.0: pair.pinion}), exugear.Shaft("slow", {0.0: pair.wheel})
    return exugear.build(exugear.Gearbox([exugear.Stage(fast, slow, ste, damping=4000.0, backlash=25 * um)]))


def peak_to_peak(run, start: float, end: float) -> float:
    time, dte = run.data["time"].values, run.data["dte"].values[0]
    return float(np.ptp(dte[(time > start) & (time < end)]))


@pytest.mark.parametrize("pair", [SPUR, HELICAL])
def test_drive_and_coast_in_a_run_are_those_of_the_pair_and_of_its_mirror_image(pair):
    phase = np.arange(20) / 20
    both = ste_of(pair, [-load for load in LOADS[:0:-1]] + LOADS, phase)
    mirror = ste_of(by_hand(pair), LOADS, np.sort((pair.back_phase - phase) % 1.0))
    times, options = [0, 0.03, 0.06, 0.1], {"checks": 0, "progress": False, "sample": 1e-5}
    load = np.array(times), np.array([100.0, 100.0, -100.0, -100.0])
    model = model_of(both)
    assert "coast flank by the torques < 0 of the map" in str(model.plan)
    run = exugear.run_up(model, speed=1200 * rpm, load=load, duration=0.1, power=True, **options)
    balance = run.energy_balance()
    assert abs(balance.residual) < 2e-4 * (abs(balance.stored) + sum(balance.losses.values()))
    single = options | {"duration": 0.03, "load": 100.0, "power": True}
    drive = exugear.run_up(model_of(both.sel(torque=slice(0, None))), speed=1200 * rpm, **single)
    coast = exugear.run_up(model_of(mirror), speed=-1200 * rpm, **single)
    assert peak_to_peak(run, 0.02, 0.03) == pytest.approx(peak_to_peak(drive, 0.02, 0.03), rel=1e-3)
    assert peak_to_peak(run, 0.09, 0.1) == pytest.approx(peak_to_peak(coast, 0.02, 0.03), rel=1e-3)


@pytest.mark.parametrize(
    ("pair", "reason"), [(SPUR, "left and right flanks differ"), (HELICAL, "not the same on both halves of the width")]
)
def test_plan_and_run_say_where_the_mirror_image_does_not_hold(pair, reason):
    model = model_of(ste_of(pair, LOADS, 8))
    assert reason in str(model.plan)
    options = {"speed": 1200 * rpm, "duration": 2e-3, "checks": 0, "progress": False}
    exugear.run_up(model, load=100.0, **options)
    with pytest.warns(UserWarning, match=reason) as of_run:
        exugear.run_up(model, load=-100.0, **options)
    with pytest.warns(UserWarning, match=reason) as of_modes:
        exugear.modes(model, load=-100.0)
    assert [warning.filename for warning in (*of_run, *of_modes)] == [__file__, __file__]


def test_spur_gears_with_equal_sides_spin_on_their_mirror_image():
    pair = fem.GearPair(paper_gear(flank=(fem.HelixSlope(4 * um),)), paper_gear(), a=150 * mm)
    model = model_of(ste_of(pair, LOADS, 8))
    assert "mirror image" not in str(model.plan)
    exugear.run_up(model, speed=1200 * rpm, load=-100.0, duration=2e-3, checks=0, progress=False)
