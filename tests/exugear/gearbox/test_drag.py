"""Drag as data: Palmgren's torque by hand, limits, signs, units, and where a shaft carries it."""

import numpy as np
import pytest
from paper_gears import paper_gear

import exugear
from fem.units import mm, rpm

BALL = exugear.BearingDrag(60 * mm, 2.0, 20e-6, 3e-4, load=2000.0)


def test_palmgrens_torque_by_hand():
    """3000 rpm, 20 mm^2/s: M_0 = 1e-7 2 60000^(2/3) 60^3 = 66.2 N mm, M_1 = 0.0003 2000 60 = 36 N mm."""
    assert BALL.torque(3000 * rpm) == pytest.approx(66.21e-3 + 36e-3, rel=1e-4)
    slow = exugear.BearingDrag(60 * mm, 2.0, 20e-6)
    assert slow.torque([50 * rpm, 80 * rpm]) == pytest.approx([160e-7 * 2 * 60**3 * 1e-3] * 2, rel=0.01)
    assert slow.torque(200 * rpm) == pytest.approx(2 ** (2 / 3) * slow.torque(100 * rpm), rel=1e-6)


def test_load_is_that_of_the_bearing_where_none_is_given():
    free = exugear.BearingDrag(60 * mm, 2.0, 20e-6, 3e-4)
    assert (free.needs_load, BALL.needs_load) == (True, False)
    assert free.torque(300.0, 2000.0) == pytest.approx(BALL.torque(300.0), rel=1e-12)
    assert free.torque(300.0, 0.0) == pytest.approx(exugear.BearingDrag(60 * mm, 2.0, 20e-6).torque(300.0), rel=1e-12)


@pytest.mark.parametrize("drag", [BALL, exugear.Drag(0.5, 2e-3), exugear.Drag(viscous=1e-3), exugear.Drag()])
def test_drag_opposes_the_rotation_and_fades_at_rest(drag):
    omega = np.r_[-400.0, -1.0, 0.0, 1.0, 400.0]
    torque = drag.torque(omega)
    assert torque == pytest.approx(-drag.torque(-omega), abs=0)
    assert (torque * omega >= 0).all()
    assert torque[2] == 0


def test_constant_and_viscous_torque():
    assert exugear.Drag(0.5, 2e-3).torque(100.0) == pytest.approx(0.5 + 0.2, rel=1e-12)
    assert exugear.Drag(0.5, speed=2.0).torque(1.0) == pytest.approx(0.5 * np.tanh(0.5), rel=1e-12)


def test_a_shaft_lists_the_drags_of_its_bearings_and_its_own():
    seal, bearing = exugear.Drag(0.2), exugear.Bearing(1e8, 1e8, 1e4, drag=BALL)
    shaft = exugear.Shaft("a", {0.0: [paper_gear(), bearing], 50 * mm: seal})
    assert shaft.drags == [(0.0, BALL), (50 * mm, seal)]
    spinning = exugear.Shaft("a", {0.0: [paper_gear(), BALL, seal]})
    assert spinning.bearings == {}
    assert spinning.drags == [(0.0, BALL), (0.0, seal)]
    assert spinning.inertia == exugear.Shaft("a", {0.0: paper_gear()}).inertia


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: exugear.Drag(-1.0), r"constant must lie in \[0, 1e\+06\) N m, a drag brakes, got -1"),
        (lambda: exugear.Drag(viscous=-1.0), "viscous must lie in"),
        (lambda: exugear.Drag(1.0, speed=0.0), "speed must be at least 0.01 rad/s"),
        (lambda: exugear.BearingDrag(60, 2.0, 20e-6), r"got 60; pass metres: 60\*mm"),
        (lambda: exugear.BearingDrag(60 * mm, 2.0, 20.0), "20 mm\\^2/s are 20e-6"),
        (lambda: exugear.BearingDrag(60 * mm, -2.0, 20e-6), "f_0 must lie in"),
        (lambda: exugear.BearingDrag(60 * mm, 2.0, 20e-6, 3.0), "f_1 must lie in"),
        (lambda: exugear.BearingDrag(60 * mm, 2.0, 20e-6, load=-1.0), "load must lie in"),
        (lambda: exugear.Bearing(drag=BALL), "leave it out and put its drag on the shaft"),
        (lambda: exugear.Bearing(1e8, drag="seal"), "drag must be"),
        (lambda: BALL.torque(np.nan), "omega must be finite"),
        (lambda: BALL.torque(10.0, -1000.0), "load must be >= 0 N, got -1000; pass the magnitude"),
        (
            lambda: exugear.Shaft("a", {0.0: [paper_gear(), exugear.BearingDrag(60 * mm, 2.0, 20e-6, 3e-4)]}),
            "load of the BearingDrag at .* is not known; pass load=",
        ),
    ],
)
def test_impossible_drag_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
