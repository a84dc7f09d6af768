"""Vertex normals for drawing: shared across a smooth surface, split along its sharp edges."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, IntArray

CREASE = np.cos(np.radians(40.0))


def split_at_creases(points: Array, triangles: IntArray) -> tuple[IntArray, IntArray, Array]:
    """Copy each point once for each smooth group of faces around it.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3].

    Returns:
        The point each copy comes from, shape [c]; the triangles in terms of the copies, shape [m, 3]; unit normals
        of the copies, shape [c, 3].
    """
    corners = points[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(area, axis=1)
    unit = area / np.maximum(length, 1e-300)[:, None]
    around: list[list[tuple[int, int]]] = [[] for _ in range(len(points))]
    for face, triangle in enumerate(triangles.tolist()):
        for slot, point in enumerate(triangle):
            around[point].append((face, slot))
    sources: list[int] = []
    normals: list[Array] = []
    split = np.empty_like(triangles)
    for point, uses in enumerate(around):
        faces = [face for face, _ in uses]
        near = unit[faces] @ unit[faces].T > CREASE
        groups: list[set[int]] = []
        for k in range(len(uses)):
            touching = [g for g in groups if any(near[k, other] for other in g)]
            groups = [g for g in groups if g not in touching] + [{k}.union(*touching)]
        for group in groups:
            total = area[[faces[k] for k in group]].sum(axis=0)
            for k in group:
                split[uses[k]] = len(sources)
            sources.append(point)
            normals.append(total / max(float(np.linalg.norm(total)), 1e-300))
    return np.array(sources, dtype=np.int32), split, np.array(normals).reshape(-1, 3)
