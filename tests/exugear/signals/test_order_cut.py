"""Order cuts tell close orders apart, at any slew rate and at the ends of a signal."""

import time
import tracemalloc

import numpy as np
import pytest
import scipy
from sweeps import linear_sweep, steep_sweep, with_orders

import exugear
from fem.units import rpm

#: Two mesh harmonics with side bands one shaft order apart; the second harmonic passes a resonance.
CLOSE = {
    56: (lambda speed: 0.3 + 0 * speed, 0.0),
    57: (lambda speed: 1 + speed / 600, 0.3),
    58: (lambda speed: 0.2 + speed / 2000, 0.6),
    113: (lambda speed: 0.1 + 0 * speed, 0.9),
    114: (lambda speed: 0.5 / np.hypot(1 - (speed / 400) ** 2, 0.4 * speed / 400), 1.2),
    115: (lambda speed: 0.15 + 0 * speed, 1.5),
}


def amplitudes(components: dict, speed: np.ndarray) -> np.ndarray:
    return np.array([amplitude(speed) for amplitude, _ in components.values()])


def phases(components: dict) -> np.ndarray:
    return np.array([phase for _, phase in components.values()])[:, None]


def test_close_orders_of_a_sweep_of_3_percent_a_revolution_ends_included(measured):
    """The speed grows by 3 % in each revolution, in total by a factor of 20."""
    sweep = steep_sweep()
    cut = exugear.order_cut(with_orders(sweep, CLOSE, mean=5.0), list(CLOSE), revolutions=4.0)
    assert cut["time"].values[[0, -1]] == pytest.approx(sweep[0][[0, -1]])
    assert cut["speed"].values[[0, -1]] == pytest.approx(sweep[1][[0, -1]])
    error = np.abs(cut["amplitude"].values / amplitudes(CLOSE, cut["speed"].values) - 1)
    row = "amplitudes of six orders, mesh and side bands one shaft order apart, 3 % more speed in each revolution"
    measured(f"{row}: at the ends", error.max(), 0.003)
    measured(f"{row}: between", error[:, 2:-2].max(), 0.001)
    assert np.abs(cut["phase"].values - phases(CLOSE)).max() < 0.002


#: Natural frequency [Hz] and damping ratio of an oscillator that an order excites.
NATURAL, DAMPING = 460.0, 0.05


def response(speed: np.ndarray, order: float = 25.0) -> np.ndarray:
    """Amplitude of the oscillator under a unit excitation by an order of a shaft."""
    ratio = order * speed / (2 * np.pi * NATURAL)
    return 1 / np.hypot(1 - ratio**2, 2 * DAMPING * ratio)


def run_up(duration: float, components: dict, start: float = 500.0, end: float = 12000.0):
    """A signal of a sweep [rpm] at 25 kHz."""
    slope = (end - start) * rpm / duration
    return with_orders(linear_sweep(duration, rate=25_000.0, start=start * rpm, slope=slope), components)


def is_told(cut, components: dict) -> np.ndarray:
    """(n_order, n_point) whether amplitudes are told; those that are must be right within 3 % or 3 standard errors."""
    exact, told = amplitudes(components, cut["speed"].values), np.isfinite(cut["amplitude"].values)
    assert (told == (cut["reason"].values == 0)).all()
    error = np.abs(cut["amplitude"].values - exact)
    assert (error <= np.maximum(0.03 * exact, 3 * cut["standard_error"].values))[told].all()
    return told


STEADY = {order: (lambda speed: 0.3 + 0 * speed, 0.4) for order in (7.64, 15.28, 50)}


@pytest.mark.parametrize(("start", "end"), [(500.0, 12000.0), (12000.0, 500.0)])
def test_a_resonance_passed_at_3800_rpm_a_second_is_right_within_3_percent(start, end):
    """Windows of four revolutions give 14.9 at 500 rpm, where the amplitude is 1.26."""
    components = {25: (response, 0.0)} | STEADY
    cut = exugear.order_cut(run_up(3.0, components, start, end), list(components))
    assert cut["amplitude"].sel(order=25).values == pytest.approx(response(cut["speed"].values), rel=0.03)
    assert is_told(cut, dict(sorted(components.items()))).all()
    assert cut["resolution"].max() > 5 * cut["resolution"].min() > 0


