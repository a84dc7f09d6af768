"""Caps of the holes of open surfaces, of any size: flat where the edge of a hole is flat."""

from dataclasses import dataclass

import manifold3d
import numpy as np

from calmotion.mesh.surfaces.closed_surfaces import Closure, boundary_walks, close
from calmotion.mesh.tetrahedra import surface_area

_FLAT = 0.02  # largest distance of the edge of a hole from a plane, of its extent
_PARALLEL = np.cos(np.radians(5.0))


@dataclass(frozen=True, eq=False)
class _Loop:
    """The flat edge of a hole: corners in the direction of its cap, shape [k], and the plane of the cap."""

    corners: np.ndarray
    center: np.ndarray
    normal: np.ndarray
    extent: float


def capped(points: np.ndarray, triangles: np.ndarray) -> Closure:
    """A consistently oriented surface with all its holes closed.

    Holes with flat edges in one plane are closed together: between the edges of a tube's outer and inner surface is a
    ring. Every other hole gets a fan of triangles around its center.

    Args:
        points: Shape [n, 3].
        triangles: Shape [m, 3].
    """
    loops = [loop for walk in boundary_walks(triangles) if (loop := _flat_loop(points, np.array(walk))) is not None]
    flat = [_triangulated(points, group) for group in _coplanar(loops)]
    closed = close(points, np.vstack([triangles, *flat]))
    areas = [surface_area(points, caps) for caps in flat]
    sides = [3 * len(caps) for caps in flat]
    return Closure(
        closed.points, closed.triangles, np.append(areas, closed.areas), np.append(sides, closed.sides).astype(int)
    )


def _flat_loop(points: np.ndarray, walk: np.ndarray) -> _Loop | None:
    if len(walk) < 4:
        return None
    x = points[walk]
    center = x.mean(axis=0)
    extent = float(np.linalg.norm(x - center, axis=1).max())
    area = 0.5 * np.cross(x - center, np.roll(x, -1, axis=0) - center).sum(axis=0)
    size = float(np.linalg.norm(area))
    if size <= 1e-6 * extent**2:
        return None
    normal = area / size
    if np.abs((x - center) @ normal).max() > _FLAT * extent:
        return None
    return _Loop(walk, center, normal, extent)


def _coplanar(loops: list[_Loop]) -> list[list[_Loop]]:
    """Loops in one plane, those of opposite direction too: the cap of a hole with an island is between them."""
    groups: list[list[_Loop]] = []
    for loop in sorted(loops, key=lambda loop: -loop.extent):
        for group in groups:
            first = group[0]
            away = abs(float((loop.center - first.center) @ first.normal))
            aside = float(np.linalg.norm(loop.center - first.center))
            if abs(loop.normal @ first.normal) > _PARALLEL and away < _FLAT * first.extent and aside < first.extent:
                group.append(loop)
                break
        else:
            groups.append([loop])
    return groups


def _triangulated(points: np.ndarray, group: list[_Loop]) -> np.ndarray:
    """Triangles between the loops of a plane."""
    u, v = np.linalg.svd(group[0].normal[None])[2][1:]
    if np.cross(u, v) @ group[0].normal < 0.0:
        u, v = v, u
    corners = np.concatenate([loop.corners for loop in group])
    flat = [np.ascontiguousarray(points[loop.corners] @ np.stack([u, v], axis=1)) for loop in group]
    made = np.asarray(manifold3d.triangulate(flat, allow_convex=False))
    triangles: np.ndarray = corners[made.reshape(-1, 3)]
    return triangles
