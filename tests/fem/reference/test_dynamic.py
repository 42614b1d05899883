"""Implicit time integration: static equilibria at low speed, vibration at speed, Newmark's rule, bad input."""

import numpy as np
import pytest
from raw_twin import balanced, problem_of
from scipy.integrate import quad
from skfem import ElementQuad1

import fem
from fem import Density, dynamic, explicit
from fem.units import rpm

COARSE = Density(flank=30)
TINY = Density(flank=8, fillet=1, land=1, tooth=2, rim=1, body=2)


def static(pair, result, steps: np.ndarray, density: Density) -> np.ndarray:
    """Static transmission error at time steps, under the present viscous load."""
    problem = problem_of(pair, density, ElementQuad1(), wheel_share=1.0)
    states = zip(result["phase"].values[steps], result["torque"].values[steps] / pair.pinion.r_b, strict=True)
    return np.array([balanced(problem, *state).te for state in states])


@pytest.fixture(scope="module")
def short(paper_pair):
    """A tenth of a pitch at full speed in single tooth contact."""
    run = dynamic.RunUp(start=-0.1, run_up=0.1, stop=0.1, steps=200)
    return dynamic.transmission_error(paper_pair, 150, run, density=COARSE, progress=False)


def test_slow_gears_pass_through_static_equilibria(paper_pair, short):
    settled = np.flatnonzero(short["phase"].values > 0.02)[::3]
    assert short["te"].values[settled] == pytest.approx(static(paper_pair, short, settled, COARSE), rel=2e-3)


@pytest.mark.slow
def test_gears_at_speed_vibrate_as_by_explicit_integration(paper_pair, measured):
    """Both methods treat the wheel's hub differently: eliminated from the Newton step, and by its torques."""
    run, scheme = dynamic.RunUp(300 * rpm, 0.0, 0.3, 0.1, steps=1200), explicit.CentralDifferences(4e-8)
    implicit = dynamic.transmission_error(paper_pair, 150, run, density=TINY, progress=False)
    expected = explicit.transmission_error(paper_pair, 150, run, scheme, density=TINY, progress=False)
    te = implicit["te"].values
    assert expected.attrs["added_mass"] < 0.02
    row = "implicit against explicit time integration, rest to 300 rpm within a fifth of a pitch, te up to 51 µm"
    measured(row, np.abs(te - expected["te"].values).max() / te.max(), 0.01)
    assert te.max() > 1.2 * np.abs(static(paper_pair, implicit, [len(te) - 1], TINY)).max()


def test_diverging_steps_raise_with_a_remedy(paper_pair):
    """From rest to 1000 rpm within a tenth of a pitch, without numerical damping."""
    run = dynamic.RunUp(1000 * rpm, 0.0, 0.3, 0.1, steps=600, alpha=0.0)
    with pytest.raises(RuntimeError, match=r"no balance at phase 0\.\d+; use more steps per pitch, .* alpha nearer"):
        dynamic.transmission_error(paper_pair, 150, run, density=TINY, progress=False)


def test_load_and_error_rise_from_rest(short):
    te = short["te"].values
    assert te[0] == 0
    assert (np.diff(te[short["phase"].values < -0.05]) > 0).all()


def test_phase_is_the_integral_of_the_speed():
    run, pitch = dynamic.RunUp(), 0.11
    ramp = 2 * run.run_up * pitch / run.speed
    for t in (0.3 * ramp, ramp, 1.7 * ramp):
        turned, _ = quad(lambda s: run.motion(s, pitch)[1], 0, t, points=[min(t, ramp)])
        gained, _ = quad(lambda s: run.motion(s, pitch)[2], 0, t, points=[min(t, ramp)])
        phase, speed, _ = run.motion(t, pitch)
        assert (phase - run.start) * pitch == pytest.approx(turned)
        assert speed == pytest.approx(gained)
    assert run.motion(run.times(pitch)[-1], pitch)[0] == pytest.approx(run.stop)


def oscillation(rule: dynamic.Newmark, omega: float, n: int) -> np.ndarray:
    """x'' = -omega^2 x from x = 1 with Newmark's rule (alpha = 0)."""
    zero = np.zeros((1, 2))
    motions = tuple(dynamic.Motion((zero, zero), value) for value in (1.0, 0.0, -(omega**2)))
    x = [1.0]
    for _ in range(n):
        motions = rule.predicted(*motions)
        change = -(omega**2 * motions[0].te + motions[2].te) / (rule.acceleration_change + omega**2)
        motions = rule.corrected(motions, dynamic.Motion((zero, zero), change))
        x.append(motions[0].te)
    return np.array(x)


def test_newmark_without_damping_keeps_the_amplitude_and_converges():
    omega, n = 2 * np.pi, 200
    x = oscillation(dynamic.Newmark(0.0, 1 / n), omega, n)
    assert x == pytest.approx(np.cos(omega * np.linspace(0, 1, n + 1)), abs=1e-3)
    assert np.abs(oscillation(dynamic.Newmark(0.0, 0.05), omega, 2000)).max() < 1 + 1e-9


@pytest.mark.slow
def test_a_cycle_at_10_rpm_is_the_static_curve(paper_pair):
    result = dynamic.transmission_error(paper_pair, 150, dynamic.RunUp(), density=COARSE, progress=False)
    cycle = np.flatnonzero(result["phase"].values >= result["phase"].values[-1] - 1 + 1e-9)[::5]
    te = result["te"].values[cycle]
    expected = static(paper_pair, result, cycle, COARSE)
    assert te.mean() == pytest.approx(expected.mean(), rel=3e-3)
    assert np.ptp(te) == pytest.approx(np.ptp(expected), rel=3e-3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda pair: dynamic.RunUp(speed=-1 * rpm), "speed must be > 0"),
        (lambda pair: dynamic.RunUp(stop=2.0), "within \\[-0.75, 0.75\\]"),
        (lambda pair: dynamic.RunUp(alpha=0.1), "alpha must lie"),
        (lambda pair: dynamic.RunUp(steps=3), "steps must be at least 20"),
        (lambda pair: dynamic.RunUp(damping=-1.0), "damping must be >= 0"),
        (lambda pair: dynamic.RunUp(speed=np.inf), "speed must be > 0 and finite"),
        (lambda pair: dynamic.RunUp(steps="many"), "steps must be one real number"),
        (lambda pair: dynamic.RunUp(start=None), "start must be one real number"),
        (lambda pair: dynamic.transmission_error(pair, 0.0), "torque must be > 0"),
        (lambda pair: dynamic.transmission_error(pair, [100, 150]), "torque must be one real number"),
        (lambda pair: dynamic.transmission_error(pair, 1e9), "torque must be finite and below"),
        (lambda pair: dynamic.transmission_error(pair, 150, {"speed": 1.0}), "run must be a fem.dynamic.RunUp"),
        (
            lambda pair: dynamic.transmission_error(pair, 150, density=fem.Resolution()),
            "density must be a fem.Density",
        ),
    ],
)
def test_bad_input_is_refused(paper_pair, call, message):
    with pytest.raises(ValueError, match=message):
        call(paper_pair)
