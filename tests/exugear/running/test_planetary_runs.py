"""Runs of planetary sets whose members spin: torques, energy, parts, shares of the planets, other members driving."""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from math import cos, pi

import numpy as np
import pytest
from planetary_boxes import (
    GEAR,
    PIN,
    RING_PAIR,
    SUN_PAIR,
    helical_box,
    members,
    planar_box,
    planetary,
    planetary_box,
    published_set,
    waving_law,
)

import exugear
import fem
from fem.units import deg, mm, um


@pytest.fixture(scope="module")
def model():
    return exugear.build(planetary_box())


def test_a_steady_run_balances_the_torques_of_all_members(model):
    """Sun, carrier and ring in the ratio of their teeth, to 1e-10, on meshes of constant stiffness without ripple."""
    steady = exugear.build(planetary_box(law=waving_law(amplitude=0.0)))
    data = exugear.run_up(steady, speed=100.0, load=400.0, duration=0.02, progress=False, checks=0).data
    sun, ring, carrier = data["drive_torque"], data["reaction_torque"], -data["load_torque"]
    assert float(np.abs(sun + ring + carrier).max()) < 1e-10 * 400
    assert float(np.abs(sun - 100.0).max()) < 1e-10 * 400
    assert data["planet"].values.tolist() == [f"planet {k}" for k in (1, 1, 2, 2, 3, 3)]
    assert data["member"].values.tolist() == ["sun", "ring"] * 3
    assert float(data["mesh_frequency"][0, 0]) == pytest.approx(75.0 * 30 / (2 * np.pi))


@pytest.mark.parametrize(("driving", "held"), [("sun", "carrier"), ("carrier", "ring"), ("ring", "sun")])
def test_energy_is_balanced_whichever_member_drives(driving, held):
    """The orbiting planets turn with the carrier; its imposed speed rises."""
    built = exugear.build(planetary_box(held=held, driving=driving, planets=4))
    options = {"duration": 0.01, "progress": False, "checks": 0, "power": True}
    run = exugear.run_up(built, speed=(50.0, 60.0), load=300.0, **options)
    assert run.energy_balance().relative < 1e-8
    assert float(run.data["mesh_force"].min()) > 0


def test_a_free_set_accelerates_as_a_rigid_one(model):
    """J_c counts with the planets' masses on their circle: omega' = (T_s - T_c / 4) / sum J i^2."""
    drives, loads = {"sun": exugear.Torque(100.0)}, {"carrier": 300.0}
    options = {"duration": 0.01, "start_speed": 50.0, "progress": False, "checks": 0, "power": True}
    run = exugear.run(model, drives=drives, loads=loads, **options)
    inertia = 3 * (GEAR.mass * SUN_PAIR.a**2 / 16 + GEAR.inertia / 4) + GEAR.inertia + 0.02 / 16
    speed = run.data["shaft_speed"].sel(shaft="sun")
    assert float(speed[-1]) == pytest.approx(50.0 + 25.0 / inertia * 0.01, rel=1e-4)
    assert run.energy_balance().relative < 1e-8
    assert float(run.data["shaft_speed"].sel(shaft="ring").max()) == 0.0


def test_parts_of_a_run_give_the_serial_run(model):
    options = {"speed": (50.0, 80.0), "load": 300.0, "duration": 0.4, "progress": False, "checks": 0}
    serial = exugear.run_up(model, **options).data
    with ProcessPoolExecutor(2) as executor:
        parts = exugear.run_up(model, **options, executor=executor).data
    assert float(np.abs(parts["dte"] - serial["dte"]).max()) < 1e-6 * float(serial["dte"].std())


