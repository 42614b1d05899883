"""Elimination tree of a sparse symmetric matrix: which blocks are eliminated together, and in which order.

The symbolic half of a Cholesky factorization (Liu, SIAM Review 34, 1992). A supernode is a set of blocks whose columns
of the factor have the same rows below them; it can be eliminated once its children in the tree are.
"""

from collections import defaultdict
from dataclasses import dataclass, field
from heapq import heapify, heappop, heappush

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


def supernodes(graph: sp.csr_matrix, sizes: np.ndarray, last: np.ndarray) -> list[Supernode]:
    """Supernodes in an order of little fill, each after its children.

    graph       matrix whose pattern says which blocks are coupled; blocks are joined where this adds no fill
    sizes       (n,) numbers of unknowns of the blocks
    last        (k,) blocks that are the last supernode, in this order
    """
    order = elimination_order(graph, sizes, last)
    waiting: dict[int, list[Supernode]] = defaultdict(list)
    roots: list[Supernode] = []
    structures = column_structures(sp.csr_matrix(graph[order][:, order]))
    for block, rows in enumerate(structures[: order.size - last.size]):
        supernode = Supernode([block], rows)
        for child in waiting.pop(block, []):
            _add_child(supernode, child)
        (waiting[min(rows)] if rows else roots).append(supernode)
    tree = _postordered(roots + [child for children in waiting.values() for child in children])
    tree = [Supernode(order[node.pivots].tolist(), set(order[list(node.rows)].tolist())) for node in tree]
    return [*tree, Supernode(last.tolist(), set())] if last.size else tree


def elimination_order(graph: sp.csr_matrix, sizes: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Blocks in an order of little fill that ends with the last ones; arguments as in `supernodes`."""
    member = sp.csr_matrix(np.isin(np.arange(sizes.size), last).astype(float))
    coupled = sp.csr_matrix(abs(graph) + member.T @ member)
    order = minimum_degree(coupled) if (sizes == sizes[0]).all() else fewest_unknowns(coupled, sizes)
    return np.append(order[~np.isin(order, last)], last)


def minimum_degree(graph: sp.csr_matrix) -> np.ndarray:
    """Blocks in the order of multiple minimum degree, which SuperLU finds for a matrix of this pattern."""
    dominant = abs(graph) + sp.diags_array(abs(graph) @ np.ones(graph.shape[1]))
    return splu(sp.csc_matrix(dominant), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).perm_c.argsort()


def fewest_unknowns(graph: sp.csr_matrix, sizes: np.ndarray) -> np.ndarray:
    """Blocks by minimum degree where they differ in size: next is the one coupled to the fewest unknowns.

    Among equals it is the one whose coupling changed last, which leaves less fill. The bits of a number stand for
    unknowns, so that sets of them are united and counted at once.
    """
    coupled = [set(row.tolist()) for row in np.split(graph.indices, graph.indptr[1:-1])]
    size, ends = sizes.tolist(), np.cumsum(sizes).tolist()
    bits = [(1 << end) - (1 << end - n) for end, n in zip(ends, size, strict=True)]
    unknowns = [sum(bits[neighbour] for neighbour in row) for row in coupled]
    entries = {block: (mask.bit_count() - size[block], 0, block) for block, mask in enumerate(unknowns)}
    queue, order = list(entries.values()), []
    heapify(queue)
    while entries:
        *_, block = entry = heappop(queue)
        if entry != entries.get(block):
            continue
        del entries[block]
        order.append(block)
        rows, mask = coupled[block] - {block}, unknowns[block] & ~bits[block]
        for row in rows:
            coupled[row] = (coupled[row] | rows) - {block}
            unknowns[row] = (unknowns[row] | mask) & ~bits[block]
            entries[row] = unknowns[row].bit_count() - size[row], -len(order), row
            heappush(queue, entries[row])
    return np.array(order)


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
        supernode.pivots = child.pivots + supernode.pivots
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
