"""Harmonics of the transmission error: known amplitudes and angles."""

import numpy as np
import pytest
from paper_gears import paper_pair

import fem
from fem.units import um

TORQUE = np.array([0.0, 100.0])


def wave(phase: np.ndarray) -> np.ndarray:
    """Two harmonics of 3 um and 0.5 um about 10 um, at 100 N m."""
    te = 10 + 3 * np.cos(2 * np.pi * phase + 0.4) + 0.5 * np.cos(6 * np.pi * phase - 1.1)
    return np.outer([0.0, um], te)


def test_harmonics_of_a_known_sum():
    phase = np.arange(16) / 16 + 0.01
    harmonics = fem.te_harmonics(fem.ste_map(paper_pair(), TORQUE, phase, wave(phase)), 4).sel(torque=100.0)
    assert harmonics["amplitude"].values == pytest.approx(np.array([3, 0, 0.5, 0]) * um, abs=1e-12 * um)
    assert harmonics["angle"].sel(harmonic=[1, 3]).values == pytest.approx([0.4, -1.1])
    assert harmonics["amplitude"].attrs["units"] == "m"


def test_uneven_phases_and_several_pitches():
    phase = np.sort(np.random.default_rng(1).random(400))
    uneven = fem.te_harmonics(fem.ste_map(paper_pair(), TORQUE, phase, wave(phase)), 3)
    assert uneven["amplitude"].sel(torque=100.0).values == pytest.approx(np.array([3, 0, 0.5]) * um, abs=2e-3 * um)
    phase = np.arange(48) / 16
    whole = fem.te_harmonics(fem.ste_map(paper_pair(), TORQUE, phase, wave(phase), pitches=3), 3)
    assert whole["amplitude"].sel(torque=100.0).values == pytest.approx(np.array([3, 0, 0.5]) * um, abs=1e-12 * um)


def test_harmonics_need_phases_enough():
    phase = np.arange(8) / 8
    with pytest.raises(ValueError, match=r"harmonics must lie in \[1, 3\], below half the number of phases"):
        fem.te_harmonics(fem.ste_map(paper_pair(), TORQUE, phase, wave(phase)), 4)
