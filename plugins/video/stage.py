"""The pictures of the character in a video: cameras, trails, and the marks of the target that is farthest off."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.model import Animation, Character, Motion, Result, Simulation
from calmotion.views import (
    Camera,
    Model,
    View,
    choose_viewpoint,
    draw_over_ghost,
    fit_camera,
    floor_below,
    moving_cloud,
    near_scenery,
    prepare,
    sample_motion,
)
from PIL import Image, ImageDraw

from .timeline import Moment, Worst

SMOOTH = 2  # factor of the rendering, which is then averaged
TRAIL_S, TRAIL_POINTS = 0.6, 48
LARGEST_ZOOM = 6.0
SHAKE = 0.18  # of a panel's shorter side: the largest error in the near view
ROWS = 40  # instants that the camera keeps in the picture
Color = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class Stage:
    """All that the pictures of a video share.

    Attributes:
        model: Surfaces of the character and its scenery.
        reference: The intended motion.
        camera: Sees the whole motion, in pixels of the rendering.
        zoom: Factor of the near view.
        target: The target of the near view, -1 for none.
        floor: Height of the floor [m], or None.
    """

    model: Model
    reference: Motion
    camera: Camera
    zoom: float
    target: int
    floor: float | None

    def camera_at(self, moment: Moment) -> Camera:
        """The camera of a moment; the near view keeps the intended place of the worst target in its middle."""
        if moment.near <= 0.0:
            return self.camera
        place = sample_motion(self.reference, np.array([moment.time])).target_positions[0, self.target]
        factor = self.zoom**moment.near
        near = 0.5 * np.array(self.camera.size)
        pixel = self.camera.project(place)[:2]
        goal = pixel + moment.near * (near - pixel)
        center = goal - factor * (pixel - self.camera.center)
        return replace(self.camera, scale=factor * self.camera.scale, center=center)


def set_stage(
    character: Character, animation: Animation, result: Result, worst: Worst, width: int, shape: tuple[float, float]
) -> Stage:
    """Choose the cameras of a video.

    Args:
        character: The character.
        animation: For the times of its frames.
        result: Of `simulate` or `optimize`.
        worst: Its worst moment.
        width: Of a panel [pixels of the video].
        shape: Smallest and largest height of a panel, as shares of its width.
    """
    model = prepare(character, result.skins)
    frames = animation.frame_times
    times = frames[np.unique(np.linspace(0, len(frames) - 1, ROWS).astype(int))]
    reference = sample_motion(result.reference, times)
    runs = [sample_motion(run.motion, times) for run in (result.before, result.after) if run is not None]
    view = choose_viewpoint(character, result.skins, runs[0])
    cloud = np.concatenate([moving_cloud(character, result.skins, motion, ROWS) for motion in (reference, *runs)])
    floor = floor_below(model, reference)
    if floor is not None:  # the shadow below the character is part of the picture
        cloud = np.concatenate([cloud, cloud - np.maximum(cloud @ model.up - floor, 0.0)[:, None] * model.up])
    cloud = np.concatenate([cloud, near_scenery(character, cloud)])
    probe = fit_camera(view, cloud, width, width, 0.0).project(cloud)[:, :2]
    aspect = float(np.clip(1.08 * np.ptp(probe[:, 1]) / max(np.ptp(probe[:, 0]), 1e-9), *shape))
    camera = fit_camera(view, cloud, SMOOTH * width, SMOOTH * round(width * aspect), 0.06)
    zoom = 1.0
    if worst.target >= 0:
        rows = result.before.motion.judged
        moved = camera.project(result.before.motion.target_positions[rows, worst.target])[:, :2]
        meant = sample_motion(result.reference, result.before.motion.times[rows]).target_positions[:, worst.target]
        largest = float(np.linalg.norm(moved - camera.project(meant)[:, :2], axis=1).max())
        zoom = float(np.clip(SHAKE * min(camera.size) / max(largest, 1e-9), 1.0, LARGEST_ZOOM))
    return Stage(model, result.reference, camera, zoom, worst.target, floor)


def draw_panel(stage: Stage, run: Simulation, moment: Moment, color: Color, ghost: Color) -> Image.Image:
    """One motion at one moment, over the intended motion, with the trails of the targets."""
    now = np.array([moment.time])
    camera = stage.camera_at(moment)
    motion, reference = sample_motion(run.motion, now), sample_motion(stage.reference, now)
    view = View(stage.model, motion, reference, 0, camera, SMOOTH, floor=stage.floor)
    picture = Image.fromarray(draw_over_ghost(view))
    marks = Image.new("RGBA", camera.size)
    draw = ImageDraw.Draw(marks)
    width = max(camera.size[0] / 260.0, 2.0)
    for motion_, tint, share in ((stage.reference, ghost, 0.6), (run.motion, color, 1.0)):
        trail = recent(motion_, moment.time)
        for k in range(trail.shape[1]):
            draw_trail(draw, camera.project(trail[:, k])[:, :2], tint, share * width)
    if moment.near > 0.0:
        ends = [camera.project(m.target_positions[0, stage.target])[:2] for m in (reference, motion)]
        draw.line([tuple(end) for end in ends], fill=(*color, 255), width=round(0.8 * width))
        for end, tint in zip(ends, (ghost, color), strict=True):
            draw_dot(draw, end, 1.9 * width, tint)
    picture.paste(marks.reduce(SMOOTH), mask=marks.reduce(SMOOTH).getchannel("A"))
    return picture


def recent(motion: Motion, time: float) -> Array:
    """Places of the targets in the last moments before a time, within the shot [m], shape [p, K, 3]."""
    times = np.linspace(max(time - TRAIL_S, 0.0), time, TRAIL_POINTS)
    return sample_motion(motion, times).target_positions


def draw_trail(draw: ImageDraw.ImageDraw, pixels: Array, color: Color, width: float) -> None:
    """A line that fades and tapers towards its beginning, with a dot at its end."""
    count = len(pixels) - 1
    for k in range(count):
        share = (k + 1) / count
        ends = [tuple(pixels[k]), tuple(pixels[k + 1])]
        tint = (*color, round(230 * share**1.5))
        thick = max(width * (0.35 + 0.65 * share), 1.0)
        draw.line(ends, fill=tint, width=round(thick))
        if thick > 3.0:
            draw_dot(draw, pixels[k + 1], 0.5 * thick - 0.5, tint)
    draw_dot(draw, pixels[-1], 1.2 * width, color)


def draw_dot(draw: ImageDraw.ImageDraw, place: Array, radius: float, color: tuple[int, ...]) -> None:
    """A filled circle."""
    x, y = place
    fill = color if len(color) == 4 else (*color, 255)
    draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=fill)
