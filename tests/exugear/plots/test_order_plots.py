"""Plots of signals over speed: what stands where, in which units."""

import numpy as np
import pytest
import scipy
from sweeps import linear_sweep, with_orders

import exugear
from exugear import plots
from fem.units import rpm

ORDERS = {20: (lambda speed: 2e-6 + 0 * speed, 0.0), 40: (lambda speed: speed * 1e-8, 0.0)}


@pytest.fixture(scope="module")
def signal():
    """A transmission error of two orders over a run-up from 20 to 180 rad/s."""
    return with_orders(linear_sweep(8.0, rate=10_000.0), ORDERS).assign_attrs(units="m", long_name="DTE")


def test_order_cuts_are_curves_over_rpm_in_micrometres(signal):
    cut = exugear.order_cut(signal, list(ORDERS))
    ax = plots.plot_order_cuts(cut, plots.figure().axes[0], linewidth=3.0)
    flat, rising = ax.lines
    assert flat.get_xdata()[[0, -1]] == pytest.approx(np.array([20, 180]) / rpm)
    assert flat.get_ydata() == pytest.approx(2, rel=0.01)
    assert rising.get_ydata()[-1] == pytest.approx(1.8, rel=0.01)
    assert (ax.get_ylabel(), ax.get_xlabel()) == ("DTE [µm]", "speed of the shaft [rpm]")
    assert ax.get_legend_handles_labels()[1] == ["order 20", "order 40"]
    assert flat.get_linewidth() == 3.0
    low, high = plots.plot_order_cuts(cut, plots.figure().axes[0], decibels=40.0).get_ylim()
    assert high / low == pytest.approx(150)


def test_maps_are_darkest_at_the_orders(signal):
    (picture,) = plots.plot_order_map(
        exugear.order_tracking(signal, highest_order=50), plots.figure().axes[0]
    ).collections
    level, edges = picture.get_array().mean(axis=1), picture.get_coordinates()[:, 0, 1]
    assert edges[level.argmax()] == pytest.approx(20, abs=0.5)
    assert picture.get_clim()[1] == pytest.approx(20 * np.log10(2), abs=0.1)
    spectra = exugear.spectrogram(signal, resolution=20.0)
    over_time = plots.plot_spectrogram(spectra, plots.figure().axes[0])
    assert over_time.get_xlabel() == "time [s]"
    over_speed = plots.plot_spectrogram(exugear.waterfall(signal, resolution=20.0), plots.figure().axes[0])
    assert over_speed.get_xlabel() == "speed of the shaft [rpm]"


def test_a_map_says_where_its_lines_smear_resonances(signal):
    """The speed rises by 20 rad/s in a second, in 8 revolutions by more than a tenth below 100 rad/s."""
    tracked = exugear.order_tracking(signal, highest_order=50)
    expected = 20 * 8 * 2 * np.pi / tracked["speed"].values ** 2
    assert tracked["speed_change"].values[5:] == pytest.approx(expected[5:], rel=0.1)
    label = plots.plot_order_map(tracked, plots.figure().axes[0]).get_xlabel()
    assert "resonances are smeared" in label
    assert float(label.split(" to ")[1].split(":")[0]) == pytest.approx(100 / rpm, rel=0.05)
    slow = tracked.isel(time=tracked["speed_change"].values < 0.1)
    assert "smeared" not in plots.plot_order_map(slow, plots.figure().axes[0]).get_xlabel()


def test_a_run_up_and_coast_down_is_drawn_over_time(signal):
    time = np.linspace(0, 8, 80_001)
    speed = 100 - 20 * np.abs(time - 4)
    angle = scipy.integrate.cumulative_trapezoid(speed, time, initial=0)
    both_ways = exugear.recorded_signal(time, speed, np.sin(angle))
    ax = plots.plot_order_cuts(exugear.order_cut(both_ways, [1]), plots.figure().axes[0])
    assert ax.get_xlabel() == "time [s]"


def test_a_cascade_stands_at_the_speeds_and_its_peaks_rise_as_asked(signal):
    spectra = exugear.waterfall(signal, lines=9, resolution=20.0)
    ax = plots.plot_waterfall(spectra, plots.figure().axes[0], height=4.0)
    lines = sorted((line.get_ydata() for line in ax.lines), key=min)
    step = np.ptp(spectra["speed"].values) / rpm / 8
    assert [line.min() for line in lines] == pytest.approx(spectra["speed"].values / rpm, abs=0.01 * step)
    assert max(np.ptp(line) for line in lines) == pytest.approx(4 * step, rel=0.01)
    assert "µm" in ax.get_title()


