"""Bodies in 3D: a transform a frame, each mesh once, and of its vertices and colors what changes."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import rerun as rr
from calmotion.arrays import Array
from calmotion.model import Body, Character, Motion, Result, SurfaceMesh
from calmotion.views import carriers, deformed_points, deviations, modes_of, relative_poses, split_at_creases
from numpy.typing import NDArray

from .deviation import deviation_colors
from .layout import REFERENCE, SCENERY, TIME

GHOST = (0, 158, 115, 90)
INSIDE = 0.02  # of the largest deviation: how far the ghost lies inside the bodies
# Shares of the largest deviation between which the ghost of a body appears: nearer, its surface would cut through the
# body's, and show as patches that come and go.
HIDDEN, SHOWN = 0.12, 0.3
DEFAULT_COLOR = (0.55, 0.55, 0.57)


def log_bodies(
    recording: rr.RecordingStream,
    root: str,
    character: Character,
    result: Result,
    motions: Mapping[str, Motion],
    scale: float,
) -> None:
    """A transform for each body and frame, its meshes once, the vertices of those that bend, the colors of those off.

    Args:
        root: Of a motion that is not the intended one.
        motions: Of all roots, at the shot's frames.
        scale: Deviation that has the whole color change [m].
    """
    motion, intended = motions[root], motions[REFERENCE]
    frames = rr.TimeColumn(TIME, duration=motion.times)
    log_poses(recording, root, character, motion)
    for index, body in enumerate(character.bodies):
        for s, surface in enumerate(() if body.between else body.surfaces):
            if surface.drawn:
                modes = modes_of(result.skins[index], s)
                color = display_color(surface.color)
                colors = deviation_colors(color, surface.points, modes, index, motion, intended, scale)
                points = deformed_points(surface.points, modes, motion.elastic[index])
                log_mesh(recording, entity_of(root, body, surface), surface, points, color, colors, frames)


def log_ghost(
    recording: rr.RecordingStream,
    root: str,
    character: Character,
    result: Result,
    motions: Mapping[str, Motion],
    scale: float,
) -> None:
    """The intended motion behind another one: transparent, and only those bodies and times that are off visibly.

    It lies a little inside the bodies, so that it is hidden where they are where they should be.

    Args:
        root: Of the motion that is in front.
        motions, scale: As for `log_bodies`.
    """
    motion, intended = motions[root], motions[REFERENCE]
    frames = rr.TimeColumn(TIME, duration=intended.times)
    tree = f"{REFERENCE}/{root}"
    log_poses(recording, tree, character, intended)
    for index, body in enumerate(character.bodies):
        for s, surface in enumerate(() if body.between else body.surfaces):
            modes = modes_of(result.skins[index], s)
            if not surface.drawn:
                continue
            share = deviations(surface.points, modes, index, motion, intended).max(axis=1) / max(scale, 1e-12)
            opacity = np.clip((share - HIDDEN) / (SHOWN - HIDDEN), 0.0, 1.0)
            if not np.any(opacity):
                continue
            tints = np.tile(np.array(GHOST, dtype=np.uint8), (len(opacity), 1))
            tints[:, 3] = (GHOST[3] * opacity).round()
            points = deformed_points(moved_inside(surface, INSIDE * scale), modes, intended.elastic[index])
            log_mesh(recording, entity_of(tree, body, surface), surface, points, tints, None, frames)


def log_poses(recording: rr.RecordingStream, root: str, character: Character, motion: Motion) -> None:
    """A transform for each body and frame; they add up along the entity tree, which mirrors the prims'."""
    frames = rr.TimeColumn(TIME, duration=motion.times)
    for index, (body, carrier) in enumerate(zip(character.bodies, carriers(character.bodies), strict=True)):
        if not body.between:
            positions, rotations = relative_poses(motion, index, carrier)
            columns = rr.Transform3D.columns(translation=positions, quaternion=rotations[:, [1, 2, 3, 0]])
            recording.send_columns(root + body.path, [frames], columns)


def entity_of(root: str, body: Body, surface: SurfaceMesh) -> str:
    """The entity of a surface under a root."""
    return root + (surface.path if surface.path != body.path else f"{body.path}/mesh")


def moved_inside(surface: SurfaceMesh, depth: float) -> Array:
    """The points of a surface, moved inwards [m], but at most by a tenth of its smallest extent; shape [n, 3]."""
    sources, _, normals = split_at_creases(surface.points, surface.triangles)
    directions = np.zeros_like(surface.points)
    np.add.at(directions, sources, normals)
    directions /= np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-12)
    depth = min(depth, 0.1 * float(np.ptp(surface.points, axis=0).min()))
    return np.asarray(surface.points - depth * directions)


def log_scenery(recording: rr.RecordingStream, character: Character) -> None:
    """What stands about the robot, once."""
    for surface in character.scenery:
        log_mesh(recording, SCENERY + surface.path, surface, surface.points[None], display_color(surface.color))


def log_mesh(
    recording: rr.RecordingStream,
    entity: str,
    surface: SurfaceMesh,
    points: Array,
    color: tuple[int, int, int, int] | NDArray[np.uint8],
    colors: NDArray[np.uint8] | None = None,
    frames: rr.TimeColumn | None = None,
) -> None:
    """One surface.

    Args:
        points: One row when it does not deform, else one a frame.
        color: Of the whole surface, or one a frame, shape [f, 4].
        colors: Of its points, one row a frame, instead.
        frames: Their times; None for what stays as it is.
    """
    sources, triangles, normals = split_at_creases(surface.points, surface.triangles)
    fixed: dict[str, Any] = {"triangle_indices": triangles, "vertex_normals": normals.astype(np.float32)}
    changing: dict[str, Any] = {}
    # A static component would hide one that changes over time, so each is either here or there.
    if len(points) == 1:
        fixed["vertex_positions"] = points[0, sources].astype(np.float32)
    else:
        changing["vertex_positions"] = points[:, sources].astype(np.float32).reshape(-1, 3)
    if colors is not None:
        changing["vertex_colors"] = colors[:, sources].reshape(-1, 4)
    elif isinstance(color, tuple):
        fixed["albedo_factor"] = color
    recording.log(entity, rr.Mesh3D.from_fields(**fixed), static=True)
    if changing:
        count = len(next(iter(changing.values()))) // len(sources)
        recording.send_columns(entity, [frames], rr.Mesh3D.columns(**changing).partition([len(sources)] * count))
    if not isinstance(color, tuple):
        recording.send_columns(entity, [frames], rr.Mesh3D.columns(albedo_factor=color))


def display_color(color: tuple[float, float, float] | None) -> tuple[int, int, int, int]:
    """A linear color as rerun shows it: 8 bits in sRGB."""
    linear = np.clip(np.array(color if color is not None else DEFAULT_COLOR, dtype=float), 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    red, green, blue = (255.0 * encoded).round().astype(int).tolist()
    return red, green, blue, 255
