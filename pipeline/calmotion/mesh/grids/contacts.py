"""Contacts of tetrahedra in a point or along an edge, which hold nothing.

Where a mesh follows a surface only roughly, parts of it that are near each other meet in a corner or along an edge.
Elements carry forces through it, less and less the finer they are: a joint of a gripper hung on two of them, and its
first frequency was twice that of the limit, which has no connection there.
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, BoolArray, Indices, IntArray
from calmotion.mesh.tetrahedra import FACES, shared_sides, tet_volumes

_APART = 0.05  # of the way to the middle of its elements, which a copy is moved
_THINNEST = 0.5  # least part of its volume that an element keeps


def without_contacts(points: Array, tets: IntArray) -> tuple[Array, IntArray]:
    """The tetrahedra with a point of its own for each side of a contact.

    Elements at a point are on one side where a way leads from one to the other through faces at this point; an edge
    both of whose ends are held in this way stays. Points of a contact are moved a little into their own sides: two in
    one place cannot be told apart.

    Args:
        points: [m], shape [n, 3].
        tets: Of positive volume, shape [m, 4].

    Returns:
        Points [m], shape [k, 3], and tetrahedra, shape [m, 4]; the same where there is no contact.
    """
    label, source = _sides(tets)
    doubled = np.bincount(source, minlength=len(points))[source] > 1
    if not doubled.any():
        return points, tets
    order = np.argsort(source, kind="stable")  # points that nothing touches keep their order
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    apart = number[label].reshape(tets.shape).astype(tets.dtype)
    return _moved(points[source[order]], apart, doubled[order]), apart


def _sides(tets: IntArray) -> tuple[Indices, Indices]:
    """The side to which each corner of each tetrahedron belongs, shape [4m], and the point of each side."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    corners = np.arange(4 * len(tets)).reshape(-1, 4)
    ways = []
    for faces in shared_sides(tets):  # the three corners of each, in the order of their numbers in the mesh
        at = corners[faces // 4][np.arange(len(faces))[:, None], FACES[faces % 4]]
        ways.append(np.take_along_axis(at, np.argsort(tets.ravel()[at], axis=1), axis=1).ravel())
    graph = coo_matrix((np.ones(len(ways[0])), tuple(ways)), shape=(corners.size,) * 2)
    label = connected_components(graph, directed=False)[1]
    _, first, numbered = np.unique(label, return_index=True, return_inverse=True)
    return numbered.reshape(-1), tets.ravel()[first].astype(np.int64)


def _moved(points: Array, tets: IntArray, chosen: BoolArray) -> Array:
    """The points with some of them moved into their elements, as far as no element becomes flat by that."""
    middle = np.repeat(points[tets].mean(axis=1), 4, axis=0)
    corner, uses = tets.ravel(), np.bincount(tets.ravel(), minlength=len(points))
    mean = np.stack([np.bincount(corner, middle[:, k], len(points)) for k in range(3)], axis=1) / uses[:, None]
    step = np.where(chosen[:, None], _APART * (mean - points), 0.0)
    least = _THINNEST * tet_volumes(points, tets)
    while (flattened := tet_volumes(points + step, tets) < least).any():
        step[np.unique(tets[flattened])] *= 0.5
    return np.asarray(points + step)