@pytest.mark.parametrize("shift", [10 * um, -10 * um])
def test_a_pin_displaced_against_the_force_on_it_gives_its_planet_more(shift):
    """(1 + (N - 1) X) / N and (1 - X) / N with X = k e / F, 1/k = 1 / (2 k_m cos^2 alpha); e > 0: behind."""
    box = planetary_box(law=waving_law(amplitude=0.0), pin_errors=(-shift, 0.0, 0.0))
    data = exugear.run_up(exugear.build(box), speed=10.0, load=4000.0, duration=1e-3, progress=False, checks=0).data
    forces = data["mesh_force"].values[:, -1].reshape(3, 2).sum(axis=1)
    k, total = 2 * 5e8 * cos(SUN_PAIR.alpha_wt) ** 2, forces.sum() * cos(SUN_PAIR.alpha_wt)
    x = k * shift / total
    expected = [(1 + 2 * x) / 3, (1 - x) / 3, (1 - x) / 3]
    assert forces / forces.sum() == pytest.approx(expected, abs=2e-3)


def test_a_stage_behind_the_carrier_runs_with_the_set():
    wheel_shaft = exugear.Shaft("out", {60 * mm: GEAR})
    carrier = exugear.Shaft("carrier", {60 * mm: GEAR}, inertia=0.02)
    stage = exugear.Stage(carrier, wheel_shaft, waving_law(), pair=SUN_PAIR)
    box = exugear.Gearbox([planetary(**members() | {"carrier": carrier}), stage], held="ring")
    options = {"progress": False, "checks": 0, "power": True}
    run = exugear.run_up(exugear.build(box), speed=(50.0, 60.0), load=100.0, duration=0.01, **options)
    assert run.energy_balance().relative < 1e-8
    assert run.data["planet"].values.tolist()[-1] == ""
    assert float(run.data["mesh_force"].sel(stage="carrier-out").mean()) == pytest.approx(100.0 / GEAR.r_b, rel=0.1)


def test_held_members_take_no_drive_and_no_load(model):
    with pytest.raises(ValueError, match=r"shafts \['ring'\] are held by the gearbox and take the reaction torque"):
        exugear.run(model, drives={"sun": 50.0}, loads={"ring": 10.0}, duration=0.01)
    with pytest.raises(ValueError, match="no shaft 'ring'"):
        exugear.run(model, drives={"sun": 50.0}, stop=[exugear.SpeedReached("ring", 1.0)], duration=0.01)


@pytest.mark.parametrize(
    ("driving", "held"), [("sun", "ring"), ("sun", "carrier"), ("ring", "sun"), ("carrier", "ring")]
)
def test_energy_is_balanced_on_elastic_pins(driving, held):
    """Planets move in the plane; sun, ring and carrier on bearings."""
    built = exugear.build(planar_box(held=held, driving=driving, bearings=PIN))
    options = {"duration": 0.01, "progress": False, "checks": 0, "power": True}
    run = exugear.run_up(built, speed=(50.0, 60.0), load=100.0, **options)
    assert run.energy_balance().relative < 1e-8
    assert {"planet 1 at 0 mm", "carrier at 0 mm"} <= set(run.data["bearing"].values.tolist())


def test_pins_carry_the_load_of_the_carrier_and_the_centrifugal_force():
    """Steady on constant stiffness: radially m W^2 (a + d), tangentially the load over N a; all torques balance."""
    model = exugear.build(planar_box(law=waving_law(amplitude=0.0)))
    options = {"duration": 0.01, "power": True, "tolerance": 1e-4, "progress": False, "checks": 0}
    data = exugear.run_up(model, speed=400.0, load=400.0, **options).data
    force = data["bearing_force"].sel(bearing="planet 2 at 0 mm").isel(time=-1)
    radial, tangential = (float(force.sel(direction=x)) for x in ("x", "y"))
    d, a = -radial / 1e8, SUN_PAIR.a
    assert radial == pytest.approx(-GEAR.mass * 100.0**2 * (a + d), rel=1e-3)
    assert tangential == pytest.approx(-400.0 / (3 * a), rel=1e-3)
    total = data["drive_torque"] + data["reaction_torque"] - data["load_torque"]
    assert float(np.abs(total).max()) < 1e-9 * 400
    assert float(np.abs(data["drive_torque"] - 100.0).max()) < 1e-9 * 100


