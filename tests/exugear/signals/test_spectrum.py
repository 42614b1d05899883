"""Envelope, peaks and orders of signals that are known."""

import numpy as np
import pytest
import scipy

import exugear
from exugear import envelope, peaks, spectrum


def tracked(time, speed, values, highest_order: float, **options):
    """Order map of arrays."""
    return exugear.order_tracking(
        exugear.recorded_signal(time, speed, values), highest_order=highest_order, revolutions=8, **options
    )


def test_envelope_of_a_growing_sine():
    t = np.linspace(0, 10, 200_001)
    outline = envelope(t, t * np.sin(2 * np.pi * 50 * t) + 3, windows=100)
    assert outline.amplitude == pytest.approx(outline.abscissa, abs=0.06)
    assert outline.rms == pytest.approx(outline.abscissa / np.sqrt(2), abs=0.02)
    assert (outline.high + outline.low) / 2 == pytest.approx(3, abs=0.06)


def test_resonances_of_oscillators_are_interpolated_between_samples():
    f = np.linspace(1, 3000, 400)
    response = sum(a / np.hypot(1 - (f / f0) ** 2, 0.06 * f / f0) for a, f0 in ((1, 600), (2, 1800)))
    tops = peaks(f, response)
    assert tops.abscissa == pytest.approx([600, 1800], rel=3e-3)
    assert (np.diff(tops.abscissa) > 0).all()


def test_windows_hold_whole_cycles_of_a_slow_start():
    t = np.linspace(0, 3, 75_001)
    cycles = 500 * t**2
    outline = envelope(t, np.cos(2 * np.pi * cycles), cycles=cycles)
    assert outline.amplitude == pytest.approx(1, abs=0.02)
    assert outline.abscissa.size > 250
    (whole,) = envelope(t, t, cycles=0 * t).amplitude
    assert whole == pytest.approx(1.5, rel=0.01)


def test_beat_of_samples_and_cycles_is_no_resonance():
    """About six samples a cycle: the largest sample of a window varies with the position of samples in the cycle."""
    t = np.arange(0, 7, 4.8e-5)
    frequency = 3440 + 60 * t / 7
    outline = envelope(frequency, np.cos(2 * np.pi * (3440 + 30 * t / 7) * t))
    assert outline.amplitude == pytest.approx(1, abs=0.03)
    assert outline.peaks().abscissa.size == 0


def test_scatter_and_a_rise_to_the_end_are_no_resonances():
    f = np.linspace(1, 3000, 280)
    planted = 1 / np.hypot(1 - (f / 1800) ** 2, 0.16 * f / 1800) + 0.5 / np.hypot(1 - (f / 3300) ** 2, 0.08 * f / 3300)
    scatter = 0.01 * np.random.default_rng(3).normal(size=f.size)
    tops = peaks(f, planted + scatter, prominence=0.004)
    assert tops.abscissa == pytest.approx([1800], rel=0.02)


def test_orders_of_a_run_up_do_not_depend_on_speed():
    t = np.linspace(0, 10, 400_001)
    speed = 20 + 20 * t
    angle = 20 * t + 10 * t**2
    orders = tracked(t, speed, 2 * np.sin(57 * angle) + 0.5 * np.cos(114 * angle), 150)
    for order, amplitude in ((57, 2.0), (114, 0.5)):
        line = np.argmin(np.abs(orders["order"].values - order))
        assert orders["amplitude"].values[:, line] == pytest.approx(amplitude, rel=1e-4)
    assert orders["amplitude"].values[:, np.abs(orders["order"].values - 80) < 10].max() < 1e-4
    step = orders["speed"].values[1:] ** 2 - orders["speed"].values[:-1] ** 2
    assert step == pytest.approx(2 * 20 * 2 * np.pi * 2, rel=0.02), "lines overlap by three quarters"


