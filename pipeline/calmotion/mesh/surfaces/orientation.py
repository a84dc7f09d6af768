"""Consistent orientation of triangles: patches between non-manifold edges, each of which is flipped as a whole."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from calmotion.arrays import Array, BoolArray, Indices


@dataclass(frozen=True, eq=False)
class Patches:
    """Sets of triangles that are connected by edges with exactly two triangles.

    Attributes:
        label: Patch of each triangle, 0 to `count` - 1, shape [m].
        flip: Triangles to flip so that the orientation of each patch is consistent, shape [m].
        one_sided: Patches without a consistent orientation, such as a Moebius strip, ascending.
        count: Number of patches.
    """

    label: Indices
    flip: BoolArray
    one_sided: Indices
    count: int


def patches_of(triangles: Indices, areas: Array) -> Patches:
    """The patches of a surface, each with the orientation of most of its area.

    Args:
        triangles: Shape [m, 3].
        areas: Of the triangles [m^2], shape [m].
    """
    m = len(triangles)
    edge, forward = directed_edges(triangles)
    order = np.argsort(edge, kind="stable")
    first = np.flatnonzero(np.diff(edge[order], prepend=-1))
    twice = first[np.diff(np.append(first, len(order))) == 2]
    one, two = order[twice], order[twice + 1]
    faces = np.stack([one, two]) // 3
    clash = forward[one] == forward[two]  # consistent neighbours have opposite directions along their edge
    # two triangles may share two edges; the matrix then holds their sum
    graph = coo_matrix((np.ones(len(clash)), (faces[0], faces[1])), shape=(m, m)).tocsr()
    count, label = connected_components(graph, directed=False)
    flip = np.zeros(m, dtype=bool)
    if clash.any():
        differs: dict[tuple[int, int], bool] = {}
        for a, b, c in zip(*faces.tolist(), clash.tolist(), strict=True):
            differs[a, b] = differs[b, a] = c
        for patch in np.unique(label[faces[0][clash]]):
            start = int(np.flatnonzero(label == patch)[0])
            faces_of_patch, before = breadth_first_order(graph, start, directed=False)
            for face in faces_of_patch[1:].tolist():
                flip[face] = flip[before[face]] ^ differs[face, int(before[face])]
            if areas[faces_of_patch[flip[faces_of_patch]]].sum() > 0.5 * areas[faces_of_patch].sum():
                flip[faces_of_patch] = ~flip[faces_of_patch]
    wrong = clash ^ flip[faces[0]] ^ flip[faces[1]]
    return Patches(label, flip, np.unique(label[faces[0][wrong]]), int(count))


def directed_edges(triangles: Indices) -> tuple[Indices, BoolArray]:
    """For each side of each triangle: the index of its edge, and whether it goes from the lower to the higher corner.

    Returns:
        Both of shape [3m].
    """
    start = triangles.ravel()
    end = np.roll(triangles, -1, axis=1).ravel()
    low, high = np.minimum(start, end).astype(np.int64), np.maximum(start, end)
    edge = np.unique(low * (int(triangles.max(initial=0)) + 1) + high, return_inverse=True)[1].ravel()
    return edge, start < end


def patch_boundaries(triangles: Indices, label: Indices, count: int) -> Array:
    """Boundary of each patch: net number of passes along each boundary edge, dense, shape [edges, count]."""
    edge, forward = directed_edges(triangles)
    sign = np.where(forward, 1.0, -1.0)
    net = coo_matrix((sign, (edge, np.repeat(label, 3))), shape=(int(edge.max()) + 1, count)).tocsr()
    net.eliminate_zeros()
    return np.asarray(net[np.flatnonzero(np.diff(net.indptr))].toarray())


def closing_signs(boundaries: Array) -> Array:
    """Signs of the patches, -1 for a flip, that reduce the length of their common boundary greedily.

    Args:
        boundaries: Of `patch_boundaries`, shape [edges, k].

    Returns:
        Shape [k]. The flip with the largest reduction comes first, until none reduces it.
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
