"""How wide a part of a surface a joint takes hold of, before there is a mesh."""

from __future__ import annotations

import numpy as np

from calmotion.geometry.distances import closest_on_triangles, ray_length
from calmotion.geometry.sections import outlines
from calmotion.geometry.tetrahedra import Indices
from calmotion.shot.character import Array, Body

_DIRECTIONS = 8  # across the body, both ways
_DEPTHS = 40  # at which its width is measured
_ROOM = 0.45  # of the distance to the next joint, as finite elements share the surface


def grip_radius(points: Array, triangles: Indices, body: Body, center: Array, room: float) -> float | None:
    """Radius of the surface that moves rigidly with a joint [m], or less.

    As `fem.automatic_patch.automatic_radius` measures it, unless the shot gives a radius or names the surfaces.

    Args:
        points: Of the solid [m], shape [n, 3].
        triangles: Shape [m, 3], outward.
        body: With `flexible` settings.
        center: AttachmentFrame of the joint [m], shape [3], body frame.
        room: Distance to the next joint's [m].

    Returns:
        None where the anchor is farther from the surface than finite elements may accept.
    """
    assert body.flexible is not None
    corners = points[triangles]
    closest = closest_on_triangles(center, corners)
    gaps = np.linalg.norm(closest - center, axis=1)
    gap, authored = float(gaps.min()), body.flexible.interface_radius
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    if gap > (0.25 * size if authored < 0.0 else authored):
        return None
    radius = authored
    if authored < 0.0:
        surface = closest[int(gaps.argmin())]
        # at one place only: in the middle of a bar, the opposite face is as near
        touched = corners[np.linalg.norm(closest - surface, axis=1) <= 1e-9 * size]
        normal = np.cross(touched[:, 1] - touched[:, 0], touched[:, 2] - touched[:, 0]).sum(axis=0)
        length = float(np.linalg.norm(normal))
        if length == 0.0:
            return None
        width = _half_width(points, triangles, surface, -normal / length, size)
        radius = max(1.25 * gap, float(np.hypot(gap, width)))
        radius = min(radius, max(_ROOM * room, 1.25 * gap))
    return min([radius, *(_named_radius(surface.triangles) for surface in body.interfaces)])


def _half_width(points: Array, triangles: Indices, surface: Array, inward: Array, size: float) -> float:
    """Half width of the body below a place on its surface: the first that is no more than twice as deep [m]."""
    depth = min(ray_length(surface, inward, points[triangles], 1e-6 * size), size)
    depths = np.geomspace(2e-3, 0.5, _DEPTHS) * depth
    which, p, q = outlines(points, triangles, surface, inward, depths)
    widths = np.full(_DEPTHS, np.inf)
    for angle in np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS:
        ray, side = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        a, b = p @ side, q @ side
        met = (a > 0.0) != (b > 0.0)
        far = (p @ ray)[met] + ((q - p) @ ray * a)[met] / (a - b)[met]
        reach = np.full((2, _DEPTHS), np.inf)
        np.minimum.at(reach, ((far < 0.0).astype(int), which[met]), np.abs(far))
        widths = np.minimum(widths, 0.5 * reach.sum(axis=0))
    enough = np.flatnonzero(widths <= 2.0 * depths)
    return float(widths[enough[0]]) if len(enough) else depth


def _named_radius(triangles: Array) -> float:
    """Half the smaller side of a rectangle that is as wide as triangles of shape [k, 3, 3] [m]."""
    area = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    middle = triangles.mean(axis=1)
    weight = area / max(float(area.sum()), np.finfo(float).tiny)
    center = weight @ middle
    arms, far = triangles - center, middle - center
    # int x x^T over a triangle is area (sum x_i x_i^T + 9 m m^T) / 12
    second = np.einsum("t,tka,tkb->ab", weight, arms, arms) + 9.0 * np.einsum("t,ta,tb->ab", weight, far, far)
    return float(np.sqrt(3.0 * max(np.linalg.eigvalsh(second / 12.0)[1], 0.0)))
