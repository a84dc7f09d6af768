"""The lamp's motion: keys in frames and degrees, 24 frames a second.

It looks at the sheet on its right, perks up, turns to the left, nods twice, and comes back. Positive pitch lowers; the
head looks at the desk in every pose.
"""

from __future__ import annotations

import numpy as np
from kit.curves import Key, sample_keys

RATE = 24.0
FIRST, LAST = 1, 109
FRAMES = tuple(range(FIRST, LAST + 1))

TURN: tuple[Key, ...] = ((7, -20.0), (22, -20.0), (36, 42.0), (72, 42.0), (88, -5.0))
SHOULDER: tuple[Key, ...] = ((7, -62.0), (14, -50.0), (24, -88.0), (34, -82.0), (42, -66.0), (70, -66.0), (90, -72.0))
ELBOW: tuple[Key, ...] = ((7, 92.0), (14, 84.0), (25, 74.0), (35, 98.0), (44, 84.0), (70, 84.0), (89, 96.0))
LOOK: tuple[Key, ...] = (
    (7, 62.0), (14, 70.0), (25, 18.0), (34, 30.0), (44, 46.0),
    (50, 74.0), (56, 38.0), (62, 74.0), (68, 46.0), (72, 46.0), (90, 60.0),
)  # fmt: skip


def tracks() -> dict[str, tuple[float, ...]]:
    """Angle of each motor [deg] at the frames."""
    turn, shoulder, elbow, look = (sample_keys(keys, FRAMES) for keys in (TURN, SHOULDER, ELBOW, LOOK))
    curves = {"Turn": turn, "Shoulder": shoulder, "Elbow": elbow, "HeadPitch": look - shoulder - elbow}
    # Adding 0 turns a negative zero into zero.
    return {name: tuple((np.round(values, 4) + 0.0).tolist()) for name, values in curves.items()}
