"""Oscillators with published or closed-form solutions, by the built model in Exudyn."""

import numpy as np
import pytest
from measured_rows import deviation
from scenes import K, Oscillator, linear_law, rectangular_law, swept

F = 10e3
STEADY = [
    (2.2, 2.2, 0.058993),
    (1.8, 1.8, 0.100536),
    (1.5, 1.5, 0.178030),
    (1.2, 1.2, 0.477057),
    (1.2, 1.0, 1.033563),
    (1.2, 0.8, 1.871110),
    (1.2, 0.7, 2.547585),
    (0.6, 0.7, 0.463351),
    (0.65, 0.8, 0.658228),
    (0.6, 0.6, 0.367941),
    (0.5, 0.5, 0.331070),
    (0.4, 0.4, 0.331000),
    (0.3, 0.3, 0.474838),
]
DEAD_ZONE, F_M, F_AH = 5e-6, 0.1, 0.05


@pytest.fixture(scope="module")
def rectangular() -> Oscillator:
    return Oscillator(rectangular_law())


def swept_rms(oscillator: Oscillator, start: float, end: float, periods: float = 200, hold: float = 30) -> float:
    """rms about the mean over the last 10 mesh cycles, after a slow sweep and a hold.

    In 30 periods a transient falls to exp(-0.05 2 pi 30) = 8e-5.
    """
    kept = 10 / end
    until = (periods if start != end else 0) + hold + kept
    frequency = swept(start, end, periods, until) if start != end else lambda x: end
    y, x = oscillator.run(frequency, lambda x: F, until)
    return float(np.std(y[x >= x[-1] - kept]) * K / F)


@pytest.mark.parametrize(("start", "end", "rms"), STEADY)
def test_rectangular_stiffness_with_contact_loss(rectangular, start, end, rms, measured):
    row = "rectangular stiffness with contact loss, rms on both branches"
    measured(row, deviation(swept_rms(rectangular, start, end), rms), 1e-2)


def test_jump_up_lies_within_half_a_percent(rectangular):
    below, above = (swept_rms(rectangular, 0.8, 0.8453 * share, periods=300, hold=60) for share in (0.995, 1.005))
    assert below < 1.0 < 1.4 < above


@pytest.mark.slow
def test_upper_branch_ends_within_one_percent_of_its_fold():
    """Fold at W = 0.5923: last of an independent quasi-static sweep (Runge-Kutta, steps of 0.2 %, 300 cycles each)."""
    oscillator = Oscillator(rectangular_law(reach=3e-4))
    above, below = (swept_rms(oscillator, 0.95, 0.5923 * share, periods=350, hold=60) for share in (1.01, 0.99))
    assert below < 0.5 < 3.0 < above


def test_shape_of_the_deflection_does_not_depend_on_the_torque(rectangular):
    runs = [rectangular.run(lambda x: 0.9, lambda x, f=f: f, 40, tolerance=1e-7)[0] / f for f in (F, F / 50)]
    assert np.abs(runs[0] - runs[1]).max() < 1e-6 * np.abs(runs[0]).max()


@pytest.fixture(scope="module")
def clearance() -> Oscillator:
    return Oscillator(linear_law(backlash=2 * DEAD_ZONE))


def harmonic(oscillator: Oscillator, start: float, end: float, sweep: float = 250.0, hold: float = 150.0) -> float:
    """First-harmonic amplitude over the dead zone's half width at W = end, after a slow sweep from start and a hold."""
    periods = sweep + hold

    def push(x: float) -> float:
        swept_to = min(x, sweep)
        w = start + (end - start) * swept_to / sweep
        angle = 2 * np.pi * ((start + w) / 2 * swept_to + end * (x - swept_to))
        return K * DEAD_ZONE * (F_M + F_AH * w**2 * np.cos(angle))

    y, x = oscillator.run(lambda x: 0.0, push, periods, steps=80)
    kept = x >= periods - 20 / end
    carrier = np.exp(-2j * np.pi * end * x[kept])
    return float(2 * abs(np.mean((y[kept] - y[kept].mean()) * carrier)) / DEAD_ZONE)


@pytest.mark.parametrize(("w", "amplitude"), [(1.0, 0.1880), (0.8, 0.2845), (0.75, 0.3155)])
def test_clearance_oscillator_on_its_upper_branch(clearance, w, amplitude):
    assert harmonic(clearance, 1.0, w, sweep=100.0, hold=100.0) == pytest.approx(amplitude, rel=5e-3)


def test_clearance_oscillator_jumps_up(clearance):
    below, above = (harmonic(clearance, 0.78, 0.8286 * share) for share in (0.995, 1.005))
    assert below < 0.2 < above


def test_clearance_oscillator_falls_at_its_fold(clearance):
    below, above = (harmonic(clearance, 0.9, 0.7080 * share) for share in (0.995, 1.005))
    assert below < 0.2 < above
