"""Triangles made to agree on which side is out: patches between non-manifold edges, turned as wholes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.geometry.tetrahedra import Indices
from calmotion.shot.character import Array, BoolArray


@dataclass(frozen=True, eq=False)
class Patches:
    """Triangles that hang together over edges of exactly two triangles.

    Attributes:
        label: Patch of each triangle, 0 to `count` - 1, shape [m].
        turn: Triangles to be turned so that each patch agrees with itself, bool, shape [m].
        one_sided: Patches that cannot agree, as a Moebius strip cannot, ascending.
        count: Number of patches.
    """

    label: Indices
    turn: BoolArray
    one_sided: Indices
    count: int


def patches_of(triangles: Indices, areas: Array) -> Patches:
    """The patches of a surface, each turned the way that most of its area is turned already.

    Args:
        triangles: Shape [m, 3].
        areas: Of the triangles [m^2], shape [m].
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    m = len(triangles)
    edge, forward = directed_edges(triangles)
    order = np.argsort(edge, kind="stable")
    first = np.flatnonzero(np.diff(edge[order], prepend=-1))
    twice = first[np.diff(np.append(first, len(order))) == 2]
    one, two = order[twice], order[twice + 1]
    faces = np.stack([one, two]) // 3
    clash = forward[one] == forward[two]  # neighbours that agree run along their edge in opposite directions
    # two triangles may share two edges; the matrix then holds their sum
    graph = coo_matrix((np.ones(len(clash)), (faces[0], faces[1])), shape=(m, m)).tocsr()
    count, label = connected_components(graph, directed=False)
    turn = np.zeros(m, dtype=bool)
    if clash.any():
        differs: dict[tuple[int, int], bool] = {}
        for a, b, c in zip(*faces.tolist(), clash.tolist(), strict=True):
            differs[a, b] = differs[b, a] = c
        for patch in np.unique(label[faces[0][clash]]):
            start = int(np.flatnonzero(label == patch)[0])
            found, before = breadth_first_order(graph, start, directed=False)
            for face in found[1:].tolist():
                turn[face] = turn[before[face]] ^ differs[face, int(before[face])]
            if areas[found[turn[found]]].sum() > 0.5 * areas[found].sum():
                turn[found] = ~turn[found]
    wrong = clash ^ turn[faces[0]] ^ turn[faces[1]]
    return Patches(label, turn, np.unique(label[faces[0][wrong]]), int(count))


def directed_edges(triangles: Indices) -> tuple[Indices, BoolArray]:
    """For each side of each triangle, [3m]: the number of its edge, and if it runs from low to high corner."""
    start = triangles.ravel()
    end = np.roll(triangles, -1, axis=1).ravel()
    low, high = np.minimum(start, end).astype(np.int64), np.maximum(start, end)
    edge = np.unique(low * (int(triangles.max(initial=0)) + 1) + high, return_inverse=True)[1].ravel()
    return edge, start < end


def patch_boundaries(triangles: Indices, label: Indices, count: int) -> Array:
    """What bounds each patch: net passes along each edge that bounds some patch, dense, shape [edges, count]."""
    from scipy.sparse import coo_matrix

    edge, forward = directed_edges(triangles)
    sign = np.where(forward, 1.0, -1.0)
    net = coo_matrix((sign, (edge, np.repeat(label, 3))), shape=(int(edge.max()) + 1, count)).tocsr()
    net.eliminate_zeros()
    return net[np.flatnonzero(np.diff(net.indptr))].toarray()


def signs_that_close(boundaries: Array) -> Array:
    """For each patch 1 or -1 (turned), so that the patches together have as little boundary as turning can reach.

    Args:
        boundaries: Of `patch_boundaries`, shape [edges, k].

    Returns:
        Shape [k]. Greedy: the turn that helps most first, until none helps; patches that fit already stay.
    """
    signs = np.ones(boundaries.shape[1])
    total = boundaries.sum(axis=1)
    while len(total):
        gain = np.abs(total).sum() - np.abs(total[:, None] - 2.0 * boundaries * signs).sum(axis=0)
        best = int(gain.argmax())
        if gain[best] <= 0.0:
            break
        total = total - 2.0 * boundaries[:, best] * signs[best]
        signs[best] = -signs[best]
    return signs