@pytest.mark.parametrize("box", [planar_box, helical_box])
def test_torques_balance_throughout_a_steady_run_on_pins(box):
    """To 1e-10, by default as with the energy books; orbits start without a kick, in segments of any length."""
    model, options = exugear.build(box(law=waving_law(amplitude=0.0))), {"progress": False, "checks": 0}
    for accuracy in ({"duration": 0.01}, {"duration": 0.05}, {"duration": 0.01, "power": True, "tolerance": 1e-4}):
        data = exugear.run_up(model, speed=100.0, load=400.0, **options, **accuracy).data
        total = data["drive_torque"] + data["reaction_torque"] - data["load_torque"]
        assert float(np.abs(total).max()) < 1e-10 * 400


@pytest.mark.parametrize(("planets", "floating"), [(4, False), (4, True), (3, True)])
def test_a_floating_sun_shares_the_load_of_a_displaced_pin(planets, floating):
    """Fixed sun (1 + (N-1) X)/N and (1 - X)/N; floating (1 + (N-3) X)/N, so that three planets stay equal."""
    bearing = exugear.Bearing(radial=1e5, axial=1e8, tilt=1e6) if floating else None
    box = planar_box(bearing, waving_law(amplitude=0.0), planets=planets, pin_errors=[-20 * um] + [0.0] * (planets - 1))
    data = exugear.run_up(exugear.build(box), speed=1.0, load=4000.0, duration=1e-4, progress=False, checks=0).data
    forces = data["mesh_force"].values[:, 0].reshape(planets, 2).sum(axis=1)
    cosine = cos(SUN_PAIR.alpha_wt)
    x = 20 * um / (1 / (2 * 5e8 * cosine**2) + 1 / 1e8) / (forces.sum() * cosine)
    shares = [1 - x] * planets if not floating else [1 - (planets - 3) * x] * planets
    shares[0] = 1 + (planets - 3 if floating else planets - 1) * x
    if floating and planets == 4:
        shares[2] = shares[0]
    assert forces / forces.sum() == pytest.approx(np.array(shares) / planets, abs=5e-4)
    table = exugear.planet_shares(data, member="ring")
    assert float(table["K_gamma"]) == pytest.approx(max(shares), abs=3e-3)
    assert float(np.abs(table["share"].sum("planet") - 1.0).max()) < 1e-12


@pytest.mark.parametrize("floating", [False, True])
def test_six_planets_share_the_load_of_a_displaced_pin(floating):
    """z 54/18/-90; the sun takes the mean of the errors, floating also what a displacement of it can: cos(psi_n)."""
    sun, planet = (fem.Gear(z=z, m_n=3 * mm, b=25 * mm, d_bore=z * mm) for z in (54, 18))
    pairs = {"sun_pair": fem.GearPair(sun, planet), "ring_pair": exugear.RingPair(planet, -90, a=-108 * mm)}
    bearing = [exugear.Bearing(radial=1e4, axial=1e8, tilt=1e6)] if floating else []
    shafts = {"sun": exugear.Shaft("sun", {0.0: [sun, *bearing]})}
    shafts["ring"] = exugear.Shaft("ring", {0.0: pairs["ring_pair"].wheel}, inertia=0.05, mass=5.0)
    late = [-10 * um] + [0.0] * 5
    box = planetary_box(law=waving_law(amplitude=0.0), planets=6, pin=PIN, pin_errors=late, **pairs, **shafts)
    data = exugear.run_up(exugear.build(box), speed=1.0, load=4000.0, duration=1e-4, progress=False, checks=0).data
    forces, cosine = data["mesh_force"].values[:, 0].reshape(6, 2).sum(axis=1), cos(pairs["sun_pair"].alpha_wt)
    x = 10 * um / (1 / (2 * 5e8 * cosine**2) + 1 / 1e8) / (forces.sum() * cosine)
    left = np.eye(6)[0] - 1 / 6 - (np.cos(np.arange(6) * pi / 3) / 3 if floating else 0.0)
    assert forces / forces.sum() == pytest.approx(1 / 6 + x * left, abs=5e-5)
    assert left[0] == pytest.approx(3 / 6 if floating else 5 / 6)
    assert float(exugear.planet_shares(data)["K_gamma"]) == pytest.approx(1 + 6 * x * left[0], abs=1e-3)


