"""Optimises samples, and keeps the filmstrip and a small video of each beside it.

`python samples/pictures.py [NAME ...]`, or all.
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
VIDEO = ("width=600", "rate=12.5Hz", "quality=55")  # below a megabyte
ROUNDS = 4  # of k-means over the palette; without them the few pixels of the marks take other colors


def picture(name: str) -> None:
    """Optimise one sample with default settings and write its picture and video."""
    with tempfile.TemporaryDirectory() as folder:
        shot, layer = HERE / name / f"{name}.usda", Path(folder) / f"{name}_calm.usda"
        command = [sys.executable, "-m", "calmotion", "optimize", str(shot), "-o", str(layer)]
        command += ["--figures", folder, "--set", f"figures.plot.dpi={DPI}"]
        command += ["--video", str(HERE / name / f"{name}.webp")]
        command += [option for setting in VIDEO for option in ("--set", f"video.write.{setting}")]
        subprocess.run(command, check=True)
        strip = Image.open(Path(folder) / "filmstrip.png").convert("RGB")
    flat = strip.quantize(COLORS, kmeans=ROUNDS, dither=Image.Dither.NONE)
    flat.save(HERE / name / f"{name}.png", optimize=True)


if __name__ == "__main__":
    for wanted in sys.argv[1:] or sorted(path.parent.name for path in HERE.glob("*/motion.py")):
        picture(wanted)
