"""Local refinement of tetrahedra by longest-edge bisection."""

import numpy as np

from calmotion.arrays import Array, Indices, IntArray
from calmotion.mesh.tetrahedra import corner_keys

_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


def bisected(points: Array, tets: IntArray, marked: Indices) -> tuple[Array, IntArray, Indices]:
    """Tetrahedra of which the marked ones are smaller; neighbours are bisected as far as they have to be.

    The boundary stays where it is. A tetrahedron is bisected at the longest of its edges that are divided, and so are
    its parts: both sides of a face are divided in the same order, and fit.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4], positive volumes.
        marked: Indices of tetrahedra.

    Returns:
        Points, of which the first n are the given ones; tetrahedra with positive volumes; the tetrahedron that each of
        them is a part of.

    Source: Rivara 1984, Mesh Refinement Processes Based on the Generalized Bisection of Simplices.
    """
    corners = np.sort(tets[:, _EDGES].astype(np.int64), axis=-1)
    keys, first, edge = np.unique(corner_keys(corners), return_index=True, return_inverse=True)
    edge, ends = edge.reshape(-1, 6), corners.reshape(-1, 2)[first]
    # by length, and by number among equals: the same for all tetrahedra at an edge
    way = points[ends[:, 1]] - points[ends[:, 0]]
    rank = np.empty(len(keys), dtype=np.int64)
    rank[np.lexsort((keys, np.einsum("ij,ij->i", way, way)))] = np.arange(len(keys))
    longest = edge[np.arange(len(edge)), rank[edge].argmax(axis=1)]
    divided = np.zeros(len(keys), dtype=bool)
    more: Indices = np.asarray(marked)
    while len(more):
        divided[longest[more]] = True
        more = np.flatnonzero(divided[edge].any(axis=1) & ~divided[longest])
    chosen = np.flatnonzero(divided)
    middle = points[ends[chosen]].mean(axis=1)
    keys, rank = keys[chosen], rank[chosen]
    done: list[IntArray] = []
    parents: list[Indices] = []
    left, own = tets, np.arange(len(tets))
    while len(left):
        key = corner_keys(left[:, _EDGES])
        place = np.minimum(np.searchsorted(keys, key), max(len(keys) - 1, 0))
        height = np.where(keys[place] == key, rank[place], -1) if len(keys) else np.full(key.shape, -1)
        local = height.argmax(axis=1)
        rows = np.arange(len(left))
        whole = height[rows, local] < 0
        done.append(left[whole])
        parents.append(own[whole])
        rows, local, left, own = np.flatnonzero(~whole), local[~whole], left[~whole], own[~whole]
        new = (len(points) + place[rows, local]).astype(tets.dtype)
        parts = left.copy(), left.copy()
        for part, end in zip(parts, _EDGES[local].T, strict=True):
            part[np.arange(len(part)), end] = new
        left, own = np.concatenate(parts), np.concatenate([own, own])
    return np.concatenate([points, middle]), np.concatenate(done), np.concatenate(parents)