def test_planar_sets_are_refused_where_they_are_not_built():
    box = planar_box()
    with pytest.raises(ValueError, match=r"planets .* turn on ideal pins; give the set elastic ones"):
        exugear.plan(planar_box(pin=None))
    with pytest.raises(ValueError, match="ideal revolute joints, on which planets cannot orbit"):
        exugear.build(box, plan=exugear.plan(box).with_joints())


def test_planets_may_differ_one_by_one():
    """A softer mesh and a softer pin take load off their planets; the plan says what is held and what orbits."""
    soft = exugear.Bearing(radial=5e7, axial=1e8, tilt=1e6, damping_time=2e-5)
    laws = [waving_law(amplitude=0.0), waving_law(amplitude=0.0), waving_law(amplitude=0.0)]
    box = planar_box(sun_mesh=laws, pin=[soft, PIN, PIN], planet=[GEAR, GEAR, exugear.Shaft("odd", {0.0: GEAR})])
    model = exugear.build(box)
    assert "its spin stays 0, and it takes the reaction" in str(model.plan)
    assert "odd: 3 coordinates, planar body on elastic bearings (it has an elastic pin" in str(model.plan)
    data = exugear.run_up(model, speed=1.0, load=400.0, duration=1e-4, progress=False, checks=0).data
    shares = exugear.planet_shares(data)["mean_share"]
    assert float(shares[0]) < 0.32 < float(shares.sel(planet="odd"))


@pytest.mark.parametrize("damping", [{"damping": 2000.0}, {"damping_ratio": 0.06}])
def test_damping_of_a_set_is_that_of_its_stages(damping):
    stages = planetary(waving_law(damping=0.0), **damping).stages
    for stage in stages:
        share = stage.force.damping / stage.critical_damping
        given = stage.force.damping if "damping" in damping else share
        assert given == pytest.approx(next(iter(damping.values())))


def test_a_torque_support_takes_the_reaction():
    """Its spring is wound up by the torque that a held ring would take, and its energy counts."""
    parts = {0.0: [RING_PAIR.wheel, exugear.TorqueSupport(1e6, damping_time=1e-4)]}
    ring = exugear.Shaft("ring", parts, inertia=0.05, mass=5.0)
    box = exugear.Gearbox([planetary(waving_law(amplitude=0.0), ring=ring)])
    options = {"progress": False, "checks": 0, "power": True}
    run = exugear.run_up(exugear.build(box), speed=100.0, load=400.0, duration=0.01, **options)
    assert float(run.data["reaction_torque"][-1]) == pytest.approx(300.0, rel=1e-6)
    assert run.energy_balance().relative < 1e-9


def test_a_load_on_the_back_flanks_needs_backlash(model):
    with pytest.raises(ValueError, match="backlash must be finite for a load on the back flank of stage sun-planet 1"):
        exugear.run_up(model, speed=50.0, load=-400.0, duration=0.01, progress=False)


