"""The bartender's serving motion: keys in frames and degrees, 24 frames a second.

Hold, swing to the right and reach for the drink, stop, lift, swing across to the left and serve, stop, back to the
middle with a toast, settle. Positive pitch lowers; the wrist keeps the cup level in every pose.
"""

from __future__ import annotations

import numpy as np
from kit.curves import Key, sample_keys

RATE = 24.0
FIRST, LAST = 1, 97
FRAMES = tuple(range(FIRST, LAST + 1))

WAIST: tuple[Key, ...] = ((7, 0.0), (18, -52.0), (30, -52.0), (46, 46.0), (63, 46.0), (77, 0.0))
SHOULDER: tuple[Key, ...] = (
    (6, 58.0),
    (17, 34.0),
    (27, 34.0),
    (34, 56.0),
    (41, 52.0),
    (50, 30.0),
    (62, 30.0),
    (78, 40.0),
)
ELBOW: tuple[Key, ...] = (
    (8, -88.0),
    (19, -38.0),
    (28, -38.0),
    (36, -92.0),
    (42, -84.0),
    (52, -34.0),
    (61, -34.0),
    (76, -72.0),
)
LEAN: tuple[Key, ...] = ((28, 0.0), (34, -5.0), (42, 5.0), (48, 0.0))


def tracks() -> dict[str, tuple[float, ...]]:
    """Angle of each motor [deg] at the frames."""
    waist, shoulder, elbow, lean = (sample_keys(keys, FRAMES) for keys in (WAIST, SHOULDER, ELBOW, LEAN))
    curves = {
        "Waist": waist,
        "Shoulder": shoulder,
        "Elbow": elbow,
        "WristPitch": -(shoulder + elbow),
        "WristRoll": lean,
    }
    # Adding 0 turns a negative zero into zero.
    return {name: tuple((np.round(values, 4) + 0.0).tolist()) for name, values in curves.items()}
