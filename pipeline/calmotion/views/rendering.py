"""A picture of a character at one instant: camera, light, shadow, and the outline of the intended motion."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from calmotion.arrays import Array, IntArray
from calmotion.model.character import Character
from calmotion.model.result import Motion, Skin
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.views.painting import LEVELS, Light, Marks, Visible, develop, mark, outlines
from calmotion.views.playback import deformed_points, modes_of
from calmotion.views.raster import Hits, rasterize, split_at_creases
from calmotion.views.viewpoint import Viewpoint

Pixels = NDArray[np.uint8]  # sRGB, shape [height, width, 3]
DEFAULT_COLOR = (0.55, 0.55, 0.57)


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
        matrix = rotation_from_quaternion(motion.rotations[row, body])
        deformed = deformed_points(points, modes, motion.elastic[body][row : row + 1])[0]
        corners.append((deformed @ matrix.T + motion.positions[row, body])[triangles])
        normals.append((directions @ matrix.T)[triangles])
        owners.append(np.full(len(triangles), number, dtype=np.int32))
    return np.concatenate(corners), np.concatenate(normals), np.concatenate(owners)


def scene(model: Model, motion: Motion, row: int) -> tuple[Array, Array, IntArray]:
    """The same of the scenery, and of the bodies at one row after it."""
    still, bodies = model.still, pose(model, motion, row)
    return (
        np.concatenate([still[0], bodies[0]]),
        np.concatenate([still[1], bodies[1]]),
        np.concatenate([still[2], bodies[2]]),
    )


def fit_camera(view: Viewpoint, cloud: Array, width: int, height: int, margin: float = 0.04) -> Camera:
    """The camera from the direction of a viewpoint whose picture just contains world points of shape [n, 3]."""
    flat = view.picture(cloud)
    low, high = flat.min(axis=0), flat.max(axis=0)
    room = (1.0 - 2.0 * margin) * np.array([width, height])
    scale = float(np.min(room / np.maximum(high - low, 1e-9)))
    center = 0.5 * np.array([width, height]) - 0.5 * scale * (low + high)
    return Camera(view.eye, view.axes, scale, center, (width, height))


def floor_below(model: Model, motion: Motion) -> float | None:
    """Height of the lowest point of the bodies in the first row, along `Model.up` [m]; None without gravity."""
    corners = pose(model, motion, 0)[0]
    return float((corners @ model.up).min()) if len(corners) and np.any(model.up) else None


@dataclass(frozen=True, eq=False)
class Seen:
    """What a camera sees of a pose.

    Attributes:
        hits: The visible triangles.
        visible: The same with normals and surfaces of the triangles, for kernels.
        shadow: The floor in its shadow, in pixels of the picture; None for no shadow.
        still: How many of the triangles are scenery; they come first.
        picture: Of the scenery alone, where it was made for many poses; sRGB, 8 bits.
    """

    hits: Hits
    visible: Visible
    shadow: Hits | None
    still: int
    picture: Pixels | None = None

    @property
    def surface(self) -> IntArray:
        """The visible surface of each pixel, -1 for none, shape [height, width]."""
        return np.asarray(np.append(self.visible.owners, -1)[self.hits.triangle], dtype=np.int32)

    @property
    def part(self) -> IntArray:
        """First row, first column, and the ends of rows and columns in which the bodies are."""
        return _part(self.hits, self.still, 0)

    def outlines(self, count: int) -> Marks:
        """Where the character and its edges are, see `painting.outlines`; `count` is its number of surfaces."""
        found = np.zeros(self.hits.triangle.shape, dtype=np.uint8)
        outlines(self.visible, count, self.part, found)
        return found


def _part(hits: Hits, first: int, margin: int) -> IntArray:
    """First row, first column, and the ends of rows and columns of the triangles from the first on, with a margin."""
    height, width = hits.triangle.shape
    pixels = hits.corners[first:, :, :2][hits.corners[first:, :, 2].min(axis=1) > 0.0].reshape(-1, 2)
    low, high = pixels.min(axis=0, initial=np.inf) - margin, pixels.max(axis=0, initial=-np.inf) + 1.0 + margin
    ends = np.clip([low[1], low[0], high[1], high[0]], 0, [height, width, height, width])
    return np.asarray(ends, dtype=np.int32)


def with_picture(view: View, backdrop: Seen) -> Seen:
    """A backdrop with its picture, of which each pose before it changes a part."""
    width, height = (side // view.smooth for side in view.camera.size)
    shown, marks = np.empty((height, width, 3), np.uint8), np.zeros(backdrop.hits.triangle.shape, np.uint8)
    whole = np.array([0, 0, height, width], dtype=np.int32)
    marks = marks[: height * view.smooth, : width * view.smooth]
    develop(backdrop.visible, light_of(view, backdrop.shadow), marks, whole, shown)
    return replace(backdrop, picture=shown)


def see(view: View, motion: Motion | None, backdrop: Seen | None = None, shadow: bool = True) -> Seen:
    """What a camera sees.

    Args:
        view: For the model, the camera and the floor.
        motion: The pose at the row of the view; None: the scenery alone.
        backdrop: The scenery, where it was drawn before.
        shadow: Whether the floor gets a shadow.
    """
    model, camera = view.model, view.camera
    corners, normals, owners = model.still if motion is None else scene(model, motion, view.row)
    before = (backdrop.hits, backdrop.shadow) if backdrop else (None, None)
    hits = rasterize(camera.project(corners), *camera.size, before=before[0])
    flat = np.all(normals[:, 0] == normals[:, 1], axis=1) & np.all(normals[:, 0] == normals[:, 2], axis=1)
    visible = Visible(hits.triangle, hits.nearness, hits.corners, normals, owners, flat)
    return Seen(hits, visible, _shadow(view, corners, before[1]) if shadow else None, len(model.still[0]))


def draw_over_ghost(view: View, backdrop: Seen | None = None, ghost: tuple[Seen, Marks] | None = None) -> Pixels:
    """The motion in full color, and the intended motion where it differs: filled beside the character, and outlined.

    Args:
        view: What is seen.
        backdrop: The scenery, where it was drawn before.
        ghost: The intended motion, where it was drawn before.

    Returns:
        sRGB of each pixel, 8 bits, shape [height, width, 3].
    """
    smooth, backdrop = view.smooth, backdrop or see(view, None)
    (other, edges), seen = ghost or ghost_of(view, backdrop), see(view, view.motion, backdrop)
    width, height = (side // smooth for side in view.camera.size)
    marks = np.zeros(edges.shape, dtype=np.uint8)
    mark(seen.outlines(len(view.model.parts)), edges, smooth, other.part, marks)
    part, shown = np.array([0, 0, height, width], dtype=np.int32), backdrop.picture
    if shown is None:
        shown = np.empty((height, width, 3), dtype=np.uint8)
    else:
        shown, parts = shown.copy(), [seen.part // smooth, (other.part + smooth - 1) // smooth]
        parts[0][2:] += 1
        parts += [_part(seen.shadow, seen.still, round(3.0 * _blur(view)) + 2)] if seen.shadow is not None else []
        ends = np.array(parts)
        part = np.concatenate([ends[:, :2].min(axis=0), np.minimum(ends[:, 2:].max(axis=0), [height, width])])
    develop(seen.visible, light_of(view, seen.shadow), marks[: height * smooth, : width * smooth], part, shown)
    return shown


def _blur(view: View) -> float:
    """Standard deviation of the edge of shadows [pixels of the picture]."""
    return max(view.camera.size[0] / 180.0, 1.0) / view.smooth


def ghost_of(view: View, backdrop: Seen) -> tuple[Seen, Marks]:
    """The intended motion of a view before the scenery, and where it and its edges are."""
    seen = see(view, view.reference, backdrop, shadow=False)
    return seen, seen.outlines(len(view.model.parts))


def light_of(view: View, shadow: Hits | None) -> Light:
    """How the surfaces of a view look.

    Args:
        view: For the colors, and the camera, by which the lights stand.
        shadow: The floor in the shadow, in pixels of the picture.
    """
    soft, near = np.zeros((0, 0), dtype=np.float32), np.zeros((0, 0), dtype=np.float32)
    if shadow is not None and shadow.filled.any():
        rows, columns = (np.flatnonzero(shadow.filled.any(axis=axis)) for axis in (1, 0))
        blur = _blur(view)
        edge = round(3.0 * blur) + 1
        part = np.s_[max(rows[0] - edge, 0) : rows[-1] + edge + 1, max(columns[0] - edge, 0) : columns[-1] + edge + 1]
        soft, near = np.zeros(shadow.triangle.shape, dtype=np.float32), shadow.nearness
        gaussian_filter(shadow.filled[part].astype(np.float32), blur, truncate=3.0, output=soft[part])
    # Very dark colors are made slightly lighter; otherwise shading would be invisible.
    colors = 0.03 + 0.97 * np.clip(view.model.colors, 0.0, 1.0)
    ways = np.stack([key_light(view.camera), fill_light(view.camera)])
    return Light(colors, ways, soft, near, np.array(view.ghost), _srgb())


@cache
def _srgb() -> Pixels:
    """sRGB, 8 bits, of levels of linear light."""
    level = np.linspace(0.0, 1.0, LEVELS)
    encoded = np.where(level <= 0.0031308, 12.92 * level, 1.055 * np.maximum(level, 1e-9) ** (1.0 / 2.4) - 0.055)
    return np.asarray(np.round(255.0 * encoded), dtype=np.uint8)


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


def _shadow(view: View, corners: Array, before: Hits | None) -> Hits | None:
    """The floor in the shadow of world triangles [m], shape [m, 3, 3], in pixels of the picture; None for no shadow.

    Args:
        before: That of the first triangles, where it is there already.
    """
    if view.floor is None:
        return None
    up, camera = view.model.up, view.camera
    light = key_light(camera)
    slope = float(light @ up)
    if slope < 0.1 or float(camera.axes[2] @ up) > -0.02:  # a low light, or no view of the floor
        return None
    width, height = (side // view.smooth for side in camera.size)
    camera = replace(camera, scale=camera.scale / view.smooth, center=camera.center / view.smooth, size=(width, height))
    still = 0 if before is None else len(before.corners)
    own = corners[still:]
    above = np.maximum(own @ up - view.floor, 0.0)
    flat = camera.project(own - (above / slope)[..., None] * light)
    flat[above.max(axis=1) <= 1e-3 * above.max(initial=0.0)] = 0.0  # what lies on the floor casts none
    if before is not None:
        flat = np.concatenate([before.corners, flat])
    return rasterize(flat, width, height, both_sides=True, before=before)
