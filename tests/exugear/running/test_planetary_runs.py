"""Runs of planetary sets whose members spin: torques, energy, parts, shares of the planets, other members driving."""

from concurrent.futures import ProcessPoolExecutor
from math import cos

import numpy as np
import pytest
from planetary_boxes import GEAR, SUN_PAIR, members, planetary, planetary_box, waving_law

import exugear
from fem.units import mm, um


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
