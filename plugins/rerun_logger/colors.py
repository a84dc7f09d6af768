"""Colors of a recording: curves that can be read on the dark and on the light theme, and lines that fade."""

import colorsys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array

Color = tuple[int, int, int]

BACKGROUND: Color = (236, 238, 241)  # of the 3D views, on every theme
# Between these a color has a contrast of 3 or more both with white and with the dark theme's background.
DARKEST, BRIGHTEST = 0.13, 0.29  # relative luminance
PALE = 0.45  # share of the full color at the end of a line that fades
SPREAD = 40.0 / 360.0  # of the hues of several curves


@dataclass(frozen=True)
class Style:
    """Color (8 bits, safe for color-blind viewers: Okabe and Ito), line width in points, and name of a motion."""

    color: Color
    width: float
    label: str

    def shade(self, index: int, count: int, spread: float = SPREAD) -> Color:
        """A relative of the color, one of several curves: another hue within the `spread`, dark and bright in turn."""
        if count < 2:
            return self.color
        hue, _, strength = colorsys.rgb_to_hls(*(c / 255.0 for c in self.color))
        hue += spread * (index / (count - 1) - 0.5)
        wanted = (DARKEST, BRIGHTEST)[index % 2]
        low, high = 0.0, 1.0
        for _ in range(20):  # luminance grows with lightness
            middle = 0.5 * (low + high)
            low, high = (middle, high) if luminance(_rgb(hue, middle, strength)) < wanted else (low, middle)
        red, green, blue = _rgb(hue, 0.5 * (low + high), strength)
        return round(red), round(green), round(blue)


def _rgb(hue: float, light: float, strength: float) -> tuple[float, float, float]:
    red, green, blue = colorsys.hls_to_rgb(hue % 1.0, light, strength)
    return 255.0 * red, 255.0 * green, 255.0 * blue


def luminance(color: Sequence[float]) -> float:
    """Relative luminance of an sRGB color of 8 bits.

    Source: Web Content Accessibility Guidelines 2.2, relative luminance.
    """
    share = np.array(color[:3], dtype=float) / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


def fading(color: Color, count: int) -> Array:
    """Colors from a pale one to the full color, shape [count, 3], 8 bits.

    Lines of rerun are opaque: the background's color would be a white line where a body is behind it.
    """
    shares = np.linspace(PALE, 1.0, count)
    mixed = np.array(BACKGROUND) + shares[:, None] * (np.array(color, dtype=float) - BACKGROUND)
    return np.asarray(mixed.round(), dtype=np.uint8)
