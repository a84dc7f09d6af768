"""Optimises samples, and keeps the filmstrip and a small video of each beside it.

`python samples/pictures.py [NAME ...]`, or all samples. A real robot, which is not part of this repository, is drawn by
`python samples/pictures.py --robot SHOT VIDEO [OPTIONS of optimize]`; rendered frames become a video by
`--frames FOLDER VIDEO`.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

HERE = Path(__file__).resolve().parent
DPI = 125  # 1500 pixels across
COLORS = 255  # a palette is a third of the size
VIDEO = ("width=560", "rate=12.5Hz", "quality=42")  # below a megabyte
ROUNDS = 4  # of k-means over the palette; without them the few pixels of the marks take other colors


def picture(name: str) -> None:
    """Optimise one sample with default settings and write its picture and video."""
    with tempfile.TemporaryDirectory() as folder:
        figures = ("--figures", folder, "--set", f"figures.plot.dpi={DPI}")
        film(HERE / name / f"{name}.usda", HERE / name / f"{name}.webp", *figures)
        strip = Image.open(Path(folder) / "filmstrip.png").convert("RGB")
    flat = strip.quantize(COLORS, kmeans=ROUNDS, dither=Image.Dither.NONE)
    flat.save(HERE / name / f"{name}.png", optimize=True)


def film(shot: Path, video: Path, *options: str) -> None:
    """Optimise a shot with default settings and write a small video."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "calmotion", "optimize", str(shot), "-o", str(Path(folder) / "calm.usda")]
        command += ["--video", str(video), *options]
        command += [option for setting in VIDEO for option in ("--set", f"video.write.{setting}")]
        subprocess.run(command, check=True)


def join(frames: Path, video: Path) -> None:
    """Make a video of numbered pictures, eight a second."""
    first, *others = (Image.open(path).convert("RGB") for path in sorted(frames.glob("[0-9]*.png")))
    first.save(video, save_all=True, append_images=others, duration=125, loop=0, quality=60, method=6)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["--frames", folder, video]:
            join(Path(folder), Path(video))
            sys.exit()
        case ["--robot", shot, video, *options]:
            film(Path(shot), Path(video), *options)
            sys.exit()
    for wanted in sys.argv[1:] or sorted(path.parent.name for path in HERE.glob("*/motion.py")):
        picture(wanted)
