"""The rapper's verse: keys in frames and degrees, 24 frames a second, 144 beats a minute (10 frames a beat).

The microphone goes up on the count, the hand chops every beat, throws out to the crowd twice, and comes
down again. Positive angles lower the arm; the elbow's angle is that of the crank, which the forearm copies.
"""

from __future__ import annotations

import numpy as np
from kit.curves import Key, sample_keys

RATE = 24.0
FIRST, LAST = 1, 145
FRAMES = tuple(range(FIRST, LAST + 1))

UPPER_ARM: tuple[Key, ...] = (
    (7, 66.0), (15, 16.0), (20, 38.0), (25, 8.0), (30, 38.0), (35, 4.0), (40, 36.0), (47, -6.0), (56, 30.0),
    (61, 4.0), (66, 34.0), (76, -22.0), (85, 26.0), (94, -20.0), (104, 36.0), (126, 66.0),
)  # fmt: skip
ELBOW: tuple[Key, ...] = (
    (7, 34.0), (16, -64.0), (21, -12.0), (26, -74.0), (31, -6.0), (36, -78.0), (41, -8.0), (48, -88.0), (56, -28.0),
    (62, -78.0), (67, -10.0), (77, -84.0), (85, -20.0), (95, -82.0), (105, -16.0), (127, 34.0),
)  # fmt: skip


def tracks() -> dict[str, tuple[float, ...]]:
    """Angle of each motor [deg] at the frames."""
    keys = {"UpperArm": UPPER_ARM, "Elbow": ELBOW}
    return {name: tuple((np.round(sample_keys(curve, FRAMES), 4) + 0.0).tolist()) for name, curve in keys.items()}
