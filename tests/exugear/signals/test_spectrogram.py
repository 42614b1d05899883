"""Spectra over frequency along a run."""

import numpy as np
import pytest
from sweeps import linear_sweep, with_orders

import exugear


def test_a_tone_has_its_amplitude_at_its_frequency_at_all_times():
    time, speed, _ = linear_sweep(2.0)
    signal = exugear.recorded_signal(time, speed, 5 + 3 * np.cos(2 * np.pi * 1230 * time), units="N")
    spectra = exugear.spectrogram(signal, resolution=10.0)
    assert spectra["amplitude"].sel(frequency=1230, method="nearest").values == pytest.approx(3, rel=1e-4)
    away = np.abs(spectra["frequency"].values - 1230) > 25
    assert spectra["amplitude"].values[:, away].max() < 1e-3
    assert spectra["speed"].values == pytest.approx(20 + 20 * spectra["time"].values, rel=1e-3)


def test_the_first_spectrum_starts_with_the_signal_and_overlap_sets_the_next():
    signal = exugear.recorded_signal(*linear_sweep(1.0)[:2], np.zeros(40_001))
    half, most = (exugear.spectrogram(signal, resolution=20.0, overlap=share)["time"].values for share in (0.5, 0.9))
    assert half[:2] == pytest.approx([0.025, 0.05])
    assert most[:2] == pytest.approx([0.025, 0.03])
    with pytest.raises(ValueError, match=r"resolution must lie in \[1, .*\] Hz, got 0.5 Hz"):
        exugear.spectrogram(signal, resolution=0.5)
    with pytest.raises(ValueError, match=r"resolution must lie in \[1, .*\] Hz, got 1e\+06 Hz"):
        exugear.spectrogram(signal, resolution=1e6)


def test_a_waterfall_has_equal_steps_of_the_speed_and_orders_on_rays():
    signal = with_orders(linear_sweep(8.0, slope=25.0), {57: (lambda speed: 2 + 0 * speed, 0.0)})
    spectra = exugear.waterfall(signal, lines=20, resolution=20.0)
    assert spectra["amplitude"].dims == ("speed", "frequency")
    assert np.diff(spectra["speed"].values) == pytest.approx(200 / 19, rel=0.05)
    peaks = spectra["frequency"].values[spectra["amplitude"].values.argmax(axis=1)]
    assert peaks == pytest.approx(57 * spectra["speed"].values / (2 * np.pi), abs=20)
    assert spectra["amplitude"].values.max() < 2.01


def test_spectra_keep_channels():
    signal = with_orders(linear_sweep(1.0), {57: (lambda speed: 2 + 0 * speed, 0.0)})
    spectra = exugear.spectrogram(signal.expand_dims(bearing=["a", "b"]), resolution=50.0)
    assert spectra["amplitude"].dims == ("bearing", "time", "frequency")
