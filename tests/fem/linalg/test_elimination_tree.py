"""The elimination tree orders all blocks, and joining blocks to supernodes adds no fill."""

import numpy as np
import pytest
from grid_matrices import grid

from fem.linalg.elimination_tree import supernodes

#: Blocks of equal and of different sizes take different orders.
SIZES = {"equal": lambda n: np.ones(n, int), "different": lambda n: np.random.default_rng(0).integers(1, 50, n)}
NONE = np.zeros(0, int)


@pytest.mark.parametrize("sizes", SIZES)
@pytest.mark.parametrize("last", [NONE, np.array([359, 7, 180])], ids=["none", "three"])
def test_every_block_is_eliminated_once_and_before_all_rows_of_its_columns(sizes, last):
    tree, eliminated = supernodes(grid(12, 30), SIZES[sizes](360), last), set()
    for supernode in tree:
        eliminated |= set(supernode.pivots)
        assert not eliminated & supernode.rows
    assert sorted(block for supernode in tree for block in supernode.pivots) == list(range(360))
    assert len(tree) < 300
    assert not last.size or tree[-1].pivots == last.tolist()


@pytest.mark.parametrize("sizes", SIZES)
def test_fill_is_that_of_the_order(sizes):
    """Dense Cholesky in the same order has as many entries: joined blocks add none."""
    graph = grid(9, 14)
    tree = supernodes(graph, SIZES[sizes](126), NONE)
    order = [block for supernode in tree for block in supernode.pivots]
    dense = np.linalg.cholesky(graph.toarray()[np.ix_(order, order)])
    fronts = [(len(supernode.pivots), len(supernode.rows)) for supernode in tree]
    stored = sum(n * (n + 1) // 2 + n * m for n, m in fronts)
    assert stored == np.count_nonzero(np.abs(dense) > 1e-14)


def test_order_counts_unknowns_not_blocks():
    """The factor of blocks of different sizes has fewer entries than in the order for equal ones."""
    graph, sizes = grid(9, 14), SIZES["different"](126)

    def stored(counted: np.ndarray) -> int:
        fronts = [(node.pivots, list(node.rows)) for node in supernodes(graph, counted, NONE)]
        return sum(sizes[pivots].sum() * (sizes[pivots].sum() / 2 + sizes[rows].sum()) for pivots, rows in fronts)

    assert stored(sizes) < 0.8 * stored(np.ones(126, int))
