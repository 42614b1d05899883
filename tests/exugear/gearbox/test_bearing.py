"""Bearings as data: stiffness about a pole, clearance, tables, refused arguments."""

import numpy as np
import pytest
from hypothesis import given
from strategies import floats

from exugear import Bearing
from exugear.gearbox.bearing_law import strain_energy, tangent_stiffness
from exugear.multibody.bearings_and_drags import bearing_functions
from fem.units import um

LOOSE_SPIN = np.diag([3e8, 2e8, 1e8, 4e5, 5e5, 0.0])
X_AND_ABOUT_Y = np.zeros((6, 6))
X_AND_ABOUT_Y[0, 4] = X_AND_ABOUT_Y[4, 0] = 1e6
COUPLED = LOOSE_SPIN + X_AND_ABOUT_Y


def motion_at(pole, lever: float) -> np.ndarray:
    """Displacement (6,) of a point at a lever above a pole that moves by (6,), to first order: x + phi x r."""
    pole = np.asarray(pole)
    return np.r_[pole[:3] + np.cross(pole[3:], [0, 0, lever]), pole[3:]]


@given(floats(-0.5, 0.5), floats(0, 6))
def test_stiffness_about_a_pole_stores_the_energy_of_the_bearing(lever, angle):
    pole = np.array([np.cos(angle), np.sin(angle), 0.3, np.sin(3 * angle), np.cos(2 * angle), 0.7])
    for bearing in (Bearing(5e8, 1e8, 2e5), Bearing(matrix=COUPLED)):
        motion = motion_at(pole, lever)
        energy = motion @ bearing.stiffness @ motion
        assert pole @ bearing.at(lever) @ pole == pytest.approx(energy, rel=1e-12)


def test_moving_the_pole_forth_and_back_restores_the_stiffness():
    bearing = Bearing(5e8, 1e8, 2e5)
    about_pole = Bearing(matrix=bearing.at(0.2))
    assert about_pole.at(-0.2) == pytest.approx(bearing.stiffness, rel=1e-12, abs=1e-6)
    assert not bearing.at(0.2)[5].any()


def test_radial_force_begins_beyond_the_clearance():
    bearing = Bearing(1e8, clearance=10 * um)
    assert bearing.radial_force([0, 10 * um, 30 * um]) == pytest.approx([0, 0, 2000])
    assert (bearing.linear, bearing.reach) == (False, np.inf)
    assert bearing.stiffness[0, 0] == 1e8


def test_bearings_are_as_stiff_just_beyond_their_clearance():
    for x, stiffness in ((10 * um + 1e-11, 1e8), (10 * um - 1e-11, 0.0)):
        matrix = tangent_stiffness(Bearing(1e8, clearance=10 * um), 0.0, np.array([x, 0, 0, 0, 0, 0]))
        assert matrix[0, 0] == pytest.approx(stiffness, rel=1e-12)


@given(floats(-3e-5, 3e-5), floats(-3e-5, 3e-5), floats(-0.1, 0.1))
def test_force_and_tangent_of_a_bearing_follow_from_its_energy(x, y, lever):
    bearing, h = Bearing(axial=1e8, tilt=1e3, table=([0, 1e-5, 1e-3], [0, 500, 1e5])), 1e-9
    q = np.array([x, y, 2e-6, 3e-5, -4e-5, 0.0])
    steps = h * np.eye(6)[:5]
    energy = lambda q: strain_energy(bearing, lever, q[:, :5])  # noqa: E731
    gradient = (energy(q + steps) - energy(q - steps)) / (2 * h)
    force, *_ = bearing_functions(bearing, lever)
    linear = np.diag([0, 0, 1e8, 1e3, 1e3])
    expected = -np.array(force(None, 0.0, 0, q, [0.0] * 6))[:5] + linear @ q[:5]
    assert gradient == pytest.approx(expected, rel=1e-5, abs=0.02)
    r = np.hypot(x + lever * q[4], y - lever * q[3])
    if abs(r - 1e-5) > 1e-7 and r > 1e-7:
        slopes = (
            [np.array(force(None, 0.0, 0, q + s, [0.0] * 6))[:5] for s in steps],
            [np.array(force(None, 0.0, 0, q - s, [0.0] * 6))[:5] for s in steps],
        )
        tangent = tangent_stiffness(bearing, lever, q)[:5, :5] - linear
        assert -np.subtract(*slopes) / (2 * h) == pytest.approx(tangent, rel=1e-2, abs=1e4)


def test_a_bearing_is_read_from_a_table_with_units(tmp_path):
    path = tmp_path / "bearing.csv"
    path.write_text("# rig 3\nforce [kN]; displacement [um]\n1.1; 20\n0; 0\n0.1; 10\n")
    assert Bearing.from_table(path, axial=1e8) == Bearing(axial=1e8, table=([0, 10 * um, 20 * um], [0, 100, 1100]))
    path.write_text("force, displacement\n0, 0\n")
    with pytest.raises(ValueError, match="header"):
        Bearing.from_table(path)


