"""Viewpoint for a character: in front of its motion, slightly to the side and above."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.model.character import Character
from calmotion.model.result import Motion, Skin
from calmotion.views.playback import deformed_points, modes_of, rotation_matrices, world_points

SIDE = np.radians(38.0)
ELEVATION = np.radians(17.0)
STILL = 1e-3  # of a body that does not move: range of its place [m] and of its quaternion
ROOM = 1.2  # largest growth of a picture for the scenery
ROOM_FOR_CUT = 1.5  # for a piece of which the picture has at least half without it


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """A camera direction, and the sphere that the picture contains.

    Attributes:
        center: [m], shape [3], world.
        radius: [m].
        toward_eye: Unit vector from the center to the eye, shape [3].
        up: Unit vector, shape [3].
    """

    center: Array
    radius: float
    toward_eye: Array
    up: Array


def choose_viewpoint(character: Character, skins: tuple[Skin | None, ...], motion: Motion) -> Viewpoint:
    """A viewpoint from which the whole motion is visible.

    The front of a character is the side of its targets. Up is opposite to gravity.

    Args:
        skins: One for each body.
        motion: The motion to show.
    """
    clouds = [motion.target_positions.reshape(-1, 3)]
    fixed = []
    for row in np.unique(np.linspace(0, len(motion.times) - 1, 12).astype(int)):
        for index, body in enumerate(character.bodies):
            points = [
                p
                for p, s in zip(world_points(body, index, skins[index], motion, row), body.surfaces, strict=True)
                if s.visible
            ]
            corners = [corner for p in points for corner in (p.min(axis=0), p.max(axis=0))]
            clouds.append(np.array(corners).reshape(-1, 3))
            fixed.append(motion.positions[row, index])
    cloud = np.vstack([*clouds, motion.positions[:1].reshape(-1, 3)])
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    strength = float(np.linalg.norm(character.gravity))
    up = -character.gravity / strength if strength > 0.0 else np.array([0.0, 0.0, 1.0])
    ahead = np.zeros(3)
    if motion.target_positions.size and fixed:
        ahead = motion.target_positions.reshape(-1, 3).mean(axis=0) - np.mean(fixed, axis=0)
    ahead = ahead - (ahead @ up) * up
    radius = max(0.5 * float(np.linalg.norm(high - low)), 1e-3)
    if np.linalg.norm(ahead) < 0.02 * radius:
        axis = np.eye(3)[int(np.argmin(np.abs(up)))]
        ahead = axis - (axis @ up) * up
    ahead = ahead / np.linalg.norm(ahead)
    level = np.cos(SIDE) * ahead - np.sin(SIDE) * np.cross(up, ahead)
    return Viewpoint(0.5 * (low + high), radius, np.cos(ELEVATION) * level + np.sin(ELEVATION) * up, up)


def moving_cloud(character: Character, skins: tuple[Skin | None, ...], motion: Motion, rows: int = 40) -> Array:
    """Targets, and the corners of the convex hulls of the drawn surfaces of bodies that move, at instants of a motion,
    shape [n, 3]; of all bodies, where none moves.

    A picture that has the corners of a hull has all of its surface; robots have surfaces of a hundred thousand points.
    """
    clouds = [motion.target_positions.reshape(-1, 3)]
    instants = np.unique(np.linspace(0, len(motion.times) - 1, 12).astype(int))
    matrices = rotation_matrices(motion.rotations[instants])
    moved = np.ptp(motion.positions, axis=0).max(axis=1) + np.ptp(motion.rotations, axis=0).max(axis=1)
    seen = moved > STILL if np.any(moved > STILL) else np.ones(len(moved), bool)
    for index, body in enumerate(character.bodies):
        for s, surface in enumerate(body.surfaces):
            if surface.drawn and seen[index]:
                corners, modes = hull_corners(surface.points), modes_of(skins[index], s)
                own = None if modes is None else modes[corners]
                points = deformed_points(surface.points[corners], own, motion.elastic[index][instants])
                turned = points @ np.swapaxes(matrices[:, index], 1, 2)
                clouds.append((turned + motion.positions[instants, index][:, None]).reshape(-1, 3))
    return np.concatenate(clouds)


def near_scenery(character: Character, cloud: Array) -> Array:
    """Corners of the hulls of the still surfaces that belong into a picture: a robot's head and feet, what it hits.

    Not those, such as a stage, for which the picture would have to be much larger than for the character. It is made
    larger for those that it would cut through, such as a table of which it has the greater part.

    Args:
        character: With its scenery.
        cloud: What the picture has to contain [m], shape [n, 3].

    Returns:
        [m], shape [k, 3]; empty where there are none.
    """
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    diagonal = float(np.linalg.norm(high - low))

    def grown(piece: Array) -> tuple[float, Array, Array]:
        lower, upper = np.minimum(low, piece.min(axis=0)), np.maximum(high, piece.max(axis=0))
        return float(np.linalg.norm(upper - lower)) / diagonal, lower, upper

    def share_inside(piece: Array) -> float:
        lower, upper = piece.min(axis=0), piece.max(axis=0)
        inside = np.minimum(high, upper) - np.maximum(low, lower)
        return float(np.prod(np.clip(inside, 0.0, None) / np.maximum(upper - lower, 1e-12)))

    pieces = [surface.points[hull_corners(surface.points)] for surface in character.scenery if surface.drawn]
    kept = [np.zeros((0, 3))]
    for piece in sorted(pieces, key=lambda piece: grown(piece)[0]):
        growth, lower, upper = grown(piece)
        if growth <= (ROOM_FOR_CUT if share_inside(piece) >= 0.5 else ROOM):
            low, high = lower, upper
            kept.append(piece)
    return np.concatenate(kept)


def hull_corners(points: Array) -> IntArray:
    """Indices of the points, shape [n, 3], that are corners of their convex hull; of all, where they are flat."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(ConvexHull(points).vertices, dtype=np.int32)
    except (QhullError, ValueError):  # flat, or fewer than four
        return np.arange(len(points), dtype=np.int32)


def eye_that_sees(view: Viewpoint, cloud: Array, half_angle: float, aspect: float) -> tuple[Array, Array]:
    """The nearest eye in the direction of a viewpoint whose picture contains all points, and where it looks.

    Args:
        view: For its directions.
        cloud: World points [m], shape [n, 3].
        half_angle: Half the vertical opening angle of the eye [rad].
        aspect: Width over height of the picture.

    Returns:
        The eye and a point in the middle of the picture, at the middle distance of the points [m], shape [3] each.
    """
    forward = -view.toward_eye
    right = np.cross(forward, view.up)
    right = right / np.linalg.norm(right)
    axes = np.stack([right, np.cross(right, forward), forward])
    local = cloud @ axes.T
    depth = local[:, 2]
    slopes = np.tan(half_angle) * np.array([aspect, 1.0])
    # Each side of the picture is a plane through the eye: a - slope * (depth - z) <= e <= a + slope * (depth - z).
    low = (local[:, :2] - slopes * depth[:, None]).max(axis=0)
    high = (local[:, :2] + slopes * depth[:, None]).min(axis=0)
    z = float(np.min((high - low) / (2.0 * slopes)))
    z = min(z, float(depth.min()) - 1e-3 * view.radius)
    eye = np.append(0.5 * (low + high), z)
    look = np.append(eye[:2], 0.5 * (depth.min() + depth.max()))
    return eye @ axes, look @ axes
