"""Capacity, basic reference rating life and contact pressure."""

from dataclasses import replace

import numpy as np
import pytest
from rolling_bearings import GROOVE, ROLLER, deep_groove

from exugear import RollingBearing
from fem.units import mm

STRAIGHT = RollingBearing.cylindrical_roller(**ROLLER)
STRAIGHT = replace(STRAIGHT, rows=(replace(STRAIGHT.rows[0], drop=0.0),))


@pytest.mark.parametrize(("direction", "life"), [(0, 13163.0e6), (2, 2222.73e6)])
def test_the_life_of_a_deep_groove_bearing_is_the_known_one(direction, life):
    assert deep_groove().under(1000.0 * np.eye(5)[direction]).life == pytest.approx(life, rel=5e-5)


@pytest.mark.parametrize(
    ("bearing", "exponent"),
    [(deep_groove(), 3), (STRAIGHT, 4)],
    ids=["balls", "rollers"],
)
def test_lives_fall_by_their_exponent(bearing, exponent):
    lives = [bearing.under((F, 0, 0, 0, 0)).life for F in (0.2 * bearing.C, 0.4 * bearing.C)]
    assert np.log2(lives[0] / lives[1]) == pytest.approx(exponent, rel=1e-6)


def test_under_its_capacity_a_bearing_lives_about_a_million_revolutions():
    """Rollers up to 1 / 0.83^4 times as long: the factor of ISO 281 for edges, which the laminae replace."""
    assert deep_groove().under((23.4e3, 0, 0, 0, 0)).life == pytest.approx(1e6, rel=0.03)
    roller = RollingBearing.cylindrical_roller(**ROLLER)
    assert 1e6 < roller.under((roller.C, 0, 0, 0, 0)).life < 1e6 / 0.83**4


def test_the_capacity_follows_from_the_geometry():
    """A 6305 with these balls has 22.5 to 23.4 kN in catalogues."""
    computed = RollingBearing.deep_groove(**{name: x for name, x in GROOVE.items() if name != "C"}).C
    assert computed == pytest.approx(23.1e3, rel=0.01)


def test_two_loads_wear_as_the_sum_of_their_damage():
    """Loads of the same positions: 1 / L = sum of the shares over the lives."""
    bearing = deep_groove()
    q = np.array([bearing.under((F, 0, 0, 0, 0)).displacement for F in (500.0, 2000.0)])
    each = np.array([bearing.life(displacement) for displacement in q])
    assert 1 / bearing.life(q, [0.7, 0.3]) == pytest.approx(0.7 / each[0] + 0.3 / each[1], rel=2e-3)


def test_the_pressure_at_the_static_capacity_is_that_of_iso_76():
    """The heaviest of 7 balls carries about 5 F_r / Z: 4200 MPa under about 11 kN, the C_0 of a 6305."""
    loaded = deep_groove().under((11.5e3, 0, 0, 0, 0))
    assert loaded.pressures[0][0].max() == pytest.approx(4200e6, rel=0.05)
    assert loaded.pressures[0][0].argmax() == 0
    assert loaded.loads[0][0] == pytest.approx(4.37 / 7 * 11.5e3, rel=0.05)
    roller = STRAIGHT.under((5e3, 0, 0, 0, 0))
    per_length, curvature = roller.loads[0].max() / (12 * mm), 2 / (10 * mm * (1 - 1 / 6))
    expected = (per_length * 210e9 * curvature / (2 * np.pi * (1 - 0.3**2))) ** 0.5
    assert roller.pressures[0][0].max() == pytest.approx(expected, rel=1e-6)
