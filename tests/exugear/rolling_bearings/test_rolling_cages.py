"""Cages that roll in runs: ball passing frequency and size of the variable compliance, energy, ribs, frequencies."""

import numpy as np
import pytest
from bearing_boxes import LAW, box_of
from helical_gears import helical
from rolling_bearings import ANGULAR, ROLLER, deep_groove
from scenes import linear_law

import exugear
import fem
from exugear import RollingBearing
from fem.units import deg, mm, um

QUIET = {"progress": False, "checks": 0}


def box_on(bearing: RollingBearing, law: exugear.MeshForce = LAW) -> exugear.Gearbox:
    """The paper's pair, each shaft on two of these bearings at equal distances from its gear."""
    ends = dict.fromkeys((0.0, 60 * mm), bearing)
    return box_of(law=law, fast=ends, slow=ends)


def test_the_outer_ring_is_passed_at_its_frequency_and_the_shaft_moves_as_in_statics():
    """Variable compliance: Z / 2 (1 - D_w / D_pw) times the speed, as far as statics differ under the mean load."""
    bearing, omega = deep_groove(20 * um, damping_time=1e-4).rolling(), 300.0
    row, duration = bearing.rows[0], 0.1
    law = linear_law()
    law = exugear.MeshForce(law.phase, law.deflection, law.force_table, damping=2700.0)
    run = exugear.run_up(
        exugear.build(box_on(bearing, law)),
        speed=omega,
        load=100.0,
        duration=duration,
        displacement=True,
        **QUIET,
    ).data.isel(bearing=0)
    force, moved = (run[name].sel(direction=["x", "y"]).values for name in ("bearing_force", "bearing_displacement"))
    passing = row.Z / 2 * (1 - 11.5 / 43.5) * omega / (2 * np.pi)
    assert bearing.orders["outer"] * omega / (2 * np.pi) == pytest.approx(passing)
    mean = -force.mean(axis=1)
    across = np.array([-mean[1], mean[0]]) / np.hypot(*mean)
    motion = across @ moved
    spectrum = np.abs(np.fft.rfft((motion - motion.mean()) * np.hanning(motion.size)))
    frequency = np.fft.rfftfreq(motion.size, float(np.diff(run["time"].values).mean()))
    assert frequency[spectrum.argmax()] == pytest.approx(passing, abs=0.6 / duration)
    angles = np.linspace(0, 2 * np.pi / row.Z, 24, endpoint=False)
    statics = [deep_groove(20 * um).rolling(x).under((*mean, 0, 0, 0)).displacement[:2] for x in angles]
    assert np.ptp(motion) == pytest.approx(np.ptp(np.array(statics) @ across), rel=0.1)


@pytest.mark.parametrize("kind", ["balls", "rollers"])
def test_books_close_while_cages_roll(kind):
    roller = RollingBearing.cylindrical_roller(**ROLLER, clearance=10 * um, guidance=1e8, damping_time=2e-5)
    bearing = roller if kind == "rollers" else deep_groove(10 * um, damping_time=2e-5)
    box = box_on(bearing.rolling(0.3))
    options = {"speed": (200.0, 300.0), "load": 100.0, "duration": 0.02, "step": 4e-6} | QUIET
    run = exugear.run_up(exugear.build(box), power=True, **options)
    assert run.energy_balance().relative < 2e-7


def test_a_cage_that_has_turned_by_a_pitch_is_as_before():
    bearing, force = deep_groove(10 * um), (800.0, 300.0, 200.0, 0.0, 0.0)
    pitch = 2 * np.pi / bearing.rows[0].Z
    before, after, between = (bearing.rolling(x).under(force).displacement for x in (0.0, pitch, pitch / 2))
    assert after == pytest.approx(before, rel=1e-9)
    assert np.abs(between - before).max() > 1e-7
    assert bearing.under(force).displacement == pytest.approx(before, rel=1e-9)