def test_spectra_are_shown_up_to_where_their_energy_lies(signal):
    """Order 40 ends at 1146 Hz and the sampling at 5000 Hz; silence is shown as a whole."""
    spectra = exugear.waterfall(signal, resolution=20.0)
    axes = [plot(spectra, plots.figure().axes[0]) for plot in (plots.plot_waterfall, plots.plot_spectrogram)]
    tops = axes[0].get_xlim()[1], axes[1].get_ylim()[1]
    assert all(1100 < top < 1300 for top in tops)
    assert plots.plot_waterfall(spectra, plots.figure().axes[0], top=700.0).get_xlim()[1] == 700
    assert plots.plot_waterfall(0 * spectra, plots.figure().axes[0]).get_xlim()[1] == 5000
    with pytest.raises(ValueError, match="top must be >= 20 Hz"):
        plots.plot_spectrogram(spectra, top=5.0)


def test_levels_name_channels_and_reference(signal):
    cut = exugear.order_cut(signal.expand_dims(bearing=["a", "b"]).assign_attrs(signal.attrs), list(ORDERS))
    rms = (cut["amplitude"] / np.sqrt(2)).assign_attrs(cut["amplitude"].attrs)
    ax = plots.plot_levels(exugear.level(rms, 1e-6), plots.figure().axes[0])
    names = ["a, order 20", "a, order 40", "b, order 20", "b, order 40"]
    assert ax.get_legend_handles_labels()[1] == names
    assert ax.lines[0].get_ydata() == pytest.approx(20 * np.log10(np.sqrt(2)), abs=0.1)
    assert ax.get_ylabel() == "level re 1 µm [dB]"


def test_curves_name_harmonic_and_stage_and_titles_the_channel(signal):
    """Mesh orders 20 and 8 of two stages; order 21 is a side band."""
    stages = {"of_stages": '{"fast-middle": 20.0, "middle-slow": 8.0}'}
    of_run = signal.assign_coords(mesh_order=((), 20.0, stages), bearing="slow at 0 mm", direction="y")
    cut = exugear.order_cut(of_run, [8, 20, 21, 40])
    names = ["1 x mesh middle-slow", "1 x mesh fast-middle", "order 21", "2 x mesh fast-middle, 5 x mesh middle-slow"]
    levels = exugear.level(cut["amplitude"], 1e-6)
    for ax in (plots.plot_order_cuts(cut, plots.figure().axes[0]), plots.plot_levels(levels, plots.figure().axes[0])):
        assert ax.get_legend_handles_labels()[1] == names
        assert ax.get_title() == "bearing slow at 0 mm, along y"


def test_amplitudes_that_cannot_be_told_leave_gaps(signal):
    cut = exugear.order_cut(signal, list(ORDERS))
    cut["amplitude"][:, :5] = np.nan
    flat, _ = plots.plot_order_cuts(cut, plots.figure().axes[0], decibels=40.0).lines
    assert np.isnan(flat.get_ydata()[:5]).all()
    assert np.isnan(exugear.level(cut["amplitude"], 1e-6).values[:, :5]).all()
    cut["amplitude"][:] = np.nan
    with pytest.raises(ValueError, match="cuts must hold an amplitude > 0 that can be told"):
        plots.plot_order_cuts(cut, plots.figure().axes[0], decibels=40.0)


def test_several_channels_and_other_data_are_refused(signal):
    cut = exugear.order_cut(signal.expand_dims(bearing=["a", "b"]), list(ORDERS))
    with pytest.raises(ValueError, match=r"cuts must hold one channel; select one.*bearing"):
        plots.plot_order_cuts(cut)
    with pytest.raises(ValueError, match="order_map must hold an amplitude over time or speed and order"):
        plots.plot_order_map(exugear.spectrogram(signal))


def test_missing_amplitudes_leave_the_range_of_colours(signal):
    tracked = exugear.order_tracking(signal, highest_order=50)
    (whole,) = plots.plot_order_map(tracked, plots.figure().axes[0]).collections
    tracked["amplitude"][0, 0] = np.nan
    (partly,) = plots.plot_order_map(tracked, plots.figure().axes[0]).collections
    assert partly.get_clim() == pytest.approx(whole.get_clim())


@pytest.mark.parametrize("decibels", [0.0, -60.0])
def test_ranges_that_turn_a_picture_upside_down_are_refused(signal, decibels):
    tracked = exugear.order_tracking(signal, highest_order=50)
    for draw, data in ((plots.plot_order_map, tracked), (plots.plot_order_cuts, exugear.order_cut(signal, [20]))):
        with pytest.raises(ValueError, match="decibels must be > 0 dB"):
            draw(data, decibels=decibels)
    with pytest.raises(ValueError, match="height must be > 0"):
        plots.plot_waterfall(exugear.waterfall(signal, resolution=20.0), height=-1.0)
    with pytest.raises(ValueError, match="a map needs two spectra or more"):
        plots.plot_order_map(tracked.isel(time=[0]))


def test_a_signal_that_runs_backwards_is_refused(signal):
    backwards = signal.isel(time=slice(None, None, -1))
    with pytest.raises(ValueError, match="times of the signal must increase"):
        exugear.spectrogram(backwards, resolution=20.0)
    with pytest.raises(ValueError, match="times of the signal must increase"):
        exugear.order_tracking(backwards, highest_order=50)
