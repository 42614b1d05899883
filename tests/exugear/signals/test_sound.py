"""Sound files: pitch, amplitude, no aliases, whole or absent."""

import numpy as np
import pytest
from scipy.io import wavfile

import exugear


def tone(frequency: float, rate: float, amplitude: float = 3.0):
    time = np.arange(round(rate)) / rate
    return exugear.recorded_signal(time, 1 + time, 100 + amplitude * np.sin(2 * np.pi * frequency * time), units="N")


@pytest.mark.parametrize("rate", [48_000, 44_100])
def test_pitch_amplitude_and_length_survive(tmp_path, rate):
    full_scale = exugear.write_sound(tmp_path / "force.wav", tone(1000.0, 25_123.0), rate=rate)
    stored, samples = wavfile.read(tmp_path / "force.wav")
    assert stored == rate
    assert samples.size == pytest.approx(rate, abs=2)
    spectrum = np.abs(np.fft.rfft(samples * np.hanning(samples.size))) * 4 / samples.size
    assert spectrum.argmax() == 1000
    assert spectrum.max() / 32767 * full_scale == pytest.approx(3.0, rel=1e-3)


def test_what_the_file_cannot_hold_is_kept_out(tmp_path):
    """30 kHz at 100 kHz would alias to 18 kHz of 48 kHz."""
    exugear.write_sound(tmp_path / "high.wav", tone(30_000.0, 100_000.0), full_scale=4.0)
    _, samples = wavfile.read(tmp_path / "high.wav")
    assert np.abs(samples[200:-200].astype(float)).max() <= 1


def test_files_of_one_full_scale_are_comparable_and_loud_ones_refused(tmp_path):
    for amplitude in (1.0, 2.0):
        exugear.write_sound(tmp_path / f"{amplitude:g}.wav", tone(500.0, 48_000.0, amplitude), full_scale=4.0)
    quiet, loud = (np.abs(wavfile.read(tmp_path / f"{x}.wav")[1].astype(float)).max() for x in (1, 2))
    assert (loud / 32767, loud / quiet) == pytest.approx((0.5, 2.0), rel=1e-3)
    with pytest.raises(ValueError, match=r"full_scale must be at least the largest value, 2.*got 1"):
        exugear.write_sound(tmp_path / "clipped.wav", tone(500.0, 48_000.0, 2.0), full_scale=1.0)
    assert not (tmp_path / "clipped.wav").exists()


def test_a_constant_signal_is_silent(tmp_path):
    """Its deviation from the mean is rounding, which must not become noise at full scale."""
    assert exugear.write_sound(tmp_path / "still.wav", tone(500.0, 48_000.0, 0.0) / 3) == 1.0
    assert not wavfile.read(tmp_path / "still.wav")[1].any()


def test_channels_and_unequal_steps_are_refused(tmp_path):
    signal = tone(500.0, 48_000.0)
    with pytest.raises(ValueError, match="signal must be one channel over time, select it"):
        exugear.write_sound(tmp_path / "a.wav", signal.expand_dims(bearing=["a"]))
    with pytest.raises(ValueError, match="signal must have equal steps of time"):
        exugear.write_sound(tmp_path / "a.wav", signal[np.r_[0:100, 200:300]])
    with pytest.raises(OSError, match="could not be written"):
        exugear.write_sound(tmp_path / "missing" / "a.wav", signal)