def test_frequencies_of_a_bearing_are_those_of_rolling():
    """The 6205 of Case Western Reserve University: 3.585, 5.415, 0.398 and 4.714 / 2 times the speed."""
    orders = RollingBearing.deep_groove(Z=9, D_w=7.94 * mm, D_pw=39.04 * mm).orders
    assert [orders[x] for x in ("outer", "inner", "cage", "element")] == pytest.approx(
        [3.585, 5.415, 0.3983, 4.7135 / 2], rel=1e-3
    )


def test_the_cage_of_a_bearing_on_a_pin_follows_its_outer_ring():
    """Elements pass the pin, which stands, as often as cage and elements say, and so the outer ring that turns."""
    bearing = RollingBearing.deep_groove(Z=9, D_w=7.94 * mm, D_pw=39.04 * mm)
    orders = bearing.on_pin().orders
    assert orders["cage"] == pytest.approx(1 - bearing.orders["cage"])
    assert 9 * orders["cage"] == pytest.approx(orders["inner"])
    assert 9 * (1 - orders["cage"]) == pytest.approx(orders["outer"])


def test_ribs_carry_along_the_axis():
    bearing = RollingBearing.cylindrical_roller(**ROLLER, guidance=2e7)
    loaded = bearing.under((1000.0, 0.0, -300.0, 0.0, 0.0))
    assert loaded.displacement[2] == pytest.approx(-300.0 / 2e7, rel=1e-9)
    assert loaded.force[2] == pytest.approx(-300.0)
    with pytest.raises(ValueError, match="guidance must be 0 or lie in"):
        RollingBearing.cylindrical_roller(**ROLLER, guidance=20.0)


def test_rings_that_part_in_a_run_are_told():
    """Both bearings hold the shaft against +z; the torque turns round, and with it the thrust."""
    gears = helical(1), helical(-1)
    ball = RollingBearing.angular_contact(**ANGULAR, direction=1, damping_time=2e-5)
    fast = exugear.Shaft("fast", {30 * mm: gears[0], 0.0: ball, 60 * mm: ball})
    slow = exugear.Shaft("slow", {30 * mm: gears[1], 0.0: exugear.Bearing(5e8, 1e8), 60 * mm: exugear.Bearing(5e8)})
    law = exugear.MeshForce(LAW.phase, LAW.deflection, LAW.force_table, damping=2700.0, backlash=100 * um)
    box = exugear.Gearbox([exugear.Stage(slow, fast, law, pair=fem.GearPair(*gears[::-1], a=150 * mm))])
    load = np.array([0.0, 2e-3, 4e-3, 0.012]), np.array([150.0, 150.0, -150.0, -150.0])
    with pytest.warns(UserWarning, match="their axial force is lost: .'fast at 0 mm': .* of the samples"):
        run = exugear.run_up(exugear.build(box), speed=100.0, load=load, duration=0.012, **QUIET)
    parted = run.data["bearing_parted"]
    assert 0.2 < float(parted.sel(bearing="fast at 0 mm")) < 0.9
    assert float(parted.sel(bearing="slow at 0 mm")) == 0.0


def test_a_bearing_on_a_pin_is_the_bearing_seen_from_its_outer_ring():
    for bearing, force in (
        (RollingBearing.angular_contact(**ANGULAR), (300.0, -200.0, 900.0, 1.0, -2.0)),
        (deep_groove(10 * um), (300.0, -200.0, 100.0, 0.0, 0.0)),
    ):
        loaded, on_pin = bearing.under(force), bearing.on_pin().under(tuple(-x for x in force))
        assert on_pin.displacement == pytest.approx(-loaded.displacement, rel=1e-6, abs=1e-12)
        assert on_pin.loads[0] == pytest.approx(loaded.loads[0], rel=1e-5, abs=1e-6)


def test_a_ring_that_turns_against_the_load_lives_longer():
    """On a pin the inner ring stands under the load, which wears it at one position: Harris has V = 1.2 there."""
    bearing, force = deep_groove(), (2000.0, 0.0, 0.0, 0.0, 0.0)
    ratio = bearing.under(force).life / bearing.on_pin().under(force).life
    assert 1.05 < ratio < 1.2**3
    assert bearing.rolling(5 * deg).on_pin().cage_rolls
