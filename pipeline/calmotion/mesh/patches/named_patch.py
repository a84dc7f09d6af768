"""The interface patch on a part of the surface that the shot names."""

import numpy as np

from calmotion.arrays import Array, IntArray, box_diagonal
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.mesh.surfaces.distances import closest_on_triangles
from calmotion.mesh.surfaces.nearby_triangles import unit_normals

_DISTANCE = 5e-3  # of the body's size: distance that a tetrahedraliser may keep from the surface
_FACING = 0.5  # least cosine between the normals; excludes the other side of a thin wall


def named_patch(mesh: QuadraticMesh, triangles: Array) -> IntArray:
    """Surface nodes that lie on given triangles and on a triangle of the mesh that faces the same direction, ascending.

    The mesh need not share points or edges with the triangles. Where its elements are larger than the named part, the
    patch may be empty.

    Args:
        triangles: Corners [m], shape [k, 3, 3], body frame, outward.
    """
    distance = _DISTANCE * box_diagonal(mesh.nodes)
    normals, _ = unit_normals(triangles)
    of_mesh, _ = unit_normals(mesh.nodes[mesh.surface[:, :3]])
    low, high = triangles.min(axis=(0, 1)) - distance, triangles.max(axis=(0, 1)) + distance
    surface = mesh.surface_nodes
    near = surface[np.all((mesh.nodes[surface] >= low) & (mesh.nodes[surface] <= high), axis=1)]
    corners = mesh.surface.ravel()
    order = np.argsort(corners, kind="stable")
    first, last = (np.searchsorted(corners[order], near, side) for side in ("left", "right"))
    nodes = []
    for node, begin, end in zip(near, first, last, strict=True):
        gaps = np.linalg.norm(closest_on_triangles(mesh.nodes[node], triangles) - mesh.nodes[node], axis=1)
        # each triangle by itself: the mean at the rim of a thin end is mostly that of the sides
        around = of_mesh[order[begin:end] // mesh.surface.shape[1]]
        if np.any(around @ normals[gaps <= distance].T > _FACING):
            nodes.append(node)
    return np.array(nodes, dtype=np.int32)
