"""Nested dissection: an order of elimination with small fill-in of a sparse symmetric matrix.

A graph is cut by a thin set of nodes (a separator), which is eliminated last; both sides are cut again, and so on.
Each piece becomes one dense block of the factor, so the tree of pieces is also the elimination tree.

Source: George, Nested Dissection of a Regular Finite Element Mesh, SIAM Journal on Numerical Analysis 10(2), 1973.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra, maximum_bipartite_matching

from calmotion.arrays import Array, BoolArray

_LEAF = 48  # largest number of nodes of a piece that is not cut
_LANDMARKS = 4  # nodes from which distances in the graph are measured
_SMALLEST_SIDE = 0.3  # least share of the nodes on either side of a cut
_EQUAL = 1e-9  # relative difference below which lengths of axes, or heights, are equal
_COVERED = 2  # cuts of a piece of which the smallest separator is worked out
_DENSE = 0.5  # share of the nodes of a piece above which a separator is not used


@dataclass(frozen=True, eq=False)
class Dissection:
    """Pieces of a graph, children before parents.

    Attributes:
        order: Nodes in the order of elimination, shape [n]; piece k holds order[start[k]:start[k + 1]].
        start: Shape [pieces + 1].
        parent: The separator that cuts off each piece, -1 for a root, shape [pieces].
    """

    order: Any
    start: Any
    parent: Any


def dissect(graph: Any, points: Array | None = None) -> Dissection:
    """Nested dissection of a graph.

    Args:
        graph: Sparse CSR, symmetric pattern, shape [n, n]; values and the diagonal do not matter.
        points: Coordinates of the nodes, shape [n, d]: cuts are planes. None: distances in the graph to a few nodes far
            from each other are used as coordinates.

    Returns:
        Pieces such that nodes of two pieces are neighbours only if one piece is an ancestor of the other.
    """
    n = graph.shape[0]
    graph = csr_matrix((np.ones(graph.nnz, dtype=np.int8), graph.indices, graph.indptr), shape=graph.shape)
    pieces: list[Any] = []
    parent: list[int] = []
    # the reverse of a depth-first walk in preorder: children come before their parent
    stack = [(np.arange(n), graph, None if points is None else np.asarray(points, dtype=float), -1)]
    while stack:
        nodes, part, where, above = stack.pop()
        if len(nodes) == 0:
            continue
        cut = None if len(nodes) <= _LEAF else _cut(part, _levels(part) if where is None else _heights(where))
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
            stack.append((nodes[side], _induced(part, side), below, above))
    count = len(pieces)
    above_of = np.array(parent[::-1], dtype=np.int64)
    return Dissection(
        order=np.concatenate(pieces[::-1]) if count else np.zeros(0, dtype=np.int64),
        start=np.concatenate([[0], np.cumsum([len(piece) for piece in pieces[::-1]])]).astype(np.int64),
        parent=np.where(above_of < 0, -1, count - 1 - above_of),
    )


def _induced(graph: Any, nodes: Any) -> Any:
    """The subgraph of some nodes, ascending."""
    n, k = graph.shape[0], len(nodes)
    place = np.full(n, -1, dtype=graph.indices.dtype)
    place[nodes] = np.arange(k, dtype=place.dtype)
    row = np.repeat(place, np.diff(graph.indptr))
    column = place[graph.indices]
    kept = (row >= 0) & (column >= 0)
    start = np.zeros(k + 1, dtype=graph.indptr.dtype)
    np.cumsum(np.bincount(row[kept], minlength=k), out=start[1:])
    indices = column[kept]
    return csr_matrix((np.ones(len(indices), dtype=np.int8), indices, start), shape=(k, k))


def _levels(graph: Any) -> Array:
    """The three with the largest variance among the distances in the graph to a few nodes far from each other and the
    differences of these distances, shape [n, 3].

    They are integers, so cuts do not depend on rounding.
    """
    n = graph.shape[0]
    distances = np.zeros((n, _LANDMARKS))
    landmark = int(dijkstra(graph, unweighted=True, indices=0, directed=False).argmax())
    nearest = np.full(n, np.inf)
    for k in range(_LANDMARKS):
        distance = dijkstra(graph, unweighted=True, indices=landmark, directed=False)
        # components that are not connected to the landmark are behind all others
        distances[:, k] = np.where(np.isinf(distance), n, distance)
        nearest = np.minimum(nearest, distances[:, k])
        landmark = int(nearest.argmax())
    first, second = np.triu_indices(_LANDMARKS, 1)
    levels = np.concatenate([distances, distances[:, first] - distances[:, second]], axis=1)
    spread = n * np.sum(levels**2, axis=0) - np.sum(levels, axis=0) ** 2
    return levels[:, np.argsort(-spread, kind="stable")[:3]]


def _heights(points: Array) -> Array:
    """Coordinates of points along their principal axes, the longest first, shape [n, d].

    Where axes have equal lengths, any basis of their span is principal; the one nearest to the coordinate axes is used.
    Coordinates are rounded, so points that differ by rounding have equal heights.
    """
    centered = points - points.mean(axis=0)
    lengths, axes = np.linalg.eigh(centered.T @ centered)
    group = np.cumsum(np.concatenate([[0], np.diff(lengths) > _EQUAL * max(lengths[-1], 1e-300)]))
    for index in range(group[-1] + 1):
        columns = np.flatnonzero(group == index)
        span = axes[:, columns]
        near = np.sort(np.argsort(-np.sum(span**2, axis=1).round(6), kind="stable")[: len(columns)])
        axes[:, columns] = np.linalg.qr(span @ span[near].T)[0]
    large = np.abs(axes) > 0.9 * np.max(np.abs(axes), axis=0)
    axes = axes * np.sign(axes[np.argmax(large, axis=0), np.arange(axes.shape[1])])
    heights = centered @ axes[:, ::-1]
    unit = _EQUAL * max(float(np.max(np.abs(heights), initial=0.0)), 1e-300)
    return np.asarray(np.round(heights / unit))


def _cut(graph: Any, heights: Array) -> tuple[Any, Any, Any] | None:
    """Separator and both sides (indices) of a graph, from the best cut at one level of one of several heights.

    The nodes of rank below c are on the left of a cut at c. Those of them with a neighbour of rank c or above form the
    separator; a cumulative sum gives their number for all c at once. The smallest separators of the two best cuts
    follow from minimum vertex covers.

    Args:
        heights: Of the nodes along several directions, shape [n, directions].
    """
    n = graph.shape[0]
    low, high = max(1, int(_SMALLEST_SIDE * n)), min(n - 1, int((1.0 - _SMALLEST_SIDE) * n))
    balance = 1.0 + np.abs(np.arange(low, high + 1) / n - 0.5)
    cuts: list[tuple[float, float, Any]] = []
    begin = np.flatnonzero(np.diff(graph.indptr))
    for height in heights.T[:3]:
        for sign in (1.0, -1.0):
            rank = np.empty(n, dtype=np.int64)
            rank[np.argsort(sign * height, kind="stable")] = np.arange(n)
            highest = rank.copy()  # rank of the highest neighbour
            if len(begin):
                near = np.maximum.reduceat(rank[graph.indices], graph.indptr[begin])
                highest[begin] = np.maximum(rank[begin], near)
            # a node of rank p with its highest neighbour at m is in the separator for p < c <= m
            step = np.bincount(rank + 1, minlength=n + 2) - np.bincount(highest + 1, minlength=n + 2)
            costs = np.cumsum(step)[low : high + 1] * balance
            k = int(costs.argmin())
            cuts.append((float(costs[k]), float(balance[k]), rank < low + k))
    cuts.sort(key=lambda cut: cut[0])
    separator, left, least = np.zeros(0, dtype=np.int64), cuts[0][2], np.inf
    for _, weight, side in cuts[:_COVERED]:
        cover = _cover(graph, side)
        if weight * len(cover) < least:
            separator, left, least = cover, side, weight * len(cover)
    if len(separator) > _DENSE * n:
        return None
    side = left.astype(np.int8)
    side[separator] = 2
    return separator, np.flatnonzero(side == 1), np.flatnonzero(side == 0)


def _cover(graph: Any, left: BoolArray) -> Any:
    """The least set of nodes (indices, of both sides) that touches all edges between the left nodes and the others.

    By the theorem of Koenig: of the left nodes those that no alternating path from a left node without a partner
    reaches, and of the others those that one reaches. It does not depend on which of the largest matchings is found.
    """
    near, far = np.flatnonzero(left), np.flatnonzero(~left)
    across = graph[near][:, far]
    across.data = np.ones(across.nnz, dtype=np.int32)
    partner = maximum_bipartite_matching(across, perm_type="column")
    matched = np.flatnonzero(partner >= 0)
    reached, grows = partner < 0, True
    while grows:
        beyond = across.T @ reached > 0
        more = beyond[partner[matched]] & ~reached[matched]
        reached[matched] |= more
        grows = bool(more.any())
    return np.concatenate([near[~reached], far[beyond]])
