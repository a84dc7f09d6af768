"""Recordings that cannot be of the shot: in other units, in another frame, or of a robot that rests."""

from collections.abc import Sequence

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Character, reach
from calmotion.recordings import ANGLE, MARKER, Channel, SensorRecording

from ..signals import Signals

LONGEST = 200.0  # of a recording, over the length of the shot: all places of the shot in it are tried
LEAST = 0.02  # motion of the channel that moves most, over that of the robot of the shot
FARTHEST = 5.0  # of a marker from where the robot has it, over the reach of the robot


def refuse_long(recordings: Sequence[SensorRecording], length: float) -> None:
    """Refuse recordings that are far longer than the shot.

    Args:
        recordings: The recordings.
        length: Of the shot [s].

    Raises:
        ShotError: One is.
    """
    for recording in recordings:
        lasts = recording.end - recording.start
        if lasts > LONGEST * length:
            raise ShotError(
                "the recording is far longer than the shot",
                path=recording.file,
                found=f"{lasts:.4g} s of recording, {length:.4g} s of the shot",
                remedy="Write times in seconds, or their unit into the map of the recording; cut it to the performance",
            )


def refuse_unlike(character: Character, recordings: Sequence[SensorRecording], robot: Signals) -> None:
    """Refuse recordings whose markers are far from where the robot has them at any time, and those in which no marker
    and no angle moves that does in the shot.

    Args:
        character: The robot.
        recordings: The recordings.
        robot: Signals of the robot of the shot.

    Raises:
        ShotError: One is.
    """
    known = {
        MARKER: {target.path: robot.positions[:, k] for k, target in enumerate(character.targets)},
        ANGLE: {motor.path: robot.angles[:, k, None] for k, motor in enumerate(character.motors)},
    }
    for recording in recordings:
        shares = []
        for channel in recording.channels:
            signal = known.get(channel.kind, {}).get(channel.path)
            if signal is None:
                continue
            measured = np.isfinite(channel.values).any(axis=0)
            values, signal = channel.values[:, measured], signal[:, measured]
            if channel.kind == MARKER:
                _refuse_far(recording.file, channel, values, signal, reach(character))
            moves = float(np.max(np.ptp(signal, axis=0)))
            if moves > 0.0:
                shares.append(float(np.max(np.nanmax(values, axis=0) - np.nanmin(values, axis=0))) / moves)
        if shares and max(shares) < LEAST:
            raise ShotError(
                "nothing moves in the recording",
                path=recording.file,
                found=f"at most {100.0 * max(shares):.2g}% of the motion of the shot",
                remedy="Record the performance of this shot, and check which columns hold it",
            )


def _refuse_far(file: str, channel: Channel, values: Array, signal: Array, size: float) -> None:
    away = float(np.linalg.norm(np.nanmedian(values, axis=0) - np.median(signal, axis=0)))
    if away > FARTHEST * size:
        raise ShotError(
            "the marker is far from the robot",
            path=file,
            attribute=channel.name,
            found=f"{away:.3g} m away, where the robot reaches {size:.3g} m",
            remedy="Write positions in metres and in the world of the shot, or their unit into the map of the "
            "recording",
        )
