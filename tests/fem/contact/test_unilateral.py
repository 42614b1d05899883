"""The one active-set solver: closed forms, non-negative least squares, and problems on which plain exchanges cycle."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq, nnls

from fem.contact.unilateral import EXCHANGES, PENETRATION, Equilibrium, unilateral_contact
from fem.units import um


def counted_contact(compliance, gap, force: float, active=None, exchanges=EXCHANGES) -> tuple[Equilibrium, int]:
    """Candidates with a compliance matrix that are pressed together by a total force; the number of solutions."""
    n = gap.size

    def solve(_, active: np.ndarray) -> Equilibrium:
        touching = active if active.any() else gap == gap.min()
        per_te, per_gap = np.linalg.solve(
            compliance[touching][:, touching], np.stack([np.ones(n), gap], axis=1)[touching]
        ).T
        te = (force + per_gap.sum()) / per_te.sum()
        f = np.zeros(n)
        f[touching] = per_te * te - per_gap
        slack = np.where(touching, 0.0, compliance @ f + gap - te)
        solutions.append(active)
        return Equilibrium(te, per_te.sum(), f, slack, True)

    solutions: list = []
    state = unilateral_contact(solve)(None, np.ones(n, bool) if active is None else active, exchanges)
    return state, len(solutions)


def contact(*problem, **options) -> Equilibrium:
    return counted_contact(*problem, **options)[0]


def admissible(compliance, gap, force: float, state: Equilibrium) -> None:
    f, te = state.force, state.te
    slack = compliance @ f + gap - te
    assert f.min() >= 0
    assert slack.min() >= -1.01 * PENETRATION  # summed in another order
    assert np.abs(f * slack).max() < 1e-12 * force * um
    assert f.sum() == pytest.approx(force, rel=1e-9)


def test_a_spring_closes_its_gap_and_yields():
    state = contact(np.array([[2e-9]]), np.array([3 * um]), 500.0)
    assert (state.te, state.stiffness, state.force[0]) == pytest.approx((4 * um, 5e8, 500))


def test_of_springs_with_rising_gaps_as_many_touch_as_the_force_closes():
    """Springs of 1 N/um, gaps 0, 1, 2, ... um: k touch from k (k - 1) / 2 N on, te = (F + k (k - 1) / 2) / k."""
    for force, touching in ((0.5, 1), (2.0, 2), (4.5, 3), (7.0, 4)):
        state = contact(np.eye(6) * 1e-6, np.arange(6) * um, force)
        assert (state.force > 0).sum() == touching
        assert state.te / um == pytest.approx((force + touching * (touching - 1) / 2) / touching)


def least_squares(compliance, gap, force: float) -> float:
    """Transmission error by non-negative least squares for the forces at each, and bisection."""
    lower = np.linalg.cholesky(compliance)

    def too_much(te: float) -> float:
        return nnls(lower.T, np.linalg.solve(lower, te - gap))[0].sum() - force

    return brentq(too_much, gap.min(), gap.min() + 2 * force * compliance.max() + 10 * um, xtol=1e-18)


@given(st.integers(0, 10**6), st.integers(1, 25), st.floats(0, 4))
def test_random_compliances_against_least_squares(seed, n, exponent):
    rng, force = np.random.default_rng(seed), 10**exponent
    root = rng.standard_normal((n, n))
    compliance, gap = 1e-9 * (root @ root.T / n + 1e-2 * np.eye(n)), rng.uniform(0, 5 * um, n)
    state = contact(compliance, gap, force, rng.random(n) < 0.5)
    admissible(compliance, gap, force, state)
    assert state.te == pytest.approx(least_squares(compliance, gap, force), rel=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_exchanges_that_cycle_end_by_joining_one_by_one(seed):
    """A compliance that is singular up to 1e-9 of its size, like that of very narrow strips."""
    rng, n = np.random.default_rng(seed), 100
    x = np.linspace(0, 1, n)
    compliance = 1e-9 * (np.exp(-((np.subtract.outer(x, x) / 0.2) ** 2)) + 1e-9 * np.eye(n))
    gap = rng.uniform(0, 5 * um, n)
    state, solutions = counted_contact(compliance, gap, 2000.0, rng.random(n) < 0.5)
    admissible(compliance, gap, 2000.0, state)
    assert EXCHANGES < solutions < EXCHANGES + n


@pytest.mark.parametrize("seed", range(20))
def test_candidates_may_touch_without_force(seed):
    """The signs of their force and gap are rounding, by which exchanges would never end."""
    rng, n, te = np.random.default_rng(seed), 40, 5 * um
    root = rng.standard_normal((n, n))
    compliance, f = 1e-9 * (root @ root.T / n + 1e-3 * np.eye(n)), np.where(rng.random(n) < 0.4, rng.random(n), 0.0)
    gap = te - compliance @ f + np.where((f > 0) | (rng.random(n) < 0.5), 0.0, 1 * um)
    state = contact(compliance, gap, f.sum(), rng.random(n) < 0.5)
    assert state.te == pytest.approx(te, rel=1e-9)
    assert state.force == pytest.approx(f, abs=1e-6)


@given(st.integers(0, 10**6))
def test_candidates_that_join_one_by_one_reach_the_same_equilibrium(seed):
    rng, n = np.random.default_rng(seed), 20
    root = rng.standard_normal((n, n))
    compliance, gap = 1e-9 * (root @ root.T / n + 1e-2 * np.eye(n)), rng.uniform(0, 5 * um, n)
    usual = contact(compliance, gap, 1000.0)
    slow = contact(compliance, gap, 1000.0, exchanges=1)
    assert slow.te == pytest.approx(usual.te, rel=1e-12)
    assert slow.force == pytest.approx(usual.force, abs=1e-8)


def test_a_system_without_equilibrium_raises_with_a_remedy():
    def solve(_, active: np.ndarray) -> Equilibrium:
        return Equilibrium(0.0, 1.0, np.ones(2), np.zeros(2), converged=False)

    with pytest.raises(RuntimeError, match="contact did not converge; try a neighbouring phase"):
        unilateral_contact(solve)(None, np.ones(2, bool))
