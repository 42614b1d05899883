"""Friction of stages and drag of shafts in runs: power balance, excitation of the bearings, signs, rest."""

from dataclasses import replace
from itertools import pairwise
from math import cos, sin

import numpy as np
import pytest
from friction_cases import MU
from measured_rows import deviation
from paper_gears import paper_gear, paper_pair
from planetary_boxes import GEAR, PIN, helical_box, planar_box, planetary_box
from scenes import linear_law, ran, smooth_box, smooth_stage

import exugear
from fem.units import mm, rpm, um

PAIR = paper_pair()
FRICTION = exugear.MeshFriction.of_pair(PAIR, MU)
BALL = exugear.Bearing(radial=2e8, axial=1e8, damping_time=1e-4)
SILENT = {"progress": False, "checks": 0}
PITCHES, OMEGA, LOAD = 2, 2.0, 150.0
MESH_PERIOD = 2 * np.pi / (OMEGA * PAIR.pinion.z)
#: Bearings of both shafts: none, or so that the bodies are planar or in space.
BEARINGS = {"spin": {}, "planar": {0 * mm: BALL, 60 * mm: BALL}, "space": {10 * mm: BALL, 60 * mm: BALL}}


def box(parts=None, friction=FRICTION, *, angle: float = 0.0, **data) -> exugear.Gearbox:
    """The paper's pair of constant stiffness, damped, with friction; data: of both shafts."""
    shafts = [exugear.Shaft(name, {30 * mm: paper_gear()} | (parts or {}), **data) for name in ("fast", "slow")]
    law = linear_law(reach=2e-3, backlash=50 * um)
    return exugear.Gearbox([exugear.Stage(*shafts, law, pair=PAIR, damping_ratio=0.06, friction=friction, angle=angle)])


def slow_run(gearbox: exugear.Gearbox, **changes):
    """Data of a run at constant low speed over whole mesh cycles, and the mean torque of the drive [N m]."""
    model = exugear.build(gearbox)
    data = ran(model, **{"speed": OMEGA, "load": LOAD, "duration": (1 + PITCHES) * MESH_PERIOD, "checks": 0} | changes)
    data = data.isel(time=slice(-int(PITCHES * MESH_PERIOD / data.attrs["sample"]), None))
    return data, float(data["drive_torque"].mean())


@pytest.mark.parametrize("bearings", BEARINGS)
def test_loss_of_a_slow_run_is_ohlendorfs(bearings):
    """The drive pays for it: drive less load is the loss; on bearings friction also excites them."""
    data, drive = slow_run(box(BEARINGS[bearings]))
    transmitted = float(data["mesh_force"].mean()) * PAIR.pinion.r_b * OMEGA
    loss = float(data["friction_loss"].mean())
    assert loss == pytest.approx(FRICTION.loss(PAIR) * transmitted, rel=5e-3)
    assert (drive - LOAD) * OMEGA == pytest.approx(loss, rel=5e-3)


@pytest.mark.parametrize("speed", [OMEGA, -OMEGA])
@pytest.mark.parametrize("load", [LOAD, -LOAD])
def test_friction_dissipates_for_each_sense_of_rotation_and_of_torque(speed, load):
    data, drive = slow_run(box(), speed=speed, load=load)
    assert np.sign(data["mesh_force"].mean()) == np.sign(load)
    loss = float(data["friction_loss"].mean())
    assert float(data["friction_loss"].quantile(0.1)) > 0
    assert loss == pytest.approx(FRICTION.loss(PAIR) * LOAD * OMEGA, rel=0.01)
    assert abs(drive * speed) - LOAD * OMEGA == pytest.approx(loss if load * speed > 0 else -loss, rel=0.02)


