"""Triangulated surfaces as oriented chains: boundaries, closing of small holes, inside and outside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.geometry.tetrahedra import Indices, surface_area
from calmotion.shot.character import Array


@dataclass(frozen=True, eq=False)
class Closure:
    """A surface with its holes capped.

    Attributes:
        points: [m], shape [n, 3]; those of the input, then one for each cap of more than three edges.
        triangles: Shape [m, 3]; those of the input, then the caps.
        areas: Area of each cap [m^2].
        sides: Number of edges of each cap.
    """

    points: Array
    triangles: Indices
    areas: Array
    sides: Indices


def boundary_walks(triangles: Indices) -> list[list[int]]:
    """Closed walks along the boundary of a consistently oriented surface, in the orientation of the caps.

    Edges are counted with their direction: the boundary is the chain of edges that do not cancel, also where an edge
    has four triangles. The boundary of a boundary is zero, so as many edges leave each corner as arrive there, and all
    walks are closed.
    """
    start = triangles.ravel()
    end = np.roll(triangles, -1, axis=1).ravel()
    low, high = np.minimum(start, end), np.maximum(start, end)
    edges, inverse = np.unique(np.stack([low, high], axis=1), axis=0, return_inverse=True)
    net = np.zeros(len(edges), dtype=int)
    np.add.at(net, inverse.ravel(), np.where(start < end, 1, -1))
    leaving: dict[int, list[int]] = {}
    for (a, b), count in zip(edges[net != 0].tolist(), net[net != 0].tolist(), strict=True):
        # the cap has the opposite direction along the common edge
        tail, head = (b, a) if count > 0 else (a, b)
        leaving.setdefault(tail, []).extend([head] * abs(count))
    walks = []
    for corner in sorted(leaving):
        while leaving[corner]:
            place = corner
            walk: list[int] = []
            at: dict[int, int] = {}
            while leaving.get(place):
                at[place] = len(walk)
                walk.append(place)
                place = leaving[place].pop()
                if place in at:  # the walk closes here: remove this part, and continue from its corner
                    loop = walk[at[place] :]
                    for corner_of_loop in loop:
                        del at[corner_of_loop]
                    walk = walk[: len(walk) - len(loop)]
                    walks.append(loop)
    return walks


def close(points: Array, triangles: Indices) -> Closure:
    """Cap each hole of a consistently oriented surface with a fan of triangles.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3].
    """
    new_points, new_triangles = [points], [triangles]
    areas, sides = [], []
    count = len(points)
    for walk in boundary_walks(triangles):
        if len(walk) < 3:
            continue
        if len(walk) == 3:
            cap, corners = np.array([walk]), points
        else:
            center = points[walk].mean(axis=0)
            cap = np.array([[a, b, count] for a, b in zip(walk, walk[1:] + walk[:1], strict=True)])
            new_points.append(center[None])
            corners = np.vstack(new_points)
            count += 1
        new_triangles.append(cap)
        areas.append(surface_area(corners, cap))
        sides.append(len(walk))
    return Closure(np.vstack(new_points), np.vstack(new_triangles), np.array(areas), np.array(sides, dtype=int))


def winding_number(point: Array, points: Array, triangles: Indices) -> float:
    """Winding number of a surface around a point: 1 inside a closed outward surface, 0 outside.

    Source: van Oosterom and Strackee 1983 (solid angle of a triangle); Jacobson et al. 2013.
    """
    a, b, c = (points[triangles[:, k]] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    det = np.einsum("ij,ij->i", a, np.cross(b, c))
    rest = (
        la * lb * lc
        + np.einsum("ij,ij->i", a, b) * lc
        + np.einsum("ij,ij->i", b, c) * la
        + np.einsum("ij,ij->i", c, a) * lb
    )
    return float(np.arctan2(det, rest).sum() / (2.0 * np.pi))
