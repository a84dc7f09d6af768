"""A video of a result: its frames, composed of pictures, numbers and the error curve."""

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice

import numpy as np
from calmotion.model import Animation, Character, Result, Simulation
from calmotion.multibody import processors
from calmotion.support import distinct_names
from calmotion.views import Pace, pace_of
from PIL import Image, ImageDraw

from .chart import FAINT, GRID, INK, Chart, Color, Curve, draw_chart, font
from .encoding import encode
from .stage import Stage, draw_panels, set_stage
from .timeline import AFTER_WORST, BEFORE_WORST, Moment, largest_errors, moments, worst_moment

# Okabe and Ito's colors, as in the figures and recordings.
BEFORE, AFTER, INTENDED = (213, 94, 0), (0, 114, 178), (0, 158, 115)
HEIGHTS = (0.55, 1.15)  # of a panel, as shares of its width
CHART = 0.13  # height of the chart, as a share of the width of the video
LEAST_CHART = 100  # [pixels]
ENCODING = 2e-8  # time of WebP's encoder for a pixel of a square as wide as the video, on a processor of 2020 [s]
AHEAD = 3  # frames that are drawn before the encoder needs them, each of which takes some 50 MB meanwhile
Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Settings:
    """Width [pixels], frames per second, speed of the slow motion, and quality (1 to 100) of a video."""

    width: int = 1120
    rate: float = 25.0
    slow: float = 0.2
    quality: int = 80


@dataclass(frozen=True, eq=False)
class Film:
    """What all frames share.

    Attributes:
        stage: Cameras and surfaces.
        runs: Each motion with its color and name.
        chart: The error curves.
        target: Name of the target of the near view.
        width: Of the video [pixels].
        pace: The tempo; None where it is the animation's.
    """

    stage: Stage
    runs: tuple[tuple[Simulation, Color, str], ...]
    chart: Chart | None
    target: str
    width: int
    pace: Pace | None = None

    @property
    def text(self) -> int:
        """Size of large letters [pixels]."""
        return max(round(self.width / 56), 12)


def write_video(
    path: str,
    character: Character,
    animation: Animation,
    result: Result,
    settings: Settings,
    progress: Progress = lambda fraction, message: None,
) -> None:
    """Write a video of a result; the same result gives the same frames.

    Args:
        path: A .webp or .mp4 file.
        character: The character.
        animation: For the times of its frames.
        result: Of `simulate` (one panel) or of `optimize` (two).
        settings: Size, rate and speed.
        progress: Called with a fraction in 0..1 and a message.

    Raises:
        ShotError: The file cannot be written.
    """
    film, frames = plan(character, animation, result, settings)
    seconds = expected_time(film, frames)
    progress(0.0, f"about {seconds:.0f} s for {len(frames)} frames" if seconds >= 1.0 else f"{len(frames)} frames")
    encode(path, _drawn(film, frames, progress), len(frames), settings.rate, settings.quality)


def expected_time(film: Film, frames: Sequence[Moment]) -> float:
    """How long a video takes to write, of the order of the real time [s]; threads draw, and one encodes meanwhile."""
    draw_frame(film, frames[0])  # loads the kernels
    begin = time.perf_counter()
    draw_frame(film, frames[0])
    draw_frame(film, frames[-1])
    drawing = 0.5 * (time.perf_counter() - begin) * len(set(frames)) / processors()
    return max(drawing, ENCODING * film.width**2 * len(frames))


def _drawn(film: Film, frames: Sequence[Moment], progress: Progress) -> Iterator[Image.Image]:
    """The frames in order, which threads draw ahead of the encoder; a moment that stays is drawn once."""
    with ThreadPoolExecutor(processors()) as pool:
        ahead: deque[tuple[Moment, Future[Image.Image]]] = deque()
        coming = iter(frames)
        try:
            for number in range(len(frames)):
                for moment in islice(coming, 1 + AHEAD - len(ahead)):
                    same = ahead and ahead[-1][0] == moment
                    ahead.append((moment, ahead[-1][1] if same else pool.submit(draw_frame, film, moment)))
                progress(number / len(frames), f"frame {number + 1} of {len(frames)}")
                yield ahead.popleft()[1].result()
        finally:
            for _, drawing in ahead:
                drawing.cancel()