def test_losses_of_an_idler_gearbox_add_up():
    """Both stages rub, the idler is braked; a stage without friction records none."""
    names, drag = ("fast", "idler", "slow", "end"), exugear.Drag(0.4)
    parts = [{30 * mm: [paper_gear(), *[drag] * (name == "idler")]} for name in names]
    shafts, law = [exugear.Shaft(name, part) for name, part in zip(names, parts, strict=True)], linear_law(reach=2e-3)
    pairs, frictions = pairwise(shafts), (FRICTION, FRICTION, None)
    mesh = {"pair": PAIR, "damping_ratio": 0.06}
    stages = [exugear.Stage(*pair, law, friction=f, **mesh) for pair, f in zip(pairs, frictions, strict=True)]
    data, drive = slow_run(exugear.Gearbox(stages))
    lost = data["friction_loss"].mean("time").values
    assert lost == pytest.approx(FRICTION.loss(PAIR) * LOAD * OMEGA * np.array([1, 1, 0]), rel=0.02)
    drag_torque = data["drag_torque"].mean("time").values
    assert drag_torque == pytest.approx([0, float(drag.torque(OMEGA)), 0, 0], rel=1e-3)
    total = lost.sum() + float(data["drag_loss"].sum("shaft").mean())
    assert (drive - LOAD) * OMEGA == pytest.approx(total, rel=5e-3)


@pytest.mark.parametrize("bearings", BEARINGS)
@pytest.mark.parametrize("coefficient", [MU, exugear.XuFriction(20e-3, 0.4 * um)])
def test_energy_balance_closes_with_friction_and_drag(bearings, coefficient):
    friction, drag = exugear.MeshFriction.of_pair(PAIR, coefficient), exugear.BearingDrag(80 * mm, 3.0, 1e-4)
    model = exugear.build(box({**BEARINGS[bearings], 20 * mm: drag}, friction))
    step = model.plan.step() / 2
    given = {"speed": (20.0, 60.0), "load": LOAD, "duration": 0.1, "step": step, "sample": step}
    run = exugear.run_up(model, **given, power=True, progress=False, checks=0)
    balance = run.energy_balance()
    assert balance.losses["friction_loss"] > 0.1
    assert balance.losses["drag_loss"] > 0.1
    assert balance.relative < 1e-6


def test_friction_of_displaced_shafts_that_only_spin():
    """Shafts displaced along their axes as one: the same mesh, by the kernel of bodies in space."""
    expected, _ = slow_run(box())
    data, _ = slow_run(box(offset=exugear.Placement(z=20 * um)))
    for name in ("friction_loss", "friction_force", "mesh_force"):
        largest = float(abs(expected[name]).max())
        assert data[name].values == pytest.approx(expected[name].values, rel=1e-4, abs=1e-4 * largest)


def test_without_friction_the_run_is_the_same():
    plain, none = (
        slow_run(box(BEARINGS["planar"], friction)) for friction in (None, exugear.MeshFriction.of_pair(PAIR, 0.0))
    )
    assert "friction_loss" not in plain[0]
    assert not none[0]["friction_loss"].any()
    for name in ("dte", "mesh_force", "bearing_force"):
        assert np.array_equal(plain[0][name], none[0][name])


@pytest.mark.parametrize("bearings", ["planar", "space"])
@pytest.mark.parametrize("angle", [0.0, 1.1])
def test_bearings_carry_the_friction_force_which_reverses_at_the_pitch_point(bearings, angle):
    """Across the line of action; friction on the wheel acts along z x n, n the direction of the mesh force."""
    data, _ = slow_run(box(BEARINGS[bearings], angle=angle))
    alpha = PAIR.alpha_wt
    across = np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]]) @ [-cos(alpha), sin(alpha)]
    forces = data["bearing_force"]
    on_wheel = forces.sel(bearing=[str(x) for x in forces["bearing"].values if x.startswith("slow")]).sum("bearing")
    reaction = on_wheel.sel(direction=["x", "y"]).values.T @ across
    friction = data["friction_force"].values[0]
    force = data["mesh_force"].values[0]
    assert np.sqrt(np.mean((reaction + friction) ** 2)) < 0.06 * np.sqrt(np.mean(friction**2))
    position = (data["time"].values / MESH_PERIOD + 0.5) % 1 - 0.5
    before, behind = (abs(position - x) < 0.05 for x in (-0.06, 0.06))
    for window, sense in ((before, -1), (behind, 1)):
        assert friction[window] == pytest.approx(sense * MU * force[window], rel=0.02)
        assert reaction[window].mean() == pytest.approx(-friction[window].mean(), rel=0.02)


