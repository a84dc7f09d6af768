"""Error against the intended motion as a color of the surfaces: the own color without error, vermillion at most."""

import numpy as np
from calmotion.arrays import Array
from calmotion.model import Character, Motion, Result
from calmotion.views import deviations, modes_of
from numpy.typing import NDArray

from .layout import INPUT, STYLES

SEEN = 1.0 / 64.0  # a smaller share of the whole color change is not told from none
OFF = np.array(STYLES[INPUT].color, dtype=float)


def largest_deviation(character: Character, result: Result, motion: Motion, reference: Motion) -> float:
    """By how much any visible point of a motion is off at most [m]; both at the shot's frames."""
    largest = 0.0
    for index, body in enumerate(character.bodies):
        for s, surface in enumerate(body.surfaces):
            if surface.drawn:
                modes = modes_of(result.skins[index], s)
                largest = max(largest, float(deviations(surface.points, modes, index, motion, reference).max()))
    return largest


def deviation_colors(
    color: tuple[int, int, int, int],
    points: Array,
    modes: Array | None,
    body: int,
    motion: Motion,
    reference: Motion,
    scale: float,
) -> NDArray[np.uint8] | None:
    """Colors of the points of a surface at each frame, shape [f, n, 4], or None where the deviation cannot be seen.

    Args:
        color: Color of the surface, 8 bits.
        points, modes, body, motion, reference: As for `deviations`.
        scale: Deviation that has the whole color change [m].
    """
    share = deviations(points, modes, body, motion, reference) / max(scale, 1e-12)
    if share.max(initial=0.0) < SEEN:
        return None
    base = np.array(color[:3], dtype=float)
    mixed = base + np.clip(share, 0.0, 1.0)[..., None] * (OFF - base)
    colors = np.full((*share.shape, 4), 255, dtype=np.uint8)
    colors[..., :3] = mixed.round()
    return colors
