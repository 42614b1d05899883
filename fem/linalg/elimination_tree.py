"""Elimination tree of a sparse symmetric matrix: which blocks are eliminated together, and in which order.

The symbolic half of a Cholesky factorization (Liu, SIAM Review 34, 1992). A supernode is a set of blocks whose columns
of the factor have the same rows below them; it can be eliminated once its children in the tree are.
"""

from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu


@dataclass
class Supernode:
    """Blocks that are eliminated together.

    pivots      numbers of these blocks, in the order of elimination
    rows        blocks eliminated later in which their columns of the factor are not zero
    children    supernodes whose first later block is one of the pivots
    """

    pivots: list[int]
    rows: set[int]
    children: list["Supernode"] = field(default_factory=list)


def supernodes(graph: sp.csr_matrix) -> list[Supernode]:
    """Supernodes in an order of little fill, each after its children.

    graph       matrix whose pattern says which blocks are coupled; blocks are joined where this adds no fill
    """
    order = minimum_degree(graph)
    waiting: dict[int, list[Supernode]] = defaultdict(list)
    roots: list[Supernode] = []
    for block, rows in enumerate(column_structures(sp.csr_matrix(graph[order][:, order]))):
        supernode = Supernode([block], rows)
        for child in waiting.pop(block, []):
            _add_child(supernode, child)
        (waiting[min(rows)] if rows else roots).append(supernode)
    tree = _postordered(roots)
    return [Supernode(order[node.pivots].tolist(), set(order[list(node.rows)].tolist())) for node in tree]


def minimum_degree(graph: sp.csr_matrix) -> np.ndarray:
    """Blocks in the order of multiple minimum degree, which SuperLU finds for a matrix of this pattern."""
    dominant = abs(graph) + sp.diags_array(abs(graph) @ np.ones(graph.shape[1]))
    return splu(sp.csc_matrix(dominant), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).perm_c.argsort()


def column_structures(graph: sp.csr_matrix) -> list[set[int]]:
    """Later blocks in which the factor's column of each block is not zero, with those that its children fill in."""
    rows = [set(row[row > block].tolist()) for block, row in enumerate(np.split(graph.indices, graph.indptr[1:-1]))]
    for structure in rows:
        if structure:
            parent = min(structure)
            rows[parent] |= structure - {parent}
    return rows


def _add_child(supernode: Supernode, child: Supernode) -> None:
    """Merge a child with the same rows below into the supernode; any other stays a child."""
    if len(child.rows) == len(supernode.pivots) + len(supernode.rows):
        supernode.pivots += child.pivots
        supernode.children += child.children
    else:
        supernode.children.append(child)


def _postordered(roots: list[Supernode]) -> list[Supernode]:
    """All supernodes of the trees, each after its children, a subtree without a gap."""
    backwards, stack = [], list(roots)
    while stack:
        backwards.append(stack.pop())
        stack += backwards[-1].children
    return backwards[::-1]
