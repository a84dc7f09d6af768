"""Trails of the targets: where each was in the last moments, fading and tapering towards the past."""

import numpy as np
import rerun as rr
from calmotion.arrays import Array
from calmotion.model import Character, Motion
from calmotion.views import sample_motion
from numpy.typing import NDArray

from .colors import Style, fading
from .layout import REFERENCE, STYLES, TIME

LENGTH_S = 0.8
PIECES, POINTS = 10, 6  # of a trail, and of each of its pieces
APART = 0.03  # of the largest deviation: nearer trails of two motions would flicker through each other


def log_trails(
    recording: rr.RecordingStream,
    root: str,
    character: Character,
    motion: Motion,
    intended: Motion,
    times: Array,
    scale: float,
) -> None:
    """The recent path of each target at each frame, and its place; those of the intended motion where they differ.

    Args:
        motion: Of all time steps, for smooth lines.
        intended: Likewise.
        times: Of the frames [s].
        scale: Largest deviation [m].
    """
    own, meant = (recent_paths(run, times) for run in (motion, intended))
    for k, target in enumerate(character.targets):
        differ = np.linalg.norm(own[:, :, :, k] - meant[:, :, :, k], axis=-1) > APART * scale
        pieces = np.ones(own.shape[:2], dtype=bool)
        log_trail(recording, f"trails/{root}{target.path}", STYLES[root], own[:, :, :, k], pieces, times)
        entity = f"trails/{REFERENCE}/{root}{target.path}"
        log_trail(recording, entity, STYLES[REFERENCE], meant[:, :, :, k], np.any(differ, axis=2), times)


def log_trail(
    recording: rr.RecordingStream, entity: str, style: Style, paths: Array, shown: NDArray[np.bool_], times: Array
) -> None:
    """One trail at each frame.

    Args:
        paths: [m], shape [f, PIECES, POINTS, 3].
        shown: Which pieces are drawn, shape [f, PIECES]; the dot is drawn with the last one.
        times: [s], shape [f].
    """
    frames = rr.TimeColumn(TIME, duration=times)
    widths = [rr.Radius.ui_points(style.width * share) for share in np.linspace(0.15, 1.1, PIECES)]
    look = rr.LineStrips3D.from_fields(colors=fading(style.color, PIECES), radii=widths)
    recording.log(entity, look, static=True)
    nothing = np.empty((0, 3), dtype=np.float32)
    strips = [
        path if drawn else nothing
        for row, flags in zip(paths, shown, strict=True)
        for path, drawn in zip(row, flags, strict=True)
    ]
    recording.send_columns(entity, [frames], rr.LineStrips3D.columns(strips=strips).partition([PIECES] * len(times)))
    dot = f"{entity}/now"
    recording.log(dot, rr.Points3D.from_fields(colors=[style.color], radii=[rr.Radius.ui_points(4.0)]), static=True)
    places = rr.Points3D.columns(positions=paths[shown[:, -1], -1, -1])
    recording.send_columns(dot, [frames], places.partition(shown[:, -1].astype(int)))


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
