"""Averages over the turns of a shaft, condition indicators, envelope spectra: signals of known answer."""

import numpy as np
import pytest
from planetary_boxes import planetary_box
from scenes import smooth_box
from scipy.special import jv

import exugear

Z, TURNS = 23, 60


def sampled(values, *, turns=TURNS, speed=2 * np.pi * 20, **about):
    """A signal over the angle of a shaft at constant speed: values(angle)."""
    time = np.linspace(0.0, 2 * np.pi * turns / speed, int(turns * 400) + 1)
    return exugear.recorded_signal(time, np.full(time.size, speed), values(speed * time), **about)


def mesh(angle):
    """Two mesh harmonics of a sound gear."""
    return np.cos(Z * angle) + 0.3 * np.cos(2 * Z * angle + 1.0)


def average_of(values, **options):
    return exugear.synchronous_average(sampled(values), highest_order=3.5 * Z, **options)


def test_the_average_of_what_repeats_is_what_repeats():
    average = average_of(lambda x: mesh(x) + 0.2 * np.cos(x))
    exact = mesh(average["angle"]) + 0.2 * np.cos(average["angle"])
    assert average.values == pytest.approx(exact.values, abs=2e-4)
    assert average.attrs["turns"] == TURNS - 1
    assert 0 < average.attrs["turns_left_out"] < 1


def test_noise_falls_with_the_root_of_the_number_of_turns():
    noise = np.random.default_rng(1).normal(size=400 * TURNS + 1)
    averages = [average_of(lambda x: noise, turns=turns) for turns in (1, 4, 16)]
    rms = [float(np.sqrt((x**2).mean())) for x in averages]
    assert rms[0] / rms[1] == pytest.approx(2, rel=0.1)
    assert rms[0] / rms[2] == pytest.approx(4, rel=0.1)


def test_the_average_of_the_wheel_by_a_tachometer_at_the_pinion():
    """Order 47 of the wheel is order 23 of the pinion; what the pinion alone repeats vanishes in 47 of its turns."""
    heard = sampled(lambda x: np.cos(23 * x) + 0.4 * np.cos(23 / 47 * x + 0.5) + 0.3 * np.cos(x), turns=200)
    average = exugear.synchronous_average(heard, highest_order=100, shaft_order=23 / 47, turns=23)
    angle = average["angle"]
    assert average.isel(average=0).values == pytest.approx(np.cos(47 * angle) + 0.4 * np.cos(angle + 0.5), abs=2e-4)
    assert average["speed"].values == pytest.approx(2 * np.pi * 20 * 23 / 47)
    assert average.sizes["average"] == 4


def test_the_average_follows_a_changing_speed():
    time = np.linspace(0, 2.0, 80_001)
    speed = 2 * np.pi * (10 + 10 * time)
    angle = 2 * np.pi * (10 * time + 5 * time**2)
    average = exugear.synchronous_average(exugear.recorded_signal(time, speed, mesh(angle)), highest_order=80)
    assert average.values == pytest.approx(mesh(average["angle"]).values, abs=1e-3)


def test_indicators_of_an_amplitude_modulation():
    """(1 + m cos x) cos(Z x): side bands of m/2, all of them in the first pair: nothing left in the difference."""
    m = 0.2
    indicators = exugear.condition_indicators(average_of(lambda x: (1 + m * np.cos(x)) * np.cos(Z * x)), [Z])
    assert float(indicators["side_band_ratio"].sel(harmonic=1)) == pytest.approx(m, rel=1e-3)
    assert float(indicators["FM0"]) == pytest.approx(2 * (1 + m), rel=1e-2)
    assert float(indicators["rms"]) == pytest.approx(np.sqrt((1 + m**2 / 2) / 2), rel=1e-4)
    assert float(indicators["energy_ratio"]) < 1e-3
    assert float(indicators["NA4"]) == pytest.approx(2.25, rel=1e-2)  # residual m cos x cos Z x: (3/2)^2