def test_stepped_planets_written_by_hand_run():
    """Two gears on each planet: ratio 1 + (30 / 30) (80 / 20) = 5; the torques follow."""
    small = fem.Gear(z=20, m_n=3 * mm, alpha_n=20 * deg, b=25 * mm, d_bore=20 * mm)
    outer = exugear.RingPair(small, -80, a=-90 * mm)
    ring = exugear.Shaft("ring", {60 * mm: outer.wheel}, inertia=0.05, mass=5.0)
    carrier, stages = members()["carrier"], []
    for number in range(3):
        planet = exugear.Shaft(f"planet {number + 1}", {0.0: GEAR, 60 * mm: small})
        place = {"angle": 2 * pi * number / 3 - (2 * pi if number == 2 else 0), "carrier": carrier}
        stages.append(exugear.Stage(members()["sun"], planet, waving_law(0.0), pair=SUN_PAIR, **place))
        stages.append(exugear.Stage(planet, ring, waving_law(0.0), pair=outer, **place))
    box = exugear.Gearbox(stages, held="ring")
    assert box.ratios["carrier"] == 1 / 5
    data = exugear.run_up(exugear.build(box), speed=50.0, load=500.0, duration=2e-3, progress=False, checks=0).data
    assert float(data["drive_torque"][-1]) == pytest.approx(100.0, rel=1e-9)
    assert data["member"].values.tolist() == ["sun", "ring"] * 3


def test_planets_in_sequence_cancel_the_mesh_harmonics_that_the_table_says():
    """Set of Shweiki et al., slow, small harmonics 1 to 3 of the stiffness: ripple of the sun against the carrier."""
    phase = np.arange(64) / 64
    ripple = sum(0.003 * np.cos(2 * pi * harmonic * phase) for harmonic in (1, 2, 3))
    law = exugear.MeshForce(phase, [0, 1 * mm], np.outer(5e8 * (1 + ripple), [0, 1 * mm]), damping=3e4)
    amplitudes = []
    for angles in ((0.0, 120 * deg, 240 * deg), (0.0, 126 * deg, 252 * deg)):
        box = planetary_box(law=law, angles=angles, **published_set())
        speed = 2 * pi * 20.0 / (21 * (1 - 21 / 120))
        options = {"progress": False, "checks": 0, "sample": 1e-4, "step": 1e-5}
        data = exugear.run_up(exugear.build(box), speed=speed, load=5000.0, duration=0.1, **options).data
        turn = (data["dte"][0] + data["dte"][1]).values[-501:-1]
        amplitudes.append(np.abs(np.fft.rfft(turn))[[1, 2, 3]])
    table = planetary(law, angles=angles, **published_set()).mesh_phases(3)
    assert amplitudes[1] / amplitudes[0] == pytest.approx(table["torque_sum"].values, abs=0.01)


def test_a_set_of_spins_drives_one_on_pins():
    """Ratio 4 x 4; each carrier bears what its planets leave, by contacts here and by pins there."""
    middle = exugear.Shaft("middle", {0.0: GEAR}, inertia=0.02)
    first = planetary(**members() | {"carrier": middle, "name": "first"})
    ring = exugear.Shaft("ring 2", {0.0: RING_PAIR.wheel}, inertia=0.05, mass=5.0)
    second = planetary(sun=middle, ring=ring, carrier=members()["carrier"], name="second", pin=PIN)
    box = exugear.Gearbox([first, second], held=("ring", "ring 2"))
    model = exugear.build(box)
    options = {"duration": 0.01, "progress": False, "checks": 0, "power": True}
    run = exugear.run(model, drives={"middle": (20.0, 25.0)}, loads={"sun": -25.0, "carrier": 400.0}, **options)
    assert run.energy_balance().relative < 1e-8
    assert run.data["reaction_torque"].sizes["held_end"] == 2
    inertia = sum(x * (box.ratios[name] / box.ratios["middle"]) ** 2 for name, x in box.inertias.items())
    assert float(run.data["drive_torque"].mean()) == pytest.approx(500.0 * inertia, rel=0.02)


