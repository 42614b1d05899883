"""Plots of designs of flanks: what a drawing office and a designer read from them."""

from dataclasses import replace
from math import hypot

import numpy as np
import pytest
import xarray as xr
from paper_gears import paper_pair

import fem
from exugear import plots
from fem.units import mm, um


def relieved() -> fem.GearPair:
    pair = paper_pair()
    flank = [fem.TipRelief(12 * um, 3 * mm), fem.LeadCrowning(5 * um), fem.EndRelief(4 * um, 3 * mm)]
    return replace(pair, pinion=replace(pair.pinion, flank=flank))


def test_profile_and_lead_show_the_material_that_is_removed():
    pair = relieved()
    gear = pair.pinion
    profile, lead = (
        plots.plot_flank(pair, direction=direction).lines[0].get_xydata() for direction in ("profile", "lead")
    )
    assert profile[0] == pytest.approx([gear.roll_form / mm, 0.0], abs=1e-9)
    assert profile[-1] == pytest.approx([gear.roll_tip / mm, -12.0])
    assert lead[[0, -1], 1] == pytest.approx([-9.0, -9.0])
    assert plots.plot_flank(pair, gear="wheel").lines[0].get_ydata() == pytest.approx(0.0)
    ax = plots.plot_flank(pair)
    begins = 2 * hypot(gear.roll_tip - 3 * mm, gear.r_b) / mm
    assert f"d {begins:.3f} mm" in [text.get_text() for text in ax.texts]


def test_the_drawing_has_both_gears_and_their_modifications_in_words():
    drawing = plots.flank_drawing(relieved(), title="best")
    titles = [ax.get_title() for ax in drawing.axes]
    assert titles == [
        "pinion, z = 57: profile",
        "pinion, z = 57: lead",
        "wheel, z = 57: profile",
        "wheel, z = 57: lead",
    ]
    words = [text.get_text() for ax in drawing.axes for text in ax.texts]
    assert any("TipRelief(C_a=12 um, length=3 mm)" in text for text in words)
    assert "no modification" in words


def test_landscape_has_its_optimum_and_units():
    axes = {"C_a": ("C_a", [0.0, 10e-6, 20e-6], {"unit": "um"}), "share": ("share", [0.0, 1.0], {"unit": ""})}
    best = {"optimum_C_a": 10e-6, "optimum_share": 1.0}
    data = xr.DataArray(np.arange(6.0).reshape(3, 2), axes, ("C_a", "share"), attrs=best)
    ax = plots.plot_landscape(data)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("C_a [µm]", "share")
    assert ax.lines[0].get_xydata().tolist() == [[pytest.approx(10.0), 1.0]]
    line = plots.plot_landscape(data.isel(share=0))
    assert line.lines[0].get_ydata().tolist() == [0.0, 2.0, 4.0]
    with pytest.raises(ValueError, match="data must be a landscape"):
        plots.plot_landscape(xr.DataArray([1.0], dims="x"))


def test_a_front_is_drawn_in_micrometres():
    values = {"low": ("case", [1e-6, 2e-6], {"units": "m"}), "high": ("case", [5e8, 4e8], {"units": "Pa"})}
    ax = plots.plot_pareto_front(xr.Dataset(values, attrs={"first": "low", "second": "high"}))
    assert ax.lines[0].get_xdata() == pytest.approx([1.0, 2.0])
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("low [µm]", "high [Pa]")
    with pytest.raises(ValueError, match="data must be a Pareto front"):
        plots.plot_pareto_front(xr.Dataset(values))
