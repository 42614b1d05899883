"""Displacement, stiffness and loads of rolling bearings: published numbers, closed forms, symmetry, convexity."""

import pickle
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import scipy
from rolling_bearings import (
    ANGULAR,
    ROLLER,
    TAPERED,
    any_load,
    ball_forces_by_energy,
    deep_groove,
    every_kind,
    forces_of_elements,
    random_bearings,
    random_displacements,
)

from exugear import RollingBearing
from exugear.rolling_bearings.law import response
from fem.units import deg, mm, um


@pytest.mark.parametrize(
    ("clearance", "direction", "displacement"),
    [(0, 0, 15.1101), (0, 2, 133.538), (10, 0, 21.223), (10, 2, 149.172)],
)
def test_a_deep_groove_bearing_is_displaced_as_known(clearance, direction, displacement):
    loaded = deep_groove(clearance * um).under(1000.0 * np.eye(5)[direction])
    expected = displacement * um * np.eye(5)[direction]
    assert loaded.displacement == pytest.approx(expected, rel=2e-5, abs=1e-12)


def test_an_angular_contact_bearing_is_as_stiff_as_its_closed_form():
    bearing = RollingBearing.angular_contact(**ANGULAR)
    loaded, row = bearing.under((0, 0, 2000.0, 0, 0)), bearing.rows[0]
    Q, S = loaded.loads[0][0], np.hypot(*row.contacts(loaded.displacement[None])[0, 0])
    d, sine = S - row.A, 2000.0 / (row.Z * Q)
    along, across = 1.5 * Q / d, Q / S
    axial = row.Z * (along * sine**2 + across * (1 - sine**2))
    radial = row.Z / 2 * (along * (1 - sine**2) + across * sine**2)
    assert np.diag(loaded.stiffness)[:3] == pytest.approx([radial, radial, axial], rel=1e-9)


def test_a_half_loaded_roller_bearing_has_the_published_loads():
    """Q_max = 4.08 F_r / (Z cos(alpha)) and F_a = 1.26 F_r tan(alpha) (Harris)."""
    bearing = RollingBearing.tapered_roller(**TAPERED | {"Z": 100, "D_w": 1 * mm, "L_we": 1 * mm})
    loaded = bearing.displaced((500 * um, 0, 0, 0, 0))
    radial, axial = loaded.force[0], loaded.force[2]
    assert loaded.loads[0].max() == pytest.approx(4.08 * radial / (100 * np.cos(15 * deg)), rel=3e-3)
    assert axial == pytest.approx(1.26 * radial * np.tan(15 * deg), rel=3e-3)


@pytest.mark.parametrize("bearing", every_kind().values(), ids=every_kind())
def test_force_and_stiffness_are_slopes_of_one_energy(bearing):
    h, directions = np.array([1e-9, 1e-9, 1e-9, 1e-7, 1e-7]), np.eye(5)
    for q in random_displacements(20):
        ahead, behind, now = (response(bearing.law, 0.0, x) for x in (q + h * directions, q - h * directions, q[None]))
        size = np.abs(now.gradient).max() + 1
        assert (ahead.energy - behind.energy) / (2 * h) == pytest.approx(now.gradient[0], rel=1e-4, abs=1e-4 * size)
        stiffness = now.hessian[0]
        assert np.abs(stiffness - stiffness.T).max() <= 1e-8 * np.abs(stiffness).max()
        slopes = (ahead.gradient - behind.gradient) / (2 * h[:, None])
        assert slopes == pytest.approx(stiffness, rel=1e-2, abs=1e-3 * np.abs(stiffness).max() + 1)


def test_tables_of_rollers_have_the_forces_of_their_laminae():
    bearing, q = every_kind()["cylindrical roller"], random_displacements(500) * np.array([1, 1, 1, 0.5, 0.5])
    by_laminae, by_table = (response(law, 0.0, q).gradient[:, :2] for law in (bearing.law, bearing.law_of_runs))
    error, size = np.linalg.norm(by_table - by_laminae, axis=1), np.linalg.norm(by_laminae, axis=1)
    assert np.median(error / np.maximum(size, 1.0)) < 1e-4
    assert (error < 2e-3 * size + 3.0).all()


def test_rollers_beyond_their_table_press_as_their_laminae():
    bearing, q = every_kind()["cylindrical roller"], np.array([[300 * um, 0, 0, 0, 20e-3], [0, 400 * um, 0, 20e-3, 0]])
    by_laminae, by_table = (response(law, 0.0, q).gradient for law in (bearing.law, bearing.law_of_runs))
    assert by_table == pytest.approx(by_laminae, rel=1e-2, abs=1e-6)