def plan(character: Character, animation: Animation, result: Result, settings: Settings) -> tuple[Film, list[Moment]]:
    """What the video shows: the shared parts of its frames, and their moments."""
    worst = worst_moment(result)
    span = (float(animation.frame_times[0]), float(animation.frame_times[-1]))
    runs: list[tuple[Simulation, Color, str]] = [(result.before, BEFORE, "as animated")]
    if result.after is not None:
        runs.append((result.after, AFTER, "optimised"))
    width = settings.width - settings.width % 2
    panel = width // len(runs)
    shape = HEIGHTS if len(runs) > 1 else (HEIGHTS[0] / 2, HEIGHTS[1] / 2)
    stage = set_stage(character, animation, result, worst, panel, shape)
    slow = None
    if worst.target >= 0 and settings.slow < 1.0:
        slow = (max(worst.time - BEFORE_WORST, span[0]), min(worst.time + AFTER_WORST, span[1]))
    curves = [
        Curve(run.motion.times[run.motion.judged], 1e3 * largest_errors(run), color, name) for run, color, name in runs
    ]
    paths = [target.path for target in character.targets]
    title = "error [mm]" if len(paths) == 1 else f"largest error of the {len(paths)} targets [mm]"
    size = (width, max(round(CHART * width), LEAST_CHART))
    chart = Chart(curves, span, size, slow, title, INTENDED) if paths else None
    name = distinct_names(paths)[paths[worst.target]] if worst.target >= 0 else ""
    film = Film(stage, tuple(runs), chart, name, width, pace_of(character, result))
    return film, moments(*span, worst, settings.rate, settings.slow)


def draw_frame(film: Film, moment: Moment) -> Image.Image:
    """One frame: a panel for each motion with its error above, and the curve below."""
    panels = draw_panels(film.stage, [(run, color) for run, color, _ in film.runs], moment, INTENDED)
    head = round(3.4 * film.text)
    chart = draw_chart(film.chart, moment.time) if film.chart else None
    height = head + panels[0].height + (chart.height if chart else 0)
    frame = Image.new("RGB", (film.width, height + height % 2), "white")
    for k, panel in enumerate(panels):
        frame.paste(panel, (k * panel.width, head))
    if chart:
        frame.paste(chart, (0, head + panels[0].height))
    draw = ImageDraw.Draw(frame)
    for k in range(1, len(panels)):
        x = k * panels[0].width
        draw.line((x, round(0.6 * film.text), x, head + panels[0].height), fill=GRID, width=max(film.width // 700, 1))
    for k, (run, color, name) in enumerate(film.runs):
        write_head(draw, film, k * panels[0].width, run, moment, color, name)
    write_time(draw, film, moment, head + panels[0].height)
    return frame


def write_head(
    draw: ImageDraw.ImageDraw, film: Film, left: int, run: Simulation, moment: Moment, color: Color, name: str
) -> None:
    """Name of the motion, and its error at this moment."""
    x, y = left + film.text, 0.55 * film.text
    draw.text((x, y), name, font=font(round(1.25 * film.text), bold=True), fill=color)
    errors = run.position_errors
    if not errors.shape[1]:
        return
    column = errors[:, film.stage.target] if moment.near > 0.0 else errors.max(axis=1)
    value = 1e3 * float(np.interp(moment.time, run.motion.times, column))
    label = film.target if moment.near > 0.0 else "error"
    number = f"{value:.1f} mm" if value >= 0.95 else f"{value:.2f} mm"
    right = left + film.width // len(film.runs) - film.text
    draw.text((right, y), number, font=font(round(1.25 * film.text), bold=True), fill=color, anchor="ra")
    draw.text((right, y + 1.6 * film.text), label, font=font(round(0.8 * film.text)), fill=FAINT, anchor="ra")


def write_time(draw: ImageDraw.ImageDraw, film: Film, moment: Moment, bottom: int) -> None:
    """Time of the shot and its speed, at the lower edge of the panels."""
    letters = font(round(0.85 * film.text))
    base = bottom - 0.5 * film.text
    speed = ""
    if moment.near > 0.0:
        speed = f"  slow motion {moment.speed:g}×" if moment.speed else ""
    elif film.pace is not None and (pace := film.pace.text(moment.time)):
        speed = f"  {pace}"
    halo = max(round(film.text / 8), 1)
    draw.text(
        (film.text, base), f"{moment.time:.2f} s{speed}", font=letters, fill=INK, anchor="ls",
        stroke_width=halo, stroke_fill="white",
    )  # fmt: skip
