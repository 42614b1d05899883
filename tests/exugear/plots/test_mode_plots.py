"""Plots of modes: lines of the Campbell diagram, its marks, and displaced shafts."""

from itertools import pairwise

import numpy as np
import planetary_set
import pytest
from modal_boxes import pair_of_shafts, three_shafts
from planetary_boxes import helical_box, waving_law

import exugear
from exugear import plots
from fem.units import deg, mm, rpm


@pytest.fixture(scope="module")
def model() -> exugear.Model:
    return three_shafts()


def test_campbell_diagram_shows_all_modes_and_orders_and_marks_meshing_modes(model):
    data = exugear.campbell(model, speed=(0.0, 6000 * rpm), load=150.0)
    ax = plots.plot_campbell(data, plots.figure().axes[0], marked=0.3)
    lines = [line for line in ax.lines if len(line.get_xdata()) == data.sizes["speed"]]
    assert len(lines) == data.sizes["mode"] + data.sizes["order"]
    marked = data["crossing_energy_share"] >= 0.3
    assert ax.collections[0].get_offsets().data == pytest.approx(
        np.c_[data["crossing_speed"][marked] / rpm, data["crossing_frequency"][marked]]
    )
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    orders = ["orders of mesh input-middle", "orders of mesh middle-output", "rotation of shafts"]
    assert labels == ["modes", *orders, "50 % of the mode's energy in the mesh"]


def test_diagram_without_a_crossing_is_drawn():
    data = exugear.campbell(pair_of_shafts(), speed=(0.0, 1.0), load=150.0)
    assert data.sizes["crossing"] == 0
    assert plots.plot_campbell(data, plots.figure().axes[0]).get_xlim()[1] == pytest.approx(1.0 / rpm)


def test_mode_is_drawn_with_its_largest_displacement_as_half_the_largest_radius(model):
    data = exugear.modes(model, load=150.0)
    radius = float(data["part_radius"].max()) / mm
    for mode in data["mode"].values:
        ax = plots.plot_modes(data, plots.figure().axes[0], mode=int(mode))
        positions = ax.get_xticks()
        moved = [line for line in ax.lines if line.get_color() in ("#0072B2", "#E69F00") and line.get_xdata().size]
        along = [np.abs(x - positions[i // 2]).max() for i, x in enumerate(line.get_xdata() for line in moved)]
        arrows = [np.subtract(text.xy, text.xyann) for text in ax.texts]
        largest = max(*along, *(np.abs(arrow).max() for arrow in arrows), 0.0)
        assert largest <= 0.5 * radius * (1 + 1e-6)
        assert largest >= 0.3 * radius
        assert f"mode {mode}: " in ax.get_title()


def test_many_shafts_stand_in_rows_in_which_they_can_be_read():
    """Six members of a set in space, carrier included: two rows of three, of which none reaches into another."""
    data = exugear.modes(exugear.build(helical_box(waving_law())), load=500.0)
    axes = [plots.plot_modes(data, plots.figure().axes[0], mode=mode) for mode in (5, 8)]
    for ax in axes:
        gears = [patch.get_bbox() for patch in ax.patches]
        names = [text.get_text() for text in ax.texts if text.get_text()]
        assert sorted(names) == sorted(dict.fromkeys(data["part_shaft"].values.tolist())) and len(names) == 6
        rows = sorted({round(box.y0, 6) for box in gears})
        assert len(rows) == 2 and rows[1] - rows[0] > gears[0].height
        for row in rows:
            ends = sorted((box.x0, box.x1) for box in gears if round(box.y0, 6) == row)
            assert len(ends) == 3 and all(left[1] < right[0] for left, right in pairwise(ends))
        assert max(box.width for box in gears) > 0.25 * np.diff(ax.get_xlim())
    orbit = data["part_radius"].values[data["part_kind"].values == "carrier"]
    assert orbit == pytest.approx(90 * mm / np.cos(15 * deg))


def test_data_of_another_kind_are_refused(model):
    data = exugear.modes(model, load=150.0)
    with pytest.raises(ValueError, match=r"data must have crossing_speed; pass what exugear.campbell"):
        plots.plot_campbell(data)
    with pytest.raises(ValueError, match=r"mode must lie in \[1, 18\]"):
        plots.plot_modes(data, mode=19)
    with pytest.raises(ValueError, match=r"data lacks part_shaft and body_radius; pass what exugear.modes"):
        plots.plot_modes(data.drop_vars("part_shaft"))


def test_planetary_set_is_drawn_with_all_its_bodies():
    gears = planetary_set.build()
    gears.mbs.Assemble()
    planetary_set.put_into_mesh(gears)
    ax = plots.plot_modes(exugear.modes(gears.mbs), plots.figure().axes[0], mode=2)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == list(gears.nodes)
    lines = [(line.get_color(), line.get_linestyle()) for line in ax.get_legend().get_lines()]
    assert len(set(lines)) == len(gears.nodes)
    radii = sorted({round(patch.radius, 6) for patch in ax.patches})
    base = (0.0, planetary_set.R_SUN / mm, planetary_set.R_RING / mm)
    assert radii == pytest.approx(base, abs=1e-5)
