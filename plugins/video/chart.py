"""The error curve below the pictures of a video, and its texts."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from calmotion.arrays import Array
from PIL import Image, ImageDraw, ImageFont

SMOOTH = 3
INK, FAINT, GRID = (34, 34, 34), (120, 124, 130), (226, 228, 232)
Color = tuple[int, int, int]


@cache
def font(size: int, bold: bool = False) -> ImageFont.FreeTypeFont:
    """A font that comes with matplotlib, so that every machine draws the same letters."""
    import matplotlib

    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name), size)


@dataclass(frozen=True, eq=False)
class Curve:
    """One curve: times [s] and values [mm], its color and name."""

    times: Array
    values: Array
    color: Color
    name: str


@dataclass(frozen=True, eq=False)
class Chart:
    """The curves and their place.

    Attributes:
        curves: What is drawn, the last one on top.
        span: First and last time [s].
        size: Width and height [pixels].
        slow: The part of the slow motion [s], or None.
        title: What the curves show.
        intended: Color of the intended motion in the pictures.
    """

    curves: Sequence[Curve]
    span: tuple[float, float]
    size: tuple[int, int]
    slow: tuple[float, float] | None
    title: str
    intended: Color

    @property
    def text(self) -> int:
        """Size of letters [pixels]."""
        return max(round(self.size[1] / 9.5), 9)

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Left, top, right, bottom of the area of the curves [pixels]."""
        width, height = self.size
        return 3.6 * self.text, 2.0 * self.text, width - 1.5 * self.text, height - 1.9 * self.text

    @property
    def top(self) -> float:
        """Value at the upper edge [mm]."""
        return round_up(max([float(c.values.max(initial=0.0)) for c in self.curves] + [1e-3]))

    def place(self, times: Array, values: Array) -> list[tuple[float, float]]:
        """Pixels of points of a curve."""
        left, top, right, bottom = self.box
        x = left + (times - self.span[0]) / max(self.span[1] - self.span[0], 1e-9) * (right - left)
        y = bottom - values / self.top * (bottom - top)
        return list(zip(x.tolist(), y.tolist(), strict=True))


def round_up(value: float) -> float:
    """The next of 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step for step in (1, 1.5, 2, 3, 4, 5, 6, 8, 10) if step * power >= value * (1 - 1e-9)) * power)


@cache
def _curves(chart: Chart, played: bool) -> Image.Image:
    """The chart with its curves as they look before, or after they were played, `SMOOTH` times as large."""
    large = Image.new("RGB", (SMOOTH * chart.size[0], SMOOTH * chart.size[1]), "white")
    draw = ImageDraw.Draw(large, "RGBA")
    left, top, right, bottom = (SMOOTH * side for side in chart.box)
    if chart.slow:
        ends = chart.place(np.array(chart.slow), np.zeros(2))
        draw.rectangle((SMOOTH * ends[0][0], top, SMOOTH * ends[1][0], bottom), fill=(244, 245, 247))
    draw.line((left, bottom, right, bottom), fill=GRID, width=SMOOTH)
    draw.line((left, top, right, top), fill=GRID, width=SMOOTH)
    for curve in chart.curves:
        points = [(SMOOTH * x, SMOOTH * y) for x, y in chart.place(curve.times, curve.values)]
        draw.line(points, fill=(*curve.color, 80), width=SMOOTH, joint="curve")
        if played:
            draw.polygon([*points, (points[-1][0], bottom), (points[0][0], bottom)], fill=(*curve.color, 40))
            draw.line(points, fill=(*curve.color, 255), width=2 * SMOOTH, joint="curve")
    return large


@cache
def _shown(chart: Chart, played: bool) -> Image.Image:
    """The same in the size of the video, with title, scale and legend."""
    picture = _curves(chart, played).reduce(SMOOTH)
    write_labels(picture, chart)
    return picture


def draw_chart(chart: Chart, time: float) -> Image.Image:
    """The chart at a time of the shot: what was played is drawn in full, what comes is faint."""
    picture, now = _shown(chart, False).copy(), chart.place(np.array([time]), np.zeros(1))[0][0]
    left, top, _, bottom = chart.box
    part = (0, int(top), round(now), chart.size[1] - chart.text)
    picture.paste(_shown(chart, True).crop(part), part)
    # the line and the dots of this moment, smooth: on the large curves around it
    radius = chart.text / 3.2
    low, high = int(now - radius) - 1, int(now + radius) + 2
    strip = (low, int(top - radius) - 1, high, int(bottom + radius) + 2)
    large = picture.crop(strip).resize(
        (SMOOTH * (high - low), SMOOTH * (strip[3] - strip[1])), Image.Resampling.NEAREST
    )
    draw = ImageDraw.Draw(large)
    x = SMOOTH * (now - low)
    draw.line((x, SMOOTH * (top - strip[1]), x, SMOOTH * (bottom - strip[1])), fill=INK, width=SMOOTH)
    for curve in chart.curves:
        value = float(np.interp(time, curve.times, curve.values))
        y = SMOOTH * (chart.place(np.array([time]), np.array([value]))[0][1] - strip[1])
        draw.ellipse((x - SMOOTH * radius, y - SMOOTH * radius, x + SMOOTH * radius, y + SMOOTH * radius), curve.color)
    picture.paste(large.reduce(SMOOTH), strip[:2])
    return picture


def write_labels(picture: Image.Image, chart: Chart) -> None:
    """Title, scale and legend."""
    draw, letters = ImageDraw.Draw(picture), font(chart.text)
    left, top, right, bottom = chart.box
    draw.text((left, 0.3 * chart.text), chart.title, font=letters, fill=FAINT)
    draw.text((right, 0.3 * chart.text), "green: intended motion", font=letters, fill=chart.intended, anchor="ra")
    draw.text((left - 0.5 * chart.text, top), f"{chart.top:g}", font=letters, fill=FAINT, anchor="rm")
    draw.text((left - 0.5 * chart.text, bottom), "0", font=letters, fill=FAINT, anchor="rm")
    draw.text((left, bottom + 0.5 * chart.text), f"{chart.span[0]:.0f} s", font=letters, fill=FAINT)
    draw.text((right, bottom + 0.5 * chart.text), f"{chart.span[1]:.1f} s", font=letters, fill=FAINT, anchor="ra")
