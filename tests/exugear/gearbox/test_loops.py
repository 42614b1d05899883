"""Loops of gears: which angles close them, by the messages and tooth by tooth."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import paper_pair
from trains import STIFF, apart, coupled, gear, half_angles, loose_pair, on, pressed, square, wheels

from exugear import Gearbox, Stage
from fem.units import mm

Z = 57


def test_square_of_equal_gears_assembles():
    box = square()
    assert box.shaft_positions["d"] == pytest.approx((150 * mm, 150 * mm))
    assert box.directions == {"a": 1, "b": -1, "c": -1, "d": 1}
    assert box.static_forces(100.0) == pytest.approx([50 / paper_pair().wheel.r_b] * 4)


@given(st.integers(34, 100))
@settings(max_examples=20)
def test_rhombus_assembles_at_whole_multiples_of_half_a_pitch(n):
    """Turning its sides by delta shifts the teeth by 4 z delta / 2 pi pitches against each other."""
    angle = n * np.pi / (2 * Z)
    square(angle)
    with pytest.raises(ValueError, match=r"phase error -?0\.4"):
        square(angle + 0.4 * np.pi / (2 * Z))


def quadrilateral(angles, teeth=(25, 40, 31, 28)) -> list[Stage]:
    """Four unlike gears, b and c between a and d."""
    gears = [gear(z, x) for z, x in zip(teeth, (0.1, 0.0, 0.3, -0.1), strict=True)]
    a, b, c, d = (on(name, part) for name, part in zip("abcd", gears, strict=True))
    ends = [(a, b), (a, c), (b, d), (c, d)]
    pairs = [loose_pair(fast.gears[0.0], slow.gears[0.0]) for fast, slow in ends]
    stages = zip(ends, pairs, angles, strict=True)
    return [Stage(*pair_ends, STIFF, pair=pair, angle=angle) for pair_ends, pair, angle in stages]


def refused_angles(angles) -> tuple[str, list[float]]:
    """The message that refuses a quadrilateral, and the angles that it proposes."""
    with pytest.raises(ValueError, match="angle=") as refused:
        Gearbox(quadrilateral(angles))
    named = {int(i): float(angle) for angle, i in re.findall(r"angle=(\S+) in stage (\d)", str(refused.value))}
    return str(refused.value), [named.get(i, angle) for i, angle in enumerate(angles)]


def pressed_both_ways(angles) -> float:
    """Tooth by tooth from a over b and over c to d: how far the latter puts its teeth ahead, in pitches."""
    pairs = [stage.pair for stage in quadrilateral(angles)]
    a, b, c, d = pairs[0].pinion, pairs[0].wheel, pairs[1].wheel, pairs[3].wheel
    start = angles[0] - half_angles(a, pairs[0].a * a.z / (a.z + b.z))
    ends = []
    for middle, i, j in ((b, 0, 2), (c, 1, 3)):
        tooth, _ = pressed(pairs[i], a, start, angles[i], +1)
        ends.append(pressed(pairs[j], middle, tooth, angles[j], -1)[0])
    return (ends[1] - ends[0]) * d.z / (2 * np.pi)


def test_loop_of_unlike_gears_fits_tooth_by_tooth():
    """The miss of the message is that of the teeth, and 0 at the angles that it names."""
    _, closed = refused_angles([0.2, 1.4, 1.5, 0.0])
    message, fitting = refused_angles(closed)
    miss = float(re.search(r"phase error (\S+) pitch", message)[1])
    assert apart(pressed_both_ways(closed), miss) < 1e-4
    assert apart(pressed_both_ways(fitting), 0) < 1e-5
    assert Gearbox(quadrilateral(fitting)).phases[0] == 0


def test_loop_that_cannot_close_gets_no_angles():
    with pytest.raises(ValueError, match="no angles nearby fit"):
        Gearbox(quadrilateral([0.0, np.pi, 1.0, 2.0], teeth=(60, 40, 31, 18)))


def test_angles_of_the_messages_close_the_loops():
    """The angles that the messages name are taken, and the box is built."""
    a, b, c, d = wheels("a", "b", "c", "d")
    stages = [coupled(a, b), coupled(a, c, 1.2), coupled(b, d, 1.21), coupled(c, d, 0.01)]
    with pytest.raises(ValueError, match=r"does not close, the gap is .* mm; these angles") as refused:
        Gearbox(stages)
    stages = with_angles(stages, str(refused.value))
    with pytest.raises(ValueError, match=r"phase error .* pitch.* gear of its own") as refused:
        Gearbox(stages)
    assert len(Gearbox(with_angles(stages, str(refused.value))).phases) == 4


def with_angles(stages: list[Stage], message: str) -> list[Stage]:
    named = {int(i): float(angle) for angle, i in re.findall(r"angle=(\S+) in stage (\d)", message)}
    assert named
    return [coupled(x.fast, x.slow, named.get(i, x.angle)) for i, x in enumerate(stages)]
