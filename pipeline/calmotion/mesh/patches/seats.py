"""The flat round seat about a joint: what a servo horn, a bearing's flange or a washer lies on.

Its edge is where the part that is screwed to it ends, so a joint holds all of it. A plate is no seat: its flat side
does not end at one distance from the axis.
"""

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, box_diagonal
from calmotion.mesh.patches.automatic_patch import Skin
from calmotion.mesh.surfaces.distances import ray_length, triangle_parts
from calmotion.mesh.tetrahedra import part_of_each

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
    size = box_diagonal(triangles)
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


_FACING, _STEEP = 0.9, 0.3  # cosines: of normals towards the axis, at least; and along it, at most
_ALIKE = 0.1  # of a radius: how far those of one bore, and of both, differ
_SECTORS, _COVERED = 16, 12  # of the angle around the axis, and how many a bore covers; a housing closes as many
_ASIDE = 1e-6  # of the radius: how far a place is moved from where a triangle may end
_PARTS = triangle_parts(4)


@dataclass(frozen=True)
class Bore:
    """A bore around the axis of a joint.

    Attributes:
        radius: [m].
        low, high: Where it begins and ends along the axis, from the joint [m].
    """

    radius: float
    low: float
    high: float

    @property
    def away(self) -> float:
        """Distance of the joint from it along the axis [m]."""
        return max(self.low, -self.high, 0.0)


def other_cheek(skin: Skin, center: Array, radius: float, axis: Array) -> Array | None:
    """Where a joint at a bore in one cheek of a fork is at the other cheek [m], shape [3]; None without a fork.

    Args:
        skin: The surface, outward.
        center: Of the joint [m], shape [3].
        radius: Of the sphere of what it holds at the first cheek [m].
        axis: Of the joint, unit vector, shape [3].
    """
    found = bores(skin, center, axis)
    held = [bore for bore in found if np.hypot(bore.radius, bore.away) <= radius]
    if not held:
        return None
    own = min(held, key=lambda bore: bore.away)
    others = [bore for bore in found if bore not in held and abs(bore.radius - own.radius) <= _ALIKE * own.radius]
    for other in sorted(others, key=lambda bore: bore.away):
        above = other.low > own.high
        if not (above or other.high < own.low):
            continue
        facing, theirs = (own.high, other.low) if above else (own.low, other.high)
        if not _is_open(skin.nodes[skin.surface[:, :3]], center + 0.5 * (facing + theirs) * axis, axis, own.radius):
            return None
        return np.asarray(center + (theirs + facing) * axis)  # as far behind its face as the joint is behind this one
    return None


def bores(skin: Skin, center: Array, axis: Array) -> list[Bore]:
    """The bores around an axis through a center; arguments as of `other_cheek`."""
    triangles = skin.surface[:, :3]
    x = skin.nodes[triangles] - center
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    middle = x.mean(axis=1)
    out = middle - np.outer(middle @ axis, axis)
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), np.finfo(float).tiny)
    facing = np.flatnonzero((np.einsum("ki,ki->k", normal, out) < -_FACING) & (np.abs(normal @ axis) < _STEEP))
    if not len(facing):
        return []
    across = np.linalg.svd(axis[None])[2][1:]
    part = part_of_each(triangles[facing])
    found = []
    for label in range(int(part.max()) + 1):
        own = x[facing[part == label]]
        away = np.linalg.norm(own @ across.T, axis=2)
        u, v = (np.einsum("pk,tkx->tpx", _PARTS, own).reshape(-1, 3) @ across.T).T
        sectors = np.floor((np.arctan2(v, u) + np.pi) / (2.0 * np.pi) * _SECTORS).clip(0, _SECTORS - 1)
        if np.ptp(away) <= _ALIKE * away.max() and len(np.unique(sectors)) >= _COVERED:
            along = own @ axis
            found.append(Bore(float(away.mean()), float(along.min()), float(along.max())))
    return found


def _is_open(triangles: Array, place: Array, axis: Array, radius: float) -> bool:
    """Whether no wall goes around an axis at a place."""
    across = np.linalg.svd(axis[None])[2][1:]
    angles = 2.0 * np.pi * (np.arange(_SECTORS) + 0.5) / _SECTORS
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1) @ across
    start = place + _ASIDE * radius * axis
    return sum(bool(np.isfinite(ray_length(start, ray, triangles, 0.0))) for ray in rays) < _COVERED
