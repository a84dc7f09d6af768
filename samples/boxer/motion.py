"""The boxer's combination: keys in frames and degrees, 24 frames a second.

From the guard a jab, a jab and a cross, a slip away from what comes back, and a last cross over it. A fist goes out on
a straight line within five frames, stops at once, and snaps back; the pelvis turns the shoulder behind it. Positive
angles lower an arm; an arm's yaw is positive inwards, the pelvis' turn to the left.
"""

from __future__ import annotations

from collections.abc import Sequence

from figure.tracks import tracks as figure_tracks
from kit.curves import Key

RATE = 24.0
FIRST, LAST = 1, 111
FRAMES = tuple(range(FIRST, LAST + 1))
OUT, HOLD, BACK = 5, 1, 7  # frames that a punch takes out, stays, and takes back

JABS, CROSSES = (16, 35), (49, 86)  # frames at which they land
SLIP = 66


def _punches(landing: Sequence[int], guard: float, reach: float) -> list[Key]:
    """A joint that is in the guard [deg], and at `reach` [deg] when a punch lands."""
    keys: list[Key] = []
    for frame in landing:
        keys += [(frame - OUT, guard), (frame, reach), (frame + HOLD, reach), (frame + HOLD + BACK, guard)]
    return keys


PITCH, ELBOW, WRIST, YAW = 51.0, -126.0, 6.0, 13.0  # of the guard
TURN = -22.0  # of the pelvis: the left shoulder leads

LEFT = {
    "ShoulderYaw": _punches(JABS, YAW, -21.0),
    "ShoulderPitch": _punches(JABS, PITCH, -13.0),
    "Elbow": _punches(JABS, ELBOW, -12.0),
    "Wrist": _punches(JABS, WRIST, 16.0),
}
RIGHT = {
    "ShoulderYaw": _punches(CROSSES, YAW, -12.0),
    "ShoulderPitch": _punches(CROSSES, PITCH, -17.0),
    "Elbow": _punches(CROSSES, ELBOW, -12.0),
    "Wrist": _punches(CROSSES, WRIST, 16.0),
}
TRUNK = {
    "PelvisTurn": [(11, TURN), (17, -31.0), (24, TURN), (30, TURN), (36, -31.0), (43, -29.0), (49, 24.0), (51, 24.0),
                   (62, TURN), (80, -28.0), (86, 24.0), (88, 24.0), (99, TURN)],
    "ChestBend": [(8, 6.0), (16, 10.0), (25, 5.0), (35, 10.0), (49, 13.0), (57, 6.0), (SLIP, 16.0), (76, 10.0),
                  (86, 13.0), (98, 6.0)],
    "ChestLean": [(8, 0.0), (49, 3.0), (57, 0.0), (SLIP + 1, 18.0), (70, 18.0), (82, -3.0), (87, 3.0), (98, 0.0)],
    "HeadTurn": [(8, 20.0), (16, 30.0), (24, 20.0), (35, 30.0), (49, -16.0), (60, 20.0), (78, 24.0), (86, -18.0),
                 (98, 20.0)],
    "HeadNod": [(8, 4.0), (16, -4.0), (25, 4.0), (35, -4.0), (49, -6.0), (58, 4.0), (SLIP, -12.0), (76, -4.0),
                (86, -6.0), (98, 4.0)],
}  # fmt: skip


def tracks() -> dict[str, tuple[float, ...]]:
    """Angle of each motor [deg] at the frames."""
    return figure_tracks(TRUNK, LEFT, RIGHT, FRAMES)