def test_indicators_of_a_phase_modulation():
    """cos(Z x + p cos x): side bands of J_1(p) / J_0(p) of the harmonic on either side."""
    p = 0.3
    average = average_of(lambda x: np.cos(Z * x + p * np.cos(x)))
    indicators = exugear.condition_indicators(average, [Z], side_bands=2)
    expected = 2 * (jv(1, p) + jv(2, p)) / jv(0, p)
    assert float(indicators["side_band_ratio"].sel(harmonic=1)) == pytest.approx(expected, rel=1e-3)
    assert float(indicators["crest_factor"]) == pytest.approx(np.sqrt(2), rel=1e-2)


def test_rounding_has_no_shape_and_harmonics_that_are_missing_no_side_bands():
    level = exugear.condition_indicators(average_of(lambda x: 5.0 + 0.0 * x), [Z])
    assert all(np.isnan(level[name]).all() for name in level if name not in ("rms", "peak_to_peak"))
    single = exugear.condition_indicators(average_of(lambda x: np.cos(Z * x)), [float(Z)])
    bands = single["side_band_ratio"]
    assert np.isfinite(bands.sel(harmonic=1)) and np.isnan(bands.sel(harmonic=2))
    assert all(np.isnan(single[name]) for name in ("FM4", "M6A", "NA4"))  # the resampling errs by 1e-7 of the mesh
    assert float(single["FM0"]) == pytest.approx(2.0, rel=1e-6)


def test_noise_is_normal_and_impulses_are_not():
    """FM4 and NA4 of normal noise are 3, M6A 15; an impact a turn raises them, the mesh and its run-out do not."""
    noise = 0.3 * np.random.default_rng(1).normal(size=400 * TURNS + 1)

    def impact(x):
        return np.exp(-(((x - 2.0) % (2 * np.pi)) / 0.05))

    regular = lambda x: mesh(x) + 0.2 * np.cos(x) + noise  # noqa: E731
    sound, damaged = (
        exugear.condition_indicators(average_of(values, turns=10), [Z])
        for values in (regular, lambda x: regular(x) + 1.5 * impact(x))
    )
    assert sound["FM4"].values == pytest.approx(3.0, abs=0.9)
    assert sound["M6A"].values == pytest.approx(15.0, abs=13)
    assert (damaged["FM4"].values > 6).all()
    assert (damaged["NA4"].values > 6).all()
    assert (damaged["kurtosis"].values < 6).all()


def test_na4_refers_to_the_sound_gear():
    """Twice the residual signal at the same shape: the fourth moment is 16 times that of the baseline."""
    residual = lambda x: 0.1 * np.cos(5 * x)  # noqa: E731
    sound = average_of(lambda x: mesh(x) + residual(x), turns=10)
    damaged = average_of(lambda x: mesh(x) + 2 * residual(x), turns=10)
    alone = exugear.condition_indicators(damaged, [Z])
    assert alone["NA4"].values == pytest.approx(1.5, rel=1e-2)
    against = exugear.condition_indicators(damaged, [Z], baseline=sound)
    assert against["NA4"].values == pytest.approx(16 * 1.5, rel=1e-2)
    assert against["FM4"].values == pytest.approx(alone["FM4"].values)


def test_na4_refers_to_the_mean_variance_so_far():
    """A residual signal that grows to twice after four averages: 16 / ((4 + 4) / 5)^2 of its kurtosis in the fifth."""
    first = 10 * 2 * np.pi * 4 + 2 * np.pi * 0.5
    average = average_of(lambda x: mesh(x) + 0.1 * np.cos(5 * x) * np.where(x < first, 1, 2), turns=10)
    trend = exugear.condition_indicators(average, [Z])["NA4"].values
    assert trend[:4] == pytest.approx(1.5, rel=2e-2)
    assert trend[4] == pytest.approx(1.5 * 16 / (8 / 5) ** 2, rel=5e-2)


