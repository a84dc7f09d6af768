"""The other cheek of a fork: a joint whose frame is at one cheek holds both, for its pin is in the bores of both.

A bore is a band of triangles that face the axis of the joint and go around it. Between the cheeks of a fork the axis is
in the open; two bores of a closed housing are no fork, and the joint at one of its ends does not hold the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.mesh.patches.automatic_patch import Skin
from calmotion.mesh.surfaces.distances import ray_length, triangle_parts
from calmotion.mesh.tetrahedra import part_of_each

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
