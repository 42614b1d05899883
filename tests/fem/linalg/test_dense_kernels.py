"""Kernels work in place on parts of matrices."""

import numpy as np
import pytest

from fem.linalg.dense_kernels import eliminate, solve_lower


@pytest.fixture
def front():
    """Part of a matrix in Fortran order, positive definite."""
    whole = np.zeros((9, 9), order="F")
    root = np.random.default_rng(0).standard_normal((7, 7))
    whole[2:, 2:] = root @ root.T + np.eye(7)
    return whole[2:, 2:]


def test_elimination_of_the_first_unknowns_leaves_the_schur_complement(front):
    whole = front.copy()
    eliminate(front, 3)
    expected = whole[3:, 3:] - whole[3:, :3] @ np.linalg.solve(whole[:3, :3], whole[:3, 3:])
    assert np.tril(front[3:, 3:]) == pytest.approx(np.tril(expected), abs=1e-12)
    assert np.tril(front)[:, :3] == pytest.approx(np.linalg.cholesky(whole)[:, :3], abs=1e-12)
    assert np.triu(front, 1) == pytest.approx(np.triu(whole, 1))


def test_both_triangular_solutions_solve_the_system(front):
    x = np.asfortranarray(np.arange(14.0).reshape(7, 2))
    b, lower = np.asfortranarray(front @ x), front.copy("F")
    eliminate(lower, 7)
    solve_lower(lower, b)
    solve_lower(lower, b, transposed=True)
    assert b == pytest.approx(x, abs=1e-10)


@pytest.mark.parametrize("pivot", [-1.0, np.nan])
def test_pivots_must_be_positive(front, pivot):
    front[2, 2] = pivot
    with pytest.raises(np.linalg.LinAlgError, match="must be positive definite"):
        eliminate(front, 3)
