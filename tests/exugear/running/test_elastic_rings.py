"""Runs of sets whose ring vibrates in modes: its flexibility counts once, and planets deflect one another by it."""

import re
from concurrent.futures import ProcessPoolExecutor
from math import pi

import numpy as np
import pytest
import xarray as xr
from elastic_rings import BOLTS, BUSH, box_on_ring, ring_map, ring_modes, ring_pair, set_on_ring
from planetary_boxes import PIN, waving_law
from ring_gears import COARSE, planet

import exugear
import fem
from fem.units import deg, mm

OPTIONS = {"progress": False, "checks": 0}
SUPPORTS = pytest.mark.parametrize("support", [BUSH, BOLTS], ids=["bush", "bolts"])


@pytest.fixture(scope="module")
def spinning() -> exugear.Model:
    """Three planets on ideal pins, the ring on a bush."""
    return exugear.build(box_on_ring())


def slow_run(support, planets: int) -> xr.Dataset:
    """A run so slow that the ring follows as in statics, at constant stiffness of the sun's mesh."""
    law = waving_law(0.0, damping=3e3)
    box = box_on_ring(support, sun_mesh=law, planets=planets)
    options = {"sample": 4e-5, "step": 4e-6, **OPTIONS}
    return exugear.run_up(exugear.build(box), speed=0.5, load=70.0 * planets, duration=0.02, **options).data


@SUPPORTS
def test_in_slow_motion_modes_and_their_map_are_the_map(support):
    """A planet alone: te of the whole map at the mesh force, with no flexibility lost or counted twice."""
    data = slow_run(support, 1).isel(stage=1)
    whole, phases, forces = exugear.MeshForce.from_ste(ring_map(support)), data["phase"].values, data["mesh_force"]
    static = [whole.deflection_at(p, f) for p, f in zip(phases[::50], forces.values[::50], strict=True)]
    modes = ring_modes(support)
    assert data["dte"].values[::50] == pytest.approx(static, rel=1e-5)
    assert float(modes["flexibility"].min()) * float(forces[0]) > 0.35 * static[0]


@SUPPORTS
def test_planets_deflect_one_another_by_the_rim(support):
    """te of a mesh: of its map, and the cross compliance sum g_i g_j / omega^2 of the modes times the other forces."""
    data, modes = slow_run(support, 3).isel(stage=slice(1, None, 2), time=-1), ring_modes(support)
    whole, forces = exugear.MeshForce.from_ste(ring_map(support)), data["mesh_force"].values
    around = np.append(modes["at"].values, 2 * pi)
    pitch = 2 * pi / 69
    first = pitch * float(data["phase"][0])
    angles = (first + np.arange(3) * 2 * pi / 3) % (2 * pi)
    soft = np.array([
        np.interp(angles, around, np.append(g, g[0])) / (2 * pi * f)
        for g, f in zip(modes["left_flank"].values, modes["frequency"].values, strict=True)
    ])  # fmt: skip
    between = soft.T @ soft
    alone = np.array([whole.deflection_at(p, f) for p, f in zip(data["phase"].values, forces, strict=True)])
    others = (between - np.diag(np.diag(between))) @ forces
    assert np.abs(others).min() > 0.005 * alone.min()
    assert data["dte"].values == pytest.approx(alone + others, rel=2e-5)


@pytest.mark.parametrize(
    ("support", "load", "options"),
    [(BUSH, 200.0, {}), (BOLTS, -200.0, {}), (BUSH, -200.0, {"pin": PIN}), (BOLTS, 200.0, {"pin": PIN})],
    ids=["bush-driving-spinning", "bolts-coast-spinning", "bush-coast-on pins", "bolts-driving-on pins"],
)
def test_energy_books_close(support, load, options):
    """On the driving and on the coast flanks, planets on ideal and on elastic pins; the speed rises."""
    model = exugear.build(box_on_ring(support, **options))
    run = exugear.run_up(model, speed=(50.0, 60.0), load=load, duration=0.004, power=True, **OPTIONS)
    assert run.energy_balance().relative < 2e-8
    assert "ring rim" in run.data["coupling"].values
    assert float((np.sign(load) * run.data["mesh_force"]).min()) > 0


def test_torques_balance_while_the_ring_stands(spinning):
    """At the start all amplitudes are static: sun, ring and carrier balance, and the ring's torque is that of gears.

    Amplitudes of the ring, whose support takes the torque, are recorded in single precision.
    """
    data = exugear.run_up(spinning, speed=1.0, load=200.0, duration=1e-4, **OPTIONS).data
    total = data["drive_torque"] + data["reaction_torque"] - data["load_torque"]
    assert abs(float(total[0])) < np.finfo(np.float32).eps * 200
    assert float(data["reaction_torque"][0]) == pytest.approx(200.0 * 69 / 90, rel=1e-3)


