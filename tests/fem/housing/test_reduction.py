"""Housings of a mesh reduced to the seats of bearings, against beams, plates and reciprocity."""

from functools import cache

import meshio
import numpy as np
import pytest
from skfem import MeshHex, MeshTet
from skfem.io.meshio import to_meshio

import exugear
import fem
from fem.units import GPa, mm

STEEL = fem.Material(E=210 * GPa, nu=0.3, density=7850.0)
LENGTH, WIDE, HIGH = 1.0, 0.1, 0.05


def at(axis: int, position: float):
    return lambda points: np.abs(points[axis] - position) < 1e-6


@cache
def cantilever(kind: str = "hexahedron") -> fem.ReducedHousing:
    """A bar clamped at one end, its seat at the other."""
    axes = np.linspace(0, LENGTH, 13), np.linspace(-WIDE / 2, WIDE / 2, 3), np.linspace(-HIGH / 2, HIGH / 2, 3)
    grid = {"hexahedron": MeshHex, "tetra": MeshTet}[kind].init_tensor(*axes)
    mesh = to_meshio(grid)
    return fem.reduce_housing(mesh, [at(0, LENGTH)], at(0, 0.0), material=STEEL, modes=8)


@pytest.mark.parametrize("kind", ["hexahedron", "tetra"])
def test_a_cantilever_has_the_stiffness_and_the_frequencies_of_a_beam(kind):
    housing = cantilever(kind)
    compliance = np.linalg.inv(housing.seat_stiffness)
    E, G, A = 210e9, 210e9 / 2.6, WIDE * HIGH
    I_y, I_z = WIDE * HIGH**3 / 12, HIGH * WIDE**3 / 12
    shear = LENGTH / (5 / 6 * G * A)
    beam = [LENGTH / (E * A), LENGTH**3 / (3 * E * I_z) + shear, LENGTH**3 / (3 * E * I_y) + shear]
    np.testing.assert_allclose(np.diag(compliance)[:3], beam, rtol=0.02)
    assert compliance[4, 4] == pytest.approx(LENGTH / (E * I_y), rel=0.015)
    first = [1.875104**2 / (2 * np.pi) * np.sqrt(E * x / (7850 * A)) for x in (I_y, I_z)]
    np.testing.assert_allclose(housing.frequencies[:2], first, rtol=0.02)
    assert 0 <= housing.errors.max() < 0.01
    assert housing.areas.sum() == pytest.approx(2 * (WIDE * HIGH + WIDE * LENGTH + HIGH * LENGTH))


def test_the_surface_moves_with_its_seat_and_radiates_most_in_resonance():
    housing, first = cantilever(), cantilever().frequencies[0]
    forces = np.zeros((3, 6))
    forces[:, 2] = 1.0
    frequency = [0.25 * first, first, 3 * first]
    velocity = housing.surface_velocity(frequency, forces)
    power = housing.radiated_power(frequency, forces)
    np.testing.assert_allclose(power, 1.204 * 343.2 / 2 * np.abs(velocity) ** 2 @ housing.areas)
    assert power[1] > 100 * max(power[0], power[2])
    # Far below the resonance the seat follows the force by its static compliance, and the surface by at most that.
    quiet = housing.response([1.0], forces[:1], damping_ratio=0.0)[0]
    assert quiet[2].real == pytest.approx(np.linalg.inv(housing.seat_stiffness)[2, 2], rel=2e-3)
    slow = np.abs(housing.surface_velocity([1.0], forces[:1])[0])
    assert slow.max() == pytest.approx(2 * np.pi * abs(quiet[2]), rel=0.1)


@cache
def wall() -> fem.ReducedHousing:
    """A wall with two square bosses as seats, which stands on its lower edge."""
    grid = MeshHex.init_tensor(np.linspace(0, 0.3, 7), np.linspace(0, 0.2, 5), np.linspace(0, 0.02, 2))
    in_square = [
        lambda p, x=x: (np.abs(p[0] - x) < 0.026) & (np.abs(p[1] - 0.1) < 0.051) & (p[2] > 0.019)
        for x in (0.075, 0.225)
    ]
    return fem.reduce_housing(to_meshio(grid), in_square, at(1, 0.0), modes=10)


def test_seats_of_a_common_wall_move_each_other():
    housing = wall()
    compliance = np.linalg.inv(housing.seat_stiffness)
    np.testing.assert_allclose(compliance, compliance.T, rtol=1e-8, atol=1e-12 * np.abs(compliance).max())
    assert compliance[2, 8] > 0.2 * compliance[2, 2]
    # The wall is its own mirror image.
    assert compliance[2, 2] == pytest.approx(compliance[8, 8], rel=1e-6)
    np.testing.assert_allclose(housing.centres, [[0.075, 0.1, 0.02], [0.225, 0.1, 0.02]], atol=1e-9)


def test_a_reduced_wall_is_the_housing_of_a_gearbox():
    housing = exugear.Housing.from_reduction(wall(), [("fast", 0.0), ("slow", 0.0)], damping_time=1e-5)
    np.testing.assert_allclose(housing.seat_stiffness, wall().seat_stiffness, rtol=1e-9)
    gear = fem.Gear(z=50, m_n=3 * mm, b=20 * mm, d_bore=30 * mm)
    ball = exugear.Bearing(radial=3e8, axial=1e8)
    shafts = [exugear.Shaft(name, {0.0: ball, 40 * mm: gear, 80 * mm: ball}) for name in ("fast", "slow")]
    law = exugear.MeshForce([0.0, 0.5], [0, 1 * mm], [[0, 5e5], [0, 5e5]])
    box = exugear.Gearbox([exugear.Stage(*shafts, law, pair=fem.GearPair(gear, gear, a=150 * mm))], housing=housing)
    data = exugear.load_distribution(box, 200.0, mesh_stiffness=15e9)
    assert float(abs(data["seat_displacement"]).max()) > 0
    text = str(exugear.plan(box))
    assert exugear.plan(box).elastic_housing.modes > 0
    assert "static stiffness alone" in text
    assert "stand on ground" in text


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"seats": [at(0, 5.0)]}, "seat 0 has no facet"),
        ({"fixed": at(0, 5.0)}, "fixed has no facet"),
        ({"seats": [at(1, WIDE / 2)]}, "must not touch each other"),
        ({"modes": 0}, "modes must lie in"),
        ({"mesh": meshio.Mesh(np.zeros((3, 3)), [("triangle", [[0, 1, 2]])])}, "tetrahedra or hexahedra"),
    ],
)
def test_wrong_meshes_and_regions_are_refused_in_words(changes, words):
    axes = np.linspace(0, LENGTH, 3), np.linspace(-WIDE / 2, WIDE / 2, 2), np.linspace(-HIGH / 2, HIGH / 2, 2)
    valid = {"mesh": to_meshio(MeshHex.init_tensor(*axes)), "seats": [at(0, LENGTH)], "fixed": at(0, 0.0), "modes": 3}
    with pytest.raises(ValueError, match=words):
        fem.reduce_housing(**valid | changes)


def test_a_mesh_in_millimetres_is_refused():
    axes = np.linspace(0, 1000, 3), np.linspace(0, 50, 2), np.linspace(0, 50, 2)
    with pytest.raises(ValueError, match="must be in metres"):
        fem.reduce_housing(to_meshio(MeshHex.init_tensor(*axes)), [at(0, 1000.0)], at(0, 0.0))
