"""Envelope, resonances and orders of signals that are known."""

import numpy as np
import pytest

from exugear.spectrum import envelope, order_spectrum, resonances


def test_envelope_of_a_growing_sine():
    t = np.linspace(0, 10, 200_001)
    found = envelope(t, t * np.sin(2 * np.pi * 50 * t) + 3, windows=100)
    assert found.amplitude == pytest.approx(found.place, abs=0.06)
    assert found.rms == pytest.approx(found.place / np.sqrt(2), abs=0.02)
    assert (found.high + found.low) / 2 == pytest.approx(3, abs=0.06)


def test_resonances_of_oscillators_are_found_between_the_samples():
    f = np.linspace(1, 3000, 400)
    response = sum(a / np.hypot(1 - (f / f0) ** 2, 0.06 * f / f0) for a, f0 in ((1, 600), (2, 1800)))
    found = resonances(f, response)
    assert found.place == pytest.approx([600, 1800], rel=3e-3)
    assert (np.diff(found.place) > 0).all()


def test_orders_of_a_run_up_stay_where_they_are():
    t = np.linspace(0, 10, 400_001)
    speed = 20 + 20 * t
    angle = 20 * t + 10 * t**2
    found = order_spectrum(t, speed, 2 * np.sin(57 * angle) + 0.5 * np.cos(114 * angle), orders=150)
    for order, amplitude in ((57, 2.0), (114, 0.5)):
        line = np.argmin(np.abs(found.order - order))
        assert found.amplitude[:, line] == pytest.approx(amplitude, rel=0.05)
    assert np.median(found.amplitude[:, np.abs(found.order - 80) < 10]) < 0.01


def test_orders_that_are_sampled_too_coarsely_are_left_out():
    t = np.linspace(0, 10, 20_001)
    found = order_spectrum(t, 100 * t, np.sin(t), orders=60)
    assert found.speed.max() < 2 * np.pi * 2000 / (2.2 * 60) * 1.01
    with pytest.raises(ValueError, match="sample finer"):
        order_spectrum(t, 1000 + 0 * t, np.sin(t), orders=600)


#: One second, in which 20.1 rad/s turn 3.2 times.
FINE = np.linspace(0, 1, 20001)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: envelope(np.arange(9.0), np.full(9, np.nan)), "finite"),
        (lambda: envelope(np.arange(9.0), np.zeros(8)), "one length"),
        (lambda: envelope(np.arange(9.0), np.zeros(9), windows=6), "windows must be"),
        (lambda: resonances(np.arange(9.0), np.zeros(9), prominence=5), "prominence must"),
        (lambda: order_spectrum(np.arange(9.0), np.ones(9), np.ones(9), orders=-1), "orders must"),
        (lambda: order_spectrum(FINE, 20.1 + 0 * FINE, np.sin(FINE), orders=5), "3.2 revolutions, a line takes 8"),
    ],
)
def test_bad_signals_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
