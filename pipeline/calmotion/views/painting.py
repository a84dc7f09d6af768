"""Kernels that make a picture of the visible triangles: light, shadow, the marks of another pose, and its pixels."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.support.compilation import kernel
from calmotion.views.raster import barycentric

AMBIENT, KEY, FILL = 0.34, 0.62, 0.16
BRIGHTNESS = 1.15
SHADOW = 0.30  # of the light that the floor loses in the shadow
FILLED, OUTLINED = 0.35, 0.80  # strength of another pose's color beside the character, and of its outline
NOTHING, INSIDE, OUTLINE = 0, 1, 2  # marks of another pose
BODY, EDGE = 1, 2  # what a pose has in a pixel
LEVELS = 4096  # of linear light, for which sRGB is in a table

Marks = NDArray[np.uint8]


class Visible(NamedTuple):
    """What is seen in each pixel, shape [height, width], and its triangles.

    Attributes:
        triangle: Index of the triangle, -1 for none.
        nearness: One over its distance, 0 for none.
        corners: Pixels and distances of the corners, shape [m, 3, 3].
        normals: At the corners, in the world, shape [m, 3, 3].
        owners: Surface of each triangle, shape [m].
        flat: Whether its normals are equal, shape [m].
    """

    triangle: IntArray
    nearness: NDArray[np.float32]
    corners: Array
    normals: Array
    owners: IntArray
    flat: BoolArray


class Light(NamedTuple):
    """How surfaces look.

    Attributes:
        colors: Linear RGB of each surface, shape [s, 3].
        ways: Unit vectors to the main and to the weak light, shape [2, 3].
        soft: How much of each shown pixel lies in a shadow, shape [h, w]; empty without shadows.
        shadow: One over the distance of the floor in the shadow, 0 for none, shape [h, w].
        other: Color of another pose, linear RGB, shape [3].
        levels: sRGB of `LEVELS` levels of linear light from 0 to 1.
    """

    colors: Array
    ways: Array
    soft: NDArray[np.float32]
    shadow: NDArray[np.float32]
    other: Array
    levels: Marks


@kernel
def outlines(seen: Visible, count: int, part: IntArray, found: Marks) -> None:
    """Where the character is, and where another surface of it, or none, is above or left of a pixel.

    Args:
        count: Surfaces of the character; those from this number on are scenery.
        part: First row, first column, and the ends of rows and columns that are looked at.
        found: The sum of `BODY` and `EDGE`, where each holds.
    """
    for row in range(part[0], part[2]):
        left = -1
        for column in range(part[1], part[3]):
            t = seen.triangle[row, column]
            here = seen.owners[t] if t >= 0 and seen.owners[t] < count else -1
            t = seen.triangle[row - 1, column] if row > 0 else seen.triangle[row, column]
            above = seen.owners[t] if t >= 0 and seen.owners[t] < count else -1
            edge = here != above or (here != left and column > part[1])
            found[row, column] = (BODY if here >= 0 else 0) + (EDGE if edge else 0)
            left = here


@kernel
def mark(own: Marks, other: Marks, width: int, part: IntArray, marks: Marks) -> None:
    """Mark another pose of the character where it differs: what it fills beside the character, and its outline.

    Where both poses have the same edge, nothing differs; an edge of the other pose alone is an outline.

    Args:
        own, other: As of `outlines`: the pose that is shown, and the other.
        width: Of the outline [pixels].
        part: Where the other pose is: first row, first column, and the ends of rows and columns.
        marks: One of the constants of this module for each pixel; those outside of the part stay.
    """
    for row in range(part[0], part[2]):
        for column in range(part[1], part[3]):
            if other[row, column] & BODY == 0:
                continue
            outline = _is_near(other, EDGE, row, column, width - 1)
            outline = outline and not _is_near(own, EDGE, row, column, 2 * width)
            if outline:
                marks[row, column] = OUTLINE
            elif own[row, column] & BODY == 0 and not _is_near(own, BODY, row, column, width):
                marks[row, column] = INSIDE


@kernel
def _is_near(found: Marks, what: int, row: int, column: int, far: int) -> bool:
    """Whether there is something in a pixel within `far` steps."""
    for i in range(max(row - far, 0), min(row + far, found.shape[0] - 1) + 1):
        across = far - abs(i - row)
        for j in range(max(column - across, 0), min(column + across, found.shape[1] - 1) + 1):
            if found[i, j] & what != 0:
                return True
    return False


@kernel
def develop(seen: Visible, light: Light, marks: Marks, part: IntArray, shown: Marks) -> None:
    """Light the visible triangles, average blocks of pixels, and encode them as sRGB.

    Args:
        seen: What is seen, in pixels of which blocks are one of the picture.
        light: How it looks.
        marks: As of `mark`, shape of the pixels of `seen`.
        part: First row, first column, and the ends of rows and columns of the picture that are made.
        shown: sRGB, 8 bits, shape [h, w, 3].
    """
    factor = marks.shape[0] // shown.shape[0]
    for row in range(part[0], part[2]):
        run, brightness = -1, 0.0  # a triangle that goes on, whose light changes little from pixel to pixel
        for column in range(part[1], part[3]):
            top, left = factor * row, factor * column
            soft = float(light.soft[row, column]) if light.soft.shape[0] > 0 else 0.0
            t, even = seen.triangle[top, left], True
            for i in range(top, top + factor):
                for j in range(left, left + factor):
                    even = even and seen.triangle[i, j] == t and marks[i, j] == marks[top, left]
            if even and t < 0 and soft <= 0.0 and marks[top, left] == NOTHING:
                shown[row, column, 0] = shown[row, column, 1] = shown[row, column, 2] = 255
                continue
            samples = 1 if even else factor
            red = green = blue = 0.0
            for i in range(top, top + samples):
                for j in range(left, left + samples):
                    t = seen.triangle[i, j]
                    r = g = b = 1.0
                    if t >= 0:
                        if t != run or not seen.flat[t]:
                            run, brightness = t, _brightness(seen, light.ways, t, i, j)
                        color = seen.owners[t]
                        r = min(light.colors[color, 0] * brightness, 1.0)
                        g = min(light.colors[color, 1] * brightness, 1.0)
                        b = min(light.colors[color, 2] * brightness, 1.0)
                    # what lies on the floor, such as a carpet, takes the shadow as well; what stands before it does not
                    if soft > 0.0 and (t < 0 or seen.nearness[i, j] * (1.0 - 2e-3) < light.shadow[row, column]):
                        r, g, b = (1.0 - SHADOW * soft) * r, (1.0 - SHADOW * soft) * g, (1.0 - SHADOW * soft) * b
                    if marks[i, j] != NOTHING:
                        strength = FILLED if marks[i, j] == INSIDE else OUTLINED
                        r += strength * (light.other[0] - r)
                        g += strength * (light.other[1] - g)
                        b += strength * (light.other[2] - b)
                    red, green, blue = red + r, green + g, blue + b
            scale = (LEVELS - 1) / (samples * samples)
            shown[row, column, 0] = light.levels[int(scale * red + 0.5)]
            shown[row, column, 1] = light.levels[int(scale * green + 0.5)]
            shown[row, column, 2] = light.levels[int(scale * blue + 0.5)]


@kernel
def _brightness(seen: Visible, ways: Array, t: int, row: int, column: int) -> float:
    """How bright a triangle is in a pixel."""
    a, b = barycentric(seen.corners[t], column + 0.5, row + 0.5)
    c, normals = 1.0 - a - b, seen.normals[t]
    x = a * normals[0, 0] + b * normals[1, 0] + c * normals[2, 0]
    y = a * normals[0, 1] + b * normals[1, 1] + c * normals[2, 1]
    z = a * normals[0, 2] + b * normals[1, 2] + c * normals[2, 2]
    scale = 1.0 / max(np.sqrt(x * x + y * y + z * z), 1e-12)
    key = max(x * ways[0, 0] + y * ways[0, 1] + z * ways[0, 2], 0.0) * scale
    weak = max(x * ways[1, 0] + y * ways[1, 1] + z * ways[1, 2], 0.0) * scale
    return float(BRIGHTNESS * (AMBIENT + KEY * key + FILL * weak))