@pytest.mark.parametrize("frequency", [700.0, 6100.0, 9300.0, 15500.0])
def test_frequencies_above_the_highest_order_are_not_aliased(frequency):
    """A tone of constant frequency beside order 57, above order 150 at all speeds: it stays below -60 dB."""
    t = np.linspace(0, 10, 400_001)
    speed = 2 * np.pi * np.minimum(0.9 * frequency / 150, 100) * (0.2 + 0.08 * t)
    angle = scipy.integrate.cumulative_trapezoid(speed, t, initial=0)
    orders = tracked(t, speed, np.sin(57 * angle) + np.sin(2 * np.pi * frequency * t), 150)
    away = np.abs(orders["order"].values - 57) > 0.5
    assert orders["amplitude"].values[:, away].max() < 1e-3
    assert orders["amplitude"].values[:, orders["order"].values == 57] == pytest.approx(1, rel=0.01)


def test_orders_that_are_sampled_too_coarsely_are_left_out():
    t = np.linspace(0, 10, 25_001)
    orders = tracked(t, 100 * t, np.sin(t), 60)
    assert orders["speed"].values.max() < 2 * np.pi * 2500 / (2.2 * 60) * 1.01
    with pytest.raises(ValueError, match="sample finer"):
        tracked(t, 1000 + 0 * t, np.sin(t), 600)


#: One second, in which 20.1 rad/s turn 3.2 times.
FINE = np.linspace(0, 1, 20001)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: envelope(np.arange(9.0), np.full(9, np.nan)), "finite"),
        (lambda: envelope(np.arange(9.0), np.zeros(8)), "equally long"),
        (
            lambda: envelope(np.arange(9.0), np.zeros(9), windows=6),
            "too few for 6 windows of 2 or more; pass windows=4",
        ),
        (lambda: peaks(np.arange(9.0), np.zeros(9), prominence=5), "prominence must"),
        (lambda: tracked(np.arange(9.0), np.ones(9), np.ones(9), -1), "highest_order must"),
        (lambda: tracked(np.arange(9.0), np.ones(9), np.ones(9), 1, overlap=1), "overlap must"),
        (lambda: tracked(FINE, 20.1 + 0 * FINE, np.sin(FINE), 5), "3.2 revolutions, a window takes 8"),
    ],
)
def test_bad_signals_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_superharmonics_are_the_peaks_at_fractions_of_the_main_resonance():
    tops = spectrum.Peaks(np.array([300.0, 520.0, 1040.0, 2000.0]), np.array([0.1, 0.3, 0.5, 1.0]))
    assert spectrum.superharmonics(tops, (4, 3, 2, 1)) == pytest.approx([520, np.nan, 1040, 2000], nan_ok=True)
    with pytest.raises(ValueError, match="at least one peak"):
        spectrum.superharmonics(spectrum.Peaks(np.array([]), np.array([])))


@pytest.mark.parametrize("seed", range(20))
def test_planted_peaks_are_returned_with_places_and_heights_under_noise(seed):
    """Three peaks of different heights and widths, rising also where a coast-down's abscissa falls; noise of 0.5 %."""
    frequency = np.linspace(100, 3000, 300)
    planted = {520.0: (2.0, 40.0), 1040.0: (5.0, 60.0), 1900.0: (12.0, 150.0)}
    amplitude = 1 + sum(height * np.exp(-(((frequency - at) / width) ** 2)) for at, (height, width) in planted.items())
    amplitude += 0.02 * np.random.default_rng(seed).normal(size=frequency.size)
    heights = [1 + height for height, _ in planted.values()]
    for sense in (1, -1):
        tops = peaks(frequency[::sense], amplitude[::sense])
        assert tops.abscissa == pytest.approx(list(planted), abs=20)
        assert tops.height == pytest.approx(heights, abs=0.1)


def test_a_flat_top_is_a_resonance_in_its_middle():
    """Amplitudes of a measurement, rounded to 0.01: several equal values about the peak."""
    f = np.arange(101.0)
    tops = peaks(f, np.exp(-(((f - 40) / 12) ** 2)).round(2))
    assert tops.abscissa == pytest.approx([40.0])
    assert tops.height == pytest.approx([1.0])
