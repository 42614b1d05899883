"""One style of all plots: signature, properties of artists, settings of matplotlib, legends beside the data."""

import inspect

import matplotlib
import pytest
from matplotlib.colors import to_rgba
from scenes import smooth_map
from valid_arguments import by_name, valid

from exugear import plots

NAMES = [name for name in plots.__all__ if name.startswith("plot_")]


@pytest.mark.parametrize("name", NAMES)
def test_every_plot_takes_axes_and_style_and_leaves_the_settings_of_matplotlib(name):
    parameters, before = inspect.signature(getattr(plots, name)).parameters, dict(matplotlib.rcParams)
    assert parameters["ax"].default is None
    assert [*parameters.values()][-1].kind is inspect.Parameter.VAR_KEYWORD
    by_name()
    given = {key: valid(f"exugear.plots.{name}", key) for key in [*parameters][:-1]}
    axes = plots.figure(spatial=(0,) if name == "plot_solid" else ()).axes[0]
    assert getattr(plots, name)(**{key: x for key, x in given.items() if x is not None} | {"ax": axes}) is axes
    assert dict(matplotlib.rcParams) == before


def test_style_reaches_the_lines_by_long_and_short_names():
    ax = plots.figure().axes[0]
    for style in ({"color": "k", "linewidth": 3.0, "label": "map"}, {"c": "k", "lw": 3.0, "label": "map"}):
        line = plots.plot_ste(smooth_map((150,)), ax, **style).lines[-1]
        assert to_rgba(line.get_color()) == to_rgba("k")
        assert (line.get_linewidth(), line.get_label()) == (3.0, "map")
    picture = plots.plot_contact_pattern(
        valid("exugear.plots.plot_contact_pattern", "data"), ax, cmap="cividis", vmax=7.0
    ).collections[0]
    assert (picture.get_cmap().name, picture.norm.vmax) == ("cividis", 7.0)


def test_letters_are_of_one_size_and_legends_lie_beside_the_data():
    ax = plots.plot_stiffness(smooth_map((0, 150, 350)), plots.figure().axes[0])
    ax.figure.canvas.draw()
    sizes = {ax.xaxis.label.get_size(), ax.yaxis.label.get_size()}
    assert sizes == {11}
    assert {label.get_size() for label in ax.get_xticklabels()} == {10}
    assert ax.get_legend().get_window_extent().x0 >= ax.get_window_extent().x1
    assert not ax.spines["top"].get_visible()
