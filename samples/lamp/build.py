"""Builds lamp.usda: `python samples/lamp/build.py [FILE]`. The same script always writes the same bytes."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
if str(HERE.parent) not in sys.path:
    sys.path.insert(0, str(HERE.parent))

from kit import character  # noqa: E402
from lamp import model, motion  # noqa: E402

CHARACTER = character.Character(
    name="Lamp",
    note="A desk lamp on four DYNAMIXEL XM430-W350 servos that give. Built by samples/lamp/build.py.",
    bodies=model.bodies(),
    joints=model.joints(motion.tracks()),
    looks=model.LOOKS,
    plastic=model.ABS,
    scenery=("Desk", model.scenery()),
    frames=motion.FRAMES,
    rate=motion.RATE,
    tolerance=0.001,
)

if __name__ == "__main__":
    character.write(CHARACTER, character.destination(HERE))
