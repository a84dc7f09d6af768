"""The pictures of the character in a video: cameras, trails, and the marks of the target that is farthest off."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from calmotion.arrays import Array
from calmotion.model import Animation, Character, Motion, Result, Simulation
from calmotion.views import (
    Camera,
    Model,
    Seen,
    View,
    choose_viewpoint,
    draw_over_ghost,
    fit_camera,
    floor_below,
    framed,
    ghost_of,
    prepare,
    sample_motion,
    see,
    with_picture,
)
from PIL import Image, ImageDraw

from .timeline import Moment, Worst

SMOOTH = 2  # factor of the rendering, which is then averaged
TRAIL_S, TRAIL_POINTS = 0.6, 48
LARGEST_ZOOM = 6.0
SHAKE = 0.18  # of a panel's shorter side: the largest error in the near view
ROWS = 120  # instants that the camera keeps in the picture
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

    @cached_property
    def wide(self) -> Seen:
        """The scenery as the camera of the whole motion sees it."""
        nothing = sample_motion(self.reference, np.zeros(1))
        view = View(self.model, nothing, nothing, 0, self.camera, SMOOTH, floor=self.floor)
        return with_picture(view, see(view, None))

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
    cloud = framed(view, character, result.skins, (reference, *runs))
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
    return Stage(model, result.reference, camera, zoom, worst.target, floor_below(model, reference))


def draw_panels(
    stage: Stage, runs: Sequence[tuple[Simulation, Color]], moment: Moment, ghost: Color
) -> list[Image.Image]:
    """Motions at one moment, each over the intended motion, with the trails of the targets."""
    now = np.array([moment.time])
    camera, reference = stage.camera_at(moment), sample_motion(stage.reference, now)
    first = View(stage.model, reference, reference, 0, camera, SMOOTH, floor=stage.floor)
    backdrop = stage.wide if camera is stage.camera else see(first, None)
    intended = ghost_of(first, backdrop)
    pictures = []
    for run, color in runs:
        motion = sample_motion(run.motion, now)
        picture = Image.fromarray(draw_over_ghost(replace(first, motion=motion), backdrop, intended))
        draw_marks(picture, stage, run, moment, (reference, motion), camera, (ghost, color))
        pictures.append(picture)
    return pictures


def draw_marks(
    picture: Image.Image, stage: Stage, run: Simulation, moment: Moment, poses: Sequence[Motion], camera: Camera,
    colors: tuple[Color, Color],
) -> None:  # fmt: skip
    """Draw the trails of the targets, and in a near view the target's places, the intended motion's below.

    Args:
        picture: To draw on, in place.
        stage: For the target of the near view.
        run: The motion that is shown.
        moment: Of the picture.
        poses: The intended motion and that of the run at this moment.
        camera: Of the moment.
        colors: Of both.
    """
    width = max(camera.size[0] / 260.0, 2.0)
    trails = [camera.project(recent(motion, moment.time))[..., :2] for motion in (stage.reference, run.motion)]
    points = np.concatenate([trail.reshape(-1, 2) for trail in trails])
    # only the part of the picture that is drawn on, from a pixel of the picture on
    low = SMOOTH * np.floor(np.clip((points.min(axis=0, initial=0.0) - 3.0 * width) / SMOOTH, 0, None)).astype(int)
    high = np.minimum(np.ceil(points.max(axis=0, initial=0.0) + 3.0 * width), camera.size).astype(int)
    if np.any(high <= low):
        return
    marks = Image.new("RGBA", tuple((high - low).tolist()))
    draw = ImageDraw.Draw(marks)
    for trail, tint, share in zip(trails, colors, (0.6, 1.0), strict=True):
        for k in range(trail.shape[1]):
            draw_trail(draw, trail[:, k] - low, tint, share * width)
    if moment.near > 0.0:
        ends = [camera.project(pose.target_positions[0, stage.target])[:2] - low for pose in poses]
        draw.line([tuple(end) for end in ends], fill=(*colors[1], 255), width=round(0.8 * width))
        for end, tint in zip(ends, colors, strict=True):
            draw_dot(draw, end, 1.9 * width, tint)
    small = marks.reduce(SMOOTH)
    picture.paste(small, tuple((low // SMOOTH).tolist()), small)


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
