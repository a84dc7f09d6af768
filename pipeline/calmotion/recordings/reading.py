"""Recordings of a robot, read by the readers that plugins add."""

from __future__ import annotations

import os
from collections.abc import Sequence

from calmotion.host import Host, SettingError, Settings
from calmotion.recordings.reader import RecordingReader
from calmotion.recordings.recording import RecordingRequest, SensorRecording, turned_on
from calmotion.workflow.problems import value_of

AT = "@/"  # FILE@/PRIM: where the sensor of a file sits


def requested(text: str) -> RecordingRequest:
    """A recording as the user names it: FILE, or FILE@/PRIM for a sensor whose file does not name its prim."""
    file, at, prim = text.rpartition(AT)
    return RecordingRequest(file, f"/{prim}") if at and not os.path.exists(text) else RecordingRequest(text)


def readers(host: Host) -> list[type[RecordingReader]]:
    """The readers that plugins add."""
    return [cls for cls in host.providers(SensorRecording) if issubclass(cls, RecordingReader)]


def read_recordings(host: Host, names: Sequence[str], settings: Settings) -> tuple[SensorRecording, ...]:
    """Read recordings.

    Args:
        host: With the readers.
        names: FILE or FILE@/PRIM of each.

    Raises:
        SettingError: There are none, one is named twice, or no reader reads it.
        RunError: One cannot be read.
    """
    if not names:
        raise SettingError("no recording is given", path="--recording", remedy="Name a file, such as shake.csv.")
    found = []
    requests = [requested(name) for name in names]
    for k, request in enumerate(requests):
        if any(os.path.realpath(request.file) == os.path.realpath(other.file) for other in requests[:k]):
            raise SettingError(
                "this recording is given twice", path="--recording", found=request.file, remedy="Name it once."
            )
        able = [cls for cls in readers(host) if cls.reads(request)]
        if os.path.exists(request.file) and not able:
            suffixes = sorted({suffix for cls in readers(host) for suffix in cls.suffixes})
            raise SettingError(
                "no plugin reads this recording",
                path="--recording",
                found=request.file,
                remedy=f"Use a file that ends in {', '.join(suffixes)}, or a plugin with a reader (--plugins).",
            )
        if not os.path.isfile(request.file):
            raise SettingError(
                "the recording does not exist", path="--recording", found=request.file, remedy="Check the path."
            )
        run = host.run([request], [SensorRecording], settings=settings).finish()
        found.append(turned_on(value_of(run, SensorRecording)))
    return tuple(found)


def measured_prims(recordings: Sequence[SensorRecording]) -> tuple[str, ...]:
    """Prims at which sensors sit, each once."""
    channels = [channel for recording in recordings for channel in recording.channels]
    return tuple(dict.fromkeys(path for channel in channels for path in channel.prims))
