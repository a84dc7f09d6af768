"""What the world does to the robot: reactions at its bases, and whether a base that only stands would tip over."""

from __future__ import annotations

from typing import Any

import numpy as np

from calmotion.shot import Character, Motion
from calmotion.shot.character import WORLD, Array, Body

_STANDS = 5e-3  # points of a base that are higher above its lowest one, over its extent, do not stand on the ground
_STILL = 1e-6  # a base that moves by more does not stand [m]


def reaction_rows(character: Character, motion: Motion) -> list[dict[str, Any]]:
    """For each joint to the world, the largest force and moment on the robot during the shot.

    A base that no joint of the shot holds, and that is the lowest part of the robot, may simply stand on the ground:
    `support_margin_m` is then how far the centre of pressure stays inside of the convex outline on which it stands;
    negative where the base tips over. The ground is level. It is None where the base does not stand, and
    `center_of_pressure_m` is where it is least, in world axes.
    """
    if motion.joint_forces is None or motion.joint_moments is None:
        return []
    rows, found = motion.judged, []
    times = motion.times[rows]
    for j, joint in enumerate(character.joints):
        if joint.body0 != WORLD:
            continue
        body = character.bodies[joint.body1]
        forces, moments = motion.joint_forces[rows, j], motion.joint_moments[rows, j]
        sizes, turning = np.linalg.norm(forces, axis=1), np.linalg.norm(moments, axis=1)
        row: dict[str, Any] = {
            "path": joint.path, "body": body.path,
            "max_force_n": float(sizes.max(initial=0.0)), "max_moment_n_m": float(turning.max(initial=0.0)),
            "time_s": float(times[int(np.argmax(turning))]) if len(times) else None,
            "support_margin_m": None, "support_time_s": None, "center_of_pressure_m": None,
        }  # fmt: skip
        if joint.path == body.path:  # a joint of the reader's own
            row |= _standing(character, motion, joint.body1, forces, moments)
        found.append(row)
    return found


def _standing(character: Character, motion: Motion, base: int, forces: Array, moments: Array) -> dict[str, Any]:
    """The last three entries of a row, of a base with the frame of its joint; forces and moments of shape [T, 3]."""
    weight = float(np.linalg.norm(character.gravity))
    still = np.ptp(motion.positions[:, base], axis=0).max() < _STILL
    if weight == 0.0 or not still or len(forces) == 0:
        return {}
    up = -character.gravity / weight
    lowest = [float((cloud @ up).min()) for body in character.bodies if len(cloud := _points(body))]
    points = _points(character.bodies[base])
    if not len(points):
        return {}
    heights = points @ up
    ground, extent = float(heights.min()), float(np.ptp(points, axis=0).max())
    sole = points[heights <= ground + _STANDS * extent]
    if min(lowest) < ground - _STANDS * extent or len(sole) < 3:
        return {}
    lift = forces @ up
    if lift.min() <= 0.0:
        return {}  # it is pulled down, and nothing stands like this
    at = motion.positions[0, base]
    pressure = at + (np.cross(up, moments) + (ground - at @ up) * forces) / lift[:, None]
    margins = _margins(sole, pressure, up)
    if margins is None:
        return {}
    worst = int(np.argmin(margins))
    return {
        "support_margin_m": float(margins[worst]), "support_time_s": float(motion.times[motion.judged][worst]),
        "center_of_pressure_m": pressure[worst].tolist(),
    }  # fmt: skip


def _points(body: Body) -> Array:
    """Points of a body's geometry in the pose of the first frame, world, shape [n, 3]."""
    from scipy.spatial.transform import Rotation

    clouds = [surface.points for surface in body.surfaces if surface.visible] or [s.points for s in body.surfaces]
    if not clouds:
        return np.zeros((0, 3))
    turn = Rotation.from_quat(body.rest.rotation, scalar_first=True)
    return np.asarray(turn.apply(np.concatenate(clouds)) + body.rest.position)


def _margins(sole: Array, places: Array, up: Array) -> Array | None:
    """How far places are inside of the outline of a sole, seen from above, shape [T]; None where it has no area."""
    from scipy.spatial import ConvexHull, QhullError

    across = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    across /= np.linalg.norm(across)
    plane = np.stack([across, np.cross(up, across)], axis=1)
    try:
        hull = ConvexHull(sole @ plane)
    except QhullError:
        return None
    # rows (n, c) with n.x + c <= 0 inside
    return np.asarray(-(places @ plane @ hull.equations[:, :2].T + hull.equations[:, 2]).max(axis=1))