def test_the_housing_feels_the_ring_turn(spinning):
    """Its torque balances the angular momentum of all: J omega' of spins, and that of the turning mode."""
    model = spinning
    data = exugear.run_up(model, speed=150.0, load=200.0, duration=0.01, power=True, **OPTIONS).data
    time, modes = data["time"].values, ring_modes()
    sense = model.gearbox.flank_senses[1]
    momentum = -sense * modes["turning"].values @ data["ring_rate"].values
    by_meshes = sum(
        float(stage.pair.wheel.r_b) * data["mesh_force"].values[i] * model.gearbox.flank_senses[i]
        for i, stage in enumerate(model.gearbox.stages)
        if i % 2
    )
    expected = np.gradient(momentum, time) + by_meshes
    swing = np.ptp(np.gradient(momentum, time))
    assert swing > 0.05
    assert data["reaction_torque"].values[3:-3] == pytest.approx(expected[3:-3], abs=0.03 * swing)


def test_parts_of_a_run_give_the_serial_run(spinning):
    options = {"speed": (50.0, 60.0), "load": 200.0, "duration": 0.08, **OPTIONS}
    serial = exugear.run_up(spinning, **options).data
    with ProcessPoolExecutor(2) as executor:
        parts = exugear.run_up(spinning, **options, executor=executor).data
    assert float(np.abs(parts["dte"] - serial["dte"]).max()) < 1e-5 * float(serial["dte"].std())
    rates = np.abs(serial["ring_rate"]).max()
    assert float(np.abs(parts["ring_rate"] - serial["ring_rate"]).max()) < 1e-3 * float(rates)


def test_a_run_keeps_the_modes_of_its_ring(tmp_path):
    """Saved and read again a sensor finds them; displacement, velocity and acceleration are slopes of one another."""
    model = exugear.build(box_on_ring(BOLTS))
    run = exugear.run_up(model, speed=200.0, load=200.0, duration=0.01, sample=8e-6, **OPTIONS)
    run.save(tmp_path / "run.nc")
    data = exugear.Run.load(tmp_path / "run.nc").data
    assert data["ring_mode"].values.tolist() == [f"ring {i}" for i in range(1, 14)]
    for direction in ("radial", "tangential"):
        x, v, a = (
            exugear.RingSensor(30 * deg, direction=direction, quantity=quantity).signal(data)
            for quantity in ("displacement", "velocity", "acceleration")
        )
        assert [s.attrs["units"] for s in (x, v, a)] == ["m", "m/s", "m/s^2"]
        for value, slope in ((x, v), (v, a)):
            difference = np.gradient(value.values, x["time"].values)[2:-2] - slope.values[2:-2]
            assert np.abs(difference).max() < 0.05 * np.ptp(slope.values)


def test_the_report_lists_the_modes_of_the_ring(spinning, tmp_path):
    run = exugear.run_up(spinning, speed=100.0, load=200.0, duration=0.01, **OPTIONS)
    exugear.report(run, tmp_path / "ring.html")
    page = (tmp_path / "ring.html").read_text(encoding="utf-8")
    assert "Modes of the ring on its supports" in page
    assert f"{float(ring_modes()['frequency'][0]):.5g}" in page


def test_the_plan_tells_what_the_ring_does():
    with_modes, without = (
        str(exugear.plan(exugear.Gearbox([x], held="ring"))) for x in (set_on_ring(), set_on_ring(modes=False))
    )
    assert f"its ring vibrates in 13 modes of {float(ring_modes()['frequency'][0]):.4g} to" in with_modes
    assert "damping ratio 0.01" in with_modes and "of the bending of its rim" in with_modes
    assert "of which the modes leave out" in with_modes
    assert "skipped: bending of the ring between the planets" in without


@SUPPORTS
def test_the_plan_advises_modes_that_leave_out_as_little_as_it_tells(support):
    """Those of the least number below half a per cent, on bolts also."""
    listed = [ring_modes(support, number)["cross_left_out"].values for number in range(1, 14)]
    about = {"cross_compliance": ring_modes(support)["cross"].values, "cross_left_out": np.concatenate(listed)}
    told = ring_map(support).assign_attrs(about)
    words = str(exugear.plan(exugear.Gearbox([set_on_ring(support, modes=False, ring_mesh=told)], held="ring")))
    assert "another planet deflects a mesh by up to" in words
    advice = (
        r"Planetary\(ring_modes=fem.ring_modes\(ring_pair, (\d+)\)\) couples the meshes by it and leaves out ([0-9.]+)%"
    )
    number, share = re.search(advice, words).groups()
    for modes, below in ((int(number), True), (int(number) - 1, False)):
        box = box_on_ring(support, ring_modes=ring_modes(support, modes))
        left_out = float(re.search(r"of which the modes leave out ([0-9.]+)%", str(exugear.plan(box)))[1])
        assert (left_out < 0.5) is below
        if below:
            assert left_out == pytest.approx(float(share), rel=0.1)