@pytest.mark.parametrize("law", [exugear.SchlenkFriction(20e-3, 0.4 * um), exugear.XuFriction(20e-3, 0.4 * um)])
def test_coefficient_follows_load_and_speed_in_a_run(law):
    rubbing = exugear.MeshFriction.of_pair(PAIR, law)
    for load, speed in ((150.0, 40.0), (1500.0, 40.0), (1500.0, 160.0)):
        duration = 3 * OMEGA * MESH_PERIOD / speed
        data, _ = slow_run(box(friction=rubbing), load=load, speed=speed, duration=duration)
        force = float(data["mesh_force"].mean())
        expected = rubbing.loss(PAIR, force=force, speed=speed) * force * PAIR.pinion.r_b * speed
        assert float(data["friction_loss"].mean()) == pytest.approx(expected, rel=0.03)


def test_coast_down_by_drag_comes_to_rest_without_chatter(measured):
    """From 3500 rpm, J omega / M, the drag on the slow shaft alone; then the shafts stay at rest."""
    drag, speed = 15.0, 3500 * rpm
    shafts = [
        exugear.Shaft(name, {0.0: [paper_gear(), *parts]})
        for name, parts in (("fast", ()), ("slow", (exugear.Drag(drag),)))
    ]
    model = exugear.build(exugear.Gearbox([smooth_stage(*shafts, damping=2700.0)]))
    rest = 2 * shafts[0].inertia * speed / drag
    run = exugear.run(model, duration=1.2 * rest, start_speed=speed, progress=False, checks=0)
    time, slow = run.data["time"].values, run.data["shaft_speed"].sel(shaft="slow").values
    error = deviation(np.interp(-0.01 * speed, -slow, time), 0.99 * rest)
    measured("coast-down from 3500 rpm by a constant drag: time to a hundredth of the speed", error, 0.01)
    assert abs(run.data["shaft_speed"].values[:, time > 1.1 * rest]).max() < 1e-3 * speed
    kinetic = shafts[0].inertia * speed**2
    assert np.trapezoid(run.data["drag_loss"].sum("shaft"), time) == pytest.approx(kinetic, rel=2e-3)


def test_coast_down_by_palmgrens_drag():
    """J d(omega)/dt = -(a + b omega^(2/3)) integrated by hand, the drag on both shafts."""
    drag, speed = exugear.BearingDrag(150 * mm, 4.0, 200e-6, 1e-3, load=5000.0), 3500 * rpm
    shafts = [exugear.Shaft(name, {0.0: [paper_gear(), drag]}) for name in ("fast", "slow")]
    model = exugear.build(exugear.Gearbox([smooth_stage(*shafts, damping=2700.0)]))
    end = exugear.SpeedReached("fast", 0.05 * speed)
    run = exugear.run(model, duration=5.0, start_speed=speed, stop=[end], progress=False, checks=0)
    omega = np.linspace(0.05 * speed, speed, 10001)
    expected = np.trapezoid(shafts[0].inertia / drag.torque(omega), omega)
    assert float(run.data["time"][-1]) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("bearings", BEARINGS)
