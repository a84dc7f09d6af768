"""The drummer's bar and crash: keys in frames and degrees, 24 frames a second, 103 beats a minute (14 frames a beat).

The right hand plays eighths on the hi-hat, the left one the snare on two and four, and the head nods with the beat. A
short fill leads to the crash, to which the pelvis throws the right hand. A stroke falls in two or three frames and
bounces as fast. Positive angles lower an arm; an arm's yaw is positive inwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from figure.tracks import tracks as figure_tracks
from kit.curves import Key

RATE = 24.0
FIRST, LAST = 1, 115
FRAMES = tuple(range(FIRST, LAST + 1))
EIGHTH, ONE = 7, 19
TIMES = [ONE + EIGHTH * k for k in range(12)]  # frames of the eighths
CRASH = TIMES[10]

# Hits: frame, and how far the stick is thrown back before it, as a share of a full stroke.
HAT = tuple((frame, 1.0 if k % 2 == 0 else 0.6) for k, frame in enumerate(TIMES[:9]) if k != 7)
SNARE = ((TIMES[2], 1.0), (TIMES[6], 1.0), (TIMES[7], 0.7), (TIMES[8], 0.8))


def _strokes(hits: Sequence[tuple[int, float]], low: float, throw: float, fall: int) -> list[Key]:
    """A joint through the hits: at `low` there, thrown back by `throw` in between, a fall's length before and after."""
    keys: list[Key] = []
    for n, (frame, share) in enumerate(hits):
        keys += [(frame - fall, low + share * throw), (frame, low)]
        following, back = hits[n + 1] if n + 1 < len(hits) else (math.inf, 0.5)
        if following - frame > 2 * fall:  # the stick bounces, halfway where it then waits
            keys += [(frame + fall, low + (back if following - frame < 4 * fall else 0.5) * throw)]
    return keys


RIGHT = {
    "ShoulderYaw": [(8, 0.0), (15, 4.0), (77, 4.0), (CRASH - 1, -16.0)],
    "ShoulderPitch": [(8, 66.0), *_strokes(HAT, 62.0, -2.0, 2), (84, 14.0), (CRASH, 24.0), (CRASH + 7, 17.0)],
    "Elbow": [(8, -86.0), *_strokes(HAT, -58.0, -8.0, 2), (84, -76.0), (CRASH, -36.0), (CRASH + 7, -46.0)],
    "Wrist": [(8, -6.0), *_strokes(HAT, 8.0, -30.0, 2), (85, -34.0), (CRASH, 10.0), (CRASH + 6, -16.0)],
}
LEFT = {
    "ShoulderYaw": [(8, 0.0), (15, 10.0), (78, 10.0), (CRASH, -4.0)],
    "ShoulderPitch": [(8, 66.0), *_strokes(SNARE, 66.0, -6.0, 3), (CRASH, 48.0)],
    "Elbow": [(8, -86.0), *_strokes(SNARE, -58.0, -20.0, 3), (CRASH - 1, -94.0), (101, -88.0)],
    "Wrist": [(8, -6.0), *_strokes(SNARE, 8.0, -42.0, 3), (CRASH - 2, -30.0), (100, -16.0)],
}
TRUNK = {
    "PelvisTurn": [(9, 0.0), (19, -3.0), (33, 4.0), (47, -3.0), (61, 4.0), (75, 6.0), (CRASH, -32.0), (102, -28.0)],
    "ChestBend": [(9, 0.0), (19, 5.0), (76, 5.0), (84, -1.0), (CRASH + 1, 9.0), (103, 5.0)],
    "ChestLean": [(9, 0.0), (33, -1.0), (61, 1.0), (76, -2.0), (CRASH + 1, 7.0), (102, 5.0)],
    "HeadTurn": [(10, 0.0), (20, -8.0), (64, -8.0), (72, 10.0), (78, 10.0), (88, -14.0), (101, -8.0)],
    "HeadNod": [(9, 0.0), *((TIMES[2 * k] + d, a) for k in range(5) for d, a in ((-5, -4.0), (1, 13.0))),
                (84, -8.0), (CRASH + 1, 16.0), (101, 2.0)],
}  # fmt: skip


def tracks() -> dict[str, tuple[float, ...]]:
    """Angle of each motor [deg] at the frames."""
    return figure_tracks(TRUNK, LEFT, RIGHT, FRAMES)
