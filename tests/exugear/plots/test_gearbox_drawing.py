"""The drawing of a gearbox is to scale."""

import pytest
from matplotlib.patches import Rectangle
from planetary_boxes import planetary_box
from scenes import paper_gear, two_stages

from exugear.plots import plot_gearbox
from fem.units import mm


def rectangles(box) -> list[tuple[float, ...]]:
    """(left, low, width, height) of all rectangles [mm]."""
    patches = [patch for patch in plot_gearbox(box).patches if isinstance(patch, Rectangle)]
    return [(*patch.get_xy(), patch.get_width(), patch.get_height()) for patch in patches]


def test_mates_lie_at_their_centre_distance_and_bodies_reach_their_root_circles():
    box, gear = two_stages(), paper_gear()
    bodies = [x for x in rectangles(box) if x[3] == pytest.approx(gear.d_f / mm)]
    heights = sorted({round(low + height / 2, 6) for _, low, _, height in bodies}, reverse=True)
    assert heights == pytest.approx([0, -150, -300])
    assert {round(width, 9) for _, _, width, _ in bodies} == {gear.b / mm}


def test_teeth_reach_from_root_to_tip_circles():
    tip, root = paper_gear().d_a / 2 / mm, paper_gear().d_f / 2 / mm
    bands = [(low, low + height) for _, low, _, height in rectangles(two_stages()) if height < 10]
    for expected in ((-tip, -root), (root - 150, tip - 150)):
        assert any(band == pytest.approx(expected) for band in bands)


def test_a_set_shows_one_planet_between_sun_and_ring():
    ax = plot_gearbox(planetary_box())
    names = "\n".join(text.get_text() for text in ax.texts)
    assert "planet 1" in names and "planet 2" not in names
    assert all(name in names for name in ("sun", "ring", "carrier"))
