"""Runs of planetary sets on pins in space: axial forces, tilting planets, leaning pins, energy, parts, open teeth."""

from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np
import pytest
from planetary_boxes import PIN, helical_box, planar_box, planetary_box, waving_law

import exugear
from fem.units import mm, um

DAMPED = exugear.Bearing(radial=1e8, axial=1e8, tilt=1e6, damping_time=1e-4)
OPTIONS = {"progress": False, "checks": 0}


def law_over_misalignment() -> exugear.MeshForce:
    """A mesh of constant stiffness, which a misalignment of the axes does not change."""
    law = waving_law(amplitude=0.0)
    force = np.broadcast_to(law.force_table, (2, *law.force_table.shape))
    return exugear.MeshForce(law.phase, law.deflection, force, offsets={"misalignment": [-1e-3, 1e-3]}, damping=1500.0)


def law_with_backlash(backlash: float) -> exugear.MeshForce:
    law = waving_law()
    return exugear.MeshForce(law.phase, law.deflection, law.force_table, damping=1500.0, backlash=backlash)


def test_a_spur_set_in_space_runs_as_in_the_plane():
    """To the accuracy of Newton's iteration: nothing leaves the plane, on whichever bodies."""
    box = planar_box(bearings=PIN)
    plans = exugear.plan(box), exugear.plan(box).with_bodies()
    options = OPTIONS | {"speed": (50.0, 60.0), "load": 100.0, "duration": 0.01}
    planar, space = (exugear.run_up(exugear.build(box, plan=plan), **options).data for plan in plans)
    for name in ("mesh_force", "dte", "bearing_force"):
        assert float(np.abs(space[name] - planar[name]).max()) < 1e-7 * float(np.abs(planar[name]).max())


@pytest.mark.parametrize(
    ("driving", "held"), [("sun", "ring"), ("sun", "carrier"), ("ring", "sun"), ("carrier", "ring")]
)
def test_energy_is_balanced_on_pins_in_space(driving, held):
    built = exugear.build(helical_box(held=held, driving=driving))
    run = exugear.run_up(built, speed=(50.0, 60.0), load=100.0, duration=0.01, power=True, **OPTIONS)
    assert run.energy_balance().relative < 1e-8
    assert float(run.data["mesh_force"].min()) > 0


def test_axial_forces_of_sun_and_ring_are_opposite_and_tilt_the_planets():
    """F tan(beta_b) on either side of a planet: no axial force, and the moment 2 r_w F tan(beta_b) on the pin's tilt.

    Hand model: its axis leans by this moment over k_t in the plane through the sun, which misaligns the sun mesh.
    """
    box = helical_box(law_over_misalignment(), bearing=PIN)
    data = exugear.run_up(exugear.build(box), speed=1.0, load=400.0, duration=1e-4, **OPTIONS).data
    pair, force = box.stages[0].pair, data["mesh_force"].values[:, 0]
    axial = data["bearing_force"].sel(direction="z").values[:, 0]
    by_name = dict(zip(data["bearing"].values.tolist(), axial.tolist(), strict=True))
    total = force[::2].sum() * np.tan(pair.beta_b)
    assert abs(by_name["sun at 0 mm"]) == pytest.approx(total, rel=1e-4)
    assert by_name["ring at 0 mm"] == pytest.approx(-by_name["sun at 0 mm"], rel=1e-4)
    assert max(abs(by_name[f"planet {k} at 0 mm"]) for k in (1, 2, 3)) < 1e-4 * total
    torques = data["drive_torque"] + data["reaction_torque"] - data["load_torque"]
    assert abs(float(torques[0])) < 1e-10 * 400
    lean = pair.a * force[0] * np.tan(pair.beta_b) / 1e6
    expected = lean * np.sin(pair.alpha_wt)
    assert np.abs(data["misalignment"].values[::2, 0]) == pytest.approx(abs(expected), rel=1e-3)


