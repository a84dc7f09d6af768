"""Builds drummer.usda: `python samples/drummer/build.py [FILE]`. The same script always writes the same bytes.

The character is a layer of its own, samples/figure/figure.usda; unlike the other samples a skeleton animates it.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
if str(HERE.parent) not in sys.path:
    sys.path.insert(0, str(HERE.parent))

from drummer import model, motion  # noqa: E402
from figure.model import FIGURE, joints  # noqa: E402
from kit import character, shot  # noqa: E402

SHOT = shot.Shot(
    name="Drummer",
    note="A robot that drums, its motors driven by a skeleton, drawn for Calmotion. Built by samples/drummer/build.py.",
    asset="../figure/figure.usda",
    character=FIGURE,
    joints=(*joints(motion.tracks()), *model.grips()),
    props=model.sticks(),
    looks=model.LOOKS,
    scenery=("Kit", model.scenery()),
    frames=motion.FRAMES,
    rate=motion.RATE,
    bones=model.BONES,
)

if __name__ == "__main__":
    shot.write(SHOT, character.destination(HERE))