def test_drive_pays_for_the_drag(bearings):
    """Palmgren's on each bearing, by its force in the run; drive less load is what drag dissipates."""
    drag = exugear.BearingDrag(80 * mm, 3.0, 100e-6, 1e-3, load=None if bearings != "spin" else 500.0)
    parts = {axial: exugear.Bearing(2e8, 1e8, damping_time=2e-5, drag=drag) for axial in BEARINGS[bearings]}
    gearbox = box(parts or {0.0: drag}, None)
    data, drive = slow_run(gearbox, speed=20.0, duration=0.3 * MESH_PERIOD)
    assert list(data["drag_torque"]["shaft"].values) == ["fast", "slow"]
    lost = float(data["drag_loss"].sum("shaft").mean())
    assert (drive - LOAD) * 20.0 == pytest.approx(lost, rel=1e-2)
    forces = (
        [500.0]
        if bearings == "spin"
        else [LOAD / PAIR.pinion.r_b * share for share in ((0.5, 0.5) if bearings == "planar" else (0.6, 0.4))]
    )
    by_hand = sum(float(drag.torque(20.0, load)) for load in forces)
    assert float(data["drag_torque"].sel(shaft="fast").mean()) == pytest.approx(by_hand, rel=0.02)
    assert float(data["drag_torque"].sel(shaft="slow").mean()) == pytest.approx(by_hand, rel=0.02)


@pytest.mark.parametrize("bearings", BEARINGS)
def test_runs_with_drag_start_in_equilibrium(bearings):
    """Drags as large as the load at constant speed, and in a free train: the first samples do not ring."""
    model = exugear.build(box({**BEARINGS[bearings], 20 * mm: exugear.Drag(60.0, 0.5)}, None))
    held = ran(model, speed=100.0, load=LOAD, duration=0.01, checks=0)
    free = exugear.run(model, duration=0.01, loads={"slow": LOAD}, start_speed=100.0, progress=False, checks=0).data
    for data, force in ((held, LOAD + 110), (free, 0.5 * LOAD)):
        assert data["mesh_force"].values[0] == pytest.approx(force / PAIR.pinion.r_b, rel=0.02)


def test_drag_limits_the_speed_that_a_run_expects():
    """A drive that the drag balances has the step of its speed; without it the shaft runs away, in shorter steps."""
    drives, options = {"fast": exugear.Torque(200.0)}, {"duration": 0.1, "tolerance": 1e-5, "progress": False}
    model, free = (exugear.build(box(parts, None)) for parts in ({20 * mm: exugear.Drag(viscous=1.0)}, {}))
    braked, runaway = (exugear.run(x, drives=drives, checks=0, **options) for x in (model, free))
    assert float(braked.data["speed"][-1]) == pytest.approx(100.0, rel=1e-3)
    assert float(runaway.data["speed"][-1]) > 500.0
    assert braked.step == exugear.run_up(model, speed=100.0, load=100.0, checks=0, **options).step > 1.5 * runaway.step


def test_drag_of_nonlinear_bearings_follows_their_force():
    drag = exugear.BearingDrag(80 * mm, 0.0, 100e-6, 1e-3)
    loose = exugear.Bearing(2e8, 1e8, 1e5, damping_time=2e-5, clearance=5 * um, drag=drag)
    data, drive = slow_run(box({0 * mm: loose, 60 * mm: loose}, None), speed=20.0, duration=0.3 * MESH_PERIOD)
    expected = 1e-3 * 80 * mm * LOAD / PAIR.pinion.r_b
    assert float(data["drag_torque"].sel(shaft="fast").mean()) == pytest.approx(expected, rel=0.01)
    assert drive - LOAD == pytest.approx(2 * expected, rel=0.02)


def test_drag_by_the_force_of_a_bearing_needs_the_bearing():
    drag = exugear.BearingDrag(80 * mm, 3.0, 100e-6, 1e-3)
    ball = exugear.Bearing(2e8, 1e8, drag=drag)
    gearbox = box({0 * mm: ball, 60 * mm: ball})
    with pytest.raises(ValueError, match="is not known on ideal joints; pass load="):
        exugear.build(gearbox, plan=exugear.plan(gearbox).with_joints())


