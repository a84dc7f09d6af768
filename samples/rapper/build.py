"""Builds rapper.usda: `python samples/rapper/build.py [FILE]`. The same script always writes the same bytes.

Unlike the other samples it is in centimetres, and its arm is a closed linkage with passive hinges.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
if str(HERE.parent) not in sys.path:
    sys.path.insert(0, str(HERE.parent))

from kit import character  # noqa: E402
from rapper import model, motion  # noqa: E402

TOLERANCE = 0.001
NOTE = "A rapper whose arm is a four-bar linkage, drawn for Calmotion. Built by samples/rapper/build.py."


def build(path: str | Path) -> None:
    """Write the sample to a .usda file, whole or not at all."""
    found = character.Character(
        name="Rapper",
        note=NOTE,
        bodies=model.bodies(),
        joints=model.joints(motion.tracks()),
        looks=model.LOOKS,
        plastic=model.NYLON,
        scenery=("Set", model.scenery()),
        frames=motion.FRAMES,
        rate=motion.RATE,
        tolerance=TOLERANCE,
        unit=0.01,
    )
    character.write(found, path)


if __name__ == "__main__":
    build(sys.argv[1] if len(sys.argv) > 1 else HERE / "rapper.usda")
