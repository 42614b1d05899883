"""Plots over a run: mesh force over time, orbits of shafts and of forces at bearings."""

import numpy as np
import pytest
import xarray as xr

import exugear
from exugear import plots

#: Mesh frequency [Hz], amplitude and mean of the mesh force [N].
MESH, AMPLITUDE, MEAN = 400.0, 300.0, 1000.0
BEARINGS = ["a at 0 mm", "b at 0 mm"]


def steady(duration: float) -> xr.Dataset:
    """A run at constant speed of 20 teeth with a harmonic mesh force, and bearing forces along an ellipse."""
    time = np.arange(0, duration, 1e-5)
    angle = 2 * np.pi * MESH * time
    force = np.stack([500 + 30 * np.cos(angle), 200 + 10 * np.sin(angle), 0 * time])
    return xr.Dataset(
        {
            "speed": ("time", np.full(time.size, 2 * np.pi * MESH / 20)),
            "mesh_frequency": (("stage", "time"), [np.full(time.size, MESH)]),
            "dte": (("stage", "time"), [0 * time]),
            "mesh_force": (("stage", "time"), [MEAN + AMPLITUDE * np.cos(angle)]),
            "bearing_force": (("bearing", "direction", "time"), [force, 2 * force], {"units": "N"}),
        },
        {"time": time, "stage": ["a-b"], "bearing": BEARINGS, "direction": ["x", "y", "z"]},
    )


def test_mesh_force_is_a_curve_over_few_cycles_and_a_band_over_many():
    curve = plots.plot_mesh_force(steady(1.0), plots.figure().axes[0], window=(0.5, 0.52))
    assert not curve.collections
    assert curve.lines[0].get_ydata().size == pytest.approx(2000, abs=2)
    band = plots.plot_mesh_force(steady(1.0), plots.figure().axes[0])
    high, low = (line.get_ydata() for line in band.lines[:2])
    assert high == pytest.approx(MEAN + AMPLITUDE, rel=1e-3)
    assert low == pytest.approx(MEAN - AMPLITUDE, rel=1e-3)
    for ax in (curve, band):
        assert ax.lines[-1].get_ydata()[0] == pytest.approx(MEAN, rel=1e-3)


@pytest.mark.parametrize(("share", "height"), [(0.01, 0.022), (1e-9, 0.01), (0.9, 2.09)])
def test_the_axis_of_a_mesh_force_shows_its_ripple_and_0_where_teeth_nearly_part(share, height):
    data = steady(0.1)
    data["mesh_force"] = MEAN * (1 + share * (data["mesh_force"] - MEAN) / AMPLITUDE)
    ax = plots.plot_mesh_force(data, plots.figure().axes[0])
    assert np.ptp(ax.get_ylim()) == pytest.approx(height * MEAN, rel=0.02)
    assert (ax.get_ylim()[0] <= 0) == (share == 0.9)


def test_the_orbit_shows_the_last_turn_about_its_mean():
    ax = plots.plot_orbit(steady(0.2), plots.figure().axes[0])
    orbit, mean = ax.lines
    assert orbit.get_xdata().size == pytest.approx(20 / MESH / 1e-5, abs=2)
    x, y = orbit.get_xdata() - 500, orbit.get_ydata() - 200
    assert np.hypot(x / 30, y / 10) == pytest.approx(1)
    assert [float(mean.get_xdata()[0]), float(mean.get_ydata()[0])] == pytest.approx([500, 200], abs=0.1)
    assert ax.get_legend_handles_labels()[1] == ["a at 0 mm", "mean"]


def test_the_orbit_of_the_shaft_is_in_micrometres_where_the_run_holds_displacements():
    force = steady(0.2)["bearing_force"]
    run = steady(0.2).assign(bearing_displacement=(1e-8 * force).assign_attrs(units="m"))
    ax = plots.plot_orbit(run, plots.figure().axes[0], bearing="b at 0 mm")
    x, y = ax.lines[0].get_data()
    assert np.hypot((x - 10) / 0.6, (y - 4) / 0.2) == pytest.approx(1)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("displacement along x [µm]", "displacement along y [µm]")
    of_force = plots.plot_orbit(exugear.signal(run, "bearing_force"), plots.figure().axes[0])
    assert of_force.get_xlabel() == "force along x [N]"
    assert of_force.lines[1].get_xdata() == pytest.approx([500], abs=0.1)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"bearing": "b"}, r"bearing must be one of \['a at 0 mm', 'b at 0 mm'\], got 'b'"),
        ({"window": (3.0, 4.0)}, "window must be start and end within 0 to"),
    ],
)
def test_orbits_need_a_bearing_and_a_window_of_the_run(options, words):
    with pytest.raises(ValueError, match=words):
        plots.plot_orbit(steady(0.1), **options)
    with pytest.raises(ValueError, match="run must have bearings"):
        plots.plot_orbit(steady(0.1).drop_vars("bearing_force"))
    with pytest.raises(ValueError, match="select the bearing by bearing="):
        plots.plot_orbit(exugear.signal(steady(0.1), "bearing_force", bearing="a at 0 mm"))
