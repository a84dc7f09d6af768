"""Builds bartender.usda: `python samples/bartender/build.py [FILE]`. The same script always writes the same bytes."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
if str(HERE.parent) not in sys.path:
    sys.path.insert(0, str(HERE.parent))

from bartender import model, motion  # noqa: E402
from kit import character  # noqa: E402

TOLERANCE = 0.001
NOTE = "A serving robot with two slender plastic links, drawn for Calmotion. Built by samples/bartender/build.py."


def build(path: str | Path) -> None:
    """Write the sample to a .usda file, whole or not at all."""
    found = character.Character(
        name="Bartender",
        note=NOTE,
        bodies=model.bodies(),
        joints=model.joints(motion.tracks()),
        looks=model.LOOKS,
        plastic=model.NYLON,
        scenery=("Bar", model.scenery()),
        frames=motion.FRAMES,
        rate=motion.RATE,
        tolerance=TOLERANCE,
    )
    character.write(found, path)


if __name__ == "__main__":
    build(sys.argv[1] if len(sys.argv) > 1 else HERE / "bartender.usda")
