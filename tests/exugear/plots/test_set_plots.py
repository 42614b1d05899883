"""Plots of planetary sets show the numbers of their tables."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from planetary_boxes import planar_box, planetary, planetary_box, published_set, waving_law

import exugear
from exugear import plots
from fem.units import deg, um


def axes():
    return Figure().add_subplot()


def test_phases_stand_at_their_planets_and_sums_at_their_harmonics():
    meshes = dict.fromkeys(("sun_mesh", "ring_mesh"), waving_law())
    phases = exugear.Planetary(**published_set(), **meshes, angles=(0, 126 * deg, 252 * deg)).mesh_phases(4)
    ax = plots.plot_mesh_phases(phases, axes())
    assert [line.get_xdata().tolist() for line in ax.lines] == [
        phases[f"{x}_phase"].values.tolist() for x in ("sun", "ring")
    ]
    assert [label.get_text() for label in ax.get_yticklabels()] == ["planet 1, 0°", "planet 2, 126°", "planet 3, 252°"]
    heights = [bar.get_height() for bar in plots.plot_phase_sums(phases, axes()).patches]
    assert heights == pytest.approx([*phases["torque_sum"].values, *phases["lateral_sum"].values])


def test_shares_are_drawn_in_percent_with_the_load_factor():
    run = exugear.run_up(
        exugear.build(planetary_box(pin_errors=[-5 * um, 0, 0])),
        speed=50.0, load=4000.0, duration=1e-3, progress=False, checks=0,
    )  # fmt: skip
    shares = exugear.planet_shares(run)
    ax = plots.plot_planet_shares(shares, axes())
    assert ax.lines[0].get_ydata() == pytest.approx(100 * shares["share"].values[0])
    assert f"{float(shares['K_gamma']):.4g}" in ax.get_title()


def test_side_bands_are_coloured_by_what_excites_them():
    turn = np.linspace(0.0, 44.0, 4001)
    heard = exugear.recorded_signal(turn, np.ones(turn.size), np.cos(90 * turn) + 0.1 * np.cos(87 * turn))
    lines = exugear.side_bands(heard, planetary(), harmonics=1, carrier_orders=4)
    ax = plots.plot_side_bands(lines, axes(), decibels=40.0)
    drawn = {part.get_label(): part.get_segments() for part in ax.collections}
    assert [segment[1].tolist() for segment in drawn["mesh harmonic"]] == [[0.0, 0.0]]
    ((offset, level),) = [segment[1] for segment in drawn["planet pass of equal planets"]]
    assert (offset, level) == pytest.approx((-3.0, -20.0), abs=1e-3)
    assert drawn["unequal planets, carrier or ring"] == []


def test_an_orbit_of_a_member_is_drawn_as_its_last_turn():
    options = {"duration": 5e-3, "displacement": True, "progress": False, "checks": 0}
    run = exugear.run_up(exugear.build(planar_box()), speed=50.0, load=400.0, **options)
    orbit = exugear.member_orbit(run, "planet 1")
    ax = plots.plot_orbit(orbit, axes())
    assert ax.lines[0].get_ydata() == pytest.approx(orbit["displacement"].sel(direction="y").values / um)
    assert ax.get_xlabel() == "displacement along the pin's radius [µm]"
    assert (
        plots.plot_orbit(exugear.member_orbit(run, "sun", frame="carrier"), axes()).get_title()
        == "in the frame of carrier"
    )