def test_close_orders_are_told_apart_or_nan_with_their_reason():
    """5 % apart through the resonance: in 20 s all is told; in 3 s windows of 3.2 revolutions change by half."""
    pair = {25: (response, 0.0), 26.25: (lambda speed: 1 + 0 * speed, 1.0)}
    assert is_told(exugear.order_cut(run_up(20.0, pair), list(pair)), pair).all()
    with pytest.warns(UserWarning, match=r"orders 25, 26.25 are NaN in .* change within windows of 3.2 revolutions"):
        fast = exugear.order_cut(run_up(3.0, pair), list(pair))
    told = is_told(fast, pair)
    assert told[:, fast["speed"].values > 1900 * rpm].all()
    assert not told[0, fast["speed"].values < 1300 * rpm].any()
    assert "amplitude_changes" in fast["reason"].attrs["flag_meanings"].split()[int(fast["reason"].max())]


@pytest.mark.slow
def test_an_oscillator_that_is_integrated_through_its_resonance():
    """The amplitude in a sweep, by the slowly varying phasor of the equation of motion."""
    time, speed, angle = linear_sweep(3.0, rate=25_000.0, start=500 * rpm, slope=11500 * rpm / 3)
    natural, slope = 2 * np.pi * NATURAL, 25 * 11500 * rpm / 3

    def rate(t, state):
        phasor, derivative = state
        s = 1j * 25 * (500 * rpm + slope / 25 * t)
        decay = 2 * DAMPING * natural
        return derivative, natural**2 * (1 - phasor) - (2 * s + decay) * derivative - (
            s**2 + 1j * slope + decay * s
        ) * phasor

    s = 1j * 25 * 500 * rpm
    steady = natural**2 / (natural**2 + 2 * DAMPING * natural * s + s**2)
    phasor = scipy.integrate.solve_ivp(rate, (0, 3), [steady, 0j], t_eval=time, rtol=1e-8, atol=1e-10).y[0]
    signal = exugear.recorded_signal(time, speed, np.real(phasor * np.exp(25j * angle)))
    cut = exugear.order_cut(signal, [25, 50])["amplitude"].sel(order=25)
    assert cut.values == pytest.approx(np.interp(cut["time"], time, np.abs(phasor)), rel=0.03, abs=0.003)


def test_a_tone_that_does_not_follow_the_speed_is_fitted_beside_the_orders():
    """A tone of 1000 Hz, as large as the order that crosses it at 2400 rpm."""
    steady = {25: (lambda speed: 1 + 0 * speed, 0.0)}
    signal = run_up(10.0, steady)
    tone = signal + np.cos(2 * np.pi * 1000 * signal["time"] + 0.3).values
    cut = exugear.order_cut(tone, [25], frequencies=[1000.0])
    assert cut["amplitude"].values == pytest.approx(1, rel=0.002)
    assert np.abs(exugear.order_cut(tone, [25])["amplitude"] - 1).max() > 0.5
    with pytest.raises(ValueError, match="frequencies must be > 0 Hz"):
        exugear.order_cut(tone, [25], frequencies=[0.0])


def test_orders_of_a_shaft_that_reverses_are_nan_where_it_does():
    time = np.linspace(0, 4, 80_001)
    speed = 100 * (2 - time)
    signal = exugear.recorded_signal(time, speed, np.cos(20 * (200 * time - 50 * time**2) + 0.5))
    with pytest.warns(UserWarning, match="orders 20 are NaN"):
        cut = exugear.order_cut(signal, [20])
    told = np.isfinite(cut["amplitude"].values[0])
    assert cut["amplitude"].values[0, told] == pytest.approx(1, rel=0.01)
    assert np.abs(cut["time"].values[~told] - 2).max() < 0.2
    assert 3 in cut["reason"]


@pytest.mark.parametrize("slope", [20.0, -20.0])
def test_phase_counts_from_the_angle_at_the_start_of_the_run(slope):
    sweep = linear_sweep(4.0, start=100.0, slope=slope)
    whole = with_orders(sweep, CLOSE)
    later = exugear.order_cut(whole.sel(time=slice(1.0, 3.0)), list(CLOSE))
    assert np.abs(later["phase"].values - phases(CLOSE)).max() < 0.01
    assert later["amplitude"].values == pytest.approx(amplitudes(CLOSE, later["speed"].values), rel=0.01)


