"""Plot of branches: styles by stability, marks of bifurcations, the swept run behind them."""

import numpy as np
import pytest

import exugear
from exugear import plots
from fem.units import rpm, um


@pytest.fixture(scope="module")
def data(spinning):
    return exugear.steady_states(spinning, speed=(1000 * rpm, 3500 * rpm), load=150.0)


def drawn(data, **options):
    return plots.plot_branches(data, plots.figure().axes[0], **options)


def test_unstable_orbits_are_dashed_and_all_points_drawn(data):
    ax = drawn(data)
    pieces = {style: [line for line in ax.lines if line.get_linestyle() == style] for style in ("-", "--")}
    between = sum(len(line.get_xdata()) - 1 for lines in pieces.values() for line in lines)
    assert between == data.sizes["point"] - np.unique(data["branch"]).size
    (unstable,) = pieces["--"]
    dashed = np.isin(data["rms"] / um, unstable.get_ydata())
    assert (dashed >= ~data["stable"].values).all()
    assert np.count_nonzero(data["stable"].values & dashed) <= 2


def test_folds_are_marked(data):
    folds = data["mesh_frequency"].values[data["bifurcation"] == "fold"]
    (marks,) = [line for line in drawn(data).lines if line.get_marker() == "o"]
    assert marks.get_xdata() == pytest.approx(folds)


def test_a_harmonic_has_its_order_in_the_label(data):
    ax = drawn(data, harmonic=2.0)
    assert "2 x mesh frequency" in ax.get_ylabel()
    assert max(line.get_ydata().max() for line in ax.lines) == pytest.approx(
        float(data["harmonics"].sel(harmonic=2.0).max() / um)
    )


def test_a_swept_run_lies_on_the_stable_branch(spinning, data):
    run = exugear.run_up(spinning, speed=(2200 * rpm, 3500 * rpm), duration=1.0, load=150.0, progress=False, checks=0)
    swept = drawn(data, run=run).lines[0]
    stable = data.isel(point=np.flatnonzero(data["stable"].values & (data["mesh_frequency"].values > 2000)))
    stable = stable.sortby("mesh_frequency")
    expected = np.interp(swept.get_xdata(), stable["mesh_frequency"], stable["rms"] / um)
    assert swept.get_ydata()[5:] == pytest.approx(expected[5:], rel=0.04)


def test_refusals(data):
    with pytest.raises(ValueError, match="quantity must be one of"):
        drawn(data, quantity="mean")
    with pytest.raises(ValueError, match="harmonic must be one of"):
        drawn(data, harmonic=99.0)


def test_the_title_names_the_load_or_the_loads_by_their_shafts(data):
    several = data.assign_attrs(loads=[100.0, 50.0], loaded_shafts=["left", "right"])
    assert drawn(data).get_title() == "fast-slow, 150 N m"
    assert drawn(several).get_title() == "fast-slow, 100 N m on left, 50 N m on right"
