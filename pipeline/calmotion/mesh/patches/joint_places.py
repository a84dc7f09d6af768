"""How near joints of a body may be to hold a part of its surface each, and what is left between two such parts."""

from collections.abc import Sequence

import numpy as np

from calmotion.arrays import Array, BoolArray, box_diagonal
from calmotion.mesh.patches.automatic_patch import ROOM, least_radius
from calmotion.model.meshes import CutPatch

Ball = tuple[Array, float]  # center [m], shape [3], and radius [m]

TIE = 1e-3  # of the size of a body: places that are nearer to each other are one
SAME = 1e-6  # of the size: frames that are nearer to each other have one position


def nearest_apart(triangles: Array, radius: float) -> float:
    """Distance between attachment frames from which on each has a patch of its own [m].

    Patches with less between their frames would turn more easily on the ground below them than the body bends: such
    joints hold one part of it. On the palm of the Allegro hand, the frame of the base and that of a finger are 0.7 mm
    apart; with a patch for each, the 150 mm of the palm hung on 2 mm of it.

    Args:
        triangles: Surface [m], shape [k, 3, 3], outward.
        radius: Of the patches [m]; one that is given (not negative) is meant for each of the frames.
    """
    same = SAME * box_diagonal(triangles)
    return same if radius >= 0.0 else max(same, least_radius(triangles) / ROOM)


def cut_at(position: Array, cut: Sequence[CutPatch], size: float) -> CutPatch | None:
    """The patch along whose rim the mesh is cut for an attachment frame; None without one.

    Args:
        position: Of the frame [m], shape [3].
        size: Of the body [m].
    """
    return next((patch for patch in cut if np.linalg.norm(patch.origin - position) < SAME * size), None)


def balls_between(places: Array, own: int, one: float) -> list[Ball]:
    """Balls that a patch keeps to, so that surface is left between it and the patches around other places.

    In each of them are the points that are nearer to the own place than to another one by a factor, with which they
    come as near to the other as a patch of the largest radius does. Patches that touch would be joined as stiffly as
    the elements between them are small.

    Args:
        places: Of all patches [m], shape [k, 3].
        own: Index of the own place.
        one: Distance below which places are one [m].

    Source: circles of Apollonius: the points whose distances from two places have one ratio.
    """
    ratio = ROOM / (1.0 - ROOM)
    away = places - places[own]
    distance = np.linalg.norm(away, axis=1)
    return [
        (places[own] - ratio**2 / (1.0 - ratio**2) * step, float(ratio / (1.0 - ratio**2) * length))
        for step, length in zip(away, distance, strict=True)
        if length > one
    ]


def within(points: Array, balls: Sequence[Ball]) -> BoolArray:
    """Which points are in all of the balls, shape [n].

    Args:
        points: [m], shape [n, 3].
        balls: Of `balls_between`.
    """
    found = np.ones(len(points), dtype=bool)
    for center, radius in balls:
        found &= np.linalg.norm(points - center, axis=1) <= radius
    return found


def reached_by(balls: Sequence[Ball], centers: Sequence[Array], radius: float) -> tuple[Ball, ...]:
    """The balls that do not contain all of some spheres; without spheres, none.

    Args:
        balls: Of `balls_between`.
        centers, radius: Of the spheres [m].
    """
    return tuple(ball for ball in balls if any(np.linalg.norm(ball[0] - c) + radius > ball[1] for c in centers))
