"""The flat round seat about a joint: what a servo horn, a bearing's flange or a washer lies on.

Its edge is where the part that is screwed to it ends, so a joint holds all of it. A plate is no seat: its flat side
does not end at one distance from the axis.
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array
from calmotion.mesh.surfaces.distances import triangle_parts

_ALONG = np.cos(np.radians(10.0))  # of normals along the axis
_LEVEL = 3e-3  # of the size of the body: distance of a seat from the plane through its frame
_SMALLEST, _LARGEST = 0.03, 0.25  # outer radius of a seat, of the size
_RINGS, _SECTORS = 100, 16  # in which it is measured: of its largest radius, and of the angle around it
# Screw holes and slots interrupt a seat: least part of each of its rings, of all of them, and of a sector, that is
# flat; least number of such sectors
_RING, _WHOLE, _SECTOR, _ROUND = 0.5, 0.55, 0.3, 14
_BEYOND, _EDGE = 0.2, 0.2  # largest part of a ring beyond the edge that is flat; width of the edge, of the radius
_WIDTH = 0.25  # of the radius: least width of a seat
_SAMPLES = 20_000  # places on the triangles that may belong to it


def seat_radius(center: Array, axis: Array, triangles: Array) -> float | None:
    """Outer radius of the seat around a joint [m]; None where there is none.

    Args:
        center: Origin of the attachment frame [m], shape [3].
        axis: Of the joint, unit vector, shape [3].
        triangles: Surface [m], shape [k, 3, 3], outward.
    """
    size = float(np.linalg.norm(np.ptp(triangles.reshape(-1, 3), axis=0)))
    away = triangles - center
    level = np.abs(away @ axis).max(axis=1) <= _LEVEL * size
    flat = away[level & (np.linalg.norm(away, axis=2).min(axis=1) <= 2.0 * _LARGEST * size)]
    doubled = np.cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0])
    area = 0.5 * np.linalg.norm(doubled, axis=1)
    along = 0.5 * (doubled @ axis)
    sides = along > _ALONG * area, -along > _ALONG * area
    found = [_edge(flat[side], area[side], axis, size) for side in sides]
    return min((radius for radius in found if radius is not None), default=None)


def _edge(flat: Array, area: Array, axis: Array, size: float) -> float | None:
    """Outer radius of a seat among flat triangles about the origin, shape [k, 3, 3], of areas, shape [k]."""
    if not area.sum() > 0.0:
        return None
    x, weight = _places(flat, area)
    across = np.linalg.svd(axis[None])[2][1:]
    u, v = (x @ across.T).T
    step = _LARGEST * size / _RINGS
    ring = np.floor(np.hypot(u, v) / step).astype(int)
    sector = np.minimum((np.arctan2(v, u) + np.pi) / (2.0 * np.pi) * _SECTORS, _SECTORS - 1).astype(int)
    covered = np.zeros((2 * _RINGS, _SECTORS))
    inside = ring < len(covered)
    np.add.at(covered, (ring[inside], sector[inside]), weight[inside])
    whole = np.pi * step**2 * (2.0 * np.arange(len(covered)) + 1.0)
    share = covered.sum(axis=1) / whole
    for end in range(int(np.ceil(_SMALLEST * size / step)), _RINGS + 1):
        begin = end
        while begin > 0 and share[begin - 1] >= _RING:
            begin -= 1
        edge = int(np.ceil(_EDGE * end))
        beyond = share[end + edge : end + 2 * edge]
        if end - begin < _WIDTH * end or share[end] >= _RING or beyond.max() > _BEYOND:
            continue
        seat, sectors = whole[begin:end].sum(), covered[begin:end].sum(axis=0)
        if sectors.sum() >= _WHOLE * seat and (sectors >= _SECTOR * seat / _SECTORS).sum() >= _ROUND:
            return end * step
    return None


def _places(flat: Array, area: Array) -> tuple[Array, Array]:
    """Places on triangles, shape [n, 3], and the area that each stands for [m^2], shape [n]."""
    x, weight = [], []
    parts = np.clip(np.ceil(np.sqrt(_SAMPLES * area / area.sum())).astype(int), 1, 60)
    for count in np.unique(parts):
        chosen, at = parts == count, triangle_parts(int(count))
        x.append(np.einsum("pk,tkx->tpx", at, flat[chosen]).reshape(-1, 3))
        weight.append(np.repeat(area[chosen] / len(at), len(at)))
    return np.concatenate(x), np.concatenate(weight)