@pytest.mark.parametrize("tables", [False, True])
@pytest.mark.parametrize("bearing", every_kind().values(), ids=every_kind())
def test_forces_are_monotonic(bearing, tables):
    q = random_displacements(200)
    gradient = response(bearing.law_of_runs if tables else bearing.law, 0.0, q).gradient
    assert (np.einsum("ni,ni->n", np.diff(gradient, axis=0), np.diff(q, axis=0)) >= -1e-12).all()


def test_every_load_that_is_carried_has_its_displacement():
    for bearing, force in random_bearings(60):
        loaded = bearing.under(force)
        assert loaded.force == pytest.approx(force, rel=1e-6, abs=1e-6 * np.abs(force).max())


@pytest.mark.parametrize("clearance", [0.0, 10.0, 40.0])
def test_forces_of_a_millinewton_are_carried(clearance):
    """Balls that just touch: displaced by half of the clearance and little more."""
    force = np.array([0.8e-3, 0.6e-3, 0, 0, 0])
    loaded = deep_groove(clearance * um).under(force)
    assert loaded.force == pytest.approx(force, rel=1e-6, abs=1e-9)
    assert np.hypot(*loaded.displacement[:2]) >= clearance / 2 * um


@pytest.mark.slow
def test_a_thousand_bearings_find_their_displacements():
    for bearing, force in random_bearings(1000):
        loaded = bearing.under(force)
        assert loaded.force == pytest.approx(force, rel=1e-6, abs=1e-6 * np.abs(force).max())


@pytest.mark.slow
def test_of_a_thousand_loads_in_any_direction_those_are_refused_that_no_elements_can_carry():
    """A load is carried if it is a sum of forces >= 0 of elements (Farkas: else a displacement frees them all).

    Of angular contact bearings alone some loads are such sums, but not with the forces that the balls then have: in the
    only equilibrium one of them presses with less than a tenth of its contact angle.
    """
    draw, counts = np.random.default_rng(1), Counter()
    for bearing, _ in random_bearings(1000):
        load, row = any_load(bearing, draw), bearing.rows[0]
        try:
            loaded = bearing.under(load)
        except ValueError as error:
            assert len(bearing.rows) == 1 and ("not carried" in str(error) or "apart; press them" in str(error))
            scale = 1 / np.array([1, 1, 1, row.R, row.R])
            forces = forces_of_elements(row) * scale[:, None]
            _, missing = scipy.optimize.nnls(forces, load * scale)
            counts["no sum" if missing > 1e-3 * np.linalg.norm(load * scale) else "apart"] += 1
            if missing <= 1e-3 * np.linalg.norm(load * scale):
                pressing, sines = ball_forces_by_energy(row, load)
                assert sines[pressing > 0].min() < 0.1 * np.sin(row.alpha)
        else:
            assert loaded.force == pytest.approx(load, rel=1e-6, abs=1e-6 * np.abs(load).max())
            counts["carried"] += 1
    assert counts["carried"] > 600 and counts["no sum"] > 250 and 0 < counts["apart"] < 20


def test_a_bearing_that_has_moved_to_another_process_has_its_own_law():
    bearing, force = every_kind()["tapered O"], (800.0, 0, 300.0, 0, 0)
    loaded = bearing.under(force)
    moved = pickle.loads(pickle.dumps(bearing))
    assert moved == bearing
    assert "law" not in vars(moved)
    assert moved.under(force).displacement == pytest.approx(loaded.displacement, rel=1e-12)


def test_loads_that_are_not_carried_are_refused_in_words():
    with pytest.raises(ValueError, match="not carried by a cylindrical roller bearing"):
        RollingBearing.cylindrical_roller(**ROLLER).under((0, 0, 100.0, 0, 0))
    with pytest.raises(ValueError, match="apart"):
        RollingBearing.angular_contact(**ANGULAR).under((0, 0, -100.0, 0, 0))


def test_a_preloaded_pair_holds_its_preload_and_an_O_pair_resists_tilt_more():
    pairs = [RollingBearing.angular_contact(**ANGULAR).paired(x, spacing=15 * mm, preload=400.0) for x in "OX"]
    tilt = []
    for pair in pairs:
        centred = pair.displaced(np.zeros(5))
        assert centred.force == pytest.approx(np.zeros(5), abs=1e-6)
        for row in pair.rows:
            alone = replace(pair, rows=(row,)).displaced(np.zeros(5))
            assert alone.force[2] == pytest.approx(400.0 * row.direction, rel=1e-6)
        tilt.append(centred.stiffness[3, 3])
    assert tilt[0] > 2 * tilt[1]
