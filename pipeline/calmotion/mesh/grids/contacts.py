"""Contacts of tetrahedra in a point or along an edge, which hold nothing.

Where a mesh follows a surface only roughly, parts of it that are near each other meet in a corner or along an edge.
Elements carry forces through it, less and less the finer they are: a joint of a gripper hung on two of them, and its
first frequency was twice that of the limit, which has no connection there.
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, BoolArray, Indices, IntArray
from calmotion.mesh.grids.winding import wound
from calmotion.mesh.tetrahedra import FACES, shared_sides, tet_volumes

_APART = 0.05  # of the way to the middle of its elements, which a copy is moved
_THINNEST = 0.5  # least part of its volume that an element keeps
_REACH, _CELLS = 3.0, 16  # around a contact: of the distance of the mesh to the surface, and cells to each side
_THIN = 2  # cells from both sides: a connection is none that is thinner than three quarters of the distance
# From a corner to places on the face opposite, by its corners, and shares of the reach on these ways
_WAYS = np.vstack([np.eye(3), 0.5 * (1.0 - np.eye(3)), np.full((1, 3), 1.0 / 3.0)])
_SHARES = np.array([0.3, 0.6, 0.9])


def without_contacts(
    points: Array, tets: IntArray, surface: Array | None = None, triangles: Indices | None = None, distance: float = 0.0
) -> tuple[Array, IntArray]:
    """The tetrahedra with a point of its own for each side of a contact.

    Elements at a point are on one side where a way leads from one to the other through faces at this point; an edge
    both of whose ends are held in this way stays. So does a contact whose sides the solid itself connects nearby, as
    where a rib is attached whose foot the mesh does not follow. Points of a contact are moved a little into their own
    sides: two in one place cannot be told apart.

    Args:
        points: [m], shape [n, 3].
        tets: Of positive volume, shape [m, 4].
        surface: Points of the closed surface that was meshed [m], shape [k, 3]; None: no contact stays.
        triangles: Of the surface, shape [l, 3].
        distance: How far the mesh may leave the surface [m].

    Returns:
        Points [m], shape [k, 3], and tetrahedra, shape [m, 4]; the same where there is no contact.
    """
    label, source = _sides(tets)
    if surface is not None and triangles is not None:
        for contact in np.flatnonzero(np.bincount(source) > 1):
            at = np.flatnonzero(tets.ravel() == contact)
            others = tets[at // 4][np.arange(4) != (at % 4)[:, None]].reshape(-1, 3)
            ways = _WAYS @ (points[others] - points[contact])
            label[at] = _united(label[at], points[contact], ways, surface, triangles, _REACH * distance)
        label, source = _with_points(label, tets)
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
    return _with_points(connected_components(graph, directed=False)[1], tets)


def _with_points(label: Indices, tets: IntArray) -> tuple[Indices, Indices]:
    """Sides, numbered from 0 on, and the point of each."""
    _, first, numbered = np.unique(label, return_index=True, return_inverse=True)
    return numbered.reshape(-1), tets.ravel()[first].astype(np.int64)


def _united(label: Indices, center: Array, ways: Array, surface: Array, triangles: Indices, reach: float) -> Indices:
    """The sides at a contact, one for all that the solid connects within a reach.

    Args:
        label: Side of each tetrahedron at the contact, shape [k].
        center: The contact [m].
        ways: From there to places on the face opposite of each tetrahedron [m], shape [k, p, 3].
        surface, triangles: As of `without_contacts`.
        reach: [m].
    """
    from scipy.ndimage import binary_erosion
    from scipy.ndimage import label as connected

    spacing = reach / _CELLS
    low, n = center - reach, 2 * _CELLS + 1
    inside = wound(surface, triangles, low, np.array([n + 1, n, n]), spacing)[:n] > 0
    regions = connected(binary_erosion(inside, iterations=_THIN, border_value=1))[0]
    # places of each tetrahedron at some distances, or on its face where that is nearer
    far = np.linalg.norm(ways, axis=2)[..., None, None]
    at = ways[:, :, None] * np.minimum(1.0, _SHARES[:, None] * reach / far)
    cells = np.rint((at + reach) / spacing).astype(np.int64).reshape(len(label), -1, 3)
    region = regions[tuple(np.moveaxis(cells, -1, 0))]
    sides, side = np.unique(label, return_inverse=True)
    counts = np.array([np.bincount(region[side == k].ravel(), minlength=regions.max() + 1) for k in range(len(sides))])
    counts[:, 0] = 0
    # where most of each is, since the mesh is not just where the solid is; what is nowhere stays by itself
    most = np.where(counts.any(axis=1), counts.argmax(axis=1), -1 - np.arange(len(sides)))
    _, first, group = np.unique(most, return_index=True, return_inverse=True)
    return np.asarray(sides[first[group]][side])


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
