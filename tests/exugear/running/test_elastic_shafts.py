"""Runs, modes and statics with elastic shafts, beside their finite elements and the balances of mechanics."""

from dataclasses import fields

import numpy as np
import pytest
import scipy
from elastic_boxes import LAW, elastic_box, elastic_train
from scenes import linear_law

import exugear
from exugear.gearbox.elastic_shaft import elastic_shaft
from fem.units import mm, rpm

QUIET = {"progress": False, "checks": 0}


@pytest.fixture(scope="module")
def model() -> exugear.Model:
    return exugear.build(elastic_box())


@pytest.fixture(scope="module")
def train() -> exugear.Model:
    return exugear.build(elastic_train())


def beam_deflection(shaft: exugear.Shaft, force: float, axial: float) -> float:
    """Static deflection [m] of the finite elements of a shaft on its bearings, under a force at an axial position."""
    beam, loads = shaft.beam, np.zeros(2 * shaft.beam.axial.size)
    loads[2 * beam.node(axial)] = force
    return float(np.linalg.solve(beam.supported(shaft.planar_supports), loads)[2 * beam.node(axial)])


def test_the_static_deflection_is_that_of_the_finite_elements():
    shaft = elastic_box(gears=(130 * mm,), length=300 * mm, d=40 * mm).driving
    reduced, forces = elastic_shaft(shaft, 0, 0, spatial=True, axial=False), np.zeros(6)
    forces[0], forces[4] = 1000.0, 1000.0 * (130 * mm - shaft.centre)
    moved = reduced.static_displacement(np.append(forces, np.zeros(reduced.size - 6)))[0]
    at_gear = moved[0] + (130 * mm - shaft.centre) * moved[4]
    assert at_gear == pytest.approx(beam_deflection(shaft, 1000.0, 130 * mm), rel=1e-9)
    slender = 1000.0 * (0.13 * 0.17) ** 2 / (3 * 210e9 * np.pi / 64 * 0.04**4 * 0.3)
    assert 0.85 * slender < at_gear < 1.1 * slender + 1000.0 / 1e9


@pytest.mark.parametrize("stations", [(60 * mm,), (60 * mm, 140 * mm)])
def test_rigid_motions_keep_mass_and_strain_nothing(stations):
    shaft = elastic_train().shafts[1 if len(stations) > 1 else 0]
    reduced = elastic_shaft(shaft, 2, 1, spatial=True, axial=True)
    motion = np.zeros((reduced.size, 2))
    for i in range(len(stations)):
        motion[6 * i, 0] = motion[6 * i + 5, 1] = 1.0
    motion[reduced.end, 1] = 1.0
    assert np.diag(motion.T @ reduced.mass_matrix(held=False) @ motion) == pytest.approx([shaft.mass, shaft.inertia])
    assert np.abs(reduced.stiffness_matrix @ motion).max() < 1e-9 * np.abs(reduced.stiffness_matrix).max()
    assert np.allclose(reduced.polar_matrix, -reduced.polar_matrix.T)


@pytest.mark.parametrize("end", ["held", "free"])
def test_modes_of_torsion_have_their_frequencies_and_their_damping_ratio(end):
    shaft, held = elastic_box(gears=(130 * mm,), length=300 * mm, d=40 * mm).driven, end == "held"
    reduced = elastic_shaft(shaft, 0, 2, spatial=False, axial=False, held=held)
    mass, stiffness, damping, _ = reduced.torsion.with_end(shaft, held=held)
    squares, modes = scipy.linalg.eigh(stiffness, mass)
    beam, free = shaft.beam, slice(0, -1 if held else None)
    exact = scipy.linalg.eigvalsh(beam.torsion_stiffness[free, free], beam.torsion_mass[free, free])
    first, number = 0 if held else 1, len(squares)
    assert np.sqrt(squares[first:3]) == pytest.approx(np.sqrt(exact[first:3]), rel=1e-3)
    shares = np.diag(modes.T @ damping @ modes)[first:number] / (2 * np.sqrt(squares[first:]))
    assert shares == pytest.approx(shaft.damping_ratio, rel=0.02)
    if not held:
        turning_as_a_whole = np.r_[1.0, 1.0, 0.0, 0.0]
        assert np.abs(damping @ turning_as_a_whole).max() < 1e-9 * np.abs(damping).max()


@pytest.mark.parametrize("drive", ["held", "free"])
def test_the_books_close(model, drive):
    if drive == "held":
        run = exugear.run_up(model, speed=(100 * rpm, 900 * rpm), load=150.0, duration=0.02, power=True, **QUIET)
    else:
        torques = {"drives": {"fast": exugear.Torque(150.0)}, "loads": {"slow": 100.0}}
        run = exugear.run(model, **torques, start_speed=50.0, duration=0.02, power=True, **QUIET)
    assert run.energy_balance().relative < 1e-6
    assert "fast shaft" in run.data["coupling"]


def test_the_books_of_a_train_close_with_two_gears_on_a_shaft(train):
    run = exugear.run_up(train, speed=(900 * rpm, 901 * rpm), load=150.0, duration=0.02, power=True, **QUIET)
    assert run.energy_balance().relative < 1e-6
    forces = run.data["bearing_force"].mean("time").sel(bearing=["middle at 0 mm", "middle at 200 mm"]).sum("bearing")
    radius = train.gearbox.stages[0].pair.a / 2
    assert float(np.hypot(forces[0], forces[1])) == pytest.approx(2 * 150.0 / radius, rel=0.01)


