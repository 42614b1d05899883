"""Plots of maps and runs: curves, marks, labels and limits."""

import numpy as np
import pytest
import xarray as xr
from paper_gears import few_teeth
from scenes import K, smooth_box, smooth_map

import exugear
import fem
from exugear import plots
from fem.units import mm, rpm, um

#: A stage behind another one, in mesh cycles of the first: its pinion turns with the wheel of the first.
BEHIND = 25 / 40


@pytest.fixture(scope="module")
def unequal_stages() -> exugear.Run:
    """Run-up of 20/40 and 25/50 teeth, each mesh stiffer while two pairs touch."""
    teeth = {"first": (20, 40), "second": (25, 50)}
    gears = {name: [few_teeth(z=z, x=0.0) for z in pair] for name, pair in teeth.items()}
    parts = {0 * mm: gears["first"][1], 40 * mm: gears["second"][0]}
    fast, middle = exugear.Shaft("fast", {0.0: gears["first"][0]}), exugear.Shaft("middle", parts)
    slow = exugear.Shaft("slow", {40 * mm: gears["second"][1]})
    pairs = [fem.GearPair(*pair) for pair in gears.values()]
    table = np.outer((K, 0.9 * K, 0.8 * K), [0.0, 2e-4])
    law = exugear.MeshForce(np.arange(3) / 3, np.array([0.0, 2e-4]), table, damping=2000.0, backlash=np.inf)
    ends = zip(((fast, middle), (middle, slow)), pairs, strict=True)
    box = exugear.Gearbox([exugear.Stage(*shafts, law, pair=pair) for shafts, pair in ends])
    return exugear.run_up(exugear.build(box), speed=(900 * rpm, 1500 * rpm), duration=2.0, load=100.0, progress=False)


def swept(top: float = 3000.0, duration: float = 3.0) -> xr.Dataset:
    """A transmission error of constant amplitude 2 um about 10 um over a run-up from rest."""
    time = np.arange(0, duration, 4e-5)
    cycles = top * time**2 / (2 * duration)
    return xr.Dataset(
        {
            "speed": ("time", 2 * np.pi * top * time / duration / 57),
            "mesh_frequency": (("stage", "time"), [top * time / duration]),
            "dte": (("stage", "time"), [10 * um + 2 * um * np.cos(2 * np.pi * cycles)]),
            "mesh_force": (("stage", "time"), [0 * time]),
        },
        coords={"time": time, "stage": ["a-b"]},
        attrs={"load": "150.0"},
    )


def test_each_stage_has_its_own_mesh_frequency(unequal_stages):
    first, second = unequal_stages.data["mesh_frequency"].values
    assert first == pytest.approx(20 * unequal_stages.data["speed"].values / (2 * np.pi))
    assert second == pytest.approx(BEHIND * first)
    for stage, frequency in enumerate((first, second)):
        ax = plots.plot_run_up(unequal_stages, plots.figure().axes[0], stage)
        assert ax.get_xlim()[1] == pytest.approx(frequency[-1], rel=0.01)


@pytest.mark.parametrize("stage", [0, 1])
def test_each_stage_has_its_largest_amplitude_at_mesh_order_one(unequal_stages, stage):
    data = unequal_stages.data
    speed, dte = 2 * np.pi * data["mesh_frequency"].values[stage], data["dte"].values[stage]
    signal = exugear.recorded_signal(data["time"].values, speed, dte)
    amplitude = exugear.order_tracking(signal, highest_order=3.2, revolutions=20)["amplitude"].mean("time")
    assert float(amplitude.idxmax()) == pytest.approx(1)
    (picture,) = plots.plot_mesh_order_map(unequal_stages, plots.figure().axes[0], stage).collections
    level = picture.get_array().mean(axis=1)
    edges = picture.get_coordinates()[:, 0, 1]
    (low, high), top = edges[level.argmax() :][:2], level.max()
    assert low < 1 < high
    assert top == pytest.approx(20 * np.log10(float(amplitude.max()) / um), abs=1)
    middle = (edges[1:] + edges[:-1]) / 2
    between = [k / BEHIND ** (1 - 2 * stage) for k in (1, 2)]
    assert level[np.abs(middle[:, None] - [1, 2, 3, *between]).min(axis=1) > 0.2].max() < top - 30


def test_plots_take_runs_and_their_data(unequal_stages):
    for draw in (plots.plot_run_up, plots.plot_mesh_order_map):
        of_run, of_data = (draw(x, plots.figure().axes[0], stage=1) for x in (unequal_stages, unequal_stages.data))
        assert of_run.dataLim.bounds == of_data.dataLim.bounds
    runs = {"run": unequal_stages, "data": unequal_stages.data}
    of_run, of_data = plots.plot_envelopes(runs, plots.figure().axes[0], stage=1).lines
    assert np.array_equal(of_run.get_xydata(), of_data.get_xydata())
    for draw in (plots.plot_run_up, plots.plot_mesh_order_map):
        with pytest.raises(ValueError, match=r"run must be an exugear\.Run or its data, got int"):
            draw(3)
        with pytest.raises(ValueError, match="stage must be 0 to 1, or a label, got 2"):
            draw(unequal_stages, stage=2)