def test_a_pin_that_leans_misaligns_its_meshes_as_it_orbits():
    """Without moments of the meshes the planet follows its pin: the static offset of its meshes stays, a turn long."""
    lean = [[0.0, 0.0, 2e-4, 1e-4], [0.0] * 4, [0.0] * 4]
    box = planar_box(law=law_over_misalignment(), pin_errors=lean)
    plan = exugear.plan(box)
    assert plan.shafts["planet 1"].name == "BEARINGS"
    data = exugear.run_up(exugear.build(box), speed=100.0, load=400.0, duration=0.25, **OPTIONS).data
    expected = [box.offsets(stage)["misalignment"] for stage in box.stages[:2]]
    assert data["misalignment"].values[:2, -1] == pytest.approx(expected, rel=2e-3)
    assert np.ptp(data["misalignment"].values[:2], axis=1).max() < 1e-3 * min(map(abs, expected))


def test_only_what_tilts_moves_in_space():
    """The ring on a bearing beside its plane; the others stay in the plane, and the plan says why."""
    ring = exugear.Shaft("ring", {0.0: planar_box().stages[1].pair.wheel, 10 * mm: PIN}, inertia=0.05, mass=5.0)
    plan = exugear.plan(planar_box(ring=ring))
    kinds = {name: kind for name, kind in plan.shafts.items() if kind.name == "BEARINGS"}
    assert list(kinds) == ["ring"]
    assert "its bearings do not lie symmetrically" in plan.why["ring"]
    assert "nothing tilts it" in plan.why["planet 1"]


def test_planets_beside_the_bearings_of_their_carrier_tilt_it():
    carrier = exugear.Shaft("carrier", {20 * mm: PIN, 40 * mm: PIN}, inertia=0.02, mass=5.0)
    plan = exugear.plan(planar_box(carrier=carrier))
    assert plan.shafts["carrier"].name == plan.shafts["planet 2"].name == "BEARINGS"
    assert plan.shafts["sun"].name == "PLANAR"
    assert "its carrier 'carrier' tilts" in plan.why["planet 2"]


@pytest.mark.parametrize("box", [partial(planar_box, DAMPED), partial(helical_box, bearing=None)])
def test_parts_of_a_set_on_pins_give_the_serial_run(box):
    """Later parts start from the equilibrium at the angle of their carrier."""
    model = exugear.build(box(law=waving_law(damping=6000.0), pin=DAMPED))
    options = OPTIONS | {"speed": (50.0, 80.0), "load": 300.0, "duration": 0.5}
    serial = exugear.run_up(model, **options).data
    with ProcessPoolExecutor(2) as executor:
        parts = exugear.run_up(model, **options, executor=executor).data
    assert 0 < float(np.abs(parts["dte"] - serial["dte"]).max()) < 1e-6 * float(serial["dte"].std())


def test_a_set_starts_with_a_planet_that_carries_nothing():
    """Its pin stands so far with the force that its teeth are open: the others share the load."""
    for box in (planetary_box, planar_box, helical_box):
        built = exugear.build(box(law=law_with_backlash(200 * um), pin_errors=[60 * um, 0.0, 0.0]))
        data = exugear.run_up(built, speed=10.0, load=100.0, duration=1e-4, **OPTIONS).data
        forces = data["mesh_force"].values[:, 0].reshape(3, 2)
        assert np.abs(forces[0]).max() == 0.0
        assert forces[1] == pytest.approx(forces[2], rel=1e-2)
        assert forces[1:].min() > 0


@pytest.mark.parametrize("box", [planetary_box, planar_box, helical_box])
def test_energy_is_balanced_where_a_planet_carries_nothing_and_the_speed_rises(box):
    """Its inertia torque acts on no tooth yet: it does not accelerate at first; later it strikes, as teeth of pairs."""
    built = exugear.build(box(law=law_with_backlash(200 * um), pin_errors=[60 * um, 0.0, 0.0]))
    run = exugear.run_up(built, speed=(50.0, 60.0), load=100.0, duration=0.01, power=True, **OPTIONS)
    assert run.energy_balance(0.0, 0.001).relative < 5e-9
    assert run.energy_balance().relative < 1e-7
    assert float(run.data["mesh_force"][0].max()) > 0.0


def test_a_planet_thrown_into_the_ring_stops_the_run():
    """m W^2 a / k = 150 um: both flanks of the ring mesh would carry, which its law does not know."""
    built = exugear.build(planar_box(law=law_with_backlash(50 * um)))
    with pytest.raises(exugear.RunStopped, match=r"planet 1-ring come .* um too close for their backlash of 50 um"):
        exugear.run_up(built, speed=(900.0, 1400.0), load=100.0, duration=0.002, **OPTIONS)
