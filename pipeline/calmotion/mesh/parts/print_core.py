"""How much of each tetrahedron of a printed part is in its solid skin, and where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import boundary_triangles
from calmotion.model.materials.printed import Core

# An edge has as many parts as make them half as long as the skin is thick, within limits, of all samples too
_FINE, _FEWEST, _MOST, _SAMPLES = 2.0, 4, 20, 3_000_000
_EXTENT = 1.4  # of a part across the skin, of the cube root of its volume
_CHUNK = 500_000  # samples at a time
_REGULAR = 0.118  # volume of a regular tetrahedron of edge 1


@dataclass(frozen=True, eq=False)
class SkinShare:
    """The skin in the tetrahedra of a body.

    Attributes:
        places: Barycentric coordinates of the parts of a tetrahedron, shape [p, 4].
        shares: Of each part that is skin, shape [e, p].
    """

    places: Array
    shares: Array


def skin_share(points: Array, tets: IntArray, core: Core) -> SkinShare:
    """The skin of tetrahedra, below their boundary.

    Args:
        points: Corners [m], shape [n, 3].
        tets: Shape [e, 4], positive volumes.
    """
    corners = points[tets]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    edge = float(np.cbrt(np.quantile(volumes, 0.9) / _REGULAR))
    most = min(_MOST, int(np.cbrt(_SAMPLES / len(tets))))
    parts = max(min(int(np.ceil(_FINE * edge / core.skin)), most), _FEWEST)
    places = places_of(parts)
    extents = _EXTENT * np.cbrt(volumes) / parts
    boundary = NearbyTriangles(points, boundary_triangles(tets), core.skin + float(extents.max()))
    shares = np.zeros((len(tets), len(places)))
    step = max(_CHUNK // len(places), 1)
    for start in range(0, len(tets), step):
        part = corners[start : start + step]
        at = np.einsum("pc,eci->epi", places, part).reshape(-1, 3)
        depth = np.linalg.norm(at - boundary.closest(at), axis=1).reshape(len(part), -1)
        # a part across the inner side of the skin is skin in proportion
        share = np.clip((core.skin - depth) / extents[start : start + step, None] + 0.5, 0.0, 1.0)
        shares[start : start + step] = np.nan_to_num(share, nan=0.0)
    return SkinShare(places, shares)


def places_of(parts: int) -> Array:
    """Barycentric coordinates of the centers of the equal parts of a tetrahedron, shape [parts^3, 4].

    The tetrahedron 1 >= x >= y >= z >= 0 consists of all of its like in the cells of a grid that are within it.
    """
    cells = np.stack(np.meshgrid(*(np.arange(parts),) * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    centers = []
    for first, second, third in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)):
        center = np.zeros(3)
        center[first], center[second], center[third] = 0.75, 0.5, 0.25
        centers.append((cells + center) / parts)
    x, y, z = np.concatenate(centers).T
    within = (x > y) & (y > z)
    x, y, z = x[within], y[within], z[within]
    return np.stack([1.0 - x, x - y, y - z, z], axis=1)
