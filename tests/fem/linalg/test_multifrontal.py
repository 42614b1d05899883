"""Cholesky factors by fronts: any matrix, any groups, and no more fill than the order of elimination makes."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from fem.linalg import multifrontal
from fem.linalg.block_matrix import KroneckerMatrix, Sparse


def grid(n: int, m: int) -> sp.csr_matrix:
    """Positive definite matrix that couples the neighbours of a grid."""
    line = [sp.diags_array([-1.0, 2.1, -1.0], offsets=[-1, 0, 1], shape=(k, k)) for k in (n, m)]
    return sp.csr_matrix(sp.kron(line[0], sp.eye_array(m)) + sp.kron(sp.eye_array(n), line[1]))


def blocks(graph: sp.csr_matrix, size: np.ndarray, rng) -> tuple[sp.csr_matrix, np.ndarray]:
    """Random positive definite matrix with groups of these sizes, coupled as in the graph, and their unknowns."""
    group = rng.permutation(np.repeat(np.arange(size.size), size))
    coupled = graph.toarray()[np.ix_(group, group)] != 0
    matrix = np.where(coupled, rng.standard_normal(coupled.shape), 0)
    matrix = matrix + matrix.T
    return sp.csr_matrix(matrix + np.diag(np.abs(matrix).sum(axis=0) + 1)), group


@settings(deadline=None, max_examples=60)
@given(st.integers(1, 7), st.integers(1, 7), st.integers(0, 10**6))
def test_any_groups_are_solved(n, m, seed):
    rng = np.random.default_rng(seed)
    matrix, group = blocks(grid(n, m), rng.integers(1, 6, n * m), rng)
    x = rng.standard_normal((group.size, 3))
    assert multifrontal.factorize(Sparse(matrix, group))(matrix @ x) == pytest.approx(x, abs=1e-10)


def test_parts_that_are_not_coupled_are_solved():
    matrix = sp.csr_matrix(sp.block_diag([grid(3, 4), grid(2, 5), grid(1, 1)]))
    x = np.random.default_rng(0).standard_normal((23, 1))
    assert multifrontal.factorize(Sparse(matrix, np.arange(23)))(matrix @ x) == pytest.approx(x, abs=1e-12)


def test_every_group_is_eliminated_once_and_before_all_it_touches():
    found, done = multifrontal.eliminated(grid(12, 30)), set()
    for front in found:
        done |= set(front.groups)
        assert not done & front.later
    assert sorted(group for front in found for group in front.groups) == list(range(360))
    assert len(found) < 300


def test_fill_is_that_of_the_order():
    """Dense Cholesky in the same order has as many entries: joined groups add none."""
    graph = grid(9, 14)
    found = multifrontal.eliminated(graph)
    order = [group for front in found for group in front.groups]
    dense = np.linalg.cholesky(graph.toarray()[np.ix_(order, order)])
    stored = sum(len(f.groups) * (len(f.groups) + 1) // 2 + len(f.groups) * len(f.later) for f in found)
    assert stored == np.count_nonzero(np.abs(dense) > 1e-14)


def test_what_is_not_wanted_is_left_out():
    rng = np.random.default_rng(0)
    matrix, group = blocks(grid(20, 6), np.full(120, 3), rng)
    wanted = np.flatnonzero(group < 5)
    b = np.zeros((360, 2))
    b[wanted] = rng.standard_normal((wanted.size, 2))
    x = multifrontal.factorize(Sparse(matrix, group), wanted)(b)
    assert x[wanted] == pytest.approx(np.linalg.solve(matrix.toarray(), b)[wanted], abs=1e-12)
    assert np.isnan(np.delete(x, wanted, axis=0)).all()


def test_loads_beside_the_wanted_are_refused():
    solve = multifrontal.factorize(Sparse(grid(3, 3), np.arange(9)), wanted=np.array([2, 4]))
    with pytest.raises(ValueError, match="b must be zero where nothing is wanted"):
        solve(np.ones((9, 1)))


@pytest.mark.parametrize("shift", [3.0, np.nan])
def test_matrix_must_be_positive_definite(shift):
    with pytest.raises(np.linalg.LinAlgError, match=r"matrix must be positive definite, .*; hold what moves"):
        multifrontal.factorize(Sparse(sp.csr_matrix(grid(3, 3) - shift * sp.eye_array(9)), np.arange(9)))


def products(n: int, m: int, size: int, rng) -> KroneckerMatrix:
    """Positive definite sum of two products over a grid, its unknowns numbered at random."""
    between = [grid(n, m), sp.csr_matrix(sp.eye_array(n * m))]
    places = np.stack(sp.coo_matrix(between[0]).coords)
    values = np.stack([np.asarray(one[tuple(places)]).ravel() for one in between], axis=1)
    root = rng.standard_normal((2, size, size))
    inside = root @ root.swapaxes(1, 2) + np.eye(size)
    return KroneckerMatrix(places, values, inside, np.sort(rng.permutation(n * m * size).reshape(n * m, size)))


@settings(deadline=None, max_examples=40)
@given(st.integers(1, 6), st.integers(1, 6), st.integers(1, 5), st.integers(0, 10**6))
def test_products_are_solved_as_the_matrix_that_they_make(n, m, size, seed):
    rng = np.random.default_rng(seed)
    summed = products(n, m, size, rng)
    x = rng.standard_normal((summed.members.size, 2))
    whole = np.zeros((summed.members.size,) * 2)
    for (i, j), factors in zip(summed.places.T, summed.values, strict=True):
        whole[np.ix_(summed.members[i], summed.members[j])] = np.tensordot(factors, summed.inside, 1)
    assert summed.matrix.toarray() == pytest.approx(whole, abs=1e-12)
    assert multifrontal.factorize(summed)(whole @ x) == pytest.approx(x, abs=1e-9)


def test_part_of_products_is_that_of_their_matrix():
    summed, free = products(4, 5, 3, np.random.default_rng(0)), np.ones(60, bool)
    free[summed.members[[2, 7]]], free[summed.members[:, 1]] = False, False
    part = summed.part(free)
    assert part.matrix.toarray() == pytest.approx(summed.matrix.toarray()[np.ix_(free, free)], abs=1e-12)
    assert multifrontal.factorize(part)(np.ones((36, 1))) == pytest.approx(
        np.linalg.solve(summed.matrix.toarray()[np.ix_(free, free)], np.ones((36, 1))), abs=1e-9
    )


def test_members_that_differ_between_groups_are_refused():
    summed, free = products(2, 2, 3, np.random.default_rng(0)), np.ones(12, bool)
    with pytest.raises(ValueError, match="members must increase"):
        KroneckerMatrix(summed.places, summed.values, summed.inside, summed.members[:, ::-1])
    free[summed.members[1, 2]] = False
    with pytest.raises(ValueError, match="of every group the same members must be free"):
        summed.part(free)
