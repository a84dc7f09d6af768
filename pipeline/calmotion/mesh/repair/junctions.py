"""T-junctions: corners of triangles on open edges of other triangles, which leave invisible slits."""

import numpy as np
from scipy.spatial import cKDTree

from calmotion.mesh.surfaces.orientation import directed_edges

_PASSES = 8  # a triangle may need a split at each of its edges, and its parts again


def split_at_junctions(points: np.ndarray, triangles: np.ndarray, tolerance: float) -> tuple[np.ndarray, int]:
    """Triangles, split where corners of others are on their open edges.

    Args:
        points: Welded, shape [n, 3].
        triangles: Shape [m, 3].
        tolerance: Largest distance of a corner to the edge, relative to the length of the edge.

    Returns:
        The triangles, and the number of splits.
    """
    splits = 0
    for _ in range(_PASSES):
        pieces = _one_pass(points, triangles, tolerance)
        if not pieces:
            break
        splits += len(pieces)
        whole = np.ones(len(triangles), dtype=bool)
        whole[list(pieces)] = False
        triangles = np.vstack([triangles[whole], *pieces.values()])
    return triangles, splits


def _one_pass(points: np.ndarray, triangles: np.ndarray, tolerance: float) -> dict[int, np.ndarray]:
    """The parts of each triangle that is split at one of its edges."""
    edge, _ = directed_edges(triangles)
    sides = np.flatnonzero(np.bincount(edge)[edge] == 1)
    if len(sides) == 0:
        return {}
    ends = np.stack([triangles.ravel()[sides], np.roll(triangles, -1, axis=1).ravel()[sides]], axis=1)
    corners = np.unique(ends)
    middle = points[ends].mean(axis=1)
    length = np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1)
    candidates = cKDTree(points[corners]).query_ball_point(middle, 0.5 * length * (1.0 + 1e-9))
    pieces: dict[int, np.ndarray] = {}
    for side, (a, b), near, size in zip(sides.tolist(), ends.tolist(), candidates, length.tolist(), strict=True):
        face = side // 3
        if face in pieces or len(near) <= 2:
            continue
        on = np.setdiff1d(corners[near], triangles[face])
        along = (points[b] - points[a]) / size
        offset = points[on] - points[a]
        t = offset @ along
        away = np.linalg.norm(offset - t[:, None] * along, axis=1)
        inner = (away <= tolerance * size) & (t > tolerance * size) & (t < (1.0 - tolerance) * size)
        if not inner.any():
            continue
        row = [a, *on[inner][np.argsort(t[inner])].tolist(), b]
        apex = int(np.setdiff1d(triangles[face], [a, b])[0])
        pieces[face] = np.array([[p, q, apex] for p, q in zip(row[:-1], row[1:], strict=True)])
    return pieces
