"""Runs with laws over several pitches: teeth that differ come into mesh at their time, in pairs, trains and sets."""

from dataclasses import replace

import numpy as np
import pytest
from planetary_boxes import PIN, RING_PAIR, STIFFNESS, SUN_PAIR, planar_box, planetary_box, waving_law
from scenes import smooth_law, smooth_map
from scipy.interpolate import CubicSpline
from unequal_teeth import ONCE_PER_TURN, law_with_error, map_over, once_per_turn, pair_of_unequal_teeth

import exugear
import fem
from fem.units import mm, rpm, um


@pytest.fixture(scope="module")
def pair():
    return pair_of_unequal_teeth()


@pytest.fixture(scope="module")
def ste(pair):
    return map_over(pair, 12)


def repeated(ste, pitches: int):
    """The map of a pitch, so many times over."""
    phase = (np.arange(pitches)[:, None] + ste["phase"].values).ravel()
    te = np.tile(ste["te"].values, (1, pitches))
    return fem.ste_map(fem.pair_of(ste), ste["torque"].values, phase, te, pitches=pitches)


def test_a_law_over_pitches_that_are_alike_is_that_of_a_single_pitch(tmp_path):
    single = smooth_law(damping=1000.0, backlash=20 * um)
    law = exugear.MeshForce.from_ste(repeated(smooth_map(), 5), damping=1000.0, backlash=20 * um)
    random = np.random.default_rng(1)
    phase, deflection = random.uniform(-40, 40, 500), random.uniform(-45 * um, 25 * um, 500)
    size = np.abs(single(phase, deflection)).max()
    assert law(phase, deflection, 1e-3) == pytest.approx(single(phase, deflection, 1e-3), abs=1e-12 * size)
    assert law.pitches == 5
    kept = exugear.MeshForce.load(law.save(tmp_path / "law.nc"))
    assert kept.pitches == 5
    assert kept.table.tobytes() == law.table.tobytes()


def one_turn(pair, mesh, *, bearing=None, speed: float = 100 * rpm, torque: float = 60.0, **stage):
    """A run at constant speed over a turn of the pinion, 60 samples in a pitch."""
    parts = {} if bearing is None else {-30 * mm: bearing, 30 * mm: bearing}
    fast, slow = (exugear.Shaft(name, {0.0: g} | parts) for name, g in (("fast", pair.pinion), ("slow", pair.wheel)))
    box = exugear.Gearbox([exugear.Stage(fast, slow, mesh, **{"damping_ratio": 0.1} | stage)])
    duration = 2 * np.pi / speed
    model, sample = exugear.build(box), duration / (60 * pair.pinion.z)
    options = {"duration": duration, "sample": sample, "step": sample / np.ceil(sample / 6e-6), "progress": False}
    loads = {"slow": torque * pair.wheel.z / pair.pinion.z}
    return exugear.run(model, drives={"fast": speed}, loads=loads, power=True, checks=0, **options)


def lines(values, phase, orders, teeth: int) -> np.ndarray:
    """Amplitudes at orders of a shaft, of values over its phases."""
    waves = np.exp(2j * np.pi * np.outer(orders, phase) / teeth)
    fit = np.linalg.lstsq(np.vstack([np.ones(phase.size), waves.real, waves.imag]).T, values)[0]
    return np.hypot(fit[1 : 1 + len(orders)], fit[1 + len(orders) :])


def test_pitch_errors_of_the_pinion_give_the_side_bands_of_the_static_map(pair, ste, measured):
    """At slow speed the DTE is the STE, with every tooth at its time; the energy balance closes."""
    run = one_turn(pair, ste)
    dte, phase = run.data["dte"].values[0], run.data["phase"].values[0]
    nodes, values = ste["phase"].values, ste["te"].sel(torque=60.0).values
    closed = np.append(nodes, nodes[0] + 12), np.append(values, values[0])
    te = CubicSpline(*closed, bc_type="periodic")(phase)
    measured("DTE at slow speed less the STE of the teeth in mesh, pitch errors", np.ptp(dte - te) / np.ptp(te), 5e-3)
    orders = [1, 11, 12, 13, 23, 24, 25]
    by_run, by_map = (lines(values, phase, orders, 12) for values in (dte, te))
    assert by_run == pytest.approx(by_map, abs=0.01 * um)
    assert by_map[0] == pytest.approx(ONCE_PER_TURN, rel=0.05)
    assert by_map[[1, 3]].min() > 0.02 * um
    balance = run.energy_balance()
    assert abs(balance.residual) < 1e-6 * balance.work_in


def test_gears_in_space_and_friction_follow_the_same_teeth(pair, ste):
    """On stiff bearings the DTE keeps the once-per-turn line, and friction over the pitches takes its torque."""
    bearing = exugear.Bearing(radial=1e10, axial=1e10, damping_time=1e-6)
    friction = exugear.MeshFriction.from_ste(ste, 0.05, torque=60.0)
    assert friction.pitches == 12
    run = one_turn(pair, ste, bearing=bearing, friction=friction, speed=400 * rpm)
    phase = run.data["phase"].values[0]
    amplitude = lines(run.data["dte"].values[0], phase, [1], 12)[0]
    assert amplitude == pytest.approx(ONCE_PER_TURN, rel=0.05)
    loss = float(run.data["friction_loss"].mean())
    single = exugear.MeshFriction.of_pair(pair, 0.05).loss(pair)
    assert loss == pytest.approx(single * 60.0 * 400 * rpm, rel=0.15)


