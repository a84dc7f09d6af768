"""A depth-buffered renderer of triangles, which needs neither a screen nor a graphics card."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
Indices = NDArray[np.integer]


@dataclass(frozen=True, eq=False)
class Hits:
    """The visible triangle of each pixel.

    Attributes:
        triangle: Index of the triangle, -1 for none, shape [height, width].
        shares: Barycentric coordinates in it, shape [height, width, 3].
        depth: Distance, infinite for none, shape [height, width].
    """

    triangle: Indices
    shares: Array
    depth: Array


def rasterize(corners: Array, width: int, height: int) -> Hits:
    """Find the nearest triangle in each pixel.

    Args:
        corners: Pixel coordinates (x right, y down) and depth of the corners, shape [m, 3, 3].
        width, height: Size of the picture [pixels].

    Returns:
        The hits. Triangles that face away (clockwise on an upright picture) are not drawn.
    """
    plane = corners[:, :, :2]
    edges = edge_functions(plane)
    # With y down, a triangle that faces the eye has a negative area.
    facing = np.flatnonzero(cross(plane[:, 1] - plane[:, 0], plane[:, 2] - plane[:, 0]) < 0.0)
    triangle, row = expand(
        facing, *pixel_range(plane[facing, :, 1].min(axis=1), plane[facing, :, 1].max(axis=1), height)
    )
    span, column = expand(np.arange(len(triangle)), *pixel_range(*spans(edges[triangle], row + 0.5), width))
    triangle, row = triangle[span], row[span]
    place = np.column_stack([column + 0.5, row + 0.5, np.ones(len(row))])
    shares = np.einsum("fkj,fj->fk", edges[triangle], place)
    distance = np.einsum("fk,fk->f", shares, corners[triangle, :, 2])
    pixel = row * width + column
    nearest = np.lexsort((distance, pixel))
    first = nearest[np.flatnonzero(np.diff(pixel[nearest], prepend=-1))]
    hits = Hits(
        np.full((height, width), -1, dtype=np.int32), np.zeros((height, width, 3)), np.full((height, width), np.inf)
    )
    hits.triangle.flat[pixel[first]] = triangle[first]
    hits.shares.reshape(-1, 3)[pixel[first]] = shares[first]
    hits.depth.flat[pixel[first]] = distance[first]
    return hits


def edge_functions(plane: Array) -> Array:
    """Barycentric coordinates as linear functions a x + b y + c of the plane: [m, 3, 2] gives [m, 3, 3]."""
    following, last = np.roll(plane, -1, axis=1), np.roll(plane, -2, axis=1)
    side = last - following
    area = cross(plane[:, 1] - plane[:, 0], plane[:, 2] - plane[:, 0])
    slopes = np.stack([-side[..., 1], side[..., 0]], axis=-1)
    offset = -np.sum(slopes * following, axis=-1, keepdims=True)
    return np.concatenate([slopes, offset], axis=-1) / np.where(area == 0.0, 1.0, area)[:, None, None]


def spans(edges: Array, y: Array) -> tuple[Array, Array]:
    """Ends of the line at height y in each triangle: [p, 3, 3] and [p] give two of [p]."""
    slope, value = edges[..., 0], edges[..., 1] * y[:, None] + edges[..., 2]
    root = -value / np.where(slope == 0.0, 1.0, slope)
    enter = np.where(slope > 0.0, root, -np.inf).max(axis=1, initial=-np.inf)
    leave = np.where(slope < 0.0, root, np.inf).min(axis=1, initial=np.inf)
    return enter, leave


def pixel_range(low: Array, high: Array, size: int) -> tuple[Indices, Indices]:
    """First pixel with its center in [low, high], and the number of such pixels, within 0..size."""
    first = np.ceil(np.clip(low, 0.0, size) - 0.5).astype(int)
    last = np.floor(np.clip(high, 0.0, size) - 0.5).astype(int)
    return first, np.maximum(last - first + 1, 0)


def expand(owners: Indices, first: Indices, count: Indices) -> tuple[Indices, Indices]:
    """Repeat each owner `count` times, and number the copies from `first` on."""
    repeated = np.repeat(np.arange(len(owners)), count)
    number = np.arange(len(repeated)) - np.repeat(np.cumsum(count) - count, count)
    return owners[repeated], first[repeated] + number


def cross(a: Array, b: Array) -> Array:
    """Cross product in a plane."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
