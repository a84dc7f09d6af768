"""Viewpoint for a character: in front of its motion, slightly to the side and above."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.model.character import Character
from calmotion.model.result import Motion, Skin
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.views.playback import deformed_points, modes_of, world_points

SIDE = np.radians(38.0)
ELEVATION = np.radians(17.0)
FEW = 12  # instants whose extent gives the size of a viewpoint
INSTANTS = 60  # of a motion that a picture keeps; a fast swing takes a tenth of a second
STILL = 1e-3  # of a body that does not move: range of its place [m] and of its quaternion
ROOM = 1.25  # largest growth of a picture for what stands still
ROOM_FOR_SURFACE = 1.05  # for one surface of a base that is not in the picture as a whole
ROOM_FOR_CUT = 1.5  # for scenery of which the picture has the share CUT or more without it
CUT = 1.0 / 3.0


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

    @property
    def eye(self) -> Array:
        """Far enough from the center that all of the sphere is in front of it [m], shape [3]."""
        return self.center + 5.0 * self.radius * self.toward_eye

    @property
    def axes(self) -> Array:
        """To the right, downward and forward in the picture, shape [3, 3], a row each."""
        forward = -self.toward_eye
        right = np.cross(forward, self.up)
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(forward, right), forward])

    def picture(self, points: Array) -> Array:
        """Where the eye sees world points [m], shape [n, 3], to the right and downward, over their distance; [n, 2]."""
        local = (points - self.eye) @ self.axes.T
        return np.asarray(local[:, :2] / np.maximum(local[:, 2:], 1e-9))


def choose_viewpoint(character: Character, skins: tuple[Skin | None, ...], motion: Motion) -> Viewpoint:
    """A viewpoint from which the whole motion is visible.

    The front of a character is the side of its targets. Up is opposite to gravity.

    Args:
        skins: One for each body.
        motion: The motion to show.
    """
    clouds = [motion.target_positions.reshape(-1, 3)]
    fixed = []
    for row in np.unique(np.linspace(0, len(motion.times) - 1, FEW).astype(int)):
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


def framed(
    view: Viewpoint,
    character: Character,
    skins: tuple[Skin | None, ...],
    motions: Sequence[Motion],
    trails: Array | None = None,
) -> Array:
    """What a picture of motions has to contain: all that moves, and what stands still and belongs to it.

    Args:
        view: From where it is seen.
        character: With its scenery.
        skins: One for each body.
        motions: The motions to show.
        trails: Further points [m], shape [n, 3].

    Returns:
        World points [m], shape [k, 3].
    """
    clouds = [moving_cloud(character, skins, motion) for motion in motions]
    cloud = np.concatenate(clouds if trails is None else [*clouds, trails])
    return np.concatenate([cloud, still_pieces(view, character, motions[0], cloud)])


def moving_cloud(character: Character, skins: tuple[Skin | None, ...], motion: Motion) -> Array:
    """Targets, and the corners of the convex hulls of the drawn surfaces of bodies that move, at instants of a motion,
    shape [n, 3]; of all bodies, where none moves.

    A picture that has the corners of a hull has all of its surface; robots have surfaces of a hundred thousand points.
    """
    clouds = [motion.target_positions.reshape(-1, 3)]
    instants = np.unique(np.linspace(0, len(motion.times) - 1, INSTANTS).astype(int))
    matrices = rotation_from_quaternion(motion.rotations[instants])
    moved = moving_bodies(motion)
    seen = moved if np.any(moved) else np.ones(len(moved), bool)
    for index, body in enumerate(character.bodies):
        for s, surface in enumerate(body.surfaces):
            if surface.drawn and seen[index]:
                corners, modes = hull_corners(surface.points), modes_of(skins[index], s)
                own = None if modes is None else modes[corners]
                points = deformed_points(surface.points[corners], own, motion.elastic[index][instants])
                turned = points @ np.swapaxes(matrices[:, index], 1, 2)
                clouds.append((turned + motion.positions[instants, index][:, None]).reshape(-1, 3))
    return np.concatenate(clouds)


def moving_bodies(motion: Motion) -> BoolArray:
    """Which bodies do more than stand still, shape [b]."""
    moved = np.ptp(motion.positions, axis=0).max(axis=1) + np.ptp(motion.rotations, axis=0).max(axis=1)
    return np.asarray(moved > STILL)


def still_pieces(view: Viewpoint, character: Character, motion: Motion, cloud: Array) -> Array:
    """Corners of the hulls of what stands still and belongs into a picture: a robot's base, its head, what it hits.

    A base is taken as a whole; where it is too large, as the legs of a figure, each of its surfaces that hardly makes
    the picture larger. Not a stage, for which the picture would have to be much larger than for the character; the
    picture is made larger for what it would cut in two, such as a table, but for the floor.

    Args:
        view: From where the picture is seen.
        character: With its scenery.
        motion: For the places of the bodies that stand still.
        cloud: What the picture has to contain [m], shape [n, 3].

    Returns:
        [m], shape [k, 3]; empty where there are none.
    """
    low, high = _edges(cloud)
    diagonal = float(np.linalg.norm(high - low))
    left, right = _edges(view.picture(cloud))

    def grown(piece: Array) -> float:
        lower, upper = np.minimum(low, piece.min(axis=0)), np.maximum(high, piece.max(axis=0))
        return float(np.linalg.norm(upper - lower)) / diagonal

    bases, surfaces = _still_surfaces(character, motion)
    ground = min(float((piece @ view.up).min()) for piece in [cloud, *bases])
    beside = [(piece, ROOM_FOR_SURFACE, ROOM_FOR_SURFACE) for piece in surfaces]
    for surface in character.scenery:
        if surface.drawn:
            piece = surface.points[hull_corners(surface.points)]
            floor = float((piece @ view.up).max()) <= ground + 1e-6
            beside.append((piece, ROOM, ROOM if floor else ROOM_FOR_CUT))
    rooms = [(piece, ROOM, ROOM) for piece in bases] + sorted(beside, key=lambda row: grown(row[0]))
    kept = [np.zeros((0, 3))]
    for piece, room, room_for_cut in rooms:
        lower, upper = _edges(view.picture(piece))
        inside = np.clip(np.minimum(right, upper) - np.maximum(left, lower), 0.0, None)
        cut = np.prod(inside / np.maximum(upper - lower, 1e-12)) >= CUT
        if grown(piece) <= (room_for_cut if cut else room):
            low, high = np.minimum(low, piece.min(axis=0)), np.maximum(high, piece.max(axis=0))
            left, right = np.minimum(left, lower), np.maximum(right, upper)
            kept.append(piece)
    return np.concatenate(kept)


def _edges(points: Array) -> tuple[Array, Array]:
    """Lowest and highest coordinates of points."""
    return points.min(axis=0), points.max(axis=0)


def _still_surfaces(character: Character, motion: Motion) -> tuple[list[Array], list[Array]]:
    """Corners of the hulls of bodies that stand still beside others that move, and of each of their surfaces [m]."""
    moved, matrices = moving_bodies(motion), rotation_from_quaternion(motion.rotations[:1])[0]
    bases, surfaces = [], []
    for index, body in enumerate(character.bodies):
        if not moved[index] and np.any(moved):
            points = [surface.points[hull_corners(surface.points)] for surface in body.surfaces if surface.drawn]
            points = [piece @ matrices[index].T + motion.positions[0, index] for piece in points]
            surfaces += points
            if points:
                bases.append(np.concatenate(points))
    return bases, surfaces


def hull_corners(points: Array) -> IntArray:
    """Indices of the points, shape [n, 3], that are corners of their convex hull; of all, where they are flat."""
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
    axes = view.axes
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
