"""Sampling over the shaft angle: what passes, what is kept out."""

import numpy as np
import pytest
import scipy
from sweeps import linear_sweep, with_orders

import exugear


def test_orders_up_to_the_highest_pass_unchanged():
    components = {1: (lambda speed: 1 + 0 * speed, 0.4), 150: (lambda speed: 2 + 0 * speed, 0.0)}
    sampled = exugear.over_angle(with_orders(linear_sweep(), components, mean=3.0), highest_order=150)
    angle = sampled["angle"].values
    assert np.diff(angle) == pytest.approx(2 * np.pi / (2.25 * 150))
    exact = 3 + np.cos(angle + 0.4) + 2 * np.cos(150 * angle)
    assert sampled.values[60:-60] == pytest.approx(exact[60:-60], abs=5e-5)
    assert sampled["speed"].values ** 2 == pytest.approx(20**2 + 40 * angle, rel=1e-6)


@pytest.mark.parametrize("frequency", [700.0, 6100.0, 9300.0, 15500.0])
def test_tones_that_would_alias_are_attenuated_by_100_db(frequency, measured):
    """A tone of constant frequency, above 1.25 times the highest order at all speeds."""
    time = linear_sweep()[0]
    speed = 2 * np.pi * np.minimum(0.9 * frequency / (150 * 1.25), 100) * (0.2 + 0.08 * time)
    sampled = exugear.over_angle(
        exugear.recorded_signal(time, speed, np.sin(2 * np.pi * frequency * time)), highest_order=150
    )
    measured("tones that would alias, over their amplitude", np.abs(sampled.values[60:-60]).max(), 1e-5)


def test_an_order_above_the_limit_leaves_no_trace_at_the_orders_below():
    """Order 190 would alias to 147.5 of 337.5 samples a revolution."""
    sampled = exugear.over_angle(
        with_orders(linear_sweep(), {190: (lambda speed: 1 + 0 * speed, 0.0)}), highest_order=150
    )
    assert np.abs(sampled.values[60:-60]).max() < 1e-4


EVEN = np.arange(0, 2, 4e-5)
UNEVEN = {
    "jitter": EVEN + np.r_[0, np.random.default_rng(0).uniform(-0.1, 0.1, EVEN.size - 1)] * 4e-5,
    "two rates": np.r_[np.arange(0, 1, 2e-5), np.arange(1, 2, 4e-5)],
    "a sample lost": np.delete(EVEN, 30_000),
    "every hundredth lost": np.delete(EVEN, np.arange(50, EVEN.size - 50, 100)),
}


@pytest.mark.parametrize("name", UNEVEN)
def test_samples_at_unequal_steps_of_time_are_interpolated(name):
    time = UNEVEN[name]
    angle = 10 * time + 45 * time**2
    signal = exugear.recorded_signal(time, 10 + 90 * time, np.cos(20 * angle) + 0.1 * np.cos(60 * angle))
    sampled = exugear.over_angle(signal, highest_order=80)
    x = sampled["angle"].values
    assert sampled.values[60:-60] == pytest.approx((np.cos(20 * x) + 0.1 * np.cos(60 * x))[60:-60], abs=3e-4)
    low, high = exugear.order_cut(signal, [20, 60])["amplitude"].values
    assert low == pytest.approx(1.0, abs=1e-4)
    assert high == pytest.approx(0.1, abs=1e-4)


def test_missing_samples_are_refused():
    time = np.delete(EVEN, np.arange(30_000, 30_010))
    signal = exugear.recorded_signal(time, 10 + 90 * time, np.cos(time))
    with pytest.raises(ValueError, match=r"samples are missing from 1.19996 to 1.2004 s; cut it there"):
        exugear.over_angle(signal, highest_order=80)
    assert exugear.over_angle(signal, highest_order=20).size


def test_a_start_from_rest_and_a_standstill_are_sampled():
    time = np.linspace(0, 10, 100_001)
    speed = np.clip(time - 2, 0, 3) * 30
    angle = scipy.integrate.cumulative_trapezoid(speed, time, initial=0)
    sampled = exugear.over_angle(exugear.recorded_signal(time, speed, 1 + np.cos(20 * angle)), highest_order=40)
    assert sampled.values[60:-60] == pytest.approx(1 + np.cos(20 * sampled["angle"].values[60:-60]), abs=1e-4)
    with pytest.raises(ValueError, match="signal must be of a turning shaft"):
        exugear.over_angle(exugear.recorded_signal(time, 0 * time, time), highest_order=4)
    with pytest.raises(ValueError, match="highest_order must be > 0"):
        exugear.over_angle(exugear.recorded_signal(time, speed, time), highest_order=0)