def test_the_books_of_shafts_that_only_spin_close():
    train = exugear.build(elastic_train(bearings=False))
    run = exugear.run_up(train, speed=(100 * rpm, 900 * rpm), load=150.0, duration=0.01, power=True, **QUIET)
    assert run.energy_balance().relative < 1e-6
    assert "elastic in torsion" in str(train.plan)


def test_bearings_with_clearance_carry_elastic_shafts():
    model = exugear.build(elastic_box(clearance=5e-6))
    run = exugear.run_up(model, speed=(100 * rpm, 300 * rpm), load=150.0, duration=0.01, displacement=True, **QUIET)
    force, moved = (
        run.data[name].isel(time=-1, bearing=0).values for name in ("bearing_force", "bearing_displacement")
    )
    assert np.hypot(*force[:2]) == pytest.approx(1e9 * (np.hypot(*moved[:2]) - 5e-6), rel=1e-2)


def test_the_books_close_on_rolling_bearings():
    sizes = {"Z": 9, "D_w": 11.5 * mm, "D_pw": 50 * mm, "r_i": 5.98 * mm, "r_e": 6.1 * mm}
    ends = {axial: exugear.RollingBearing.deep_groove(**sizes) for axial in (0.0, 120 * mm)}
    box = elastic_box()
    shafts = [exugear.Shaft(x.name, x.gears | ends, sections=x.sections) for x in box.shafts]
    model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, LAW, pair=box.stages[0].pair)]))
    run = exugear.run_up(model, speed=(300 * rpm, 301 * rpm), load=50.0, duration=0.01, power=True, **QUIET)
    assert run.energy_balance().relative < 1e-6
    forces = run.data["bearing_force"].mean("time").isel(bearing=[0, 1]).sum("bearing").values
    assert np.hypot(*forces[:2]) == pytest.approx(50.0 / box.stages[0].pair.pinion.r_b, rel=0.01)


def test_modes_off_the_line_of_action_are_those_of_the_shaft(model):
    shaft = model.gearbox.driving
    modes = exugear.modes(model, load=150.0)["frequency"].values
    for frequency in shaft.bending_frequencies()[:4:2]:
        assert np.abs(modes / frequency - 1).min() < 1e-3


def test_gyroscopic_moments_split_modes_as_those_of_the_shaft(model):
    shaft, speed = model.gearbox.driving, 1000.0
    modes = exugear.modes(model, load=150.0, speed=speed)["frequency"].values
    backward, forward = shaft.bending_frequencies(speed)[2:4]
    assert forward - backward > 0.05 * backward
    for frequency in (backward, forward):
        assert np.abs(modes / frequency - 1).min() < 0.02


def test_a_run_with_the_chosen_coordinates_is_that_with_many_more(model):
    plan = exugear.plan(model.gearbox)
    many = {x.shaft.name: elastic_shaft(x.shaft, 6, 3, spatial=True, axial=False) for x in plan.elastic.values()}
    finer = exugear.Plan(**{field.name: getattr(plan, field.name) for field in fields(plan)} | {"elastic": many})
    conditions = {"speed": (1000 * rpm, 1200 * rpm), "load": 150.0, "duration": 0.06, "step": 1e-5}
    runs = [exugear.run_up(x, **conditions, **QUIET).data for x in (model, exugear.build(model.gearbox, plan=finer))]
    dte, more = (run["dte"].std().item() for run in runs)
    assert dte == pytest.approx(more, rel=0.01)
    forces, of_more = (run["bearing_force"].sel(direction=["x", "y"]).std("time").values for run in runs)
    assert forces == pytest.approx(of_more, rel=0.02)


def test_long_steps_keep_the_resonances_of_slender_shafts():
    """Without masses and dampings for the step, 24 us are refused: shapes lie above 26 kHz."""
    model = exugear.build(elastic_box(gears=(130 * mm,), length=300 * mm, d=40 * mm))
    conditions = {"speed": (2530 * rpm, 2570 * rpm), "load": 150.0, "duration": 0.06}
    long, short = (exugear.run_up(model, **conditions, step=step, **QUIET).data for step in (2.4e-5, 8e-6))
    forces, of_short = (run["bearing_force"].sel(direction=["x", "y"]).std("time").values for run in (long, short))
    assert forces == pytest.approx(of_short, rel=0.015)


def test_the_plan_keeps_a_shaft_rigid_only_where_that_is_the_same():
    spinning, on_bearings = exugear.plan(elastic_train(bearings=False)), exugear.plan(elastic_box())
    assert "input" not in spinning.elastic
    assert "rigid but for the twist" in spinning.flexible["input"]
    assert [*on_bearings.elastic] == ["fast", "slow"]
    assert "if it were rigid" in str(on_bearings)


def test_the_end_of_a_held_shaft_turns_as_imposed_and_the_gear_lags_by_the_twist():
    shafts = elastic_box()
    box = exugear.Gearbox([exugear.Stage(shafts.driving, shafts.driven, linear_law(), pair=shafts.stages[0].pair)])
    run = exugear.run(
        exugear.build(box), drives={"fast": 50.0}, loads={"slow": 150.0}, duration=2e-3, power=True, **QUIET
    )
    wanted = 0.5 * 150.0**2 / box.driving.twist.torsion
    strain = run.data["strain_energy"].values
    assert strain.min() > wanted
    assert run.data["drive_torque"].values == pytest.approx(150.0, rel=1e-3)
