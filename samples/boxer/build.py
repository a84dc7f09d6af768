"""Builds boxer.usda: `python samples/boxer/build.py [FILE]`. The same script always writes the same bytes.

The character is a layer of its own, samples/figure/figure.usda; drives animate it.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
if str(HERE.parent) not in sys.path:
    sys.path.insert(0, str(HERE.parent))

from boxer import model, motion  # noqa: E402
from figure.model import FIGURE, joints  # noqa: E402
from kit import character, shot  # noqa: E402

SHOT = shot.Shot(
    name="Boxer",
    note="A robot that boxes, drawn for Calmotion. Built by samples/boxer/build.py.",
    asset="../figure/figure.usda",
    character=FIGURE,
    joints=(*joints(motion.tracks()), *model.laces()),
    props=model.gloves(),
    looks=model.LOOKS,
    scenery=("Ring", model.scenery()),
    frames=motion.FRAMES,
    rate=motion.RATE,
)

if __name__ == "__main__":
    shot.write(SHOT, character.destination(HERE))
