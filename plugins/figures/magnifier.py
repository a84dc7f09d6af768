"""Enlarged surroundings of a target in a corner of its panel; vibration is small compared to a character."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from calmotion.geometry.tetrahedra import Indices
from calmotion.shot import Motion
from calmotion.shot.character import Array
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from .scene import Camera, Pixels, View, draw_over_ghost
from .style import INTENDED

LARGEST = 4.0  # largest factor
SMALLEST = 1.5  # smallest useful factor
INSET = 0.36  # of the shorter side of a panel
DISTANCE = 0.40  # of the inset: largest distance of the target from its center


@dataclass(frozen=True)
class Magnifier:
    """The factor of enlargement."""

    factor: float

    @property
    def useful(self) -> bool:
        """Whether it shows more detail than the panel."""
        return self.factor >= SMALLEST


def inset_side(camera: Camera) -> int:
    """Side of the inset [pixels of the camera]."""
    return round(INSET * min(camera.size))


def choose_magnifier(reference: Motion, motions: list[Motion], targets: Indices, camera: Camera) -> Magnifier:
    """The largest factor (a multiple of one half) at which the target of each row is inside the inset."""
    if not len(targets):
        return Magnifier(0.0)
    rows = np.arange(len(targets))
    intended = camera.project(reference.target_positions[rows, targets])[:, :2]
    offsets = [camera.project(m.target_positions[rows, targets])[:, :2] - intended for m in motions]
    fits = DISTANCE * inset_side(camera) / max(float(np.linalg.norm(offsets, axis=-1).max()), 1e-9)
    return Magnifier(float(np.floor(2.0 * min(fits, LARGEST)) / 2.0))


def draw_magnifier(axes: Axes, magnifier: Magnifier, view: View, target: int, color: str, drawn: Pixels) -> None:
    """Draw the inset in the emptiest corner of a panel.

    Args:
        axes: The panel, in pixels of the camera.
        magnifier: The factor.
        view: Of the panel.
        target: Index of the target whose surroundings are enlarged.
        color: Of the frame and of the point of the target.
        drawn: The picture of the panel.
    """
    camera, row = view.camera, view.row
    side = inset_side(camera)
    place = camera.project(view.reference.target_positions[row, target])[:2]
    shift = 0.5 * side - magnifier.factor * (place - camera.center)
    enlarged = Camera(camera.eye, camera.axes, magnifier.factor * camera.scale, shift, (side, side))
    picture = draw_over_ghost(replace(view, camera=enlarged))
    left, top = emptiest_corner(drawn, side // view.smooth, place / view.smooth) * view.smooth
    axes.imshow(picture, extent=(left, left + side, top + side, top), interpolation="antialiased", zorder=3)
    frame = Rectangle((left, top), side, side, fill=False, edgecolor=color, linewidth=1.0, zorder=4, clip_on=False)
    axes.add_patch(frame)
    for motion, tint in ((view.reference, INTENDED), (view.motion, color)):
        spot = enlarged.project(motion.target_positions[row, target])[:2]
        axes.plot(left + spot[0], top + spot[1], "o", color=tint, markersize=3.0, zorder=5)


def emptiest_corner(drawn: Pixels, side: int, keep: Array) -> Array:
    """Left and top of a square of `side` pixels in a corner of a picture: not over `keep`, with the least ink."""
    height, width = drawn.shape[:2]
    ink = np.any(drawn < 255, axis=2)
    corners = [(left, top) for top in (height - side, 0) for left in (0, width - side)]

    def cost(corner: tuple[int, int]) -> float:
        left, top = corner
        covers = left <= keep[0] <= left + side and top <= keep[1] <= top + side
        return float(ink[top : top + side, left : left + side].sum()) + (1e9 if covers else 0.0)

    return np.array(min(corners, key=cost))
