"""Nested dissection: an order of elimination that keeps the factors of a sparse symmetric matrix small.

A graph is cut by a thin set of nodes (a separator), which is eliminated last; both sides are cut again, and so on.
Each piece becomes one dense block of the factor, so the tree of pieces is also the plan of the factorisation.

Source: George, Nested Dissection of a Regular Finite Element Mesh, SIAM Journal on Numerical Analysis 10(2), 1973.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from calmotion.linear_algebra.vertex_cover import vertex_cover
from calmotion.shot.character import Array

_LEAF = 48  # nodes of a piece that is not worth cutting
_LANDMARKS = 4
_SMALLEST_SIDE = 0.3  # of the nodes; thinner cuts may lie anywhere else
_DENSE = 0.5  # a separator that holds this share of its piece is none


@dataclass(frozen=True, eq=False)
class Dissection:
    """Pieces of a graph, children before parents.

    Attributes:
        order: Nodes in the order of elimination, shape [n]; piece k holds order[start[k]:start[k + 1]].
        start: Shape [pieces + 1].
        parent: Piece that a piece is cut off by, -1 for a root, shape [pieces].
    """

    order: Any
    start: Any
    parent: Any


def dissect(graph: Any, points: Array | None = None) -> Dissection:
    """Nested dissection of a graph.

    Args:
        graph: Sparse CSR, symmetric pattern, shape [n, n]; values and the diagonal do not matter.
        points: Where the nodes are, shape [n, d]; cuts are planes then. Without it, distances in the graph to a few
            nodes far from each other take that place.

    Returns:
        Pieces such that nodes of two different pieces are neighbours only if one piece is above the other.
    """
    from scipy.sparse import csr_matrix

    n = graph.shape[0]
    graph = csr_matrix((np.ones(graph.nnz, dtype=np.int8), graph.indices, graph.indptr), shape=graph.shape)
    pieces: list[Any] = []
    parent: list[int] = []
    # depth first, every piece after what it cuts off: the reverse of a walk that sees parents first
    stack = [(np.arange(n), graph, None if points is None else np.asarray(points, dtype=float), -1)]
    while stack:
        nodes, part, where, above = stack.pop()
        if len(nodes) == 0:
            continue
        cut = None if len(nodes) <= _LEAF else _cut(part, _places(part) if where is None else where)
        if cut is None:
            pieces.append(nodes)
            parent.append(above)
            continue
        separator, left, right = cut
        if len(separator):
            pieces.append(nodes[separator])
            parent.append(above)
            above = len(pieces) - 1
        for side in (left, right):
            below = None if where is None else where[side]
            stack.append((nodes[side], part[side][:, side], below, above))
    count = len(pieces)
    above_of = np.array(parent[::-1], dtype=np.int64)
    return Dissection(
        order=np.concatenate(pieces[::-1]) if count else np.zeros(0, dtype=np.int64),
        start=np.concatenate([[0], np.cumsum([len(piece) for piece in pieces[::-1]])]).astype(np.int64),
        parent=np.where(above_of < 0, -1, count - 1 - above_of),
    )


def _places(graph: Any) -> Array:
    """Distances to a few nodes that are far from each other, shape [n, landmarks]."""
    from scipy.sparse.csgraph import dijkstra

    n = graph.shape[0]
    place = np.zeros((n, _LANDMARKS))
    landmark = int(dijkstra(graph, unweighted=True, indices=0, directed=False).argmax())
    nearest = np.full(n, np.inf)
    for k in range(_LANDMARKS):
        distance = dijkstra(graph, unweighted=True, indices=landmark, directed=False)
        # parts that hang together with nothing else lie beyond everything
        place[:, k] = np.where(np.isinf(distance), n, distance)
        nearest = np.minimum(nearest, place[:, k])
        landmark = int(nearest.argmax())
    return place


def _cut(graph: Any, place: Array) -> tuple[Any, Any, Any] | None:
    """Separator and both sides (indices) of a graph, by the best plane across one of its principal axes.

    A plane has the nodes of rank below c on its left. Those of them with a neighbour at c or beyond separate; how
    many there are for every c at once is a running sum.
    """
    n = graph.shape[0]
    centered = place - place.mean(axis=0)
    _, axes = np.linalg.eigh(centered.T @ centered)
    row = np.repeat(np.arange(n), np.diff(graph.indptr))
    low, high = max(1, int(_SMALLEST_SIDE * n)), min(n - 1, int((1.0 - _SMALLEST_SIDE) * n))
    balance = 1.0 + np.abs(np.arange(low, high + 1) / n - 0.5)
    best: tuple[float, Any, Any] | None = None
    for axis in axes.T[::-1][:3]:
        for sign in (1.0, -1.0):
            rank = np.empty(n, dtype=np.int64)
            rank[np.argsort(sign * (centered @ axis), kind="stable")] = np.arange(n)
            reach = rank.copy()
            np.maximum.at(reach, row, rank[graph.indices])
            # a node of rank p that reaches to m separates for p < c <= m
            step = np.bincount(rank + 1, minlength=n + 2) - np.bincount(reach + 1, minlength=n + 2)
            k = int((np.cumsum(step)[low : high + 1] * balance).argmin())
            left = rank < low + k
            separator = vertex_cover(graph, left)
            cost = len(separator) * balance[k]
            if best is None or cost < best[0]:
                best = (cost, left, separator)
    assert best is not None
    _, left, separator = best
    if len(separator) > _DENSE * n:
        return None
    side = left.astype(np.int8)
    side[separator] = 2
    return separator, np.flatnonzero(side == 1), np.flatnonzero(side == 0)
