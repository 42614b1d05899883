"""Hertzian contact against tables of Harris."""

import pytest

from exugear.rolling_bearings.hertz import BallContact, ellipse


def test_ellipse_agrees_with_table_6_1_of_harris():
    assert ellipse(0.93657) == pytest.approx((3.738, 0.4166, 0.6112), rel=2e-4)


def test_a_ball_on_a_plane_deflects_by_the_closed_form():
    """Q = (4 / 3) E* R^0.5 d^1.5, p = 1.5 Q / (pi a^2) with a^2 = R d (K. L. Johnson, Contact mechanics)."""
    radius, compliance, force = 5e-3, 1e-11, 100.0
    contact = BallContact(2 * radius, 1e9, 0.0, compliance)
    assert contact.stiffness == pytest.approx(4 / 3 / compliance * radius**0.5, rel=1e-6)
    approach = (force / contact.stiffness) ** (2 / 3)
    assert contact.pressure(force) == pytest.approx(1.5 * force / (3.14159265 * radius * approach), rel=1e-6)
