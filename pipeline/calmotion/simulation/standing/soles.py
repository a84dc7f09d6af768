"""The sole of a body that stands on level ground, and how far a centre of pressure stays inside of it."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array
from calmotion.model.character import Body, Character, Frame

STANDS = 5e-3  # points of a body that are higher above its lowest one, over its extent, do not stand on the ground


def points_of(body: Body, pose: Frame) -> Array:
    """Points of a body's geometry in a pose, world, shape [n, 3]: of what is drawn, else of all."""
    from scipy.spatial.transform import Rotation

    clouds = [surface.points for surface in body.surfaces if surface.visible] or [s.points for s in body.surfaces]
    if not clouds:
        return np.zeros((0, 3))
    turn = Rotation.from_quat(pose.rotation, scalar_first=True)
    return np.asarray(turn.apply(np.concatenate(clouds)) + pose.position)


def sole_of(points: Array, up: Array) -> tuple[Array, float]:
    """Those of a body's points that stand on the ground, shape [n, 3], and its height [m].

    Args:
        points: Shape [n, 3], not empty.
        up: Unit vector against gravity.
    """
    heights = points @ up
    ground, extent = float(heights.min()), float(np.ptp(points, axis=0).max())
    return points[heights <= ground + STANDS * extent], ground


def centres_of_pressure(forces: Array, moments: Array, places: Array, up: Array, ground: float) -> Array:
    """Where the ground's reactions act, shape [T, 3]; their normal parts are not zero.

    Args:
        forces, moments: Of the ground on the body, the moments about `places`, shape [T, 3] each.
        up: Unit vector against gravity.
        ground: Its height [m].
    """
    levers = (ground - places @ up)[:, None] * forces
    return np.asarray(places + (np.cross(up, moments) + levers) / (forces @ up)[:, None])


def margins(sole: Array, places: Array, up: Array) -> Array | None:
    """How far places are inside of the outline of a sole, seen from above, shape [T]; None where it has no area."""
    across = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    across /= np.linalg.norm(across)
    plane = np.stack([across, np.cross(up, across)], axis=1)
    edges = outline(sole @ plane)
    return None if edges is None else np.asarray(-(places @ plane @ edges[:, :2].T + edges[:, 2]).max(axis=1))


def outline(points: Array) -> Array | None:
    """Edges of the convex hull of points of shape [n, 2]: rows (n, c) with n.x + c <= 0 inside, shape [e, 3]; None
    where they have no area."""
    from scipy.spatial import ConvexHull, QhullError

    if len(points) < 3:
        return None
    try:
        rows: Array = ConvexHull(points).equations
    except QhullError:
        return None
    # triangles of a sole share its edges
    return rows[np.sort(np.unique(np.round(rows, 9), axis=0, return_index=True)[1])]


def vertical(axes: Array, up: Array) -> Array:
    """The axis of a frame, of either sign, that is nearest to up: feet that give way land tilted."""
    along = axes.T @ up
    nearest = int(np.argmax(np.abs(along)))
    return np.asarray(np.sign(along[nearest]) * axes[:, nearest])


def weight_of(character: Character) -> float:
    """Of the whole robot, flexible bodies without an authored mass left out [N]."""
    masses = [body.mass.mass for body in character.bodies if body.mass is not None]
    return float(np.linalg.norm(character.gravity)) * float(sum(masses))
