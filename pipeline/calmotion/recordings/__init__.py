"""What sensors recorded of a robot: its values, the base of its readers, which plugins bring, and reading by them."""

from calmotion.recordings.reader import RecordingReader, first_line, hash_of
from calmotion.recordings.reading import measured_prims, read_recordings, requested
from calmotion.recordings.recording import (
    ACCELEROMETER,
    ANGLE,
    COMPONENTS,
    EFFORT,
    MARKER,
    UNITS,
    Channel,
    RecordingRequest,
    SensorRecording,
)

__all__ = [
    "ACCELEROMETER",
    "ANGLE",
    "COMPONENTS",
    "EFFORT",
    "MARKER",
    "UNITS",
    "Channel",
    "RecordingReader",
    "RecordingRequest",
    "SensorRecording",
    "first_line",
    "hash_of",
    "measured_prims",
    "read_recordings",
    "requested",
]
