"""Minimum vertex cover of the edges between two sides of a graph.

Its size is that of a maximum matching (theorem of Koenig), from which it follows. The matching of SciPy is extremely
slow on some meshes; this one uses augmenting paths from one node after the other.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from calmotion.shot.character import BoolArray
from calmotion.support.compilation import kernel

Indices = NDArray[np.int64]


def vertex_cover(graph: Any, left: BoolArray) -> Any:
    """The minimum vertex cover of the edges between the left nodes and the others.

    Args:
        graph: Sparse CSR, symmetric pattern, shape [n, n].
        left: Shape [n].

    Returns:
        Indices of nodes, of both sides.
    """
    row = np.repeat(np.arange(graph.shape[0]), np.diff(graph.indptr))
    across = left[row] & ~left[graph.indices]
    near, near_edge = np.unique(row[across], return_inverse=True)
    far, far_edge = np.unique(graph.indices[across], return_inverse=True)
    start = np.zeros(len(near) + 1, dtype=np.int64)
    np.cumsum(np.bincount(near_edge, minlength=len(near)), out=start[1:])
    head = far_edge.astype(np.int64)  # rows ascend, so edges are sorted by their near node
    of_near, of_far = np.full(len(near), -1), np.full(len(far), -1)
    edge, stack, visited = np.zeros(len(near), np.int64), np.zeros(len(near), np.int64), np.zeros(len(far), np.int64)
    _match(start, head, of_near, of_far, edge, stack, visited)
    reached_near, reached_far = np.zeros(len(near), dtype=np.bool_), np.zeros(len(far), dtype=np.bool_)
    _mark_reached(start, head, of_near, of_far, stack, reached_near, reached_far)
    return np.concatenate([near[~reached_near], far[reached_far]])


@kernel
def _match(
    start: Indices, head: Indices, of_near: Indices, of_far: Indices, edge: Indices, stack: Indices, visited: Indices
) -> None:
    """Maximum matching: writes partners into `of_near` and `of_far`, -1 for none.

    Args:
        start, head: Edges of near node i go to the far nodes head[start[i]:start[i + 1]].
        edge, stack, visited: Scratch: current edge of each near node, the path, last search that visited a far node.
    """
    search = 1
    for root in range(len(of_near)):
        depth = 1
        stack[0] = root
        edge[root] = start[root]
        while depth > 0:
            i = stack[depth - 1]
            if edge[i] == start[i + 1]:
                depth -= 1
                if depth > 0:
                    edge[stack[depth - 1]] += 1
                continue
            k = head[edge[i]]
            if visited[k] == search:
                edge[i] += 1
                continue
            visited[k] = search
            if of_far[k] >= 0:
                i = of_far[k]
                stack[depth] = i
                edge[i] = start[i]
                depth += 1
                continue
            # a far node without a partner: augment along the path
            for d in range(depth):
                i = stack[d]
                of_near[i] = head[edge[i]]
                of_far[head[edge[i]]] = i
            # nodes visited without success lead to no free node until the matching changes
            search += 1
            depth = 0


@kernel
def _mark_reached(
    start: Indices, head: Indices, of_near: Indices, of_far: Indices, stack: Indices,
    reached_near: BoolArray, reached_far: BoolArray,
) -> None:  # fmt: skip
    """Nodes on alternating paths from near nodes without a partner."""
    depth = 0
    for i in range(len(of_near)):
        if of_near[i] < 0:
            reached_near[i] = True
            stack[depth] = i
            depth += 1
    while depth > 0:
        depth -= 1
        i = stack[depth]
        for e in range(start[i], start[i + 1]):
            k = head[e]
            if not reached_far[k]:
                reached_far[k] = True
                # it has a partner: otherwise the matching would not be maximum
                i2 = of_far[k]
                if not reached_near[i2]:
                    reached_near[i2] = True
                    stack[depth] = i2
                    depth += 1
