"""Builds dancer.usda: `python samples/dancer/build.py [FILE]`. The same script always writes the same bytes.

Unlike the other samples it is y up, and animated by the transforms of its bodies: the motors follow from them.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
if str(HERE.parent) not in sys.path:
    sys.path.insert(0, str(HERE.parent))

from dancer import model, motion  # noqa: E402
from kit import character  # noqa: E402

CHARACTER = character.Character(
    name="Dancer",
    note="A dancer that waves two slender arms, drawn for Calmotion. Built by samples/dancer/build.py.",
    bodies=model.bodies(),
    joints=model.joints(motion.tracks()),
    looks=model.LOOKS,
    plastic=model.NYLON,
    scenery=("Set", model.scenery()),
    frames=motion.FRAMES,
    rate=motion.RATE,
    tolerance=0.001,
    up="Y",
    posed=True,
)

if __name__ == "__main__":
    character.write(CHARACTER, character.destination(HERE))
