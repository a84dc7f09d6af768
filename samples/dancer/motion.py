"""The dancer's number: keys in frames and degrees, 30 frames a second, 120 beats a minute (15 frames a beat).

Arms up on the first beats, a wave that runs from one hand to the other, two snaps of the forearms in turn, a reach to
either side, and down again. Angles lift the arm on its own side; the other arm answers half a beat later.
"""

from __future__ import annotations

import numpy as np
from kit.curves import Key, sample_keys

RATE = 30.0
FIRST, LAST = 1, 166
FRAMES = tuple(range(FIRST, LAST + 1))

RIGHT_SHOULDER: tuple[Key, ...] = (
    (8, -62.0), (23, 34.0), (31, 20.0), (39, 38.0), (54, 2.0), (68, 30.0), (84, 30.0), (99, -22.0), (114, 42.0),
    (128, 42.0), (150, -62.0),
)  # fmt: skip
RIGHT_ELBOW: tuple[Key, ...] = (
    (9, 8.0), (24, 62.0), (31, 18.0), (39, 66.0), (53, -14.0), (67, 70.0), (75, 14.0), (84, 70.0), (99, 4.0),
    (115, 34.0), (128, 34.0), (150, 8.0),
)  # fmt: skip
LEFT_SHOULDER: tuple[Key, ...] = (
    (8, -62.0), (26, 30.0), (46, 30.0), (62, -4.0), (76, 26.0), (92, 26.0), (106, 44.0), (122, -26.0), (136, -10.0),
    (154, -62.0),
)  # fmt: skip
LEFT_ELBOW: tuple[Key, ...] = (
    (9, 8.0), (27, 58.0), (46, 58.0), (61, -16.0), (75, 66.0), (83, 12.0), (92, 66.0), (107, 28.0), (122, 2.0),
    (137, 40.0), (154, 8.0),
)  # fmt: skip


def tracks() -> dict[str, tuple[float, ...]]:
    """Angle of each motor [deg] at the frames; a right arm lifts by turning the other way."""
    signs = {"RightShoulder": -1.0, "RightElbow": -1.0, "LeftShoulder": 1.0, "LeftElbow": 1.0}
    keys = (RIGHT_SHOULDER, RIGHT_ELBOW, LEFT_SHOULDER, LEFT_ELBOW)
    return {
        name: tuple((np.round(sign * sample_keys(curve, FRAMES), 4) + 0.0).tolist())
        for (name, sign), curve in zip(signs.items(), keys, strict=True)
    }