def test_orders_that_are_not_listed_and_noise_hardly_disturb():
    """An order of amplitude 0.3 three orders beside, and white noise of 5 % of the mesh order."""
    sweep = linear_sweep(5.0)
    listed = {order: CLOSE[order] for order in (56, 57, 58)}
    disturbed = with_orders(sweep, listed | {61: (lambda speed: 0.3 + 0 * speed, 0.0)})
    cut = exugear.order_cut(disturbed, list(listed))
    assert cut["amplitude"].values == pytest.approx(amplitudes(listed, cut["speed"].values), rel=0.01)
    noise = 0.05 * np.random.default_rng(1).normal(size=disturbed.size)
    noisy = exugear.order_cut(disturbed + noise, [57]).isel(order=0)
    inner = slice(2 * np.pi, disturbed["angle"][-1].item() - 2 * np.pi)
    noisy = noisy.swap_dims(time="angle").sel(angle=inner)
    assert noisy["amplitude"].values == pytest.approx(CLOSE[57][0](noisy["speed"].values), rel=0.03)


def test_channels_are_cut_together_and_keep_their_labels():
    signal = with_orders(linear_sweep(4.0), CLOSE)
    channels = signal.expand_dims(bearing=["a", "b"]) * np.array([[1.0], [2.0]])
    cut = exugear.order_cut(channels.assign_attrs(signal.attrs), [57, 114])
    assert cut["amplitude"].dims == ("bearing", "order", "time")
    single = exugear.order_cut(signal, [57, 114])["amplitude"].values
    assert cut["amplitude"].sel(bearing="b").values == pytest.approx(2 * single)
    assert cut["amplitude"].attrs["units"] == "N"
    total = exugear.rms_sum(cut["amplitude"], over="bearing")
    assert total.values == pytest.approx(np.sqrt(5) * single)


def test_orders_beyond_the_samples_are_nan_and_others_stay():
    """At 2 kHz a period of order 114 has fewer than 2.25 samples above 49 rad/s."""
    components = {57: (lambda speed: 1 + 0 * speed, 0.0)}
    cut = exugear.order_cut(with_orders(linear_sweep(rate=2000.0, slope=6.0), components), [57, 114])
    valid = np.isfinite(cut["amplitude"].values)
    limit = 2 * np.pi * 2000 / 2.25 / np.array([[57], [114]])
    assert (valid == (cut["speed"].values <= limit)).mean() > 0.99
    assert valid[0].sum() > 1.5 * valid[1].sum() > 0
    assert cut["amplitude"].values[0, valid[0]] == pytest.approx(1, abs=0.01)


def test_windows_too_short_for_the_orders_and_signals_too_short_for_windows_are_refused():
    signal = with_orders(linear_sweep(1.0), CLOSE)
    for orders, options, words in (
        ([57, 57.5], {"revolutions": 4.0}, "revolutions must be >= 8 to tell orders 0.5 apart"),
        ([57, 57.1], {}, "a window of 40 revolutions and the longer one that checks it take 56.6 of the signal's 4.77"),
        ([0, 57], {}, "orders must be > 0"),
        ([], {}, "orders must be > 0 and finite, one at least"),
        ([np.inf], {}, "orders must be > 0 and finite"),
        ([1e7, 2e7], {}, "no period of an order of .* has 2.25 samples or more; sample finer"),
        ([57], {"overlap": 1.0}, "overlap must lie"),
    ):
        with pytest.raises(ValueError, match=words):
            exugear.order_cut(signal, orders, **options)


def test_a_run_of_3_5_million_samples_is_cut_within_its_budget(measured):
    """Nine orders in 5 s of processor time and 2 GB; measured 0.6 to 1.4 s and 0.2 GB."""
    sweep = linear_sweep(70.0, rate=50_000.0, start=0.0, slope=366.5 / 70)
    signal = with_orders(sweep, {57: (lambda speed: 1 + 0 * speed, 0.0), 58: (lambda speed: 0.1 + 0 * speed, 0.0)})
    assert signal.size > 3_500_000
    tracemalloc.start()
    began = time.process_time()
    cut = exugear.order_cut(signal, [*range(56, 59), *range(113, 116), *range(170, 173)])
    spent, (_, peak) = time.process_time() - began, tracemalloc.get_traced_memory()
    tracemalloc.stop()
    for order, amplitude in ((57, 1.0), (58, 0.1)):
        assert cut["amplitude"].sel(order=order).values == pytest.approx(amplitude, rel=0.01)
    measured.cells("3.5 million samples, nine orders", f"{spent:.1f} s of processor time, {peak / 1e9:.1f} GB")
    assert spent < 5
    assert peak < 2e9