def test_envelope_of_a_run_up_from_rest_does_not_pinch():
    """Every window holds a whole mesh cycle, and the samples hide none of its extremes."""
    high, low = plots.plot_run_up(swept(), plots.figure().axes[0]).lines
    assert high.get_ydata() == pytest.approx(12, abs=0.04)
    assert low.get_ydata() == pytest.approx(8, abs=0.04)
    (line,) = plots.plot_envelopes({"run": swept()}, plots.figure().axes[0]).lines
    assert line.get_ydata() == pytest.approx(2, abs=0.04)


def test_marks_lie_inside_the_frame_which_names_stage_and_load():
    figure = plots.figure(rows=2, columns=2)
    table = xr.Dataset({"mesh_frequency": ("peak", [2960.0, 40.0])})  # as exugear.resonances returns it
    ax = plots.plot_run_up(swept(), figure.axes[0], resonances=table)
    figure.canvas.draw()
    frame = ax.get_window_extent()
    assert ax.get_title() == "a-b, 150 N m"
    assert [text.get_text() for text in ax.texts] == ["40 Hz", "2960 Hz"]
    for text in ax.texts:
        box = text.get_window_extent()
        assert box.y0 > frame.y0 and box.y1 < frame.y1


def test_labels_of_close_resonances_do_not_overlap():
    close = exugear.spectrum.Peaks(np.array([600.0, 630.0, 690.0, 720.0, 2000.0]), np.full(5, 2e-6))
    figure = plots.figure()
    figure.set_size_inches(8.0, 4.0)
    ax = plots.plot_run_up(swept(), figure.axes[0], resonances=close)
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in ax.texts]
    assert not any(box.overlaps(further) for k, box in enumerate(boxes) for further in boxes[k + 1 :])
    assert max(box.y1 for box in boxes) < ax.get_window_extent().y1


def test_order_map_spans_the_given_decibels():
    (picture,) = plots.plot_mesh_order_map(swept(), plots.figure().axes[0], decibels=40.0).collections
    low, high = picture.get_clim()
    assert high == pytest.approx(20 * np.log10(2), abs=0.01)
    assert low == pytest.approx(high - 40)


def test_static_transmission_error_names_torques_to_four_digits():
    ste = smooth_map((0, 150.00000001, 1e4 / 3))
    for draw in (plots.plot_ste, plots.plot_stiffness):
        labels = draw(ste, plots.figure().axes[0]).get_legend_handles_labels()[1]
        assert labels[-2:] == ["150 N m", "3333 N m"]


def test_static_transmission_error_over_all_pitches_and_its_alternating_part():
    plain = smooth_map((0, 150))
    phase = np.concatenate([plain["phase"].values + k for k in range(3)])
    te = np.concatenate([plain["te"].values + k * um for k in range(3)], axis=1)
    whole = fem.ste_map(fem.pair_of(plain), (0, 150), phase, te, pitches=3)
    ax = plots.plot_ste(whole, plots.figure().axes[0])
    assert ax.get_xlim() == (0, 3)
    assert ax.lines[1].get_ydata() == pytest.approx(te[1] / um)
    for ste in (plain, whole):
        line = plots.plot_ste(ste, plots.figure().axes[0], alternating=True).lines[1]
        assert line.get_ydata().mean() == pytest.approx(0, abs=1e-9)
        assert np.ptp(line.get_ydata()) == pytest.approx(np.ptp(ste["te"].values[1]) / um)
    with pytest.raises(ValueError, match="pitches must lie in"):
        plots.plot_ste(whole, pitches=4)


def test_bearing_forces_show_the_varying_part_of_the_radial_force():
    """A force that turns with amplitude 3 N about a steady force of 100 N; the axial force does not count."""
    run = swept()
    turn = 2 * np.pi * 400 * run["time"].values
    force = np.stack([100 + 3 * np.cos(turn), 3 * np.sin(turn), 50 * np.sin(turn)])
    axes = {"bearing": ["a at 0 mm"], "direction": ["x", "y", "z"]}
    run = run.assign(bearing_force=(("bearing", "direction", "time"), force[None])).assign_coords(axes)
    ax = plots.plot_bearing_forces(run, plots.figure().axes[0])
    (line,) = ax.get_lines()
    assert np.median(line.get_ydata()) == pytest.approx(3, rel=0.02)
    assert ax.get_legend_handles_labels()[1] == ["a at 0 mm"]
    with pytest.raises(ValueError, match="run must have bearings"):
        plots.plot_bearing_forces(swept(), plots.figure().axes[0])


def power_map() -> xr.Dataset:
    """An efficiency over 3 speeds and 4 loads, from 98 to 99.6 %, of which one point was not solved."""
    speed, load = np.array([50.0, 100.0, 200.0]), np.array([20.0, 50.0, 100.0, 400.0])
    values = 1 - 0.004 - 0.32 * np.sqrt(speed[:, None] / 200) / load
    values[2, 0] = np.nan
    stopped = np.where(np.isnan(values), "the map ends", "")
    over = ("speed", "load")
    return xr.Dataset({"efficiency": (over, values), "stopped": (over, stopped)}, {"speed": speed, "load": load})


