"""Steady states of oscillators with known solutions, through the public function."""

from functools import cache

import numpy as np
import pytest
from measured_rows import deviation
from scenes import K, Oscillator, rectangular_law
from scipy.interpolate import CubicSpline

import exugear

F, ZETA = 10e3, 0.05
#: W, branch, rms of the DTE about its mean over F / K, peak to peak, mean: computed independently by shooting.
RECTANGULAR = [
    (2.2, "main", 0.058993, 0.162853, 0.986362),
    (1.8, "main", 0.100536, 0.278439, 0.976822),
    (1.5, "main", 0.178030, 0.495305, 0.959180),
    (1.2, "main", 0.477057, 1.339900, 0.893853),
    (1.0, "upper", 1.033563, 2.913680, 0.679152),
    (0.8, "upper", 1.871110, 5.358065, 0.086215),
    (0.7, "upper", 2.547585, 7.363672, -0.531668),
    (0.7, "lower", 0.463351, 1.363618, 1.103129),
    (0.8, "lower", 0.658228, 1.898016, 1.145686),
    (0.6, "lower", 0.367941, 1.121851, 1.080763),
    (0.5, "lower", 0.331070, 1.101147, 1.065395),
    (0.4, "lower", 0.331000, 1.203032, 1.051353),
    (0.3, "lower", 0.474838, 1.667892, 1.083821),
]
DEAD_ZONE, F_M, F_AH = 5e-6, 0.1, 0.05


@cache
def rectangular():
    """Steady states over W of the rectangular mesh stiffness with contact loss, damped all the time."""
    oscillator = Oscillator(rectangular_law(reach=3e-4), ZETA)
    speeds = np.array([0.25, 2.5]) * oscillator.omega / oscillator.teeth
    data = exugear.steady_states(oscillator.model, speed=tuple(speeds), load=F * oscillator.r)
    return data.assign(W=data["speed"] * oscillator.teeth / oscillator.omega)


def crossings(data, w: float) -> list[dict[str, float]]:
    """Orbits of one mesh cycle at W, by splines along the branches: measures over F / K, whether they are stable."""
    orbits = []
    for number in np.unique(data["branch"].values[data["period"].values == 1]):
        points = data.isel(point=np.flatnonzero(data["branch"].values == number))
        values = np.column_stack([points["W"], *(points[name] * K / F for name in MEASURES)])
        length = np.cumsum(np.linalg.norm(np.diff(values, axis=0, prepend=values[:1]), axis=1))
        along = CubicSpline(length, values)
        for root in CubicSpline(length, values[:, 0] - w).roots(extrapolate=False):
            i = int(np.searchsorted(length, root))
            stable = bool(points["stable"].values[max(i - 1, 0) : i + 1].all())
            orbits.append(dict(zip(MEASURES, along(root)[1:], strict=True)) | {"stable": stable})
    return orbits


MEASURES = "rms", "peak_to_peak", "mean"


@pytest.mark.parametrize(("w", "branch", "rms", "peak_to_peak", "mean"), RECTANGULAR)
def test_rectangular_stiffness_with_contact_loss(w, branch, rms, peak_to_peak, mean):
    stable = [orbit for orbit in crossings(rectangular(), w) if orbit["stable"]]
    nearest = min(stable, key=lambda orbit: abs(orbit["rms"] - rms))
    assert nearest["rms"] == pytest.approx(rms, rel=1e-3)
    assert nearest["peak_to_peak"] == pytest.approx(peak_to_peak, rel=1e-3)
    assert nearest["mean"] == pytest.approx(mean, abs=1e-3)
    assert len(stable) == 1 + (w in (0.6, 0.7, 0.8))


def bifurcations(kind: str, period: int = 1) -> list[float]:
    data = rectangular()
    return sorted(data["W"].values[(data["bifurcation"] == kind).values & (data["period"] == period).values])


def test_jumps_lie_at_the_folds():
    lower, upper = bifurcations("fold")
    assert upper == pytest.approx(0.8453, rel=1e-3)
    assert lower == pytest.approx(0.5923, rel=1e-3)


def test_parametric_instability_begins_and_ends_at_period_doublings():
    """The exact interval of the linear equation y'' + 2 zeta y' + k(t) y = 0."""
    assert bifurcations("period doubling") == pytest.approx([1.8671, 2.1218], rel=1e-3)


def test_orbits_between_the_folds_and_in_the_parametric_instability_are_unstable():
    data = rectangular()
    assert sum(not orbit["stable"] for orbit in crossings(data, 0.7)) == 1
    assert [orbit["stable"] for orbit in crossings(data, 2.0)] == [False]


def test_a_subharmonic_branch_joins_both_period_doublings():
    data = rectangular()
    subharmonic = data.where(data["period"] == 2, drop=True)
    assert np.unique(subharmonic["branch"]).size == 1
    ends = sorted(subharmonic["W"].values[[0, -1]])
    assert ends == pytest.approx(bifurcations("period doubling"), rel=1e-6)
    half_order = subharmonic["harmonics"].sel(harmonic=0.5)
    assert float(half_order.max()) > F / K
    assert float(half_order[[0, -1]].max()) < 1e-6 * F / K


def clearance_oscillator(w: float):
    """An unloaded error e(t) in place of Kahraman's force F_ah W^2 cos(W t); both, and the DTE over the dead zone.

    With e'' + 2 zeta e' = -F_ah W^2 cos(W t), exact at W alone, DTE - e solves his equation.
    """
    n = 512
    phase = np.arange(n) / n
    amplitude = F_AH * w / np.hypot(w, 2 * ZETA)
    error = amplitude * DEAD_ZONE * np.sin(2 * np.pi * phase)
    deflection = error[:, None] + np.array([0.0, 1e-4])
    table = np.broadcast_to(K * np.array([0.0, 1e-4]), deflection.shape)
    law = exugear.MeshForce(phase, deflection, table, backlash=2 * DEAD_ZONE)
    oscillator = Oscillator(law, ZETA)
    speeds = np.array([0.95, 1.05]) * w * oscillator.omega / oscillator.teeth
    load = F_M * DEAD_ZONE * K * oscillator.r
    data = exugear.steady_states(oscillator.model, speed=tuple(speeds), load=load)
    data = data.assign(W=data["speed"] * oscillator.teeth / oscillator.omega)
    motion = data["harmonics"] * np.exp(1j * data["harmonic_phase"])
    relative = motion.sel(harmonic=1.0) / DEAD_ZONE + 1j * amplitude
    return data.assign(amplitude=abs(relative))


@pytest.mark.parametrize(("w", "amplitude"), [(1.0, 0.1880), (0.8, 0.2845), (0.75, 0.3155)])
def test_clearance_oscillator_on_its_upper_branch(w, amplitude, measured):
    data = clearance_oscillator(w)
    main = data.where((data["period"] == 1) & data["stable"], drop=True)
    on_branch = []
    for number in np.unique(main["branch"]):
        points = main.where(main["branch"] == number, drop=True).sortby("W")
        on_branch.append(float(np.interp(w, points["W"], points["amplitude"])))
    measured("clearance oscillator: amplitudes on the upper branch", deviation(max(on_branch), amplitude), 1e-3)


@pytest.mark.parametrize("w", [0.8286, 0.7080])
def test_clearance_oscillator_jumps_at_its_folds(w, measured):
    data = clearance_oscillator(w)
    folds = data["W"].values[(data["bifurcation"] == "fold").values]
    nearest = min(folds, key=lambda fold: abs(fold - w))
    measured("clearance oscillator: jump-up and fold", deviation(nearest, w), 1e-3)
