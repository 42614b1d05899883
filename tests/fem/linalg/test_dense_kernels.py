"""Kernels work in place on parts of matrices, and threads run them side by side."""

import numpy as np
import pytest

from fem.linalg.dense_kernels import cholesky, solve_from_the_right, solve_lower, subtract_square


@pytest.fixture
def front():
    """Positive definite matrix in Fortran order."""
    root = np.random.default_rng(0).standard_normal((7, 7))
    return np.asfortranarray(root @ root.T + np.eye(7))


def test_elimination_of_the_first_unknowns_leaves_the_schur_complement(front):
    whole = front.copy()
    cholesky(front[:3, :3])
    solve_from_the_right(front[:3, :3], front[3:, :3])
    subtract_square(front[3:, :3], front[3:, 3:])
    expected = whole[3:, 3:] - whole[3:, :3] @ np.linalg.solve(whole[:3, :3], whole[:3, 3:])
    assert np.tril(front[3:, 3:]) == pytest.approx(np.tril(expected), abs=1e-12)
    assert np.triu(front, 1) == pytest.approx(np.triu(whole, 1))


def test_both_triangular_solutions_solve_the_system(front):
    x = np.asfortranarray(np.arange(14.0).reshape(7, 2))
    b, lower = np.asfortranarray(front @ x), front.copy("F")
    cholesky(lower)
    solve_lower(lower, b)
    solve_lower(lower, b, transposed=True)
    assert b == pytest.approx(x, abs=1e-10)


def test_empty_parts_are_left_alone(front):
    lower = front.copy("F")
    cholesky(lower)
    solve_from_the_right(lower, np.zeros((0, 7), order="F"))
    subtract_square(np.zeros((0, 7), order="F"), np.zeros((0, 0), order="F"))
