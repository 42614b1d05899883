"""Both direct solvers solve."""

import gc

import numpy as np
import pytest
import scipy.sparse as sp

from fem import solver


@pytest.fixture
def system():
    n = 40
    line = sp.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(n, n))
    plane = sp.kron(line, sp.eye_array(n)) + sp.kron(sp.eye_array(n), line)
    x = np.random.default_rng(0).standard_normal((n * n, 3))
    return sp.csr_matrix(plane), x


def test_superlu_solves(system):
    matrix, x = system
    assert solver.superlu(matrix)(matrix @ x) == pytest.approx(x, abs=1e-9)


def test_superlu_by_groups_solves(system):
    matrix, x = system
    graph = sp.csr_matrix(sp.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(40, 40)))
    solve = solver.superlu_by_groups(matrix, np.arange(1600) // 40, graph)
    assert solve(matrix @ x) == pytest.approx(x, abs=1e-9)


def test_the_installed_solver_gives_the_same(system):
    matrix, x = system
    assert solver.factorize(matrix)(matrix @ x) == pytest.approx(x, abs=1e-9)


def test_pardiso_solves(system):
    solver_type = pytest.importorskip("pypardiso").PyPardisoSolver
    matrix, x = system
    assert solver.pardiso(matrix, solver_type)(matrix @ x) == pytest.approx(x, abs=1e-9)


def test_pardiso_keeps_its_factors_as_long_as_the_solution_is_wanted(system):
    """As an extra it is not always there; this one writes down what it is asked for."""
    matrix, x = system
    asked = []

    class Recorder:
        def __init__(self, mtype):
            self.mtype = mtype

        def factorize(self, upper):
            self.solved = solver.superlu(upper + sp.triu(upper, 1).T)
            asked.append("factorize")

        def solve(self, upper, b):
            asked.append("solve")
            return self.solved(b)

        def free_memory(self, everything):
            asked.append("free")

    solve = solver.pardiso(matrix, Recorder)
    for _ in range(2):
        assert solve(matrix @ x) == pytest.approx(x, abs=1e-9)
    assert asked == ["factorize", "solve", "solve"]
    del solve
    gc.collect()
    assert asked[-1] == "free"
