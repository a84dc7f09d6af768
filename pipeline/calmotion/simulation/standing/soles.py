"""The sole of a body that stands on level ground, and how far a centre of pressure stays inside of it."""

from __future__ import annotations

import numpy as np

from calmotion.shot.character import Array, Body, Frame

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
    from scipy.spatial import ConvexHull, QhullError

    if len(sole) < 3:
        return None
    across = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    across /= np.linalg.norm(across)
    plane = np.stack([across, np.cross(up, across)], axis=1)
    try:
        hull = ConvexHull(sole @ plane)
    except QhullError:
        return None
    # rows (n, c) with n.x + c <= 0 inside
    return np.asarray(-(places @ plane @ hull.equations[:, :2].T + hull.equations[:, 2]).max(axis=1))
