"""Enlarged surroundings of a target in a corner of its panel; vibration is small compared to a character."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array, Indices
from calmotion.model import Motion
from calmotion.views import INTENDED, Camera, Mask, View, draw_over_ghost, pose, rasterize
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

LARGEST = 4.0  # largest factor
SMALLEST = 1.5  # smallest useful factor
INSET = 0.36  # of the shorter side of a panel
PLACES = 13  # of an inset along each side of a panel
TITLE = 0.04  # of the height: distance of an inset from the title above
EDGE = 6.0  # between a line and an inset [pixels of the camera]
LINE = 2.0  # cost of a covered point of a line, in rows of covered pixels
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


def draw_magnifier(
    axes: Axes, magnifier: Magnifier, view: View, target: int, color: str, trails: Sequence[Array]
) -> None:
    """Draw the inset where a panel is emptiest.

    Args:
        axes: The panel, in pixels of the camera.
        magnifier: The factor.
        view: Of the panel.
        target: Index of the target whose surroundings are enlarged.
        color: Of the frame and of the point of the target.
        trails: Pixels of the lines that the inset must not cover, shape [n, 2] each.
    """
    camera, row = view.camera, view.row
    side = inset_side(camera)
    place = camera.project(view.reference.target_positions[row, target])[:2]
    shift = 0.5 * side - magnifier.factor * (place - camera.center)
    enlarged = Camera(camera.eye, camera.axes, magnifier.factor * camera.scale, shift, (side, side))
    picture = draw_over_ghost(replace(view, camera=enlarged))
    left, top = emptiest_place(occupied(view), side, [place[None], *trails])
    axes.imshow(picture, extent=(left, left + side, top + side, top), interpolation="antialiased", zorder=3)
    frame = Rectangle((left, top), side, side, fill=False, edgecolor=color, linewidth=1.0, zorder=4, clip_on=False)
    axes.add_patch(frame)
    for motion, tint in ((view.reference, INTENDED), (view.motion, color)):
        spot = enlarged.project(motion.target_positions[row, target])[:2]
        axes.plot(left + spot[0], top + spot[1], "o", color=tint, markersize=3.0, zorder=5)


def occupied(view: View) -> Mask:
    """Pixels of the camera that the character or its intended pose covers, shape [height, width]."""
    motions = (view.motion, view.reference)
    filled = [
        rasterize(view.camera.project(pose(view.model, motion, view.row)[0]), *view.camera.size).filled
        for motion in motions
    ]
    return np.asarray(filled[0] | filled[1])


def emptiest_place(covered: Mask, side: int, lines: Sequence[Array]) -> tuple[int, int]:
    """Left and top of a square of `side` pixels that covers no line if it can, and the least of the character.

    Args:
        covered: Where the character is, shape [height, width].
        side: [pixels].
        lines: Pixels of lines, shape [n, 2] each.
    """
    height, width = covered.shape
    sums = np.zeros((height + 1, width + 1))
    sums[1:, 1:] = covered.cumsum(axis=0).cumsum(axis=1)
    points = np.concatenate([line.reshape(-1, 2) for line in lines])
    below = round(TITLE * height)
    lefts = np.unique(np.linspace(0, max(width - side, 0), PLACES).astype(int))
    tops = np.unique(np.linspace(min(below, max(height - side, 0)), max(height - side, 0), PLACES).astype(int))

    def cost(place: tuple[int, int]) -> float:
        left, top = place
        right, bottom = min(left + side, width), min(top + side, height)
        ink = sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]
        inside = np.all((points > [left - EDGE, top - EDGE]) & (points < [right + EDGE, bottom + EDGE]), axis=1)
        corner = min(left, width - right) / width + min(top, height - bottom) / height
        return float(ink + LINE * inside.sum() * side + 0.02 * side * side * corner)

    return min(((int(left), int(top)) for top in tops[::-1] for left in lefts[::-1]), key=cost)
