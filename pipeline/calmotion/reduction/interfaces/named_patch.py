"""The interface patch on a part of the surface that the shot names."""

from __future__ import annotations

import numpy as np

from calmotion.geometry.distances import closest_on_triangles
from calmotion.reduction.elements.assembly import QuadraticMesh
from calmotion.shot.character import Array, IntArray

_DISTANCE = 5e-3  # of the body's size: distance that a tetrahedraliser may keep from the surface
_FACING = 0.5  # least cosine between the normals; excludes the other side of a thin wall


def named_patch(mesh: QuadraticMesh, triangles: Array) -> IntArray:
    """Surface nodes that lie on given triangles and face the same direction, ascending.

    The mesh need not share points or edges with the triangles. Where its elements are larger than the named part, the
    patch may be empty.

    Args:
        mesh: Of the body.
        triangles: Corners [m], shape [k, 3, 3], body frame, outward.
    """
    distance = _DISTANCE * float(np.linalg.norm(np.ptp(mesh.nodes, axis=0)))
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.maximum(size, np.finfo(float).tiny)
    node_normals = _node_normals(mesh)
    surface = mesh.surface_nodes
    x = mesh.nodes[surface]
    low, high = triangles.min(axis=(0, 1)) - distance, triangles.max(axis=(0, 1)) + distance
    near = surface[np.all((x >= low) & (x <= high), axis=1)]
    nodes = []
    for node in near:
        gaps = np.linalg.norm(closest_on_triangles(mesh.nodes[node], triangles) - mesh.nodes[node], axis=1)
        touched = gaps <= distance
        if np.any(touched & (normals @ node_normals[node] > _FACING)):
            nodes.append(node)
    return np.array(nodes, dtype=np.int32)


def _node_normals(mesh: QuadraticMesh) -> Array:
    """Outward unit normals at the surface nodes, the area-weighted mean of the triangles around, shape [n, 3]."""
    corners = mesh.nodes[mesh.surface[:, :3]]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    out = np.zeros_like(mesh.nodes)
    for column in range(mesh.surface.shape[1]):
        np.add.at(out, mesh.surface[:, column], area)
    return np.asarray(out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), np.finfo(float).tiny))
