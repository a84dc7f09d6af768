"""The surroundings of a target, enlarged in a corner of its panel, since a shake is small beside a character."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from calmotion.shot import Motion
from calmotion.shot.character import Array
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from .scene import Camera, Model, draw_over_ghost
from .style import INTENDED

LARGEST = 4.0
SMALLEST = 1.5
INSET = 0.36  # of the shorter side of a panel
REACH = 0.40  # of the inset: how far from its middle the target may stray


@dataclass(frozen=True)
class Magnifier:
    """How much is enlarged."""

    factor: float

    @property
    def useful(self) -> bool:
        """Whether it shows more than the panel does."""
        return self.factor >= SMALLEST


def inset_side(camera: Camera) -> int:
    """Side of the inset [pixels of the camera]."""
    return round(INSET * min(camera.size))


def choose_magnifier(reference: Motion, motions: list[Motion], targets: Array, camera: Camera) -> Magnifier:
    """The enlargement (a multiple of one half) at which a target for each row of the motions stays in sight."""
    if not len(targets):
        return Magnifier(0.0)
    rows = np.arange(len(targets))
    meant = camera.project(reference.target_positions[rows, targets])[:, :2]
    strays = [camera.project(m.target_positions[rows, targets])[:, :2] - meant for m in motions]
    fits = REACH * inset_side(camera) / max(float(np.linalg.norm(strays, axis=-1).max()), 1e-9)
    return Magnifier(float(np.floor(2.0 * min(fits, LARGEST)) / 2.0))


def draw_magnifier(
    axes: Axes,
    magnifier: Magnifier,
    model: Model,
    motion: Motion,
    reference: Motion,
    row: int,
    target: int,
    camera: Camera,
    color: str,
    drawn: Array,
    smooth: int,
) -> None:
    """Draw it in the emptiest corner of a panel.

    Args:
        axes: The panel, in pixels of the camera.
        magnifier: How much is enlarged.
        model, motion, reference, row: What is drawn in the panel.
        target: Whose surroundings.
        camera: The panel's camera.
        color: Of the frame and of the target's place.
        drawn: The panel's picture, `smooth` times smaller than the camera's.
        smooth: Pixels of the camera for one of the picture.
    """
    side = inset_side(camera)
    place = camera.project(reference.target_positions[row, target])[:2]
    shift = 0.5 * side - magnifier.factor * (place - camera.center)
    enlarged = Camera(camera.eye, camera.axes, magnifier.factor * camera.scale, shift, (side, side))
    picture = draw_over_ghost(model, motion, reference, row, enlarged, smooth)
    left, top = emptiest_corner(drawn, side // smooth, place / smooth) * smooth
    axes.imshow(picture, extent=(left, left + side, top + side, top), interpolation="antialiased", zorder=3)
    frame = Rectangle((left, top), side, side, fill=False, edgecolor=color, linewidth=1.0, zorder=4, clip_on=False)
    axes.add_patch(frame)
    for moved, tint in ((reference, INTENDED), (motion, color)):
        spot = enlarged.project(moved.target_positions[row, target])[:2]
        axes.plot(left + spot[0], top + spot[1], "o", color=tint, markersize=3.0, zorder=5)


def emptiest_corner(drawn: Array, side: int, keep: Array) -> Array:
    """Left and top of a square of `side` pixels in a corner of a picture: never over `keep`, else over least ink."""
    height, width = drawn.shape[:2]
    ink = np.any(drawn < 255, axis=2)
    corners = [(left, top) for top in (height - side, 0) for left in (0, width - side)]

    def cost(corner: tuple[int, int]) -> float:
        left, top = corner
        covers = left <= keep[0] <= left + side and top <= keep[1] <= top + side
        return float(ink[top : top + side, left : left + side].sum()) + (1e9 if covers else 0.0)

    return np.array(min(corners, key=cost))