def test_contours_of_efficiency_enclose_all_values_and_mark_what_was_not_solved():
    data = power_map()
    ax = plots.plot_efficiency(data, plots.figure().axes[0])
    levels = np.array(ax.collections[0].levels)
    values = 100 * data["efficiency"].values
    assert levels[0] <= np.nanmin(values) < levels[1]
    assert levels[-2] < np.nanmax(values) <= levels[-1]
    solved, stopped = (np.array(line.get_xydata()) for line in ax.lines)
    assert len(solved) == 11
    assert stopped == pytest.approx(np.array([[200.0 / rpm, 20.0]]))
    chosen = plots.plot_efficiency(data, plots.figure().axes[0], levels=[98.0, 99.0, 99.5])
    assert chosen.collections[0].levels.tolist() == [98.0, 99.0, 99.5]
    plots.plot_efficiency(data, plots.figure().axes[0], levels=5)
    constant = data.assign(efficiency=0 * data["efficiency"].fillna(0) + 1)
    plots.plot_efficiency(constant, plots.figure().axes[0]).figure.canvas.draw()


def test_plots_of_efficiency_need_solved_points_over_both_axes():
    data = power_map()
    for wrong, words in (
        (data.drop_vars("efficiency"), "pass what exugear.efficiency returns"),
        (data.isel(speed=[0]), "two speeds and two loads at least"),
        (data.assign(efficiency=data["efficiency"] * np.nan), "must hold a solved point"),
    ):
        with pytest.raises(ValueError, match=words):
            plots.plot_efficiency(wrong, plots.figure().axes[0])


def test_stacked_losses_of_a_run_add_up_to_what_it_dissipates():
    model = exugear.build(smooth_box(exugear.Drag(0.5)))
    given = {"load": 100.0, "duration": 0.02, "power": True, "progress": False, "checks": 0}
    for speed, abscissa in (((50.0, 100.0), "speed of the driving shaft [rpm]"), (50.0, "time [s]")):
        run = exugear.run_up(model, speed=speed, **given)
        ax = plots.plot_power(run, plots.figure().axes[0])
        assert ax.get_xlabel() == abscissa
        top = ax.collections[-1].get_paths()[0].vertices[:, 1].max()
        total = run.data["mesh_loss"].sum("stage") + run.data["drag_loss"].sum("shaft")
        assert top == pytest.approx(float(total.max()), rel=0.02)
        assert [text.get_text() for text in ax.get_legend().get_texts()] == ["shaft drag", "mesh damping"]
    long = exugear.run_up(model, speed=50.0, **given | {"duration": 0.2})
    outline = plots.plot_power(long, plots.figure().axes[0]).collections[-1].get_paths()[0].vertices
    middle = outline[(outline[:, 0] > 0.05) & (outline[:, 0] < 0.15) & (outline[:, 1] > 10), 1]
    settled = float((long.data["mesh_loss"].sum("stage") + long.data["drag_loss"].sum("shaft")).mean())
    assert middle == pytest.approx(settled, rel=0.01), "over many mesh cycles, means of each"
    with pytest.raises(ValueError, match="run it with power=True"):
        plots.plot_power(exugear.run_up(model, speed=50.0, **given | {"power": False}))


def reversing() -> xr.Dataset:
    """The same transmission error while the speed falls through 0 to its negative."""
    data = swept(1000.0, 2.0)
    turned = data["speed"].values[::-1] * np.sign(1.0 - data["time"].values)
    frequency = 57 * np.abs(data["time"].values - 1.0) * 17
    return data.assign(speed=("time", turned), mesh_frequency=(("stage", "time"), [frequency]))


def test_a_run_that_reverses_is_drawn_over_its_signed_speed_and_filled_both_ways():
    ax = plots.plot_mesh_order_map(swept(), plots.figure().axes[0])
    assert ax.get_xlabel().startswith("speed of the driving shaft [rpm]")
    (picture,) = plots.plot_run_up(reversing(), plots.figure().axes[0]).collections[:1]
    assert len(plots.plot_run_up(reversing(), plots.figure().axes[0]).collections) == 2
    assert picture.get_alpha() == 0.3


def test_an_order_map_of_less_than_a_mesh_cycle_is_refused():
    with pytest.raises(ValueError, match="run must hold more than one mesh cycle for its order map"):
        plots.plot_mesh_order_map(swept().isel(time=slice(0, 300)))


def test_long_labels_of_colour_bars_are_broken_into_lines():
    dte = exugear.recorded_signal(
        np.arange(400) / 400, np.full(400, 9.0), np.sin(np.arange(400)), long_name="force of the bearing on its shaft"
    )
    ax = plots.plot_spectrogram(exugear.spectrogram(dte), plots.figure().axes[0])
    assert ax.figure.axes[1].get_ylabel() == "force of the bearing on its\nshaft [dB re 1]"
