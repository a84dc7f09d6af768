"""A picture of a character at one instant: camera, light, shadow, and the outline of the intended motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, IntArray
from calmotion.model.character import Character
from calmotion.model.result import Motion, Skin
from calmotion.views.playback import deformed_points, modes_of, rotation_matrices
from calmotion.views.raster import Hits, rasterize
from calmotion.views.shading import split_at_creases
from calmotion.views.viewpoint import Viewpoint

Pixels = NDArray[np.uint8]  # sRGB, shape [height, width, 3]
Mask = NDArray[np.bool_]
Light = NDArray[np.float32]  # linear RGB, shape [height, width, 3]

PAPER: Light = np.ones(3, dtype=np.float32)
DEFAULT_COLOR = (0.55, 0.55, 0.57)
AMBIENT, KEY, FILL = 0.34, 0.62, 0.16
SHADOW = 0.30  # of the light that the floor loses in the shadow
FILLED, OUTLINED = 0.35, 0.80  # strength of the intended motion's color beside the character, and of its outline


@dataclass(frozen=True, eq=False)
class Model:
    """The visible surfaces of a character and its scenery, prepared for drawing.

    Attributes:
        parts: For each surface: body index, points [n, 3], modes [n, 3, r] or None, normals [n, 3], triangles.
        colors: Linear RGB of each surface, those of the scenery last, shape [s, 3].
        still: Corners [m, 3, 3], normals [m, 3, 3] and surfaces [m] of the scenery's triangles.
        up: Unit vector opposite to gravity, shape [3]; zero without gravity.
    """

    parts: tuple[tuple[int, Array, Array | None, Array, IntArray], ...]
    colors: Array
    still: tuple[Array, Array, IntArray]
    up: Array


@dataclass(frozen=True, eq=False)
class Camera:
    """A perspective camera: world to pixels.

    Attributes:
        eye: [m], shape [3].
        axes: Rows right, down, forward, shape [3, 3].
        scale: Pixels for a slope of one.
        center: Pixel of the optical axis, shape [2].
        size: Width and height [pixels].
    """

    eye: Array
    axes: Array
    scale: float
    center: Array
    size: tuple[int, int]

    def project(self, points: Array) -> Array:
        """Pixel x, pixel y and distance of world points, [..., 3] to [..., 3]; points behind the eye have no pixel."""
        local = (points - self.eye) @ self.axes.T
        depth = local[..., 2:]
        safe = np.where(np.abs(depth) > 1e-9, depth, 1e-9)
        return np.concatenate([self.center + self.scale * local[..., :2] / safe, depth], axis=-1)


@dataclass(frozen=True, eq=False)
class View:
    """One instant of a motion, and the camera.

    Attributes:
        model: Surfaces of the character.
        motion: The motion in full color.
        reference: The motion drawn as an outline.
        row: Row of both motions.
        camera: The camera.
        smooth: Pixels of the camera for one of the picture, along either axis.
        ghost: Linear RGB of the outline.
        floor: Height of the floor that takes the shadow, along `Model.up` [m]; None for no shadow.
    """

    model: Model
    motion: Motion
    reference: Motion
    row: int
    camera: Camera
    smooth: int
    ghost: tuple[float, float, float] = (0.0, 0.34, 0.17)
    floor: float | None = None


def prepare(character: Character, skins: tuple[Skin | None, ...]) -> Model:
    """Split the surfaces for shading, once for all pictures."""
    parts, colors = [], []
    for index, body in enumerate(character.bodies):
        for s, surface in enumerate(body.surfaces):
            if not surface.drawn:
                continue
            sources, triangles, normals = split_at_creases(surface.points, surface.triangles)
            modes = modes_of(skins[index], s)
            parts.append(
                (index, surface.points[sources], None if modes is None else modes[sources], normals, triangles)
            )
            colors.append(surface.color if surface.color is not None else DEFAULT_COLOR)
    corners, slopes, owners = [np.zeros((0, 3, 3))], [np.zeros((0, 3, 3))], [np.zeros(0, dtype=np.int32)]
    for surface in character.scenery:
        sources, triangles, normals = split_at_creases(surface.points, surface.triangles)
        corners.append(surface.points[sources][triangles])
        slopes.append(normals[triangles])
        owners.append(np.full(len(triangles), len(colors), dtype=np.int32))
        colors.append(surface.color if surface.color is not None else DEFAULT_COLOR)
    strength = float(np.linalg.norm(character.gravity))
    return Model(
        parts=tuple(parts),
        colors=np.array(colors, dtype=float).reshape(-1, 3),
        still=(np.concatenate(corners), np.concatenate(slopes), np.concatenate(owners)),
        up=-character.gravity / strength if strength > 0.0 else np.zeros(3),
    )


def pose(model: Model, motion: Motion, row: int) -> tuple[Array, Array, IntArray]:
    """Corners [m, 3, 3] of the bodies' triangles and their normals [m, 3, 3] in the world at one row, and the surface
    of each triangle [m]."""
    corners, normals, owners = [np.zeros((0, 3, 3))], [np.zeros((0, 3, 3))], [np.zeros(0, dtype=np.int32)]
    for number, (body, points, modes, directions, triangles) in enumerate(model.parts):
        matrix = rotation_matrices(motion.rotations[row, body])
        deformed = deformed_points(points, modes, motion.elastic[body][row : row + 1])[0]
        corners.append((deformed @ matrix.T + motion.positions[row, body])[triangles])
        normals.append((directions @ matrix.T)[triangles])
        owners.append(np.full(len(triangles), number, dtype=np.int32))
    return np.concatenate(corners), np.concatenate(normals), np.concatenate(owners)


def scene(model: Model, motion: Motion, row: int) -> tuple[Array, Array, IntArray]:
    """The same of the bodies at one row, and of the scenery after them."""
    corners, normals, owners = pose(model, motion, row)
    return (
        np.concatenate([corners, model.still[0]]),
        np.concatenate([normals, model.still[1]]),
        np.concatenate([owners, model.still[2]]),
    )


def visible_surfaces(hits: Hits, owners: IntArray) -> IntArray:
    """The visible surface of each pixel, -1 for none, from the surface of each triangle; shape [height, width]."""
    return np.asarray(np.append(owners, -1)[hits.triangle], dtype=np.int32)  # the index -1 is the last one


def fit_camera(view: Viewpoint, cloud: Array, width: int, height: int, margin: float = 0.04) -> Camera:
    """The camera from the direction of a viewpoint whose picture just contains world points of shape [n, 3]."""
    forward = -view.toward_eye
    right = np.cross(forward, view.up)
    right = right / np.linalg.norm(right)
    axes = np.stack([right, np.cross(forward, right), forward])
    eye = view.center + 5.0 * view.radius * view.toward_eye
    flat = Camera(eye, axes, 1.0, np.zeros(2), (width, height)).project(cloud)[:, :2]
    low, high = flat.min(axis=0), flat.max(axis=0)
    room = (1.0 - 2.0 * margin) * np.array([width, height])
    scale = float(np.min(room / np.maximum(high - low, 1e-9)))
    center = 0.5 * np.array([width, height]) - 0.5 * scale * (low + high)
    return Camera(eye, axes, scale, center, (width, height))


def floor_below(model: Model, motion: Motion) -> float | None:
    """Height of the lowest point of the bodies in the first row, along `Model.up` [m]; None without gravity."""
    corners = pose(model, motion, 0)[0]
    return float((corners @ model.up).min()) if len(corners) and np.any(model.up) else None


def draw(view: View) -> tuple[Light, Hits, IntArray]:
    """The motion in full color.

    Returns:
        Linear RGB of each pixel, shape [height, width, 3]; the visible triangles; and the visible surface of each
        pixel, -1 for none.
    """
    model, camera = view.model, view.camera
    corners, normals, owners = scene(model, view.motion, view.row)
    hits = rasterize(camera.project(corners), *camera.size)
    picture = np.broadcast_to(PAPER, (*hits.triangle.shape, 3)).copy()
    filled = np.flatnonzero(hits.triangle >= 0)
    triangles = hits.triangle.reshape(-1)[filled]
    # single precision throughout: this is most of the time of a video
    slopes, shares = normals.astype(np.float32)[triangles], hits.shares.reshape(-1, 2)[filled]
    normal = slopes[:, 2] + shares[:, :1] * (slopes[:, 0] - slopes[:, 2])
    normal += shares[:, 1:] * (slopes[:, 1] - slopes[:, 2])
    length = np.sqrt(np.einsum("pi,pi->p", normal, normal))
    toward = (normal @ np.stack([key_light(camera), fill_light(camera)]).T.astype(np.float32)).T
    key, fill = np.maximum(toward, 0.0) / np.maximum(length, 1e-12)
    light = 1.15 * (AMBIENT + KEY * key + FILL * fill)
    # Very dark colors are made slightly lighter; otherwise shading would be invisible.
    paint = (0.03 + 0.97 * np.clip(model.colors, 0.0, 1.0)).astype(np.float32)
    shaded = np.take(paint, owners[triangles], axis=0) * light[:, None]
    picture.reshape(-1, 3)[filled] = np.minimum(shaded, 1.0, out=shaded)
    if view.floor is not None:
        cast_shadow(picture, hits, corners, view)
    return picture, hits, visible_surfaces(hits, owners)


def key_light(camera: Camera) -> Array:
    """Unit vector to the main light: left of the eye, above and behind it."""
    right, down, forward = camera.axes
    way = -0.45 * right - 0.75 * down - 0.6 * forward
    return np.asarray(way / np.linalg.norm(way))


def fill_light(camera: Camera) -> Array:
    """Unit vector to the weak light on the other side."""
    right, down, forward = camera.axes
    way = 0.8 * right - 0.2 * down - 0.5 * forward
    return np.asarray(way / np.linalg.norm(way))


def cast_shadow(picture: Light, hits: Hits, corners: Array, view: View) -> None:
    """Darken the floor of a picture, in place, where bodies or scenery are between it and the main light."""
    from scipy.ndimage import gaussian_filter

    up, camera, floor = view.model.up, view.camera, view.floor or 0.0
    light = key_light(camera)
    slope = float(light @ up)
    if slope < 0.1 or float(camera.axes[2] @ up) > -0.02:  # a low light, or no view of the floor
        return
    height = np.maximum(corners @ up - floor, 0.0)
    above = height.max(axis=1) > 1e-3 * height.max(initial=0.0)  # what lies on the floor casts none
    corners, height = corners[above], height[above]
    flat = camera.project(corners - (height / slope)[..., None] * light)
    mask = rasterize(flat, *camera.size, both_sides=True)
    rows, columns = np.nonzero(mask.filled)
    if not len(rows):
        return
    width = max(camera.size[0] / 180.0, 1.0)
    edge = round(3.0 * width)
    part = np.s_[max(rows.min() - edge, 0) : rows.max() + edge, max(columns.min() - edge, 0) : columns.max() + edge]
    # what lies on the floor, such as a carpet, takes the shadow as well; what stands before it does not
    takes = np.logical_not(hits.filled[part]) | (hits.depth[part] > mask.depth[part] * (1.0 - 2e-3))
    soft = gaussian_filter(mask.filled[part].astype(np.float32), width, truncate=3.0)
    picture[part] *= (1.0 - SHADOW * np.where(takes, soft, 0.0))[..., None]


def draw_over_ghost(view: View) -> Pixels:
    """The motion in full color, and the intended motion where it differs: filled beside the character, and outlined."""
    picture, _, front = draw(view)
    corners, _, owners = scene(view.model, view.reference, view.row)
    hits = rasterize(view.camera.project(corners), *view.camera.size)
    ghost = visible_surfaces(hits, owners)
    return develop(lay_ghost(picture, front, ghost, len(view.model.parts), view.ghost, view.smooth), view.smooth)


def lay_ghost(
    picture: Light, front: IntArray, ghost: IntArray, bodies: int, color: tuple[float, float, float], smooth: int
) -> Light:
    """Draw another pose of the character on a picture.

    Args:
        picture: Linear RGB, shape [height, width, 3].
        front: The visible surface of each pixel, -1 for none.
        ghost: The same of the other pose.
        bodies: Surfaces of the character; those from this number on are scenery.
        color: Of the other pose, linear RGB.
        smooth: Pixels of the picture for one that will be shown.
    """
    own, ghost = np.where(front < bodies, front, -1), np.where(ghost < bodies, ghost, -1)
    beside = (ghost >= 0) & (own < 0)
    # Where both poses have the same edge, nothing differs; an edge of the ghost alone is drawn.
    edge = (ghost >= 0) & borders(ghost, smooth) & np.logical_not(grown(borders(own, 1), 2 * smooth))
    beside &= np.logical_not(grown(own >= 0, smooth)) | edge
    mixed = picture.copy()
    mixed[beside] = (1.0 - FILLED) * picture[beside] + FILLED * np.array(color)
    mixed[edge] = (1.0 - OUTLINED) * picture[edge] + OUTLINED * np.array(color)
    return mixed


def borders(surface: IntArray, width: int) -> Mask:
    """Pixels within `width` of one with another surface."""
    border = np.zeros(surface.shape, dtype=bool)
    border[1:] |= surface[1:] != surface[:-1]
    border[:, 1:] |= surface[:, 1:] != surface[:, :-1]
    return grown(border, width - 1)


def grown(mask: Mask, width: int) -> Mask:
    """The mask and all pixels within `width` of it."""
    for _ in range(width):
        wider = mask.copy()
        wider[1:] |= mask[:-1]
        wider[:-1] |= mask[1:]
        wider[:, 1:] |= mask[:, :-1]
        wider[:, :-1] |= mask[:, 1:]
        mask = wider
    return mask


def develop(picture: Light, factor: int) -> Pixels:
    """Average blocks of `factor` x `factor` pixels and encode as sRGB, 8 bits."""
    height, width = picture.shape[0] // factor, picture.shape[1] // factor
    whole = picture[: height * factor, : width * factor]
    small = sum(whole[i::factor, j::factor] for i in range(factor) for j in range(factor)) / factor**2
    encoded = np.where(small <= 0.0031308, 12.92 * small, 1.055 * np.maximum(small, 1e-9) ** (1.0 / 2.4) - 0.055)
    return np.asarray(np.round(255.0 * np.clip(encoded, 0.0, 1.0)), dtype=np.uint8)
