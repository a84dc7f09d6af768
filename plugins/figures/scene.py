"""A picture of a character at one instant: camera, light, and the silhouette of the intended motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from calmotion.shot import Character, Motion, Skin
from calmotion.shot.character import Array, IntArray
from calmotion.views.playback import deformed_points, modes_of, rotation_matrices
from calmotion.views.shading import split_at_creases
from calmotion.views.viewpoint import Viewpoint
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from .raster import Hits, rasterize
from .style import INTENDED

Pixels = NDArray[np.uint8]  # sRGB, shape [height, width, 3]

PAPER = np.array([1.0, 1.0, 1.0])
DEFAULT_COLOR = (0.55, 0.55, 0.57)
AMBIENT, KEY, FILL = 0.34, 0.62, 0.16


@dataclass(frozen=True, eq=False)
class Model:
    """The visible surfaces of a character, prepared for drawing.

    Attributes:
        parts: For each surface: body index, points [n, 3], modes [n, 3, r] or None, normals [n, 3], triangles.
        colors: Linear RGB of each surface, shape [s, 3].
    """

    parts: tuple[tuple[int, Array, Array | None, Array, IntArray], ...]
    colors: Array


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
        """Pixel x, pixel y and distance of world points, [..., 3] to [..., 3]."""
        local = (points - self.eye) @ self.axes.T
        return np.concatenate([self.center + self.scale * local[..., :2] / local[..., 2:], local[..., 2:]], axis=-1)


@dataclass(frozen=True, eq=False)
class View:
    """One instant of a motion, and the camera.

    Attributes:
        model: Surfaces of the character.
        motion: The motion in full color.
        reference: The motion drawn as a silhouette.
        row: Row of both motions.
        camera: The camera.
        smooth: Pixels of the camera for one of the picture, along either axis.
    """

    model: Model
    motion: Motion
    reference: Motion
    row: int
    camera: Camera
    smooth: int


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
    return Model(tuple(parts), np.array(colors, dtype=float).reshape(-1, 3))


def pose(model: Model, motion: Motion, row: int) -> tuple[Array, Array, IntArray]:
    """Corners [m, 3, 3] and their normals [m, 3, 3] in the world at one row, and the surface of each triangle [m]."""
    corners, normals, owners = [np.zeros((0, 3, 3))], [np.zeros((0, 3, 3))], [np.zeros(0, dtype=np.int32)]
    for number, (body, points, modes, directions, triangles) in enumerate(model.parts):
        matrix = rotation_matrices(motion.rotations[row, body])
        deformed = deformed_points(points, modes, motion.elastic[body][row : row + 1])[0]
        corners.append((deformed @ matrix.T + motion.positions[row, body])[triangles])
        normals.append((directions @ matrix.T)[triangles])
        owners.append(np.full(len(triangles), number, dtype=np.int32))
    return np.concatenate(corners), np.concatenate(normals), np.concatenate(owners)


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


def draw(model: Model, motion: Motion, row: int, camera: Camera) -> tuple[Array, Hits]:
    """Color of each pixel in linear RGB, shape [height, width, 3], and the visible triangles."""
    corners, normals, owners = pose(model, motion, row)
    hits = rasterize(camera.project(corners), *camera.size)
    picture = np.broadcast_to(PAPER, (*hits.triangle.shape, 3)).copy()
    rows, columns = np.nonzero(hits.triangle >= 0)
    triangles = hits.triangle[rows, columns]
    normal = np.einsum("pk,pki->pi", hits.shares[rows, columns], normals[triangles])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    right, down, forward = camera.axes
    key = -0.45 * right - 0.75 * down - 0.6 * forward
    fill = 0.8 * right - 0.2 * down - 0.5 * forward
    light = AMBIENT + KEY * np.maximum(normal @ (key / np.linalg.norm(key)), 0.0)
    light += FILL * np.maximum(normal @ (fill / np.linalg.norm(fill)), 0.0)
    # Very dark colors are made slightly lighter; otherwise shading would be invisible.
    paint = 0.03 + 0.97 * np.clip(model.colors[owners[triangles]], 0.0, 1.0)
    picture[rows, columns] = np.clip(paint * light[:, None] * 1.15, 0.0, 1.0)
    return picture, hits


def draw_over_ghost(view: View) -> Pixels:
    """The motion in full color over the silhouette of the reference."""
    picture, front = draw(view.model, view.motion, view.row, view.camera)
    ghost = rasterize(view.camera.project(pose(view.model, view.reference, view.row)[0]), *view.camera.size)
    red, green, blue = (channel**2.2 for channel in to_rgb(INTENDED))
    return develop(lay_ghost(picture, front, ghost, (red, green, blue), 0.35), view.smooth)


def lay_ghost(picture: Array, front: Hits, ghost: Hits, color: tuple[float, float, float], strength: float) -> Array:
    """Draw the silhouette of another pose on a picture: filled beside the character, as an outline behind it."""
    there = ghost.triangle >= 0
    free = there & (front.triangle < 0)
    mixed = picture.copy()
    mixed[free] = (1.0 - strength) * picture[free] + strength * np.array(color)
    edge = there & np.logical_not(shrink(there))
    mixed[edge] = 0.25 * picture[edge] + 0.75 * np.array(color)
    return mixed


def shrink(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The mask without its outermost two pixels."""
    for _ in range(2):
        inner = mask.copy()
        inner[1:] &= mask[:-1]
        inner[:-1] &= mask[1:]
        inner[:, 1:] &= mask[:, :-1]
        inner[:, :-1] &= mask[:, 1:]
        mask = inner
    return mask


def develop(picture: Array, factor: int) -> Pixels:
    """Average blocks of `factor` x `factor` pixels and encode as sRGB, 8 bits."""
    height, width = picture.shape[0] // factor, picture.shape[1] // factor
    small = picture[: height * factor, : width * factor].reshape(height, factor, width, factor, 3).mean(axis=(1, 3))
    encoded = np.where(small <= 0.0031308, 12.92 * small, 1.055 * np.maximum(small, 1e-9) ** (1.0 / 2.4) - 0.055)
    return np.asarray(np.round(255.0 * np.clip(encoded, 0.0, 1.0)), dtype=np.uint8)
