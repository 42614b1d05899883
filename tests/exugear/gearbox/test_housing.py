"""Housings as stiffness between the seats of bearings, in statics, runs and modes."""

import numpy as np
import pytest
import scipy
from paper_gears import paper_gear, paper_pair
from planetary_boxes import GEAR, PIN, RING_PAIR, planetary
from scenes import smooth_law

import exugear
from fem.units import mm, um

SEATS = [("fast", 0.0), ("fast", 100 * mm), ("slow", 0.0), ("slow", 100 * mm)]
BALL = exugear.Bearing(radial=2e8, axial=1e8, damping_time=1e-5)
RIGID = np.eye(24) * 1e14


def box_on(housing=None, bearing=BALL, sections: bool = False) -> exugear.Gearbox:
    options = {"sections": [(45 * mm, 100 * mm)]} if sections else {}
    parts = {0.0: bearing, 40 * mm: paper_gear(), 100 * mm: bearing}
    shafts = [exugear.Shaft(name, parts, **options) for name in ("fast", "slow")]
    law = smooth_law(damping=2700.0)
    return exugear.Gearbox([exugear.Stage(*shafts, law, pair=paper_pair())], housing=housing)


def soft_stiffness() -> np.ndarray:
    """Seats about as soft as the bearings, which all move one another."""
    random = np.random.default_rng(1).normal(size=(24, 24))
    scale = np.tile([1e4] * 3 + [1e3] * 3, 4)
    return (random @ random.T / 24 + 0.3 * np.eye(24)) * 0.8 * np.outer(scale, scale)


def soft(**options) -> exugear.Housing:
    return exugear.Housing(SEATS, soft_stiffness(), **options)


def run_of(housing, *, sections: bool = False, bearing=BALL, speed=60.0, **options) -> exugear.Run:
    model = exugear.build(box_on(housing, bearing, sections=sections))
    options = {"duration": 0.02, "progress": False, "checks": 0, "step": 2e-5, "sample": 2e-5} | options
    return exugear.run_up(model, speed=speed, load=100.0, **options)


@pytest.mark.parametrize("sections", [False, True])
def test_a_very_stiff_housing_gives_the_run_without_housing(sections):
    stiff, none = (run_of(x, sections=sections, duration=0.01).data for x in (exugear.Housing(SEATS, RIGID), None))
    for name in ("dte", "bearing_force"):
        scale = np.abs(none[name].values).max()
        np.testing.assert_allclose(stiff[name], none[name], atol=1e-4 * scale)


@pytest.mark.parametrize("sections", [False, True])
def test_books_are_closed_on_a_housing(sections):
    run = run_of(soft(damping_time=2e-5), sections=sections, speed=(60.0, 70.0), power=True)
    balance = run.energy_balance()
    assert abs(balance.residual) < 1e-5 * abs(balance.work_in)
    loss = run.data["coupling_loss"].sel(coupling="housing")
    assert float(loss.min()) >= 0
    assert float(loss.max()) > 0


def test_a_run_bears_on_its_bearings_as_statics_say():
    """The run eliminates the seats; statics keep their coordinates. On soft teeth the load is even, as in the map."""
    box = box_on(soft())
    data = exugear.load_distribution(box, 100.0, mesh_stiffness=2e7)
    steady = run_of(soft(damping_time=1e-4), speed=20.0, duration=0.06).data.isel(time=slice(1500, None))
    forces, mean = data["bearing_force"].values, steady["bearing_force"].mean("time").values
    assert np.abs(mean - forces).max() < 5e-3 * np.abs(forces).max()


def test_modes_count_the_housing_among_their_energy():
    soft_modes, rigid_modes = (exugear.modes(exugear.build(box_on(x)), load=100.0) for x in (soft(), None))
    assert float(soft_modes["frequency"][0]) < 0.8 * float(rigid_modes["frequency"][0])
    energy = soft_modes["energy_share"]
    np.testing.assert_allclose(energy.sum("element"), 1.0, atol=1e-6)
    assert float(energy.sel(element="housing").max()) > 0.05


def test_two_bearings_on_a_common_housing_move_each_other():
    """A force on the one shaft displaces the seats of the other by the compliance between them."""
    stiffness = soft_stiffness()
    data = exugear.load_distribution(box_on(exugear.Housing(SEATS, stiffness)), 100.0, mesh_stiffness=15e9)
    on_seats = np.hstack([-data["bearing_force"].values, -data["bearing_moment"].values, np.zeros((4, 1))]).ravel()
    displaced = scipy.linalg.solve(stiffness, on_seats).reshape(4, 6)[:, :3]
    np.testing.assert_allclose(data["seat_displacement"], displaced, rtol=1e-6, atol=1e-15)
    diagonal = exugear.Housing(SEATS, np.diag(np.diagonal(stiffness)))
    apart = exugear.load_distribution(box_on(diagonal), 100.0, mesh_stiffness=15e9)
    assert float(abs(apart["seat_displacement"] - data["seat_displacement"]).max()) > 0.05 * np.abs(displaced).max()


