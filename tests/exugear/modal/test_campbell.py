"""Campbell diagram: lines of modes, orders, and crossings that agree with the modes at their speeds."""

from math import pi

import numpy as np
import pytest
from modal_boxes import pair_of_shafts, three_shafts
from planetary_boxes import planetary_box

import exugear
from fem.units import rpm

TOP = 8000 * rpm


@pytest.fixture(scope="module")
def diagram():
    return exugear.campbell(three_shafts(), speed=(0.0, TOP), load=150.0)


def test_crossings_lie_on_their_orders_and_on_modes(diagram):
    model = three_shafts()
    frequencies = diagram["order_ratio"].sel(order=diagram["crossing_order"]) * diagram["crossing_speed"] / (2 * pi)
    assert diagram["crossing_frequency"].values == pytest.approx(frequencies.values, rel=1e-12)
    assert (np.diff(diagram["crossing_speed"]) >= 0).all()
    for number in np.flatnonzero(diagram["crossing_energy_share"] > 0.3)[::3]:
        crossing = diagram.isel(crossing=number)
        data = exugear.modes(model, load=150.0, speed=float(crossing["crossing_speed"]))
        nearest = data["frequency"] - crossing["crossing_frequency"]
        mode = int(np.abs(nearest.values).argmin())
        assert abs(float(nearest[mode])) < 1e-4 * float(crossing["crossing_frequency"])
        stage = str(diagram["order_stage"].sel(order=crossing["crossing_order"]).item())
        share = data["energy_share"].isel(mode=mode).sel(element=stage).item()
        assert float(crossing["crossing_energy_share"]) == pytest.approx(share, abs=0.01)


def test_all_variables_have_units_and_names(diagram):
    for name, variable in diagram.data_vars.items():
        assert {"units", "long_name"} <= set(variable.attrs), name


def test_all_orders_of_meshes_and_shafts_are_there(diagram):
    ratios = diagram["order_ratio"]
    assert ratios.sel(order="2 x mesh input-middle").item() == pytest.approx(114.0)
    assert ratios.sel(order="shaft output").item() == pytest.approx(1.0)
    assert diagram.sizes["order"] == 2 * 3 + 3


def test_every_mode_below_the_first_mesh_order_at_top_speed_is_crossed_by_it(diagram):
    top = 57 * TOP / (2 * pi)
    crossed = diagram["crossing_mode"].values[diagram["crossing_order"].values == "1 x mesh input-middle"]
    reached = diagram["mode"].values[(diagram["frequency"].isel(speed=-1) < top).values]
    assert sorted(crossed.tolist()) == reached.tolist()


def test_meshes_of_a_set_are_drawn_as_the_lines_that_they_share():
    """Six meshes of a set have one frequency: a line for each harmonic."""
    data = exugear.campbell(exugear.build(planetary_box()), speed=(0.0, 600.0), load=600.0)
    drawn = exugear.plots.plot_campbell(data).get_legend().get_texts()
    labels = [text.get_text() for text in drawn if text.get_text().startswith("orders of mesh")]
    assert labels == ["orders of mesh sun-planet 1 and 5 more"]
    ratios = data["order_ratio"].values[data["order_stage"].values != ""]
    assert np.unique(ratios.round(9)).size == ratios.size / 6


def test_frequencies_are_those_of_the_modes(diagram):
    data = exugear.modes(three_shafts(), load=150.0, speed=TOP)
    assert np.sort(diagram["frequency"].isel(speed=-1)) == pytest.approx(data["frequency"].values, rel=1e-9)
    assert (np.diff(diagram["frequency"].isel(speed=0)) >= 0).all()


def test_lines_are_smooth(diagram):
    """A swap of two lines would bend them: second differences stay far below the distances of the modes."""
    bends = np.abs(np.diff(diagram["frequency"].values, 2, axis=1))
    assert bends.max() < 0.5


def test_given_speeds_are_taken_and_shafts_that_only_spin_keep_their_frequency():
    data = exugear.campbell(pair_of_shafts(), speed=[0.0, 10.0, 500.0], load=150.0, harmonics=1)
    assert data["speed"].values.tolist() == [0.0, 10.0, 500.0]
    assert data["frequency"].values == pytest.approx(np.full((1, 3), data["frequency"].values[0, 0]), rel=1e-9)
    assert data["crossing_energy_share"].values == pytest.approx(np.ones(data.sizes["crossing"]))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"speed": (-10.0, 100.0)}, r"speed must lie in \[0"),
        ({"speed": (100.0, 10.0)}, "speed must"),
        ({"speed": (0.0, 1e7)}, "speed must lie"),
        ({"load": 0.0}, "load must be finite and not 0"),
        ({"harmonics": 0}, "harmonics must lie"),
        ({"drive": "no"}, "drive must be"),
    ],
)
def test_conditions_that_make_no_sense_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        exugear.campbell(pair_of_shafts(), **{"load": 150.0, "speed": (0.0, 100.0)} | changes)
