"""Bodies in 3D: a transform a frame, each mesh once, and of its vertices and colors what changes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import rerun as rr
from calmotion.shot import Character, Motion, Result, SurfaceMesh
from calmotion.shot.character import Array
from calmotion.views.playback import carriers, deformed_points, deviations, modes_of, relative_poses
from calmotion.views.shading import split_at_creases
from numpy.typing import NDArray

from .deviation import deviation_colors
from .layout import REFERENCE, SCENERY, TIME

GHOST = (0, 158, 115, 90)
INSIDE = 0.02  # of the largest deviation: how far the ghost lies inside the bodies
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

    The ghost of the intended motion lies a little inside the bodies, so that it is hidden where they are where they
    should be, and does not flicker through them.

    Args:
        motions: Of all roots, at the shot's frames.
        scale: Deviation that has the whole color change [m].
    """
    motion, intended = motions[root], motions[REFERENCE]
    frames = rr.TimeColumn(TIME, duration=motion.times)
    depth = INSIDE * scale
    # transforms add up along the entity tree, which mirrors the prims'
    for index, (body, carrier) in enumerate(zip(character.bodies, carriers(character.bodies), strict=True)):
        if body.between:
            continue
        positions, rotations = relative_poses(motion, index, carrier)
        columns = rr.Transform3D.columns(translation=positions, quaternion=rotations[:, [1, 2, 3, 0]])
        recording.send_columns(root + body.path, [frames], columns)
        for s, surface in enumerate(body.surfaces):
            if not surface.drawn:
                continue
            modes = modes_of(result.skins[index], s)
            points, color, colors = surface.points, GHOST, None
            if root == REFERENCE:
                others = [other for name, other in motions.items() if name != REFERENCE]
                if max(deviations(points, modes, index, other, intended).max() for other in others) < 2.0 * depth:
                    continue  # it would never be seen
                points = moved_inside(surface, depth)
            else:
                color = display_color(surface.color)
                colors = deviation_colors(color, points, modes, index, motion, intended, scale)
            entity = root + (surface.path if surface.path != body.path else f"{body.path}/mesh")
            log_mesh(
                recording, entity, surface, deformed_points(points, modes, motion.elastic[index]), color, colors, frames
            )


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
        sources, triangles, normals = split_at_creases(surface.points, surface.triangles)
        mesh = rr.Mesh3D(
            vertex_positions=surface.points[sources].astype(np.float32),
            triangle_indices=triangles,
            vertex_normals=normals.astype(np.float32),
            albedo_factor=display_color(surface.color),
        )
        recording.log(SCENERY + surface.path, mesh, static=True)


def log_mesh(
    recording: rr.RecordingStream,
    entity: str,
    surface: SurfaceMesh,
    points: Array,
    color: tuple[int, int, int, int],
    colors: NDArray[np.uint8] | None,
    frames: rr.TimeColumn,
) -> None:
    """One surface; `points` has one row when it does not deform, else one a frame, as `colors` has if there are any."""
    sources, triangles, normals = split_at_creases(surface.points, surface.triangles)
    fixed: dict[str, Any] = {"triangle_indices": triangles, "vertex_normals": normals.astype(np.float32)}
    changing: dict[str, Any] = {}
    # A static component would hide one that changes over time, so each is either here or there.
    if len(points) == 1:
        fixed["vertex_positions"] = points[0, sources].astype(np.float32)
    else:
        changing["vertex_positions"] = points[:, sources].astype(np.float32).reshape(-1, 3)
    if colors is None:
        fixed["albedo_factor"] = color
    else:
        changing["vertex_colors"] = colors[:, sources].reshape(-1, 4)
    recording.log(entity, rr.Mesh3D.from_fields(**fixed), static=True)
    if changing:
        count = len(next(iter(changing.values()))) // len(sources)
        recording.send_columns(entity, [frames], rr.Mesh3D.columns(**changing).partition([len(sources)] * count))


def display_color(color: tuple[float, float, float] | None) -> tuple[int, int, int, int]:
    """A linear color as rerun shows it: 8 bits in sRGB."""
    linear = np.clip(np.array(color if color is not None else DEFAULT_COLOR, dtype=float), 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    red, green, blue = (255.0 * encoded).round().astype(int).tolist()
    return red, green, blue, 255
