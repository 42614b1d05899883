"""Direct solutions do not depend on the solver, nor on the blocks."""

import numpy as np
import pytest
import scipy.sparse as sp

from fem.linalg import direct_solver


@pytest.fixture
def system():
    n = 40
    line = sp.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(n, n))
    plane = sp.kron(line, sp.eye_array(n)) + sp.kron(sp.eye_array(n), line)
    x = np.random.default_rng(0).standard_normal((n * n, 3))
    return sp.csr_matrix(plane), x


def test_superlu_solves(system):
    matrix, x = system
    assert direct_solver.superlu(matrix)(matrix @ x) == pytest.approx(x, abs=1e-9)


def test_blocks_do_not_change_the_solution(system):
    matrix, x = system
    for block in (np.arange(1600) // 40, np.full(1600, 7), np.random.default_rng(1).integers(0, 200, 1600)):
        assert direct_solver.factorize(matrix, block)(matrix @ x) == pytest.approx(x, abs=1e-9)