def test_na4_of_some_averages_is_that_of_a_series_that_begins_with_them():
    """The mean variance so far is that of the averages that are given, whatever their numbers."""
    average = average_of(lambda x: mesh(x) + 0.1 * np.cos(5 * x), turns=10)
    later = exugear.condition_indicators(average.isel(average=slice(2, None)), [Z])
    assert later["NA4"].values == pytest.approx(1.5, rel=2e-2)


def test_nothing_but_rounding_remains_of_a_sound_gear():
    """What is not a number is not told."""
    zeros = average_of(lambda x: 0.0 * x)
    indicators = exugear.condition_indicators(zeros, [Z])
    assert all(bool(indicators[name].isnull().all()) for name in ("FM4", "NA4", "FM0", "kurtosis", "energy_ratio"))


def test_the_envelope_of_a_band_is_its_modulation():
    m, carrier, speed = 0.4, 3000.0, 2 * np.pi * 20
    time = np.linspace(0, 2.0, 40_001)
    values = (1 + m * np.cos(3 * speed * time)) * np.cos(2 * np.pi * carrier * time) + 2 * np.cos(Z * speed * time)
    heard = exugear.recorded_signal(time, np.full(time.size, speed), values)
    inside = slice(0.2, 1.8)
    envelope = exugear.demodulate(heard, [2500.0, 3500.0]).sel(time=inside)
    exact = 1 + m * np.cos(3 * speed * envelope["time"])
    assert envelope.values == pytest.approx(exact.values, abs=5e-3)
    lines = exugear.envelope_spectrum(heard.sel(time=inside), [2500.0, 3500.0], highest_order=10)
    mean = lines["mean_amplitude"]
    assert float(mean.sel(order=3)) == pytest.approx(m, rel=1e-2)
    assert float(mean.where(abs(mean["order"] - 3) > 0.3).max()) < 0.02 * m


def test_orders_beyond_the_width_of_the_band_are_not_told_as_the_speed_rises():
    """Order 10 of 10 to 50 Hz in a band of 400 Hz: its side bands lie in the band up to 20 Hz, no line beyond 40."""
    time = np.linspace(0, 4.0, 80_001)
    speed, turned = 2 * np.pi * (10 + 10 * time), 2 * np.pi * (10 * time + 5 * time**2)
    values = (1 + 0.4 * np.cos(10 * turned)) * np.cos(2 * np.pi * 4000 * time)
    heard = exugear.recorded_signal(time, speed, values)
    lines = exugear.envelope_spectrum(heard, [3800.0, 4200.0], highest_order=12)
    of_order = lines["amplitude"].sel(order=10)
    beyond = 10 * of_order["speed"] > 2 * np.pi * 400
    assert bool(beyond.any()) and bool((of_order.isnull() == beyond).all())
    assert float(lines["mean_amplitude"].sel(order=10)) == pytest.approx(float((of_order**2).mean() ** 0.5))


def test_impacts_repeat_at_the_order_of_the_damaged_gear_as_the_speed_changes():
    """Impacts at 3.57 a turn, as of a bearing, that ring at 4 kHz, in noise, through a change of the speed."""
    time = np.arange(0, 3.0, 1 / 40_000)
    speed = 2 * np.pi * (15 + 5 * time)
    turned = 15 * time + 2.5 * time**2
    impacts = np.diff(np.floor(3.57 * turned), prepend=0.0)
    ring = np.exp(-1500 * time[:200]) * np.sin(2 * np.pi * 4000 * time[:200])
    noise = np.random.default_rng(1).normal(size=time.size)
    values = np.convolve(impacts, ring)[: time.size] + 0.05 * noise
    lines = exugear.envelope_spectrum(
        exugear.recorded_signal(time, speed, values), [3000.0, 5000.0], highest_order=12, revolutions=20
    )
    largest = lines["mean_amplitude"].sel(order=slice(1, None)).idxmax("order")
    assert float(largest) == pytest.approx(3.57, abs=1 / 20)


