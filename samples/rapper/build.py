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

CHARACTER = character.Character(
    name="Rapper",
    note="A rapper whose arm is a four-bar linkage, drawn for Calmotion. Built by samples/rapper/build.py.",
    bodies=model.bodies(),
    joints=model.joints(motion.tracks()),
    looks=model.LOOKS,
    plastic=model.NYLON,
    scenery=("Set", model.scenery()),
    frames=motion.FRAMES,
    rate=motion.RATE,
    tolerance=0.001,
    unit=0.01,
)

if __name__ == "__main__":
    character.write(CHARACTER, character.destination(HERE))
