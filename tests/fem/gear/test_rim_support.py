"""Supports of a ring: where they may be, what they must hold, and after which turn they repeat."""

from math import pi

import numpy as np
import pytest
from paper_gears import paper_gear
from ring_gears import bolted, thin_ring_pair

import fem
from fem.gear.rim_support import from_text, period, to_text
from fem.units import deg, mm


@pytest.mark.parametrize(
    ("supports", "turn"),
    [
        ((), None),
        ((fem.Bush(radial=1e9, tangential=1e9),), None),
        ((bolted(number=12),), 2 * pi / 12),
        ((bolted(angles=(0.0, 0.5, pi, pi + 0.5)),), pi),
        ((bolted(angles=(0.0, 0.5, 2.0)),), 2 * pi),
        ((bolted(number=12), bolted(number=8, first=3 * deg)), 2 * pi / 4),
    ],
)
def test_supports_repeat_after_a_turn(supports, turn):
    assert period(supports) == (None if turn is None else pytest.approx(turn))
    assert from_text(to_text(supports)) == supports


@pytest.mark.parametrize(
    ("support", "message"),
    [
        (bolted(number=3, tangential=0.0), "against rotation"),
        (bolted(number=1), "displacement and rotation"),
        (bolted(number=2, first=1.0, radial=0.0), "displacement and rotation"),
        (fem.Bush(radial=1e9, tangential=0.0), "against rotation"),
        (bolted(width=60 * mm), "width of bolts must be at most"),
        ("bolts", "support must hold fem.Bolts or fem.Bush"),
    ],
)
def test_supports_that_do_not_hold_the_ring_are_refused(support, message):
    with pytest.raises(ValueError, match=message):
        thin_ring_pair(support)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"number": 3, "angles": (0.0, 1.0)}, "one of them"),
        ({"angles": (0.0, 90.0, 180.0)}, "pass radians|within two turns"),
        ({"angles": (0.0, 2 * pi)}, "less than a turn"),
        ({"radial": -1.0}, "radial must be a stiffness >= 0"),
        ({"radial": 0.0, "tangential": 0.0}, "got 0 for both"),
        ({"width": 0.0}, "width must be > 0"),
        ({"number": 2.5}, "whole number of bolts"),
        ({"first": 45.0}, "pass radians"),
    ],
)
def test_impossible_bolts_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        bolted(**options)


def test_external_gears_have_no_support():
    with pytest.raises(ValueError, match="support holds the rim of an internal gear"):
        paper_gear(support=bolted())


def test_equal_bolts_count_from_the_first():
    bolts = bolted(number=4, first=10 * deg)
    assert np.array(bolts.angles) == pytest.approx(np.array([10, 100, 190, 280]) * deg)
