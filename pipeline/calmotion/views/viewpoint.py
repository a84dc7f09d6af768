"""Viewpoint for a character: in front of its motion, slightly to the side and above."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.shot.character import Array, Character
from calmotion.shot.result import Motion, Skin
from calmotion.views.playback import world_points

SIDE = np.radians(38.0)
ELEVATION = np.radians(17.0)


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


def choose_viewpoint(character: Character, skins: tuple[Skin | None, ...], motion: Motion, rows: int = 12) -> Viewpoint:
    """A viewpoint from which the whole motion is visible.

    The front of a character is the side of its targets. Up is opposite to gravity.

    Args:
        character: The character.
        skins: One for each body.
        motion: The motion to show.
        rows: Number of instants of the motion that are used.
    """
    clouds = [motion.target_positions.reshape(-1, 3)]
    fixed = []
    for row in np.unique(np.linspace(0, len(motion.times) - 1, rows).astype(int)):
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
