"""Solids that miss each other by a hair, as parts of an assembly in CAD do, joined across the gap."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .closing import Part, connected_pieces
from .uniting import manifold_of, part_of

_GAP = 2e-3  # of the size of the body
_SINK = 0.05  # of the gap: the bridge reaches into both sides


def bridged(solids: Sequence[Part]) -> tuple[Part | None, float]:
    """The solids as one, where gaps that are narrow enough part them, and the widest such gap.

    Each triangle that looks onto another solid from nearby grows into a prism that reaches it.

    Args:
        solids: Disjoint, outward, in units of the body's size.

    Returns:
        None when they are not one even so.
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
    """Triangles whose middle sees another solid within the gap, along their normal: number and distance."""
    from calmotion.geometry.distances import ray_length

    low, high = facing.reshape(-1, 3).min(axis=0) - _GAP, facing.reshape(-1, 3).max(axis=0) + _GAP
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    length = np.linalg.norm(normal, axis=1)
    inside = ((x.max(axis=1) > low) & (x.min(axis=1) < high)).all(axis=1) & (length > 0.0)
    found = []
    boxes_low, boxes_high = facing.min(axis=1), facing.max(axis=1)
    for i in np.flatnonzero(inside):
        n = normal[i] / length[i]
        middle = x[i].mean(axis=0)
        # only triangles that the ray can reach; the scan over all of them would be quadratic
        end = middle + _GAP * n
        reach = ((boxes_high >= np.minimum(middle, end) - 1e-9) & (boxes_low <= np.maximum(middle, end) + 1e-9)).all(1)
        if reach.any():
            gap = ray_length(middle - 1e-7 * n, n, facing[reach], 0.0)
            if gap <= _GAP:
                found.append((int(i), gap))
    return found
