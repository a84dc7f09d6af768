"""Trails of the targets: where each was in the last moments, fading and tapering towards the past."""

from __future__ import annotations

import numpy as np
import rerun as rr
from calmotion.shot import Character, Motion
from calmotion.shot.character import Array
from calmotion.views.playback import sample_motion

from .colors import fading
from .layout import STYLES, TIME

LENGTH_S = 0.8
PIECES, POINTS = 10, 6  # of a trail, and of each of its pieces


def log_trails(recording: rr.RecordingStream, root: str, character: Character, motion: Motion, times: Array) -> None:
    """The recent path of each target at each frame, and its place.

    Args:
        motion: Of all time steps, for smooth lines.
        times: Of the frames [s].
    """
    style = STYLES[root]
    frames = rr.TimeColumn(TIME, duration=times)
    radii = style.width * np.linspace(0.4, 1.1, PIECES)
    paths = recent_paths(motion, times)
    for k, target in enumerate(character.targets):
        entity = f"trails/{root}{target.path}"
        look = rr.LineStrips3D.from_fields(
            colors=fading(style.color, PIECES), radii=[rr.Radius.ui_points(radius) for radius in radii]
        )
        recording.log(entity, look, static=True)
        strips = paths[:, :, :, k].reshape(-1, POINTS, 3)
        columns = rr.LineStrips3D.columns(strips=list(strips)).partition([PIECES] * len(times))
        recording.send_columns(entity, [frames], columns)
        dot = f"{entity}/now"
        recording.log(dot, rr.Points3D.from_fields(colors=[style.color], radii=[rr.Radius.ui_points(4.0)]), static=True)
        places = paths[:, -1, -1, k]
        recording.send_columns(dot, [frames], rr.Points3D.columns(positions=places))


def recent_paths(motion: Motion, times: Array) -> Array:
    """Places of all targets before each time, none before the first frame [m].

    Returns:
        Shape [f, PIECES, POINTS, K, 3]; each piece begins where the one before it ends.
    """
    shares = np.linspace(0.0, 1.0, PIECES * (POINTS - 1) + 1)
    starts = np.maximum(times - LENGTH_S, 0.0)
    instants = starts[:, None] + shares * (times - starts)[:, None]
    places = sample_motion(motion, instants.ravel()).target_positions
    places = places.reshape(len(times), len(shares), *places.shape[1:]).astype(np.float32)
    index = np.arange(PIECES)[:, None] * (POINTS - 1) + np.arange(POINTS)
    return np.asarray(places[:, index])
