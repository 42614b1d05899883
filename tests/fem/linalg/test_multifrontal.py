"""The multifrontal solution of any matrix in any blocks is that of the assembled matrix."""

import numpy as np
import pytest
import scipy.sparse as sp
from grid_matrices import grid
from hypothesis import given, settings
from hypothesis import strategies as st

from fem.linalg import multifrontal
from fem.linalg.block_matrix import BlockMatrix, KroneckerMatrix


def random_blocks(graph: sp.csr_matrix, size: np.ndarray, rng) -> BlockMatrix:
    """Random positive definite matrix with blocks of these sizes, coupled as in the graph."""
    block = rng.permutation(np.repeat(np.arange(size.size), size))
    coupled = graph.toarray()[np.ix_(block, block)] != 0
    matrix = np.where(coupled, rng.standard_normal(coupled.shape), 0)
    matrix = matrix + matrix.T
    return BlockMatrix(sp.csr_matrix(matrix + np.diag(np.abs(matrix).sum(axis=0) + 1)), block)


@settings(max_examples=60)
@given(st.integers(1, 7), st.integers(1, 7), st.integers(0, 10**6))
def test_any_blocks_are_solved(n, m, seed):
    rng = np.random.default_rng(seed)
    blocks = random_blocks(grid(n, m), rng.integers(1, 6, n * m), rng)
    x = rng.standard_normal((blocks.block.size, 3))
    assert multifrontal.factorize(blocks)(blocks.matrix @ x) == pytest.approx(x, abs=1e-10)


def test_parts_that_are_not_coupled_are_solved():
    matrix = sp.csr_matrix(sp.block_diag([grid(3, 4), grid(2, 5), grid(1, 1)]))
    x = np.random.default_rng(0).standard_normal((23, 1))
    assert multifrontal.factorize(BlockMatrix(matrix, np.arange(23)))(matrix @ x) == pytest.approx(x, abs=1e-12)


def test_unknowns_that_are_not_accessed_stay_unknown():
    rng = np.random.default_rng(0)
    blocks = random_blocks(grid(20, 6), np.full(120, 3), rng)
    accessed = np.flatnonzero(blocks.block < 5)
    b = np.zeros((360, 2))
    b[accessed] = rng.standard_normal((accessed.size, 2))
    x = multifrontal.factorize(blocks, accessed)(b)
    assert x[accessed] == pytest.approx(np.linalg.solve(blocks.matrix.toarray(), b)[accessed], abs=1e-12)
    assert np.isnan(np.delete(x, accessed, axis=0)).all()


def test_loads_on_unknowns_that_are_not_accessed_are_refused():
    solve = multifrontal.factorize(BlockMatrix(grid(3, 3), np.arange(9)), accessed=np.array([2, 4]))
    with pytest.raises(ValueError, match="b must be zero except at the accessed unknowns"):
        solve(np.ones((9, 1)))


@pytest.mark.parametrize("shift", [3.0, np.nan])
def test_matrix_must_be_positive_definite(shift):
    with pytest.raises(np.linalg.LinAlgError, match=r"matrix must be positive definite, .*; clamp what moves"):
        multifrontal.factorize(BlockMatrix(sp.csr_matrix(grid(3, 3) - shift * sp.eye_array(9)), np.arange(9)))


def kronecker_sum(n: int, m: int, size: int, rng) -> KroneckerMatrix:
    """Positive definite sum of two Kronecker products over a grid, its unknowns numbered at random."""
    sparse = [grid(n, m), sp.csr_matrix(sp.eye_array(n * m))]
    indices = np.stack(sp.coo_matrix(sparse[0]).coords)
    entries = np.stack([np.asarray(matrix[tuple(indices)]).ravel() for matrix in sparse], axis=1)
    root = rng.standard_normal((2, size, size))
    dense = root @ root.swapaxes(1, 2) + np.eye(size)
    return KroneckerMatrix(indices, entries, dense, np.sort(rng.permutation(n * m * size).reshape(n * m, size)))


@settings(max_examples=40)
@given(st.integers(1, 6), st.integers(1, 6), st.integers(1, 5), st.integers(0, 10**6))
def test_kronecker_products_are_solved_as_their_assembled_matrix(n, m, size, seed):
    rng = np.random.default_rng(seed)
    products = kronecker_sum(n, m, size, rng)
    x = rng.standard_normal((products.unknowns.size, 2))
    assembled = np.zeros((products.unknowns.size,) * 2)
    for (i, j), entries in zip(products.indices.T, products.entries, strict=True):
        assembled[np.ix_(products.unknowns[i], products.unknowns[j])] = np.tensordot(entries, products.dense, 1)
    assert products.matrix.toarray() == pytest.approx(assembled, abs=1e-12)
    assert multifrontal.factorize(products)(assembled @ x) == pytest.approx(x, abs=1e-9)


def test_part_of_kronecker_products_is_that_of_their_assembled_matrix():
    products, free = kronecker_sum(4, 5, 3, np.random.default_rng(0)), np.ones(60, bool)
    free[products.unknowns[[2, 7]]], free[products.unknowns[:, 1]] = False, False
    part, load = products.part(free), np.ones((36, 1))
    assembled = products.matrix.toarray()[np.ix_(free, free)]
    assert part.matrix.toarray() == pytest.approx(assembled, abs=1e-12)
    assert multifrontal.factorize(part)(load) == pytest.approx(np.linalg.solve(assembled, load), abs=1e-9)


def test_free_unknowns_that_differ_between_blocks_are_refused():
    products, free = kronecker_sum(2, 2, 3, np.random.default_rng(0)), np.ones(12, bool)
    with pytest.raises(ValueError, match="unknowns must increase in each block"):
        KroneckerMatrix(products.indices, products.entries, products.dense, products.unknowns[:, ::-1])
    free[products.unknowns[1, 2]] = False
    with pytest.raises(ValueError, match="the same unknowns must be free in every block"):
        products.part(free)


@settings(max_examples=40)
@given(st.integers(1, 6), st.integers(2, 6), st.integers(0, 10**6))
def test_schur_complement_of_kept_blocks_is_that_of_the_dense_matrix(n, m, seed):
    rng = np.random.default_rng(seed)
    blocks = random_blocks(grid(n, m), rng.integers(1, 6, n * m), rng)
    kept = rng.permutation(np.flatnonzero(blocks.block < rng.integers(1, n * m)))
    inverse = np.linalg.inv(blocks.matrix.toarray())[np.ix_(kept, kept)]
    assert multifrontal.schur_complement(blocks, kept) == pytest.approx(np.linalg.inv(inverse), rel=1e-9, abs=1e-9)


def test_a_block_is_kept_as_a_whole():
    with pytest.raises(ValueError, match="all unknowns of a block must be kept"):
        multifrontal.schur_complement(BlockMatrix(grid(3, 3), np.arange(9) // 3), np.array([0, 1]))