def test_fault_orders_of_a_set_follow_from_its_teeth():
    """z 30/30/-90, ring held: turns of the carrier against the ring count."""
    model = exugear.build(planetary_box(held="ring"))
    run = exugear.run_up(model, speed=(50.0, 60.0), load=100.0, duration=5e-3, progress=False, checks=0)
    counted = {"turns_of": "carrier", "relative_to": "ring"}
    expected = {"mesh": 90, "planet pass": 3, "sun tooth": 9, "ring tooth": 3, "planet tooth": 3, "assembly phase": 3}
    for stage in ("sun-planet 1", "planet 1-ring"):
        orders = exugear.fault_orders(run, stage, **counted)
        assert {cause: float(orders.sel(cause=cause)) for cause in expected} == pytest.approx(expected)


def test_fault_orders_of_a_pair():
    """z 57 against 57: the same teeth meet at each turn."""
    run = exugear.run_up(exugear.build(smooth_box()), speed=50.0, load=10.0, duration=2e-3, progress=False, checks=0)
    orders = exugear.fault_orders(run)
    expected = {"mesh": 57, "pinion": 1, "wheel": 1, "hunting tooth": 1, "assembly phase": 1}
    assert {cause: float(orders.sel(cause=cause)) for cause in orders["cause"].values} == pytest.approx(expected)


REFUSED = {
    "highest_order must be >= 1": lambda: average_at(highest_order=0.5),
    "shaft_order must be > 0": lambda: average_at(highest_order=80, shaft_order=-1),
    "turns must be >= 1": lambda: average_at(highest_order=80, turns=0),
    "record longer, or pass fewer turns": lambda: average_at(highest_order=80, turns=TURNS),
    "mesh_orders must be given": lambda: exugear.residual_signal(average_of(mesh)),
    "mesh_orders must lie in": lambda: exugear.residual_signal(average_of(mesh), [900]),
    "side_bands must lie in": lambda: exugear.residual_signal(average_of(mesh), [Z], side_bands=12),
    "shaft_orders must lie in": lambda: exugear.residual_signal(average_of(mesh), [Z], shaft_orders=1000),
    "pass what exugear.synchronous_average returned": lambda: exugear.condition_indicators(sampled(mesh), [Z]),
    "baseline must have the samples": lambda: exugear.condition_indicators(
        average_of(mesh), [Z], baseline=average_at(highest_order=90)
    ),
    "band must be two rising frequencies": lambda: exugear.demodulate(sampled(mesh), [500.0, 100.0]),
    "got .*9000": lambda: exugear.demodulate(sampled(mesh), [100.0, 9000.0]),
    "band must be .* Hz wide or more": lambda: exugear.demodulate(sampled(mesh), [500.0, 500.001]),
    "beyond the width of the band of 50 Hz": lambda: exugear.envelope_spectrum(
        sampled(mesh), [500.0, 550.0], highest_order=20
    ),
    "got samples for order .* at the highest speed": lambda: average_at(highest_order=300),
    "got samples for order .* at the lowest speed": lambda: exugear.over_angle(sampled(mesh), highest_order=300),
    "speed of the signal must keep its sign": lambda: exugear.synchronous_average(reversing(), highest_order=20),
    "signal must be of a turning shaft": lambda: exugear.synchronous_average(turning(0.0, 0.0), highest_order=20),
}


def reversing():
    """A shaft that stops and turns back."""
    return turning(-100.0, 100.0)


def turning(first: float, last: float):
    """A shaft whose speed [rad/s] changes evenly."""
    time = np.linspace(0, 2.0, 20_001)
    return exugear.recorded_signal(time, np.linspace(first, last, time.size), np.cos(100 * time))


def average_at(**options):
    return exugear.synchronous_average(sampled(mesh), **options)


@pytest.mark.parametrize("words", REFUSED)
def test_refused_with_the_remedy(words):
    with pytest.raises(ValueError, match=words):
        REFUSED[words]()