def test_modes_of_the_gearbox_know_those_of_the_ring(spinning):
    """All coordinates have a mode; with stiff teeth far above, the rim alone has those of its finite elements."""
    plain = exugear.build(box_on_ring(modes=False))
    modes, without = (exugear.modes(model, load=200.0) for model in (spinning, plain))
    assert modes.sizes["mode"] == without.sizes["mode"] + 13
    of_ring = modes["kind"].values == "ring"
    assert of_ring.sum() >= 10
    shares = modes["energy_share"].sel(element="ring rim").values
    assert shares[of_ring].max() > 0.9
    assert modes["energy_share"].sum("element").values[modes["frequency"] > 1] == pytest.approx(1.0)
    alone = ring_modes()["frequency"].values
    nearest = np.abs(modes["frequency"].values[:, None] / alone - 1).min(axis=0)
    assert nearest[:3].max() < 0.25
    table = exugear.campbell(spinning, speed=(10.0, 100.0), load=200.0)
    assert table.sizes["mode"] == modes.sizes["mode"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"ring_mesh": waving_law(), "ring_pair": ring_pair()}, "got a MeshForce; pass the STE map"),
        ({"ring_modes": fem.ste_map}, "must be what fem.ring_modes"),
        ({"ring_damping_ratio": -0.1}, r"ring_damping_ratio must lie in \[0, 1\]"),
    ],
)
def test_modes_that_do_not_fit_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        set_on_ring(**changes)


def test_planets_in_space_see_the_ring_as_those_in_the_plane():
    """The unreduced set: the same mesh forces and amplitudes, and closed books."""
    box = box_on_ring(pin=PIN)
    options = {"speed": 100.0, "load": 200.0, "duration": 0.004, "sample": 4e-5, "step": 2e-6, "power": True, **OPTIONS}
    planar = exugear.run_up(exugear.build(box), **options)
    space = exugear.run_up(exugear.build(box, plan=exugear.plan(box).with_bodies()), **options)
    assert space.energy_balance().relative < 2e-8
    for name in ("dte", "ring_amplitude"):
        swing = float(np.ptp(planar.data[name].values))
        assert float(np.abs(space.data[name] - planar.data[name]).max()) < 1e-4 * swing


def test_a_ring_that_turns_or_stands_on_bearings_is_refused():
    of_set = set_on_ring()
    with pytest.raises(ValueError, match=r"ring 'ring' has modes, but turns; hold it"):
        exugear.Gearbox([of_set], held="carrier", driving="sun", driven="ring")
    bearing = exugear.Bearing(radial=1e8, axial=1e8, tilt=1e6)
    with pytest.raises(ValueError, match="must have no bearings beside ring_modes"):
        set_on_ring(ring=exugear.Shaft("ring", {0.0: [of_set.ring_pair.wheel, bearing]}))
    with pytest.raises(ValueError, match=r"modes must be fem.ring_modes of the pair of ste|ring_modes are of"):
        set_on_ring(ring_modes=ring_modes(BOLTS))
    tight = fem.GearPair(planet(24, 0.0), of_set.ring_pair.wheel, a=-45.0 * mm)
    with pytest.raises(ValueError, match="its pair has no backlash"):
        set_on_ring(
            ring_mesh=fem.ste_map(tight, [0, 10.0], [0, 0.3, 0.6], [[0.0] * 3, [1e-5] * 3]),
            sun_pair=fem.GearPair(of_set.sun_pair.pinion, tight.pinion, a=45.0 * mm),
            ring_modes=ring_modes().assign_attrs(fem.ring_modes(tight, 2, resolution=COARSE).attrs),
        )


def test_a_sensor_needs_modes_or_an_influence():
    model = exugear.build(exugear.Gearbox([set_on_ring(modes=False)], held="ring"))
    run = exugear.run_up(model, speed=50.0, load=200.0, duration=1e-3, **OPTIONS)
    with pytest.raises(ValueError, match="must hold the modes of the ring 'ring', or the sensor an influence"):
        exugear.RingSensor(0.1).signal(run)
    with pytest.raises(ValueError, match="quantity must be one of"):
        exugear.RingSensor(0.1, quantity="jerk")
    with pytest.raises(ValueError, match="quasi-static"):
        exugear.RingSensor(0.1, np.cos, quantity="velocity")
