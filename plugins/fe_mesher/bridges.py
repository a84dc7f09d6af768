"""Bridges across narrow gaps between solids, such as those between parts of a CAD assembly."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .closing import Part, connected_pieces
from .uniting import manifold_of, part_of

_GAP = 2e-3  # largest gap, of the size of the body
_SINK = 0.05  # overlap of a bridge with both sides, of the gap


def bridged(solids: Sequence[Part]) -> tuple[Part | None, float]:
    """The union of solids across narrow gaps, and the widest of these gaps.

    Each triangle that faces another solid across a narrow gap is extruded to a prism up to that solid.

    Args:
        solids: Disjoint, outward, in units of the size of the body.

    Returns:
        None instead of the union where it is not connected.
    """
    import manifold3d

    prisms, widest = [], 0.0
    for k, solid in enumerate(solids):
        others = [other for i, other in enumerate(solids) if i != k]
        x = solid.points[solid.triangles]
        facing = np.vstack([other.points[other.triangles] for other in others])
        for i, gap in _near(x, facing):
            widest = max(widest, gap)
            normal = np.cross(x[i, 1] - x[i, 0], x[i, 2] - x[i, 0])
            normal /= np.linalg.norm(normal)
            sink = _SINK * gap + 1e-7
            prisms.append(np.vstack([x[i] - sink * normal, x[i] + (gap + sink) * normal]))
    if not prisms:
        return None, 0.0
    made = [manifold3d.Manifold.hull_points(np.ascontiguousarray(prism)) for prism in prisms]
    whole = manifold3d.Manifold.batch_boolean([*(manifold_of(s) for s in solids), *made], manifold3d.OpType.Add)
    part = part_of(whole)
    pieces = [piece for piece in connected_pieces(part.points, part.triangles) if piece.volume > 1e-12]
    return (part if len(pieces) == 1 else None), widest


def _near(x: np.ndarray, facing: np.ndarray) -> list[tuple[int, float]]:
    """Triangles with another solid within the largest gap, along the normal at their center: index and distance."""
    from calmotion.geometry.distances import ray_length

    low, high = facing.reshape(-1, 3).min(axis=0) - _GAP, facing.reshape(-1, 3).max(axis=0) + _GAP
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    length = np.linalg.norm(normal, axis=1)
    inside = ((x.max(axis=1) > low) & (x.min(axis=1) < high)).all(axis=1) & (length > 0.0)
    near = []
    boxes_low, boxes_high = facing.min(axis=1), facing.max(axis=1)
    for i in np.flatnonzero(inside):
        n = normal[i] / length[i]
        middle = x[i].mean(axis=0)
        # only triangles whose boxes the ray can hit: testing all of them would take quadratic time
        end = middle + _GAP * n
        candidates = (
            (boxes_high >= np.minimum(middle, end) - 1e-9) & (boxes_low <= np.maximum(middle, end) + 1e-9)
        ).all(1)
        if candidates.any():
            gap = ray_length(middle - 1e-7 * n, n, facing[candidates], 0.0)
            if gap <= _GAP:
                near.append((int(i), gap))
    return near
