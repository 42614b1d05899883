"""Offsets of displaced and tilted shafts."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import paper_gear, paper_pair
from trains import coupled

from exugear import Gearbox, Placement, Shaft
from fem.units import mm


def displaced(pinion: Placement, wheel: Placement, direction: int = 1) -> dict[str, float]:
    """Offsets of the stage of a pair whose pinion turns by direction, gears at 50 mm."""
    shafts = [Shaft(name, {50 * mm: paper_gear()}, offset=x) for name, x in (("fast", pinion), ("slow", wheel))]
    if direction == 1:
        box = Gearbox([coupled(*shafts)])
        return box.offsets(box.stages[0])
    first = Shaft("first", {50 * mm: paper_gear()})
    box = Gearbox([coupled(first, shafts[0]), coupled(*shafts)])
    return box.offsets(box.stages[1])


NONE = Placement()


def test_offsets_of_a_displaced_wheel():
    pair = paper_pair()
    assert displaced(NONE, NONE) == pytest.approx({"a": pair.a, "misalignment": 0, "axial": 0}, abs=1e-15)
    moved = displaced(NONE, Placement(x=1e-4, z=2e-4))
    assert moved == pytest.approx({"a": pair.a + 1e-4, "misalignment": 0, "axial": 2e-4}, abs=1e-12)
    parting = displaced(NONE, Placement(tilt_y=1e-3))
    assert parting["a"] == pytest.approx(pair.a + 50 * mm * 1e-3, rel=1e-8)
    assert parting["misalignment"] == pytest.approx(1e-3 * np.sin(pair.alpha_wt), rel=1e-2)


@pytest.mark.parametrize("direction", [1, -1])
def test_wheel_tilted_towards_the_driving_force_opens_the_gap(direction):
    """tilt_x < 0 tilts the axis towards +y, where a pinion that turns counter-clockwise drives the wheel."""
    lean = direction * 1e-3
    leaning = displaced(NONE, Placement(y=-50 * mm * lean, tilt_x=-lean), direction)
    assert leaning["misalignment"] == pytest.approx(1e-3 * np.cos(paper_pair().alpha_wt), rel=1e-5)
    assert leaning["a"] == pytest.approx(paper_pair().a, rel=1e-9)


def test_shafts_displaced_together_keep_their_offsets():
    """A rotation of the whole pair about the pinion's origin; only second-order terms remain."""
    a, tilt_x, tilt_y = paper_pair().a, 1e-3, -2e-3
    pinion = Placement(x=1e-3, y=2e-3, z=-1e-3, tilt_x=tilt_x, tilt_y=tilt_y)
    wheel = replace(pinion, z=pinion.z - a * tilt_y)
    together = displaced(pinion, wheel)
    assert together == pytest.approx({"a": a, "misalignment": 0, "axial": 0}, abs=1e-6)
