"""Plots of load factors and dynamic stresses hold the data and name their units."""

import numpy as np
import pytest
import xarray as xr
from valid_arguments import by_name, load_factors, valid

import fem
from exugear import plots
from fem.units import MPa, mm, rpm


def lines_of(ax) -> list[np.ndarray]:
    return [line.get_ydata() for line in ax.get_lines()]


def test_dynamic_factor_is_drawn_over_the_speed_with_that_of_the_standard():
    data = valid("exugear.plots.plot_dynamic_factor", "data")
    iso = fem.iso6336.dynamic_factor(by_name()["pair"], 100.0, [50.0, 60.0])
    ax = plots.plot_dynamic_factor(data, iso=iso, linewidth=3)
    computed, standard = ax.get_lines()
    assert computed.get_ydata() == pytest.approx(data["K_v"].values[0])
    assert computed.get_xdata() == pytest.approx(data["speed"].values / rpm)
    assert computed.get_linewidth() == 3
    assert standard.get_ydata() == pytest.approx(iso.values)
    assert "rpm" in ax.get_xlabel()


def test_stress_is_drawn_over_time_for_both_gears_and_pressure_once():
    stress = valid("exugear.plots.plot_dynamic_stress", "data")
    roots, pressure = (plots.plot_dynamic_stress(stress, name=name) for name in ("root_stress", "peak_pressure"))
    assert lines_of(roots) == [pytest.approx(row / MPa) for row in stress["root_stress"].values]
    assert [text.get_text() for text in roots.get_legend().get_texts()] == ["pinion", "wheel"]
    assert lines_of(pressure) == [pytest.approx(stress["peak_pressure"].values / MPa)]
    assert "time [s]" in roots.get_xlabel()
    with pytest.raises(ValueError, match="name must be a stress"):
        plots.plot_dynamic_stress(stress, name="dte")


def test_line_load_is_drawn_with_its_mean_and_the_factors():
    data = load_factors()
    ax = plots.plot_load_factors(data)
    curve, mean = ax.get_lines()[:2]
    assert curve.get_ydata() == pytest.approx(data["line_load"].values[0] * mm)
    assert list(mean.get_ydata()) == pytest.approx([data["line_load"].values[0].mean() * mm] * 2)
    assert "1.2" in ax.get_legend().get_texts()[1].get_text()


def test_foreign_data_are_refused():
    for plot in (plots.plot_dynamic_factor, plots.plot_load_factors):
        with pytest.raises(ValueError, match="pass what"):
            plot(xr.Dataset())
    with pytest.raises(ValueError, match="several speeds"):
        data = valid("exugear.plots.plot_dynamic_factor", "data")
        plots.plot_dynamic_factor(data, iso=fem.iso6336.dynamic_factor(by_name()["pair"], 100.0, 50.0))