def test_the_hunting_period_of_two_gears_is_a_law_over_all_pairs_of_teeth():
    """Deviations of both gears, once per turn of each: lines at 1 and 12/13 of the pinion's order."""
    pinion, wheel = once_per_turn(12), once_per_turn(13)
    error = [pinion[-n % 12] + wheel[n % 13] for n in range(156)]
    law = law_with_error(error)
    pair = pair_of_unequal_teeth(wheel=True)
    assert exugear.Gearbox(stage_of(pair, law)).phases == (0.0,)
    assert exugear.Gearbox(stage_of(pair, law, phase=40.25)).phases == (40.25,)
    first, hundredth = (law.deflection_at(n, 1000.0) for n in (0, 100))
    assert first == pytest.approx(2 * ONCE_PER_TURN + 1000 / STIFFNESS, abs=1e-12)
    assert hundredth == pytest.approx(pinion[-100 % 12] + wheel[100 % 13] + 1000 / STIFFNESS, abs=1e-12)


def stage_of(pair, law, **options):
    fast, slow = exugear.Shaft("fast", {0.0: pair.pinion}), exugear.Shaft("slow", {0.0: pair.wheel})
    return [exugear.Stage(fast, slow, law, pair=pair, **options)]


def test_an_idler_has_the_same_tooth_in_both_meshes():
    """A deviation of the idler, of 20 teeth, comes into its second mesh after the turn between the meshes."""
    gear = fem.Gear(z=20, m_n=2 * mm, b=20 * mm, d_bore=20 * mm, x=0.3)
    pair = fem.GearPair(gear, gear, a=fem.GearPair(gear, gear).a + 0.05 * mm)
    law = law_with_error(once_per_turn(20))
    shafts = [exugear.Shaft(name, {0.0: gear}) for name in ("in", "idler", "out")]
    for angle in (0.4, 2.0):
        first = exugear.Stage(*shafts[:2], law, pair=pair)
        box = exugear.Gearbox([first, exugear.Stage(*shafts[1:], law, pair=pair, angle=angle)])
        alike = exugear.Gearbox([first, exugear.Stage(*shafts[1:], waving_law(), pair=pair, angle=angle)])
        assert box.phases[1] % 1 == pytest.approx(alike.phases[1], abs=1e-9)
        turned = box.flank_senses[1] * (np.pi - angle) * 20 / (2 * np.pi)
        behind = (box.phases[1] - turned + 10) % 20 - 10
        assert abs(behind) < 1


@pytest.mark.parametrize(("flank", "told"), [((), False), ("pitch", True), ("sides", True), ("even", False)])
def test_the_plan_tells_an_idler_whose_flanks_differ_from_behind(flank, told):
    """It pushes with its right flanks, whose teeth count the other way: the map of its left ones is another gear."""
    relief = fem.TipRelief(10 * um, 1 * mm)
    deviation = np.random.default_rng(1).normal(0, 2 * um, 20)
    flanks = {"pitch": fem.PitchDeviation(deviation), "sides": fem.Sides((relief,)), "even": relief}
    gear = fem.Gear(z=20, m_n=2 * mm, b=20 * mm, d_bore=20 * mm, x=0.3)
    idler = replace(gear, flank=flanks.get(flank, ()))
    into, out = (
        fem.GearPair(*gears, a=fem.GearPair(gear, gear).a + 0.05 * mm) for gears in ((gear, idler), (idler, gear))
    )
    first, second, third = (
        exugear.Shaft(name, {0.0: x}) for name, x in (("in", gear), ("idler", idler), ("out", gear))
    )
    stages = exugear.Stage(first, second, waving_law(), pair=into), exugear.Stage(second, third, waving_law(), pair=out)
    lines = exugear.plan(exugear.Gearbox(stages)).axes
    assert ("other flanks than in in-idler, with tooth -k for tooth k" in lines["idler-out"]) == told
    assert "other flanks" not in lines["in-idler"]


@pytest.mark.parametrize(("planar", "sense"), [(False, 1), (True, -1)])
def test_every_planet_meets_the_ring_at_its_own_angle(planar, sense):
    """A run-out of the ring of 90 teeth passes each planet once per turn of the carrier, from tooth 0 on."""
    ring = law_with_error(once_per_turn(90))
    meshes = {"sun_mesh": waving_law(0.0), "ring_mesh": ring}
    stiff = {"pin": replace(PIN, radial=1e10), "sun_bearing": None}
    box = planar_box(**meshes, **stiff) if planar else planetary_box(**meshes)
    speed, turns = sense * 1200 * rpm, 0.1
    options = {"duration": turns * 8 * np.pi / abs(speed), "progress": False, "checks": 0, "power": True}
    run = exugear.run(exugear.build(box), drives={"sun": speed}, loads={"carrier": 4000.0}, **options)
    data, start = run.data, np.array(box.phases)[1::2]
    by_hand = exugear.planetary_phases(SUN_PAIR, RING_PAIR, pitches=(1, 90))
    assert start == pytest.approx(by_hand.ring)
    assert start == pytest.approx(start[0] + np.array([0, 30, 60]))
    carrier = data["time"].values * speed / 4
    for number, first in enumerate(start):
        mesh = data.isel(stage=2 * number + 1)
        error = ONCE_PER_TURN * np.cos(carrier + first * 2 * np.pi / 90)
        excess = mesh["dte"].values - mesh["mesh_force"].values / STIFFNESS
        assert excess == pytest.approx(error, abs=1e-3 * ONCE_PER_TURN)
    assert abs(run.energy_balance().residual) < 1e-6 * abs(run.energy_balance().work_out)