def test_statics_take_bearings_with_clearance_on_a_housing():
    loose = exugear.Bearing(radial=2e8, axial=1e8, clearance=5 * um)
    box = box_on(soft(), loose)
    data = exugear.load_distribution(box, 100.0, mesh_stiffness=15e9)
    np.testing.assert_allclose(data["bearing_force"].sum("bearing"), 0, atol=1e-6)
    soft_teeth = exugear.load_distribution(box, 100.0, mesh_stiffness=2e7)["bearing_force"].values
    run = run_of(soft(damping_time=1e-4), bearing=loose, speed=20.0, duration=0.06).data.isel(time=slice(1500, None))
    mean = run["bearing_force"].mean("time").values
    assert np.abs(mean - soft_teeth).max() < 5e-3 * np.abs(soft_teeth).max()


def test_seats_of_three_coordinates_do_not_turn():
    k = 3e8 * np.eye(12)
    data = exugear.load_distribution(box_on(exugear.Housing(SEATS, k)), 100.0, mesh_stiffness=15e9)
    forces, moved = data["bearing_force"].values, data["seat_displacement"].values
    np.testing.assert_allclose(moved, -forces / 3e8, rtol=1e-6, atol=1e-15)


def test_a_stiffness_may_come_from_a_file(tmp_path):
    stiffness = soft_stiffness()
    np.savez(tmp_path / "housing.npz", K=stiffness, M=np.eye(24))
    scipy.io.mmwrite(tmp_path / "housing.mtx", stiffness)
    for name in ("housing.npz", "housing.mtx"):
        housing = exugear.Housing.from_file(tmp_path / name, SEATS)
        np.testing.assert_allclose(housing.stiffness, stiffness, rtol=1e-12)
    assert exugear.Housing.from_file(tmp_path / "housing.npz", SEATS).mass is not None


@pytest.mark.parametrize(
    ("seats", "stiffness", "words"),
    [
        (SEATS, np.eye(5), "must be \\(24, 24\\) or \\(12, 12\\)"),
        (SEATS, np.triu(np.ones((24, 24))) + 24 * np.eye(24), "must be symmetric"),
        (SEATS, np.ones((24, 24)), "fix the housing at its mounts"),
        ([("fast", 0.0)] * 2, np.eye(12), "listed twice"),
        ("fast", np.eye(6), "seats must be a list"),
    ],
)
def test_wrong_housings_are_refused_in_words(seats, stiffness, words):
    with pytest.raises(ValueError, match=words):
        exugear.Housing(seats, stiffness)


SEATS_OF_SET = [(name, 0.0) for name in ("sun", "ring", "carrier")]


def set_on(housing: exugear.Housing | None) -> exugear.Gearbox:
    """A planetary set on bearings, its sun pushed aside."""
    push, sizes = exugear.ExternalForce(x=300.0, y=100.0), {"inertia": 0.02, "mass": 5.0}
    shafts = {
        "sun": exugear.Shaft("sun", {0.0: [GEAR, PIN, push]}),
        "ring": exugear.Shaft("ring", {0.0: [RING_PAIR.wheel, PIN]}, **sizes),
        "carrier": exugear.Shaft("carrier", {0.0: PIN}, **sizes),
    }
    return exugear.Gearbox([planetary(pin=PIN, **shafts)], held="ring", housing=housing)


def run_of_set(housing: exugear.Housing | None) -> exugear.Run:
    options = {"duration": 0.01, "step": 1e-5, "sample": 1e-5, "progress": False, "checks": 0, "power": True}
    return exugear.run_up(exugear.build(set_on(housing)), speed=(60.0, 70.0), load=100.0, **options)


@pytest.mark.slow
def test_a_very_stiff_housing_gives_the_run_of_a_set_without_housing():
    stiff = exugear.Housing(SEATS_OF_SET, np.diag(np.tile([1e13] * 3 + [1e11] * 3, 3)))
    on_stiff, without = (run_of_set(x).data for x in (stiff, None))
    for name in ("dte", "bearing_force"):
        np.testing.assert_allclose(on_stiff[name], without[name], atol=1e-5 * np.abs(without[name].values).max())


@pytest.mark.slow
def test_a_set_on_a_housing_has_closed_books_and_bears_in_statics_as_in_the_run():
    housing = exugear.Housing(SEATS_OF_SET, soft_stiffness()[:18, :18], damping_time=2e-5)
    run = run_of_set(housing)
    balance = run.energy_balance()
    assert abs(balance.residual) < 1e-6 * abs(balance.work_in)
    statics = exugear.load_distribution(set_on(housing), load=100.0, mesh_stiffness=20e9)["bearing_force"]
    members = [f"{name} at 0 mm" for name, _ in SEATS_OF_SET]
    of_run, of_statics = (x.sel(bearing=members).sum("bearing") for x in (run.data["bearing_force"], statics))
    np.testing.assert_allclose(of_statics[:2], [-300.0, -100.0], atol=1.0)
    np.testing.assert_allclose(of_run[:2].mean("time"), [-300.0, -100.0], atol=5.0)


def test_seats_of_planets_belong_to_their_carrier():
    with pytest.raises(ValueError, match="carrier_stiffness"):
        set_on(exugear.Housing([("planet 1", 0.0)], np.eye(6)))


def test_a_seat_needs_a_bearing():
    with pytest.raises(ValueError, match="where no bearing is"):
        box_on(exugear.Housing([("fast", 50 * mm)], np.eye(6)))