def test_plan_names_friction_and_drag_or_nothing():
    plain = str(exugear.plan(smooth_box()))
    assert "friction" not in plain
    assert "braked" not in plain
    text = str(exugear.plan(smooth_box(part=exugear.Drag(0.3), friction=FRICTION)))
    assert "fast-slow: friction between the teeth, coefficient 0.06, loss 0.40% of the power" in text
    assert "slow: braked by Drag(constant=0.3 N m)" in text
    oil = exugear.SchlenkFriction(0.02, 0.4 * um)
    by_law = smooth_box(friction=exugear.MeshFriction.of_pair(PAIR, oil))
    assert f"coefficient by {oil!r}" in str(exugear.build(by_law).plan)


def test_stages_refuse_other_friction():
    with pytest.raises(ValueError, match=r"friction must be an exugear.MeshFriction"):
        smooth_box(friction=0.06)


def dragged_set(kind: str, **changes) -> exugear.Gearbox:
    """A set whose planets a torque of 2 N m brakes on their pins."""
    drag = exugear.Drag(2.0)
    if kind == "ideal":
        return planetary_box(planet=exugear.Shaft("planet", {0.0: [GEAR, drag]}), **changes)
    box_of = helical_box if kind == "space" else planar_box
    return box_of(pin=replace(PIN, drag=drag), **changes)


@pytest.mark.parametrize("kind", ["ideal", "planar", "space"])
@pytest.mark.parametrize(("held", "driving"), [("ring", "sun"), ("ring", "carrier"), ("carrier", "sun")])
def test_drag_of_planets_brakes_them_on_their_carrier(kind, held, driving):
    """Power by their speeds against the carrier; torques on the whole set balance, as the pins take the reaction."""
    gearbox = dragged_set(kind, held=held, driving=driving)
    run = exugear.run_up(exugear.build(gearbox), speed=20.0, load=400.0, duration=5e-3, power=True, **SILENT)
    against_pin = 20.0 * abs(gearbox.ratios["planet 1"] - gearbox.ratios["carrier"])
    assert run.data["drag_loss"].sum("shaft").mean() == pytest.approx(3 * 2.0 * against_pin, rel=1e-3)
    assert run.energy_balance().relative < 1e-7
    means = run.data.mean("time")
    drive, load = (gearbox.directions[x.name] for x in (gearbox.driving, gearbox.driven))
    about_z = [drive * float(means["drive_torque"]), -load * 400.0, float(means["reaction_torque"])]
    assert sum(about_z) == pytest.approx(0.0, abs=0.2)


def test_a_drive_of_load_and_drag_of_planets_keeps_the_speed_of_a_free_set():
    """A quarter of the load, and the drags by the planets' turns against the carrier per turn of the sun, 3/4."""
    model = exugear.build(dragged_set("planar", held="ring"))
    ends = {"drives": {"sun": exugear.Torque(400.0 / 4 + 3 * 2.0 * 3 / 4)}, "loads": {"carrier": 400.0}}
    run = exugear.run(model, **ends, start_speed={"sun": 100.0}, duration=0.02, power=True, **SILENT)
    assert float(run.data["shaft_speed"].sel(shaft="sun")[-200:].mean()) == pytest.approx(100.0, abs=0.05)


def test_drag_by_the_load_of_a_pin_that_turns_is_refused():
    drag = exugear.BearingDrag(25 * mm, 2.0, 25e-6, 3e-4)
    with pytest.raises(ValueError, match="load of the BearingDrag of planet 'planet 1', whose pin turns"):
        planar_box(pin=replace(PIN, drag=drag))
    planar_box(pin=replace(PIN, drag=replace(drag, load=1500.0)))
    planar_box(pin=replace(PIN, drag=drag), held="carrier")
