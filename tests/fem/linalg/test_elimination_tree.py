"""The elimination tree orders all blocks, and joining blocks to supernodes adds no fill."""

import numpy as np
from grid_matrices import grid

from fem.linalg.elimination_tree import supernodes


def test_every_block_is_eliminated_once_and_before_all_rows_of_its_columns():
    tree, eliminated = supernodes(grid(12, 30)), set()
    for supernode in tree:
        eliminated |= set(supernode.pivots)
        assert not eliminated & supernode.rows
    assert sorted(block for supernode in tree for block in supernode.pivots) == list(range(360))
    assert len(tree) < 300


def test_fill_is_that_of_the_order():
    """Dense Cholesky in the same order has as many entries: joined blocks add none."""
    graph = grid(9, 14)
    tree = supernodes(graph)
    order = [block for supernode in tree for block in supernode.pivots]
    dense = np.linalg.cholesky(graph.toarray()[np.ix_(order, order)])
    sizes = [(len(supernode.pivots), len(supernode.rows)) for supernode in tree]
    stored = sum(n * (n + 1) // 2 + n * m for n, m in sizes)
    assert stored == np.count_nonzero(np.abs(dense) > 1e-14)