def test_forces_beyond_a_table_are_refused():
    bearing = Bearing(axial=1e8, table=([0, 10 * um, 20 * um], [0, 100, 1100]))
    assert bearing.radial_force([5 * um, 15 * um]) == pytest.approx([50, 600])
    assert (bearing.linear, bearing.reach) == (False, 20 * um)
    assert np.diag(bearing.stiffness) == pytest.approx([1e8, 1e8, 1e8, 0, 0, 0])
    with pytest.raises(ValueError, match="beyond the table"):
        bearing.radial_force(21 * um)


def test_linear_bearings_are_positional_and_comparable():
    assert Bearing(5e8, 1e8, 2e5, 1e-6) == Bearing(radial=5e8, axial=1e8, tilt=2e5, damping_time=1e-6)
    assert Bearing(matrix=COUPLED) == Bearing(matrix=COUPLED.tolist())
    assert Bearing(5e8).linear and Bearing(matrix=COUPLED).linear


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({}, "has no stiffness"),
        ({"radial": 200}, r"radial must be 0 or from 10000 N/m on, got 200; pass N/m: 200 N/um are 200e6"),
        ({"radial": 2e8, "axial": 100}, "axial must be 0 or from 10000 N/m on, got 100"),
        ({"radial": 2e8, "axial": 1e8, "tilt": 0.2}, r"tilt must be 0 or from 1 N m/rad on, got 0.2"),
        ({"radial": 200, "clearance": 5e-6}, "200 N/um are 200e6"),
        ({"table": ([0, 1e-5, 2e-5], [0, 1e-3, 4e-3])}, "slope of the table must be 0 or from 10000 N/m on, got 300"),
        ({"matrix": LOOSE_SPIN * 1e-6}, r"matrix\[0, 0\] must be 0 or from 10000 N/m on, got 300"),
        ({"matrix": LOOSE_SPIN * [1, 1, 1, 1e-6, 1, 0]}, r"matrix\[3, 3\] must be 0 or from 1 N m/rad on, got 0.4"),
        ({"radial": 1e13}, "effectively rigid"),
        ({"tilt": 1e11}, "effectively rigid"),
        ({"radial": 1e8, "clearance": -1e-6}, "clearance must be >= 0"),
        ({"radial": 1e8, "clearance": 20.0}, "pass metres"),
        ({"axial": 1e8, "clearance": 1e-6}, "clearance needs a radial stiffness"),
        ({"radial": 1e8, "table": ([0, 1e-5], [0, 100])}, "leave radial out"),
        ({"radial": 1e8, "matrix": COUPLED}, "leave radial out"),
        ({"table": ([0, 1e-5], [0, 100]), "matrix": COUPLED}, "leave table out"),
        ({"table": ([0, 1e-5], [0, 100, 200])}, r"each \(n,\)"),
        ({"table": ([0, 1e-5], [1, 100])}, r"start at \(0, 0\)"),
        ({"table": ([0, 1e-5, 1e-5], [0, 100, 200])}, "must increase"),
        ({"table": ([0, 1e-5, 2e-5], [0, 100, 50])}, "must not fall"),
        ({"table": ([0, 1e-5], [0, 0])}, "end above 0 N"),
        ({"table": ([0, 10], [0, 100])}, "pass metres"),
        ({"table": ([0, 1e-5], [0, np.nan])}, "finite"),
        ({"matrix": np.eye(5)}, r"\(6, 6\)"),
        ({"matrix": LOOSE_SPIN + 1e7 * np.eye(6, k=1)}, "symmetric"),
        ({"matrix": LOOSE_SPIN + 13 * X_AND_ABOUT_Y}, "positive semi-definite"),
        ({"matrix": -LOOSE_SPIN}, "positive semi-definite"),
        ({"matrix": np.eye(6)}, "lets the shaft spin"),
        ({"matrix": np.zeros((6, 6))}, "has no stiffness"),
        ({"matrix": LOOSE_SPIN * 1e6}, "effectively rigid"),
    ],
)
def test_impossible_bearings_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        Bearing(**changes)


def test_rubber_mounts_are_bearings():
    """Shear mounts of machines: 1e4 to 1e5 N/m."""
    assert Bearing(2e4, 1e4, 5.0).stiffness[0, 0] == 2e4


def test_a_matrix_has_no_single_radial_force():
    with pytest.raises(ValueError, match="no single radial force"):
        Bearing(matrix=COUPLED).radial_force(1e-6)


@given(floats(-3e-5, 3e-5), floats(-3e-5, 3e-5), floats(-0.1, 0.1), floats(-0.1, 0.1))
def test_a_linear_table_is_damped_in_all_directions_like_a_linear_bearing(x, y, u, v):
    """A shaft that circles is damped by the secant of the law, also in a clearance that vanishes."""
    for bearing in (Bearing(axial=1e8, table=([0, 1e-3], [0, 2e5]), damping_time=4e-5), Bearing(2e8, clearance=1e-15)):
        forces, *_ = bearing_functions(bearing, 0.0)
        q, q_t = [x, y, 0, 0, 0, 0], [u, v, 0, 0, 0, 0]
        expected = [-2e8 * (x + bearing.damping_time * u), -2e8 * (y + bearing.damping_time * v)]
        assert forces(None, 0.0, 0, q, q_t)[:2] == pytest.approx(expected, rel=1e-6, abs=1e-3)