@pytest.mark.slow
def test_planets_in_sequence_take_the_mesh_frequency_out_of_a_set_on_maps_of_finite_elements():
    """Maps by finite elements of sun and ring: planets in phase add up, in sequence they hardly excite the torque."""
    sun, planet = (fem.Gear(z=z, m_n=3 * mm, b=25 * mm, d_bore=30 * mm) for z in (21, 39))
    ring = fem.Gear(z=-99, m_n=3 * mm, b=25 * mm, d_a=293.5 * mm, d_rim=340 * mm)
    pairs = fem.GearPair(sun, planet, a=90 * mm), fem.GearPair(planet, ring, a=90 * mm)
    options = {"torque": [0, 80, 160, 320], "phases": 12, "resolution": fem.Slices(), "progress": False}
    maps = [fem.static_transmission_error(pair, **options) for pair in pairs]
    carrier = exugear.Shaft("carrier", {}, inertia=0.05, mass=5.0)
    shafts = {"sun": exugear.Shaft("sun", {0.0: sun}), "ring": exugear.Shaft("ring", {0.0: ring}), "carrier": carrier}
    ripples = []
    for step in (120 * deg, 126 * deg):
        angles = (0.0, step, 2 * step)
        meshes = {"sun_mesh": maps[0], "ring_mesh": maps[1], "damping": 2000.0}
        box = exugear.Gearbox([exugear.Planetary(**shafts, **meshes, angles=angles)], held="ring")
        run = {"speed": 20.0, "load": 1000.0, "duration": 0.1, "power": True, "progress": False}
        slow = exugear.run_up(exugear.build(box), **run)
        assert slow.energy_balance().relative < 1e-6
        sun_torque = slow.data["drive_torque"].values
        assert sun_torque.mean() == pytest.approx(1000.0 * 21 / 120, rel=1e-3)
        cycles = 20.0 * (99 / 120) * 21 / (2 * pi) * slow.data["time"].values
        later = cycles > 0.5
        whole = later & (cycles < 0.5 + int(cycles[-1] - 0.5))
        ripples.append(abs(np.mean(sun_torque[whole] * np.exp(-2j * pi * cycles[whole]))))
    assert ripples[1] < 0.1 * ripples[0]


@pytest.mark.parametrize("pin", [None, PIN])
def test_a_thinner_planet_sheds_as_much_load_on_its_back_flanks(pin):
    """Its meshes have more backlash than their law, by as much as its teeth are thinner; as statics over the faces."""
    law = exugear.MeshForce([0.0, 0.5], [0, 1 * mm], np.full((2, 2), [0, 5e5]), damping=1500.0, backlash=100 * um)
    planets = [replace(GEAR, s_n=GEAR.s_n - 20 * um), GEAR, GEAR]
    model = exugear.build(planetary_box(law=law, pin=pin, planet=planets))
    backlash = [float(mesh.stage.force.backlash) for mesh in model.meshes]
    assert backlash == pytest.approx(np.add(100 * um, np.repeat([20 * um * cos(20 * deg), 0, 0], 2)), rel=1e-9)
    options = {"speed": 1.0, "duration": 1e-4, "progress": False, "checks": 0}
    forward, backward = (
        exugear.planet_shares(exugear.run_up(model, load=load, **options))["mean_share"] for load in (4000.0, -4000.0)
    )
    assert backward.values == pytest.approx(forward.values, rel=1e-4)
    assert float(backward[0]) < 0.33


@pytest.mark.parametrize("changes", [{}, {"pin": PIN}])
def test_sets_whose_planets_have_the_same_names_are_told_to_take_a_name(changes):
    """Also planets that are alike, which were taken for shafts of both sets: the train seemed to jam."""
    first = planetary(carrier=exugear.Shaft("carrier", {0.0: GEAR}))
    ring, out = replace(first.ring, name="second ring"), replace(members()["carrier"], name="out")
    second = {"sun": first.carrier, "ring": ring, "carrier": out} | changes
    ends = {"held": ("ring", "second ring"), "driving": "sun", "driven": "out"}
    with pytest.raises(ValueError, match=r"'carrier' and 'out' are named 'planet 1'; .*Planetary\(name=...\)"):
        exugear.Gearbox([first, planetary(**second)], **ends)
    assert exugear.Gearbox([first, planetary(**second, name="second")], **ends).ratios["out"] == pytest.approx(1 / 16)
